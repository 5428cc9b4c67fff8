//! Integer coordinates of a patch in the grid on its source triangle.

use glam::{DVec2, DVec3};

use super::point::{SurfacePoint, at_barycentric};
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

    /// A whole side of a source triangle.
    pub(crate) fn whole(triangle: TriangleId, side: Side) -> Self {
        Self { triangle, ij: [0; 2], level: 0, inverted: false, side }
    }

    /// The same cell of another source triangle.
    pub(crate) fn on(&self, triangle: TriangleId) -> Self {
        Self { triangle, ..*self }
    }

    /// The cell of the same side at strips `i`, `j` of level `level`.
    fn on_same_side(&self, level: u8, [i, j]: [u32; 2], inverted: bool) -> Self {
        Self { level, ij: [i as u16, j as u16], inverted, ..*self }
    }

    /// The four cells of the next level: towards the three corners, then the middle one, which is
    /// turned over and has the same centroid.
    #[must_use]
    pub fn children(&self) -> [Self; 4] {
        let [i, j] = self.ij.map(u32::from);
        let at = |di: u32, dj: u32, inverted| {
            self.on_same_side(self.level + 1, [2 * i + di, 2 * j + dj], inverted)
        };
        if self.inverted {
            [at(0, 1, true), at(1, 0, true), at(1, 1, true), at(1, 1, false)]
        } else {
            [at(1, 0, false), at(0, 1, false), at(0, 0, false), at(0, 0, true)]
        }
    }

    /// The cell of level `level`, at most this one's, that contains this one.
    #[must_use]
    pub fn ancestor(&self, level: u8) -> Self {
        let shift = u32::from(self.level - level);
        let [i, j, k] = self.strip().map(|i| i >> shift);
        self.on_same_side(level, [i, j], i + j + k + 1 < 1 << level)
    }

    /// The cell of level `level`, at least this one's, with the same centroid.
    #[must_use]
    pub fn middle(&self, level: u8) -> Self {
        (self.level..level).fold(*self, |cell, _| cell.children()[3])
    }

    /// Place of the cell in the order of `Cell::grid`.
    #[must_use]
    pub fn index(&self) -> u32 {
        let [i, j] = self.ij.map(u32::from);
        i * (2 * self.strips() - i) + 2 * j + u32::from(self.inverted)
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

    /// The point with coordinates `u` in the unit square, uniform in area.
    #[must_use]
    pub fn sample(&self, u: DVec2) -> SurfacePoint {
        let s = u.x.sqrt();
        self.point(DVec3::new(1.0 - s, s * (1.0 - u.y), s * u.y))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_and_ancestors_agree() {
        for cell in Cell::grid(TriangleId(0), Side::Front, 3) {
            for child in cell.children() {
                assert_eq!(child.ancestor(3), cell);
                let centre = child.point(DVec3::splat(1.0 / 3.0)).barycentric();
                let local = cell.local(centre);
                assert!(local.min_element() > 0.1, "{cell:?} {child:?} {local}");
                assert_eq!(index_in_grid(4, centre), child.index());
            }
            let middle = cell.middle(6).point(DVec3::splat(1.0 / 3.0)).uv;
            assert!(middle.distance(cell.point(DVec3::splat(1.0 / 3.0)).uv) < 1e-15);
        }
    }
}
