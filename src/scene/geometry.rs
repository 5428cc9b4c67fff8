//! Source triangles: where surfaces are, which way they face, and nothing about materials.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Index of a source triangle; file order, for ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TriangleId(pub u32);

impl TriangleId {
    /// The index as `usize`.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One of the two faces of a triangle. Front is where the vertices run counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Vertices run counter-clockwise.
    Front,
    /// Vertices run clockwise.
    Back,
}

impl Side {
    /// Both sides, front first.
    pub const BOTH: [Self; 2] = [Self::Front, Self::Back];

    /// +1 for the front, -1 for the back.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// Which sides of a triangle take part in the exchange of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sides {
    /// Only the front reflects and emits; the back absorbs all that arrives.
    One,
    /// Front and back reflect.
    Two,
    /// Neither side exchanges light: the triangle only blocks, and both sides absorb what arrives.
    None,
}

/// Whether a source triangle takes part, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TriangleState {
    /// It blocks and exchanges light.
    Solid,
    /// Its area is zero (or not finite): its row is zero and nothing sees it.
    Degenerate,
    /// It coincides with an earlier triangle, which takes its place.
    Duplicate,
    /// It lets light through and is left out of visibility.
    Transparent,
}

/// A named piece of the model: what the file called it, and where in the file it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surface {
    /// The name in the file: an OBJ group or object, a glTF node or mesh.
    pub name: String,
    /// Index of the glTF node (0 where the format has none).
    pub node: u32,
    /// Index of the glTF primitive within its mesh (0 where the format has none).
    pub primitive: u32,
}

/// The source triangles of a scene.
///
/// All per-triangle arrays have the same length and keep the order of the file. Degenerate and
/// duplicate triangles are flagged in [`state`](Self::state), never dropped. The pieces of a
/// triangle that a mask cuts out stand in its place.
#[derive(Debug, Clone, Default)]
pub struct Geometry {
    /// Positions in metres, right-handed.
    pub vertices: Vec<DVec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Sidedness of each triangle.
    pub sides: Vec<Sides>,
    /// Whether each triangle takes part.
    pub state: Vec<TriangleState>,
    /// Index in [`surfaces`](Self::surfaces) of each triangle.
    pub surface_of: Vec<u32>,
    /// The named surfaces.
    pub surfaces: Vec<Surface>,
    /// Number of the file's triangle that each is a piece of, ascending; empty if none is cut.
    pub face_of: Vec<u32>,
    /// Vertex indices of the file's triangles that are cut, by their numbers.
    pub cut_faces: BTreeMap<u32, [u32; 3]>,
    /// Triangles from this one on are patches as they are, neither split nor joined: their mesh was
    /// made for light.
    pub whole_from: Option<TriangleId>,
}

/// A triangle whose height is below this fraction of its longest edge is degenerate: its normal
/// would be rounding noise in the `f32` kernels.
const DEGENERATE_ASPECT: f64 = 1e-7;

/// Most triangles and vertices of a scene. A small file can ask for more than any memory holds by
/// instancing a mesh over and over.
pub(crate) const MAX_ELEMENTS: usize = 1 << 25;

/// Largest coordinate in metres: beyond it areas overflow the `f32` kernels.
pub const MAX_COORDINATE: f64 = 1e15;

