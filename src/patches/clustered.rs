//! Clusters: several whole source triangles, nearly coplanar and connected, as one patch.
//!
//! Each connected, smooth region of small triangles is cut in two again and again, across its
//! longest extent where it is too large and across the strongest bend where it is too curved, until
//! every part fits; remnants that fit to a neighbour then join it. Cutting from above rather than
//! merging pairs from below (as Garland, Willmott & Heckbert 2001, "Hierarchical face clustering on
//! polygonal surfaces", do) gives parts of nearly equal area and takes O(n log n) without a heap.
//!
//! Edges that nothing is joined across: those of one triangle or of more than two; folds; where the
//! label, the sidedness or the winding changes; and where something else stands on the edge. A
//! triangle that a contact line passes through stays alone, so that no cluster lies on both sides
//! of a wall, and none is ever cut by a contact.

mod region;
mod remnants;

use super::contact::ContactLines;
use crate::scene::{Geometry, Side, TriangleId};
use region::{Facet, NONE, Region, Shape};
use remnants::Joined;

pub(super) use region::FILL;
pub use region::{MAX_ANGLE, MAX_DIAMETER};

/// No cluster.
pub(super) const ALONE: u32 = NONE;

/// For each side the number of its cluster, or [`NONE`]; clusters have at least two members.
pub(super) fn clusters(
    geometry: &Geometry,
    contacts: &ContactLines,
    may_join: impl Fn(TriangleId) -> bool,
    max_area: f64,
    label: &[u32],
) -> Vec<u32> {
    let region = Region::new(geometry, contacts, may_join, max_area, label);
    let mut order: Vec<u32> = (0..region.facets.len() as u32).collect();
    let lengths = region.divide(&mut order, 0);
    let cluster_of = Joined::new(&region, &order, &lengths).join();
    let mut sizes = vec![0_u32; lengths.len()];
    for &c in &cluster_of {
        sizes[c as usize] += 1;
    }
    let mut of_side = vec![NONE; 2 * geometry.len()];
    for (&side, &c) in region.sides.iter().zip(&cluster_of) {
        if sizes[c as usize] > 1 {
            of_side[side as usize] = c;
        }
    }
    of_side
}

/// The member of a cluster that stands for it: near the middle, and facing as the whole does.
pub(super) fn representative(geometry: &Geometry, side: Side, members: &[TriangleId]) -> usize {
    let facets: Vec<Facet> = members.iter().map(|&t| Facet::of(geometry, t, side)).collect();
    let shape = Shape::of(facets.iter());
    let score = |f: &Facet| {
        let off_centre = (f.centroid - shape.centroid).length_squared() / shape.area;
        let turned = (1.0 - f.normal.dot(shape.normal)) / (1.0 - MAX_ANGLE.cos());
        off_centre + turned
    };
    let best = (0..facets.len()).min_by(|&a, &b| score(&facets[a]).total_cmp(&score(&facets[b])));
    best.unwrap_or(0)
}
