//! Which row of the matrix is what: row i is face i of the file.

use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, Side, Sides, TriangleId};

/// What one row and column of a matrix stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// The source triangle.
    pub triangle: TriangleId,
    /// Its side.
    pub side: Side,
    /// The patch; `None` for a triangle that takes no part: its row and column are zero.
    pub patch: Option<PatchId>,
}

/// The rows of a matrix in order: the fronts of all triangles as in the file, then, if any is
/// two-sided, the backs of all. A side that is cut into patches has a row for each; one without has
/// a single row of zeros. Triangles that only block have none.
#[derive(Debug, Clone)]
pub struct Layout {
    /// What each row stands for.
    pub faces: Vec<Face>,
    /// The row of each patch.
    row_of: Vec<u32>,
}

impl Layout {
    /// The rows of these patches, none of which may be a cluster.
    #[must_use]
    pub fn new(geometry: &Geometry, patches: &Patches) -> Self {
        let two = geometry.sides.contains(&Sides::Two);
        let mut faces = Vec::with_capacity(patches.len());
        let mut row_of = vec![0; patches.len()];
        for side in if two { &Side::BOTH[..] } else { &Side::BOTH[..1] } {
            let has_rows = |t: &TriangleId| geometry.sides[t.index()] != Sides::None;
            for triangle in geometry.ids().filter(has_rows) {
                let (first, side) = (faces.len(), *side);
                for patch in patches.of_side(triangle, side) {
                    row_of[patch.index()] = faces.len() as u32;
                    faces.push(Face { triangle, side, patch: Some(patch) });
                }
                if faces.len() == first {
                    faces.push(Face { triangle, side, patch: None });
                }
            }
        }
        Self { faces, row_of }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// The row of a patch: rows ascend as patches do.
    #[must_use]
    pub fn row_of(&self, patch: PatchId) -> u32 {
        self.row_of[patch.index()]
    }
}
