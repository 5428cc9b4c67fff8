//! Edges of source triangles after welding equal positions: who meets whom, whether or not a file
//! shares its vertices.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::{Geometry, TriangleId, position_key};
use super::hash::Mixed;

/// A triangle's part in an edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeUse {
    /// The welded vertices of the edge, the smaller in the upper half: equal for all that share it.
    pub key: u64,
    /// The triangle.
    pub triangle: TriangleId,
    /// The edge runs from corner k to corner k + 1.
    pub k: u8,
    /// Whether it runs from the larger welded vertex to the smaller.
    pub reversed: bool,
}

/// The uses of all edges of solid triangles, those of one edge side by side in the order of their
/// triangles, and the welded positions.
pub(crate) fn edge_uses(g: &Geometry) -> (Vec<EdgeUse>, Vec<DVec3>) {
    let (welded, positions) = weld(g);
    let mut uses: Vec<EdgeUse> = g
        .ids()
        .filter(|&t| g.is_solid(t))
        .flat_map(|triangle| {
            let v = g.triangles[triangle.index()].map(|v| welded[v as usize]);
            [0_u8, 1, 2].map(|k| {
                let [a, b] = [v[usize::from(k)], v[usize::from(k + 1) % 3]];
                let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                EdgeUse { key, triangle, k, reversed: a > b }
            })
        })
        .collect();
    uses.par_sort_unstable_by_key(|u| (u.key, u.triangle, u.k));
    (uses, positions)
}

/// The uses of one edge after another.
pub(crate) fn shared(uses: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    uses.chunk_by(|a, b| a.key == b.key)
}

/// The first vertex at the position of each vertex, renumbered, and the positions.
fn weld(g: &Geometry) -> (Vec<u32>, Vec<DVec3>) {
    let mut positions = Vec::with_capacity(g.vertices.len());
    let mut index: HashMap<[u64; 3], u32, Mixed> =
        HashMap::with_capacity_and_hasher(g.vertices.len(), Mixed::default());
    let welded = g
        .vertices
        .iter()
        .map(|&v| {
            *index.entry(position_key(v)).or_insert_with(|| {
                positions.push(v);
                (positions.len() - 1) as u32
            })
        })
        .collect();
    (welded, positions)
}
