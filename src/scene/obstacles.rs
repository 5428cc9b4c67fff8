//! Triangles that only block, added to a finished scene.

use glam::DVec3;

use super::arrays::{ArraysError, check_mesh};
use super::geometry::Sides;
use super::model::Scene;
use super::optics::Material;
use super::rgb::Rgb;

impl Scene {
    /// Adds triangles that hide others from each other and exchange nothing: both of their sides
    /// absorb what arrives, and a matrix has no rows for them. Positions are in metres; faces are
    /// indices of them. One that coincides with a triangle of the scene is nothing beside it.
    ///
    /// # Errors
    /// If an index is out of range, a vertex is not finite, or there are no faces or too many.
    pub fn add_obstacles(
        &mut self,
        vertices: &[[f64; 3]],
        faces: &[[u32; 3]],
    ) -> Result<(), ArraysError> {
        check_mesh(vertices, faces)?;
        let vertices: Vec<DVec3> = vertices.iter().map(|&v| v.into()).collect();
        let (name, reflectance) = ("obstacles".to_owned(), Rgb::ZERO);
        let first =
            self.extend(&vertices, faces, Material { name, reflectance, ..Material::default() });
        self.geometry.sides[first.index()..].fill(Sides::None);
        self.geometry.flag_flaws();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::{MatrixOptions, Rows};
    use crate::progress::Silent;

    const SQUARE: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn square(y: f64) -> [[f64; 3]; 4] {
        [[0.0, y, 0.0], [0.0, y, 1.0], [1.0, y, 1.0], [1.0, y, 0.0]]
    }

    #[test]
    fn an_obstacle_hides_and_has_no_row() {
        let vertices: Vec<[f64; 3]> = square(0.0).into_iter().chain(square(1.0)).collect();
        let faces = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
        let materials = [Material::default()];
        let mut scene = Scene::from_arrays(&vertices, &faces, &materials, &[]).unwrap();
        let sum = |scene: &Scene| {
            let matrix = scene.form_factors(&MatrixOptions::default(), &Silent).unwrap();
            let (mut columns, mut values) = (Vec::new(), Vec::new());
            matrix.row(0, &mut columns, &mut values).unwrap();
            (matrix.len(), values.iter().sum::<f64>())
        };
        let (rows, open) = sum(&scene);
        scene.add_obstacles(&square(0.5), &SQUARE).unwrap();
        let (same, hidden) = sum(&scene);
        assert_eq!(rows, same);
        assert!(open > 0.15 && hidden < 1e-6 + 0.2 * open, "{open} {hidden}");
    }

    #[test]
    fn nonsense_is_refused() {
        let mut scene = Scene::builtin("furnace").unwrap();
        let far = scene.add_obstacles(&square(0.0), &[[0, 1, 9]]);
        assert!(matches!(far, Err(ArraysError::Corner { face: 0, vertex: 9, count: 4 })));
        assert_eq!(scene.add_obstacles(&[], &[]), Err(ArraysError::NoFaces));
    }
}