impl Geometry {
    /// Number of source triangles, flagged ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is no triangle at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// All triangle ids in file order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = TriangleId> + use<> {
        (0..u32::try_from(self.triangles.len()).unwrap_or(u32::MAX)).map(TriangleId)
    }

    /// The three corners of a triangle in metres.
    #[must_use]
    pub fn corners(&self, id: TriangleId) -> [DVec3; 3] {
        self.triangles[id.index()].map(|v| self.vertices[v as usize])
    }

    /// Area of a triangle in m².
    #[must_use]
    pub fn area(&self, id: TriangleId) -> f64 {
        let [a, b, c] = self.corners(id);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Unit normal of a side; zero for a degenerate triangle.
    #[must_use]
    pub fn normal(&self, id: TriangleId, side: Side) -> DVec3 {
        let [a, b, c] = self.corners(id);
        (b - a).cross(c - a).normalize_or_zero() * side.sign()
    }

    /// Number of the file's triangle that this is, or is a piece of.
    #[must_use]
    pub fn face(&self, id: TriangleId) -> u32 {
        self.face_of.get(id.index()).copied().unwrap_or(id.0)
    }

    /// Number of triangles in the file.
    #[must_use]
    pub fn faces(&self) -> usize {
        self.face_of.last().map_or(self.len(), |&last| last as usize + 1)
    }

    /// Whether the triangle blocks and exchanges light.
    #[must_use]
    pub fn is_solid(&self, id: TriangleId) -> bool {
        self.state[id.index()] == TriangleState::Solid
    }

    /// Whether the triangle is a patch as it is, neither split nor joined.
    #[must_use]
    pub fn is_whole(&self, id: TriangleId) -> bool {
        self.whole_from.is_some_and(|from| id >= from)
    }

    /// Whether this side of the triangle exchanges light (one that does not absorbs).
    #[must_use]
    pub fn exchanges(&self, id: TriangleId, side: Side) -> bool {
        let takes_part = match self.sides[id.index()] {
            Sides::One => side == Side::Front,
            Sides::Two => true,
            Sides::None => false,
        };
        self.is_solid(id) && takes_part
    }

    /// Lets these sides take part, but for triangles that only block.
    pub(crate) fn choose_sides(&mut self, sides: Sides) {
        self.sides.iter_mut().filter(|s| **s != Sides::None).for_each(|s| *s = sides);
    }

    /// Smallest and largest coordinates over the solid triangles; `None` if there are none.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.ids()
            .filter(|&t| self.is_solid(t))
            .flat_map(|t| self.corners(t))
            .map(|v| (v, v))
            .reduce(|(lo, hi), (v, _)| (lo.min(v), hi.max(v)))
    }

    /// Marks degenerate triangles, and those that coincide with an earlier one (the same three
    /// positions in any order). Transparent ones keep their mark.
    pub fn flag_flaws(&mut self) {
        let mut seen = std::collections::HashSet::new();
        for id in self.ids() {
            if self.state[id.index()] == TriangleState::Transparent {
                continue;
            }
            let corners = self.corners(id);
            self.state[id.index()] = if is_degenerate(corners) {
                TriangleState::Degenerate
            } else {
                let mut key = corners.map(position_key);
                key.sort_unstable();
                if seen.insert(key) { TriangleState::Solid } else { TriangleState::Duplicate }
            };
        }
    }

    /// Turns every triangle round: fronts become backs.
    pub fn flip(&mut self) {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
    }

    /// A fingerprint of everything that form factors depend on: positions, triangles, sides and
    /// which take part. Materials do not enter.
    #[must_use]
    pub fn fingerprint(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for (triangle, (sides, state)) in
            self.triangles.iter().zip(self.sides.iter().zip(&self.state))
        {
            for &v in triangle {
                for key in position_key(self.vertices[v as usize]) {
                    hasher.update(&key.to_le_bytes());
                }
            }
            hasher.update(&[*sides as u8, *state as u8]);
        }
        *hasher.finalize().as_bytes()
    }
}

/// Bits of a position, with -0 and +0 alike: equal keys are equal positions.
#[must_use]
pub fn position_key(v: DVec3) -> [u64; 3] {
    v.to_array().map(|x| (x + 0.0).to_bits())
}

/// Whether a triangle has no area to speak of.
pub(super) fn is_degenerate([a, b, c]: [DVec3; 3]) -> bool {
    let longest2 =
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let double_area = (b - a).cross(c - a).length();
    !double_area.is_finite() || double_area <= DEGENERATE_ASPECT * longest2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_triangles(second: [u32; 3]) -> Geometry {
        let mut g = Geometry {
            vertices: vec![
                DVec3::ZERO,
                DVec3::X,
                DVec3::Y,
                DVec3::new(2.0, 0.0, 0.0),
                DVec3::new(-0.0, 0.0, 0.0),
            ],
            triangles: vec![[0, 1, 2], second],
            sides: vec![Sides::One; 2],
            state: vec![TriangleState::Solid; 2],
            surface_of: vec![0; 2],
            surfaces: vec![],
            face_of: vec![],
            cut_faces: BTreeMap::new(),
            whole_from: None,
        };
        g.flag_flaws();
        g
    }

    #[test]
    fn duplicates_are_found_in_any_winding_and_with_negative_zero() {
        assert_eq!(
            two_triangles([2, 1, 4]).state,
            [TriangleState::Solid, TriangleState::Duplicate]
        );
    }

    #[test]
    fn collinear_corners_are_degenerate() {
        assert_eq!(
            two_triangles([0, 1, 3]).state,
            [TriangleState::Solid, TriangleState::Degenerate]
        );
    }

    #[test]
    fn fingerprint_sees_geometry_and_not_names() {
        let g = two_triangles([0, 1, 3]);
        let mut named = g.clone();
        named.surfaces.push(Surface { name: "floor".into(), node: 0, primitive: 0 });
        assert_eq!(g.fingerprint(), named.fingerprint());
        let mut moved = g.clone();
        moved.vertices[0].x += 1e-9;
        assert_ne!(g.fingerprint(), moved.fingerprint());
    }
}
