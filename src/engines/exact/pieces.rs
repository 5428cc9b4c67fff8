//! Pieces: the triangles that patches consist of.

use glam::{DVec2, DVec3};

use super::polygon::Polygon;
use super::tree::Extent;
use crate::patches::{PatchId, Patches, at_barycentric};
use crate::scene::{Geometry, Side, TriangleId};
use crate::visibility::Bvh;

/// A piece, by its number among all in the order of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PieceId(pub u32);

/// A triangle of a patch, and what is known of where it lies.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub polygon: Polygon,
    /// The solid triangle that it lies on.
    pub own: Option<u32>,
}

impl Piece {
    pub fn new(fragment: &Fragment, bvh: &Bvh) -> Self {
        let Fragment { triangle, corners, normal } = *fragment;
        Self { polygon: Polygon::triangle(corners, normal), own: bvh.solid(triangle) }
    }
}

/// A triangle that belongs to a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment {
    /// The source triangle that it lies on.
    pub triangle: TriangleId,
    /// Counter-clockwise about the normal.
    pub corners: [DVec3; 3],
    /// Unit normal of the side.
    pub normal: DVec3,
}

/// All that belongs to a patch.
pub(super) fn fragments(geometry: &Geometry, patches: &Patches, id: PatchId) -> Vec<Fragment> {
    let fragment = |triangle, side, [a, b, c]: [DVec3; 3]| {
        let corners = match side {
            Side::Front => [a, b, c],
            Side::Back => [a, c, b],
        };
        Fragment { triangle, corners, normal: geometry.normal(triangle, side) }
    };
    let cell = patches.cell(id);
    let source = geometry.corners(cell.triangle);
    match patches.fragments(id) {
        Some(triangles) => triangles
            .map(|uv| {
                let at = |p: DVec2| at_barycentric(source, DVec3::new(1.0 - p.x - p.y, p.x, p.y));
                fragment(cell.triangle, cell.side, uv.map(at))
            })
            .collect(),
        None => {
            let pieces = patches.pieces(id);
            pieces.map(|c| fragment(c.triangle, c.side, c.corners(geometry))).collect()
        }
    }
}

/// The extent of a patch that consists of these triangles.
pub(super) fn extent(fragments: &[Fragment]) -> Extent {
    let first = fragments.first().map_or(DVec3::ZERO, |f| f.normal);
    let flat = fragments.iter().all(|f| f.normal.dot(first) > 1.0 - 1e-9);
    let corners = || fragments.iter().flat_map(|f| f.corners);
    Extent {
        low: corners().fold(DVec3::INFINITY, |l, c| l.min(c)),
        high: corners().fold(DVec3::NEG_INFINITY, |h, c| h.max(c)),
        normal: if flat { first } else { DVec3::ZERO },
    }
}
