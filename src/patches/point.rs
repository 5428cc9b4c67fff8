//! Where on the surface: ids of patches, and points of source triangles.

use glam::{DVec2, DVec3};

use crate::scene::{Geometry, Side, TriangleId};

/// Index of a patch, and of its row and column in the matrix of form factors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PatchId(pub u32);

impl PatchId {
    /// The index as `usize`.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A point on one side of a source triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The source triangle.
    pub triangle: TriangleId,
    /// The side of it.
    pub side: Side,
    /// Barycentric coordinates of the corners `b` and `c`: the point is `a + u (b - a) + v (c -
    /// a)`.
    pub uv: DVec2,
}

impl SurfacePoint {
    /// Barycentric coordinates of all three corners.
    #[must_use]
    pub fn barycentric(&self) -> DVec3 {
        DVec3::new(1.0 - self.uv.x - self.uv.y, self.uv.x, self.uv.y)
    }

    /// Position in metres.
    #[must_use]
    pub fn position(&self, geometry: &Geometry) -> DVec3 {
        at_barycentric(geometry.corners(self.triangle), self.barycentric())
    }
}

/// The point of a triangle with the given barycentric coordinates.
#[must_use]
pub fn at_barycentric([a, b, c]: [DVec3; 3], l: DVec3) -> DVec3 {
    a * l.x + b * l.y + c * l.z
}

/// Index of a side among the two per source triangle: `2 t` front, `2 t + 1` back.
#[must_use]
pub fn side_index(triangle: TriangleId, side: Side) -> usize {
    2 * triangle.index() + side as usize
}
