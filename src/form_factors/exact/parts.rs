//! The triangles that patches consist of: their cells, cut along the lines on which something stands
//! on them or passes through them.
//!
//! What lies beyond such a line belongs to a neighbour ([`Patches::at`]). A cell is cut along all its
//! contact lines first, so that each part lies on one side of them; parts of several owners (the end
//! of a line lies within them) are split further, and the smallest go to whom their middle belongs.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::patches::{Cell, PatchId, Patches, SurfacePoint, at_barycentric};
use crate::scene::{Geometry, Side, TriangleId};

/// A triangle of a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// The source triangle that it lies on.
    pub triangle: TriangleId,
    /// Counter-clockwise about the normal.
    pub corners: [DVec3; 3],
    /// Unit normal of the side.
    pub normal: DVec3,
}

/// Parts of several owners are split so often.
const SPLITS: u32 = 4;

/// What is thinner than this share of a cell is not cut off.
const THIN: f64 = 1e-6;

/// The parts of each patch.
pub(super) fn parts_of(geometry: &Geometry, patches: &Patches) -> Vec<Vec<Part>> {
    let mut parts: Vec<Vec<Part>> = patches
        .ids()
        .map(|id| match patches.is_parted(id) {
            true => Vec::new(),
            false => patches.pieces(id).map(|c| whole(geometry, &c)).collect(),
        })
        .collect();
    let parted: Vec<PatchId> = patches.ids().filter(|&id| patches.is_parted(id)).collect();
    let shared: Vec<Vec<(PatchId, Part)>> =
        parted.par_iter().map(|&id| share_out(geometry, patches, patches.cell(id))).collect();
    for (owner, part) in shared.into_iter().flatten() {
        parts[owner.index()].push(part);
    }
    for id in parted {
        // Too small for anything to be its own: all of it stands for it.
        if parts[id.index()].is_empty() {
            parts[id.index()].push(whole(geometry, &patches.cell(id)));
        }
    }
    parts
}

fn whole(geometry: &Geometry, cell: &Cell) -> Part {
    part(geometry, cell, cell.barycentric().map(|l| DVec2::new(l.y, l.z)))
}

/// The part with corners `uv` on the source triangle, in its winding.
fn part(geometry: &Geometry, cell: &Cell, uv: [DVec2; 3]) -> Part {
    let source = geometry.corners(cell.triangle);
    let [a, b, c] = uv.map(|p| at_barycentric(source, DVec3::new(1.0 - p.x - p.y, p.x, p.y)));
    let corners = match cell.side {
        Side::Front => [a, b, c],
        Side::Back => [a, c, b],
    };
    Part { triangle: cell.triangle, corners, normal: geometry.normal(cell.triangle, cell.side) }
}

/// All parts of a cell with whom they belong to.
fn share_out(geometry: &Geometry, patches: &Patches, cell: Cell) -> Vec<(PatchId, Part)> {
    let mut found = Vec::new();
    let outline = cell.barycentric().map(|l| DVec2::new(l.y, l.z));
    let thin = THIN / f64::from(cell.strips());
    let mut convex = vec![outline.to_vec()];
    for line in patches.contacts_in(&cell) {
        convex = convex.into_iter().flat_map(|p| cut(p, line, thin)).flatten().collect();
    }
    for polygon in convex {
        for k in 2..polygon.len() {
            let triangle = [polygon[0], polygon[k - 1], polygon[k]];
            give(patches, &cell, triangle, SPLITS, &mut |owner, uv| {
                found.push((owner, part(geometry, &cell, uv)));
            });
        }
    }
    found
}

