//! Boxes in boxes, and the triangles in them.

use super::node::Node;
use super::triangle::Triangle;
use crate::visibility::NOTHING;

/// A binary hierarchy of boxes.
#[derive(Debug, Clone)]
pub(super) struct Hierarchy {
    /// The root first; none without triangles.
    pub nodes: Vec<Node>,
    /// In the order of the leaves.
    pub triangles: Vec<Triangle>,
    /// Where each solid triangle is in `triangles`.
    pub place: Vec<u32>,
}

/// Normals with a smaller sine between them are those of one plane: single precision turns those of
/// small triangles by as much.
const PARALLEL: f64 = 1e-3;

impl Hierarchy {
    /// Whether a triangle is parallel to the solid triangle `own` and faces the same way.
    pub fn continues(&self, triangle: &Triangle, own: u32) -> bool {
        let place = self.place.get(own as usize).map_or(NOTHING, |&p| p);
        self.triangles.get(place as usize).is_some_and(|own| {
            let (m, n) = (own.normal(), triangle.normal());
            let along = m.dot(n);
            along > 0.0 && m.cross(n).length() <= PARALLEL * along
        })
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.nodes) + size_of_val(&*self.triangles) + size_of_val(&*self.place))
            as u64
    }
}
