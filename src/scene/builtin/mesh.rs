//! Triangle meshes that built-in scenes are made of, and what one does with them.

use glam::{DAffine3, DMat3, DVec3, dvec3};

/// A triangle mesh without materials.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions in metres.
    pub vertices: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// Vertices within this distance (m) of a supporting plane lie in it; it covers the rounding of a
/// rotation and is far below any length in the scenes.
const IN_PLANE: f64 = 1e-9;

impl Mesh {
    /// A mesh of quadrilaterals, each counter-clockwise and made two triangles.
    #[must_use]
    pub fn from_quads(vertices: Vec<DVec3>, quads: &[[u32; 4]]) -> Self {
        let mut mesh = Self { vertices, triangles: Vec::with_capacity(2 * quads.len()) };
        quads.iter().for_each(|&q| mesh.quad(q));
        mesh
    }

    /// Several meshes as one; they share no vertex.
    #[must_use]
    pub fn joined(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut mesh = Self::default();
        for part in parts {
            let base = mesh.vertices.len() as u32;
            mesh.vertices.extend(part.vertices);
            mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| base + v)));
        }
        mesh
    }

    /// Appends a vertex and returns its index.
    pub(super) fn vertex(&mut self, position: DVec3) -> u32 {
        self.vertices.push(position);
        (self.vertices.len() - 1) as u32
    }

    /// Appends a quadrilateral, counter-clockwise, as two triangles.
    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// The mesh in another place. A transform that mirrors turns the triangles round, so that they
    /// still face outwards.
    #[must_use]
    pub fn placed(mut self, scene_from_mesh: DAffine3) -> Self {
        for v in &mut self.vertices {
            *v = scene_from_mesh.transform_point3(*v);
        }
        if scene_from_mesh.matrix3.determinant() < 0.0 { self.inverted() } else { self }
    }

    /// The mesh moved by an offset in metres.
    #[must_use]
    pub fn at(self, x: f64, y: f64, z: f64) -> Self {
        self.placed(DAffine3::from_translation(dvec3(x, y, z)))
    }

    /// The mesh turned about the `y` axis, counter-clockwise seen from above; exact for quarter
    /// turns, so that what stands against a wall does not pierce it.
    #[must_use]
    pub fn turned(self, degrees: f64) -> Self {
        let quarter = degrees.rem_euclid(360.0) / 90.0;
        let (sin, cos) = match quarter {
            0.0 => (0.0, 1.0),
            1.0 => (1.0, 0.0),
            2.0 => (0.0, -1.0),
            3.0 => (-1.0, 0.0),
            _ => degrees.to_radians().sin_cos(),
        };
        let turn = DMat3::from_cols(dvec3(cos, 0.0, -sin), DVec3::Y, dvec3(sin, 0.0, cos));
        self.placed(DAffine3::from_mat3(turn))
    }

    /// The mesh tipped forward by a quarter turn: what was above (`y`) is in front (`z`).
    #[must_use]
    pub fn tipped(self) -> Self {
        let tip = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
        self.placed(DAffine3::from_mat3(tip))
    }

    /// The mesh moved up or down until its lowest point is at `y` (m).
    #[must_use]
    pub fn resting_on(self, y: f64) -> Self {
        let lowest = -self.reach(DVec3::NEG_Y);
        self.at(0.0, y - lowest, 0.0)
    }

    /// All triangles turned round: a solid becomes a room seen from inside.
    #[must_use]
    pub fn inverted(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// The mesh without the flat face that lies farthest in `direction` (unit): the one by which it
    /// stands on, hangs from or leans against another surface. Nobody sees that face, no light
    /// reaches it, and it would coincide with what it touches.
    #[must_use]
    pub fn open_towards(mut self, direction: DVec3) -> Self {
        let reach = self.reach(direction);
        let vertices = &self.vertices;
        self.triangles
            .retain(|t| t.iter().any(|&v| vertices[v as usize].dot(direction) < reach - IN_PLANE));
        self
    }

    /// Largest coordinate in a direction.
    fn reach(&self, direction: DVec3) -> f64 {
        self.vertices.iter().map(|v| v.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::HashMap;

    use super::*;

    pub fn signed_volume(mesh: &Mesh) -> f64 {
        let corner = |v: u32| mesh.vertices[v as usize];
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0)
            .sum()
    }

    pub fn area(mesh: &Mesh) -> f64 {
        let corner = |v: u32| mesh.vertices[v as usize];
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (corner(b) - corner(a)).cross(corner(c) - corner(a)).length())
            .sum()
    }

    /// How often each directed edge is not met by its opposite exactly once.
    pub fn open_edges(mesh: &Mesh) -> usize {
        let mut count: HashMap<(u32, u32), i32> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                *count.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
        }
        count.iter().filter(|((a, b), n)| **n != 1 || count.get(&(*b, *a)) != Some(&1)).count()
    }

    #[test]
    fn mirroring_keeps_the_outside_outside() {
        let mirror = DAffine3::from_scale(dvec3(-1.0, 1.0, 1.0));
        assert!(signed_volume(&Mesh::cone(1.0, 1.0, 8, 1).placed(mirror)) > 0.0);
        assert!(signed_volume(&Mesh::cone(1.0, 1.0, 8, 1).inverted()) < 0.0);
    }

    #[test]
    fn an_open_face_is_the_one_that_touches() {
        let open = Mesh::cuboid(DVec3::ONE, [1; 3]).resting_on(2.0).open_towards(DVec3::NEG_Y);
        assert_eq!((open.triangles.len(), open_edges(&open)), (10, 4));
        assert!((area(&open) - 5.0).abs() < 1e-12);
    }
}