/// Both parts of a convex polygon, if a segment passes through its inside.
fn cut(polygon: Vec<DVec2>, [from, to]: [DVec2; 2], thin: f64) -> [Option<Vec<DVec2>>; 2] {
    let length = from.distance(to);
    let along = (to - from) / length;
    let height = |p: DVec2| along.perp_dot(p - from);
    let high = polygon.iter().map(|&p| height(p)).fold(f64::NEG_INFINITY, f64::max);
    let low = polygon.iter().map(|&p| height(p)).fold(f64::INFINITY, f64::min);
    if high.is_nan() || high <= thin || low >= -thin {
        return [Some(polygon), None];
    }
    let mut parts = [Vec::new(), Vec::new()];
    let mut crossed = [f64::INFINITY, f64::NEG_INFINITY];
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (h, g) = (height(p), height(q));
        if h >= 0.0 {
            parts[0].push(p);
        }
        if h <= 0.0 {
            parts[1].push(p);
        }
        let on = if h * g < 0.0 { p + (q - p) * (h / (h - g)) } else { p };
        if h * g < 0.0 {
            parts.iter_mut().for_each(|part| part.push(on));
        }
        if h * g < 0.0 || h == 0.0 {
            let at = along.dot(on - from);
            crossed = [crossed[0].min(at), crossed[1].max(at)];
        }
    }
    // The segment may end before it comes here.
    if crossed[1].min(length) - crossed[0].max(0.0) <= thin {
        return [Some(polygon), None];
    }
    parts.map(Some)
}

/// Hands over a triangle, or parts of it, with the owner of each.
fn give(
    patches: &Patches,
    cell: &Cell,
    [a, b, c]: [DVec2; 3],
    splits: u32,
    each: &mut impl FnMut(PatchId, [DVec2; 3]),
) {
    // Drawn in a little: corners on a line are nobody's.
    const CORNERS: [[f64; 3]; 3] = [[0.98, 0.01, 0.01], [0.01, 0.98, 0.01], [0.01, 0.01, 0.98]];
    let at = |[r, s, t]: [f64; 3]| {
        let uv = a * r + b * s + c * t;
        patches.at(SurfacePoint { triangle: cell.triangle, side: cell.side, uv })
    };
    let middle = at([1.0 / 3.0; 3]);
    if splits == 0 || CORNERS.iter().all(|&l| at(l) == middle) {
        if let Some(owner) = middle {
            each(owner, [a, b, c]);
        }
        return;
    }
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]] {
        give(patches, cell, t, splits - 1, each);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::exact::unoccluded::area;
    use crate::scene::builtin;

    #[test]
    fn a_segment_cuts_what_it_passes_through() {
        let square = || [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from).to_vec();
        let area = |p: &Vec<DVec2>| {
            (2..p.len()).map(|k| 0.5 * (p[k - 1] - p[0]).perp_dot(p[k] - p[0])).sum::<f64>()
        };
        let cut = |from: [f64; 2], to: [f64; 2]| {
            let parts = cut(square(), [from.into(), to.into()], 1e-6);
            parts.each_ref().map(|p| p.as_ref().map(area))
        };
        assert_eq!(cut([0.25, -1.0], [0.25, 0.5]), [Some(0.25), Some(0.75)]);
        assert_eq!(cut([0.0, 0.0], [1.0, 1.0]), [Some(0.5), Some(0.5)]);
        assert_eq!(cut([0.25, -1.0], [0.25, -0.5]), [Some(1.0), None], "ends before it");
        assert_eq!(cut([-1.0, 1.0], [2.0, 1.0]), [Some(1.0), None], "runs along an edge");
        assert_eq!(cut([2.0, 0.0], [2.0, 1.0]), [Some(1.0), None], "passes by");
    }

    #[test]
    fn parts_of_all_patches_make_up_the_surface() {
        for (name, size) in [("cornell-box", 0.1), ("paper-3", 3.2), ("room", 1.0)] {
            let g = builtin::build(name).unwrap().geometry;
            let patches = Patches::uniform(&g, size).unwrap();
            let parts = parts_of(&g, &patches);
            let of_parts: f64 = parts.iter().flatten().map(|p| area(p.corners)).sum();
            let of_patches: f64 = patches.ids().map(|id| patches.area(id)).sum();
            assert!((of_parts / of_patches - 1.0).abs() < 1e-9, "{name} {of_parts} {of_patches}");
            assert!(parts.iter().all(|p| !p.is_empty()));
            for p in parts.iter().flatten() {
                let [a, b, c] = p.corners;
                assert!((b - a).cross(c - a).dot(p.normal) >= 0.0);
            }
        }
    }
}
