//! A scene from plain arrays: for callers that have a mesh in memory.

use super::builder::SceneBuilder;
use super::geometry::{MAX_COORDINATE, MAX_ELEMENTS, Sides, Surface};
use super::model::Scene;
use super::optics::Material;

/// Why arrays make no scene. Vertices, faces and materials count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArraysError {
    /// There are no faces.
    #[error("there are no faces for light to fall on")]
    NoFaces,
    /// There are more than can be dealt with.
    #[error("{count} {what} are more than the {MAX_ELEMENTS} that can be dealt with")]
    TooMany {
        /// Faces or vertices.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A coordinate is not finite, or too large.
    #[error("vertex {vertex}: {position:?} is not finite, or exceeds {MAX_COORDINATE:e} metres")]
    Vertex {
        /// Which vertex.
        vertex: usize,
        /// Where it should be.
        position: [f64; 3],
    },
    /// A face has a corner that does not exist.
    #[error("face {face}: vertex {vertex} does not exist; there are {count}, counted from 0")]
    Corner {
        /// Which face.
        face: usize,
        /// The vertex it refers to.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// Some faces have a material of their own, others do not.
    #[error("{count} indices of materials for {faces} faces; give one for each, or none at all")]
    MaterialCount {
        /// How many indices there are.
        count: usize,
        /// How many faces there are.
        faces: usize,
    },
    /// A face has a material that does not exist.
    #[error("face {face}: material {material} does not exist; there are {count}, counted from 0")]
    NoMaterial {
        /// Which face.
        face: usize,
        /// The material it refers to.
        material: u32,
        /// How many materials there are.
        count: usize,
    },
    /// A material has no sense, or needs what arrays do not have.
    #[error("material {material} ({name}): {problem}")]
    Material {
        /// Which material.
        material: usize,
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl Scene {
    /// A scene of triangles: positions in metres, y upwards, and for each face the indices of its
    /// corners, counter-clockwise seen from its front.
    ///
    /// `material_of` has an index in `materials` for each face; if it is empty, all faces are of
    /// the first material. Face i is triangle i of the geometry, and row i of a matrix.
    ///
    /// Both sides of a face reflect, and the front alone emits unless its material says otherwise;
    /// [`choose_sides`](Self::choose_sides) changes that. Reflectances above
    /// [`MAX_REFLECTANCE`](super::MAX_REFLECTANCE) are clamped, and the scene's findings
    /// say so.
    ///
    /// ```
    /// use hemicube::scene::{Material, Rgb, Scene};
    ///
    /// // A square metre of floor, and a lamp of 100 cd/m² above it that shines downwards.
    /// let vertices = [
    ///     [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0],
    ///     [0.4, 2.0, 0.4], [0.6, 2.0, 0.4], [0.5, 2.0, 0.6],
    /// ];
    /// let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6]];
    /// let floor = Material { reflectance: Rgb::splat(0.3), ..Material::default() };
    /// let lamp = Material { radiance: Rgb::splat(100.0), ..Material::default() };
    /// let scene = Scene::from_arrays(&vertices, &faces, &[floor, lamp], &[0, 0, 1])?;
    /// assert_eq!(scene.geometry.len(), 3);
    /// # Ok::<(), hemicube::scene::ArraysError>(())
    /// ```
    ///
    /// # Errors
    /// If an index is out of range, if a vertex is not finite, if a material reflects or emits
    /// what is negative or not finite, or if there are no faces or too many.
    pub fn from_arrays(
        vertices: &[[f64; 3]],
        faces: &[[u32; 3]],
        materials: &[Material],
        material_of: &[u32],
    ) -> Result<Self, ArraysError> {
        check(vertices, faces, materials, material_of)?;
        let mut builder = SceneBuilder::new("arrays");
        for &vertex in vertices {
            builder.vertex(vertex.into());
        }
        for material in materials {
            builder.material(material.clone());
        }
        let surface = builder.surface(Surface { name: "default".into(), node: 0, primitive: 0 });
        for (i, &face) in faces.iter().enumerate() {
            let material = material_of.get(i).copied().unwrap_or(0);
            builder.triangle(face, None, surface, material, Sides::Two);
        }
        Ok(builder.finish())
    }
}

fn check(
    vertices: &[[f64; 3]],
    faces: &[[u32; 3]],
    materials: &[Material],
    material_of: &[u32],
) -> Result<(), ArraysError> {
    check_mesh(vertices, faces)?;
    check_materials(materials)?;
    if !material_of.is_empty() && material_of.len() != faces.len() {
        let (count, faces) = (material_of.len(), faces.len());
        return Err(ArraysError::MaterialCount { count, faces });
    }
    let of_all = if material_of.is_empty() { &[0][..] } else { material_of };
    let known = |m: &u32| (*m as usize) < materials.len();
    match of_all.iter().position(|m| !known(m)) {
        Some(face) => {
            let (material, count) = (of_all[face], materials.len());
            Err(ArraysError::NoMaterial { face, material, count })
        }
        None => Ok(()),
    }
}

/// Refuses what makes no triangles.
pub(super) fn check_mesh(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<(), ArraysError> {
    if faces.is_empty() {
        return Err(ArraysError::NoFaces);
    }
    for (what, count) in [("vertices", vertices.len()), ("faces", faces.len())] {
        if count > MAX_ELEMENTS {
            return Err(ArraysError::TooMany { what, count });
        }
    }
    let in_range = |x: &f64| x.is_finite() && x.abs() <= MAX_COORDINATE;
    if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(in_range)) {
        return Err(ArraysError::Vertex { vertex, position: vertices[vertex] });
    }
    for (face, corners) in faces.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
            return Err(ArraysError::Corner { face, vertex, count: vertices.len() });
        }
    }
    Ok(())
}

fn check_materials(materials: &[Material]) -> Result<(), ArraysError> {
    for (material, m) in materials.iter().enumerate() {
        let problem = if !(m.reflectance.is_finite() && m.reflectance.min_element() >= 0.0) {
            "its reflectance is negative or not finite"
        } else if !(m.radiance.is_finite() && m.radiance.min_element() >= 0.0) {
            "its radiance is negative or not finite"
        } else if m.is_textured() {
            "it has a texture, but arrays have no texture coordinates"
        } else {
            continue;
        };
        return Err(ArraysError::Material { material, name: m.name.clone(), problem });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Rgb, TriangleState};

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn faces_keep_their_order_and_their_materials() {
        let named = |name: &str| Material { name: name.into(), ..Material::default() };
        let faces = [[0, 1, 2], [0, 2, 3], [0, 0, 1]];
        let scene =
            Scene::from_arrays(&CORNERS, &faces, &[named("a"), named("b")], &[1, 0, 1]).unwrap();
        assert_eq!(scene.geometry.triangles, faces);
        assert_eq!(scene.geometry.state[2], TriangleState::Degenerate);
        assert_eq!(scene.optics.material_of, [1, 0, 1]);
        let one = Scene::from_arrays(&CORNERS, &faces, &[named("a")], &[]).unwrap();
        assert_eq!(one.optics.material_of, [0; 3]);
    }

    #[test]
    fn what_has_no_sense_is_named_with_its_place() {
        let grey = || Material::default();
        let message =
            |vertices: &[[f64; 3]], faces: &[[u32; 3]], materials: &[Material], of: &[u32]| {
                Scene::from_arrays(vertices, faces, materials, of).unwrap_err().to_string()
            };
        let one = [[0, 1, 2]];
        assert!(message(&CORNERS, &[], &[grey()], &[]).contains("no faces"));
        let said = message(&[[0.0; 3], [f64::NAN; 3], [0.0; 3]], &one, &[grey()], &[]);
        assert!(said.contains("vertex 1: [NaN, NaN, NaN] is not finite"), "{said}");
        let said = message(&CORNERS, &[[0, 1, 2], [0, 4, 1]], &[grey()], &[]);
        assert!(said.contains("face 1: vertex 4 does not exist; there are 4"), "{said}");
        let said = message(&CORNERS, &[one[0]; 2], &[grey()], &[0]);
        assert!(said.contains("1 indices of materials for 2 faces"), "{said}");
        let said = message(&CORNERS, &[one[0]; 2], &[grey()], &[0, 1]);
        assert!(said.contains("face 1: material 1 does not exist; there are 1"), "{said}");
        assert!(message(&CORNERS, &one, &[], &[]).contains("material 0 does not exist"));
        let black = Material { reflectance: Rgb::splat(-0.1), ..grey() };
        assert!(message(&CORNERS, &one, &[black], &[]).contains("material 0 (default): its refl"));
        let textured = Material { radiance_texture: Some(0), ..grey() };
        assert!(message(&CORNERS, &one, &[textured], &[]).contains("it has a texture"));
    }
}
