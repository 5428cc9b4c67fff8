//! Integer coordinates of a patch in the grid on its source triangle.

use glam::{DVec2, DVec3};

use super::{SurfacePoint, at_barycentric};
use crate::scene::{Geometry, Side, TriangleId};

/// A cell of the triangular grid on one side of a source triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Cell {
    /// The source triangle.
    pub triangle: TriangleId,
    /// Strip along the first and second barycentric coordinate.
    ij: [u16; 2],
    /// Number of splits, 0 for the whole triangle.
    pub level: u8,
    /// Whether the cell is upside down with respect to its source.
    pub inverted: bool,
    /// The side of the source triangle.
    pub side: Side,
}

impl Cell {
    /// All `4^level` cells of a side in the order of their ids: strip by strip of the first
    /// coordinate, upright and inverted cells in turn.
    pub(super) fn grid(triangle: TriangleId, side: Side, level: u8) -> impl Iterator<Item = Self> {
        let n = 1_u16 << level;
        (0..n).flat_map(move |i| {
            (0..2 * (n - i) - 1).map(move |c| Self {
                triangle,
                side,
                level,
                ij: [i, c / 2],
                inverted: c % 2 == 1,
            })
        })
    }

    /// Number of strips along each coordinate, `2^level`.
    #[must_use]
    pub fn strips(&self) -> u32 {
        1 << self.level
    }

    /// The integer parts of `strips` times the barycentric coordinates of the cell's points.
    #[must_use]
    pub fn strip(&self) -> [u32; 3] {
        let [i, j] = self.ij.map(u32::from);
        [i, j, self.strips() - 1 - u32::from(self.inverted) - i - j]
    }

    /// The corners as integer barycentric coordinates, out of [`strips`](Self::strips), in the
    /// winding of the source triangle.
    #[must_use]
    pub fn lattice(&self) -> [[u32; 3]; 3] {
        let [i, j, k] = self.strip();
        if self.inverted {
            [[i, j + 1, k + 1], [i + 1, j, k + 1], [i + 1, j + 1, k]]
        } else {
            [[i + 1, j, k], [i, j + 1, k], [i, j, k + 1]]
        }
    }

    /// Barycentric coordinates of the corners on the source triangle.
    #[must_use]
    pub fn barycentric(&self) -> [DVec3; 3] {
        let scale = 1.0 / f64::from(self.strips());
        self.lattice().map(|c| DVec3::from_array(c.map(f64::from)) * scale)
    }

    /// The corners in metres, in the winding of the source triangle.
    #[must_use]
    pub fn corners(&self, geometry: &Geometry) -> [DVec3; 3] {
        let source = geometry.corners(self.triangle);
        self.barycentric().map(|l| at_barycentric(source, l))
    }

    /// The point with barycentric coordinates `local` within the cell.
    #[must_use]
    pub fn point(&self, local: DVec3) -> SurfacePoint {
        let [a, b, c] = self.barycentric();
        let l = a * local.x + b * local.y + c * local.z;
        SurfacePoint { triangle: self.triangle, side: self.side, uv: DVec2::new(l.y, l.z) }
    }

    /// Barycentric coordinates within the cell of a point of the source triangle.
    #[must_use]
    pub fn local(&self, source: DVec3) -> DVec3 {
        let [i, j, k] = self.strip().map(f64::from);
        let scaled = source * f64::from(self.strips()) - DVec3::new(i, j, k);
        if self.inverted { DVec3::ONE - scaled } else { scaled }
    }
}

/// Index of the cell under barycentric coordinates `l` in the order of [`Cell::grid`].
pub(super) fn index_in_grid(level: u8, l: DVec3) -> u32 {
    let n = 1_u32 << level;
    let scaled = l * f64::from(n);
    let i = (scaled.x.max(0.0) as u32).min(n - 1);
    let j = (scaled.y.max(0.0) as u32).min(n - 1 - i);
    let inverted = (scaled.x - f64::from(i)) + (scaled.y - f64::from(j)) > 1.0 && i + j + 2 <= n;
    i * (2 * n - i) + 2 * j + u32::from(inverted)
}
