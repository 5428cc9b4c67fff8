//! Triangles of a baked model.

use glam::{DVec2, DVec3};

use crate::patches::SurfacePoint;
use crate::scene::{Side, TriangleId};

/// A triangle of a baked model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// The source triangle that it is of.
    pub triangle: TriangleId,
    /// The side of it.
    pub side: Side,
    /// Corners in the coordinates `uv` of the source triangle, counter-clockwise seen from its
    /// front.
    pub corners: [DVec2; 3],
    /// Corners in the atlas, 0..1, from its upper left.
    pub atlas: [DVec2; 3],
    /// Number of its chart.
    pub chart: u32,
    /// Radiance at the corners, W/(m² sr) or cd/m².
    pub radiance: [[f32; 3]; 3],
}

impl Facet {
    /// The corners, counter-clockwise seen from its side.
    #[must_use]
    pub fn around(&self) -> [usize; 3] {
        match self.side {
            Side::Front => [0, 1, 2],
            Side::Back => [0, 2, 1],
        }
    }

    /// The point with these barycentric coordinates, corners in the order of `corners`.
    #[must_use]
    pub fn point(&self, l: DVec3) -> SurfacePoint {
        let [a, b, c] = self.corners;
        let uv = a * l.x + b * l.y + c * l.z;
        SurfacePoint { triangle: self.triangle, side: self.side, uv }
    }
}
