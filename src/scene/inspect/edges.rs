//! Edges of the model after welding equal positions.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::grid::{Bounds, Grid};
use crate::scene::edges::{edge_uses, shared};
use crate::scene::geometry::{Geometry, TriangleId, position_key};
use crate::scene::hash::Mixed;

/// An edge that is doubtful.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    from: DVec3,
    to: DVec3,
    /// A triangle that has it.
    pub triangle: TriangleId,
    /// Its neighbour, or itself where there is none.
    pub other: TriangleId,
}

/// Doubtful edges in the order of their triangles.
pub struct Edges {
    /// Edges of a single triangle.
    pub boundary: Vec<Edge>,
    /// Edges that their two triangles run along in the same direction: these face opposite ways.
    pub turned: Vec<Edge>,
}

/// Vertices on the interior of another triangle's edge.
pub struct TVertices {
    /// How many.
    pub count: usize,
    /// Whether only part of the model was searched.
    pub partial: bool,
    /// A triangle that has the first of them as a corner.
    pub first: TriangleId,
    /// Where it is.
    pub at: DVec3,
}

/// A vertex this close to an edge, as a fraction of its length, lies on it.
const ON_EDGE: f64 = 1e-5;

/// Rounding of `f32` coordinates, as a fraction of their size.
const COORDINATE_NOISE: f64 = 2e-7;

/// Boundary edges that are searched for T-vertices: a model with more is hardly connected at all.
const MOST_SEARCHED: usize = 400_000;

/// Edges tried for each vertex; only stars and combs of long edges have more that are near.
const MOST_TRIED: usize = 256;

impl Edges {
    /// Finds the doubtful edges of the solid triangles.
    pub fn of(g: &Geometry) -> Self {
        let (uses, positions) = edge_uses(g);
        let (mut boundary, mut turned) = (Vec::new(), Vec::new());
        for shared in shared(&uses) {
            let position = |v: u64| positions[v as usize];
            let edge = |other: TriangleId| Edge {
                from: position(shared[0].key >> 32),
                to: position(shared[0].key & 0xffff_ffff),
                triangle: shared[0].triangle,
                other,
            };
            match shared {
                [one] => boundary.push(edge(one.triangle)),
                [a, b] if a.reversed == b.reversed => turned.push(edge(b.triangle)),
                _ => {}
            }
        }
        boundary.par_sort_by_key(|e| e.triangle);
        turned.par_sort_by_key(|e| e.triangle);
        Self { boundary, turned }
    }

    /// The middle of an edge.
    pub fn middle(&self, edge: &Edge) -> DVec3 {
        edge.from.midpoint(edge.to)
    }

    /// Finds corners of the model that lie on another triangle's edge. Such an edge is a boundary
    /// edge, as nothing shares the whole of it, and the vertex ends one itself.
    pub fn t_vertices(&self, g: &Geometry) -> Option<TVertices> {
        let (low, high) = g.bounds()?;
        let noise = COORDINATE_NOISE * low.abs().max(high.abs()).max_element();
        let boundary = &self.boundary[..self.boundary.len().min(MOST_SEARCHED)];
        let tolerance = |e: &Edge| (ON_EDGE * (e.to - e.from).length()).max(noise);
        let items: Vec<(u32, u64, Bounds<3>)> = boundary
            .iter()
            .enumerate()
            .map(|(i, e)| {
                let bounds = Bounds::of([e.from.to_array(), e.to.to_array()]);
                (i as u32, 0, bounds.grown(tolerance(e)))
            })
            .collect();
        let grid = Grid::new(&items);
        let mut seen: HashMap<[u64; 3], (), Mixed> = HashMap::default();
        let vertices: Vec<(DVec3, TriangleId)> = boundary
            .iter()
            .flat_map(|e| [(e.from, e.triangle), (e.to, e.triangle)])
            .filter(|(at, _)| seen.insert(position_key(*at), ()).is_none())
            .collect();
        let unfinished = AtomicBool::new(false);
        let on_an_edge = |at: DVec3| {
            let (mut found, mut tried) = (false, 0);
            grid.meet(0, &Bounds::of([at.to_array()]), |i| {
                let e = &boundary[i as usize];
                tried += 1;
                found = lies_within(at, e, tolerance(e));
                !found && tried < MOST_TRIED
            });
            if tried == MOST_TRIED && !found {
                unfinished.store(true, Ordering::Relaxed);
            }
            found
        };
        let found: Vec<_> = vertices.into_par_iter().filter(|(at, _)| on_an_edge(*at)).collect();
        let &(at, first) = found.first()?;
        let partial = boundary.len() < self.boundary.len() || unfinished.into_inner();
        Some(TVertices { count: found.len(), partial, first, at })
    }
}

/// Whether a point is on an edge and apart from both its ends.
fn lies_within(p: DVec3, e: &Edge, tolerance: f64) -> bool {
    let along = e.to - e.from;
    let length = along.length();
    let t = (p - e.from).dot(along) / length;
    t > tolerance
        && t < length - tolerance
        && (p - e.from - along * (t / length)).length() <= tolerance
}
