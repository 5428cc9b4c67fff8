//! Which triangles touch or cross which, and along what lines.
//!
//! Triangles in one plane never part each other, however they overlap: a plane with many of them
//! has a tree of its own, which they leave out. Others are tried until the model has been looked
//! at for as long as its size allows: n triangles that all cross each other have n² contacts.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::line::{Line, Plane, clip, edge_under};
use crate::progress::{Cancelled, Progress};
use crate::scene::box_tree::{Bounds, BoxTree};
use crate::scene::hash::Mixed;
use crate::scene::planes::{SAME_NORMAL, plane_key};
use crate::scene::shares::{Looked, Shared, share_out};
use crate::scene::{Geometry, Side, TriangleId};

/// What touches one side.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    pub lines: Vec<Line>,
    /// Edges that something stands on: bit k for that from corner k to the next.
    pub edges: u8,
}

/// Points this near to a plane lie in it, relative to the size of the scene: exporters keep six or
/// seven digits.
const TOUCH: f64 = 2e-6;

/// Triangles tried for each one of the model, on the average; only of a model where most triangles
/// cross or touch many others are not all tried.
const MOST_TRIED: usize = 512;

/// A line counts as so many triangles tried: it takes memory, and work later on.
const LINE: usize = 16;

/// Planes with at least so many triangles have a tree of their own.
const MANY: usize = 16;

/// What touches the front and the back of each of some triangles.
pub(super) fn contacts(
    geometry: &Geometry,
    triangles: &[TriangleId],
    progress: &dyn Progress,
) -> Result<Shared<[Contacts; 2]>, Cancelled> {
    progress.advance(0)?;
    let search = Search::new(geometry, triangles);
    share_out(triangles.len(), MOST_TRIED, |i, most| {
        progress.advance(0)?;
        Ok(search.around(i, most))
    })
}

struct Facet {
    corners: [DVec3; 3],
    normal: DVec3,
    bounds: Bounds,
    /// Its tree.
    tree: u32,
}

struct Search {
    facets: Vec<Facet>,
    /// Of each tree the facets that it is made of.
    trees: Vec<(Vec<u32>, BoxTree)>,
    /// The tree of trees.
    over: BoxTree,
    /// Points this near (m) to a plane lie in it.
    reach: f64,
}

/// The tree of triangles in planes of few.
const REST: u32 = 0;

impl Search {
    fn new(geometry: &Geometry, triangles: &[TriangleId]) -> Self {
        let (low, high) = geometry.bounds().unwrap_or_default();
        let size = (high - low).length();
        let centre = 0.5 * (low + high);
        let facet = |&t: &TriangleId| {
            let corners @ [a, b, c] = geometry.corners(t);
            let normal = geometry.normal(t, Side::Front);
            let bounds = (a.min(b).min(c), a.max(b).max(c));
            Facet { corners, normal, bounds, tree: REST }
        };
        let mut facets: Vec<Facet> = triangles.par_iter().map(facet).collect();
        let mut planes: HashMap<u64, Vec<u32>, Mixed> = HashMap::default();
        for (i, f) in facets.iter().enumerate() {
            let key = plane_key(f.normal, f.corners[0] - centre, size);
            planes.entry(key).or_default().push(i as u32);
        }
        planes.retain(|_, members| members.len() >= MANY);
        let mut members: Vec<Vec<u32>> = planes.into_values().collect();
        members.sort_unstable_by_key(|m| m[0]);
        for (plane, members) in members.iter().enumerate() {
            members.iter().for_each(|&i| facets[i as usize].tree = plane as u32 + 1);
        }
        let rest = (0..facets.len() as u32).filter(|&i| facets[i as usize].tree == REST).collect();
        members.insert(REST as usize, rest);
        let tree = |members: Vec<u32>| {
            let boxes: Vec<Bounds> = members.iter().map(|&i| facets[i as usize].bounds).collect();
            let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let all = boxes.iter().fold(none, |a, b| (a.0.min(b.0), a.1.max(b.1)));
            (all, (members, BoxTree::new(&boxes)))
        };
        let (bounds, trees): (Vec<Bounds>, Vec<_>) = members.into_par_iter().map(tree).unzip();
        Self { over: BoxTree::new(&bounds), trees, facets, reach: TOUCH * size }
    }

    /// What touches or crosses facet `i`, if that takes about `most` tries.
    fn around(&self, i: usize, most: usize) -> Looked<[Contacts; 2]> {
        let own = &self.facets[i];
        let grown = (own.bounds.0 - 2.0 * self.reach, own.bounds.1 + 2.0 * self.reach);
        let apart = |low: DVec3, high: DVec3| {
            let height = own.normal.dot(0.5 * (low + high) - own.corners[0]);
            let extent = own.normal.abs().dot(0.5 * (high - low));
            !(grown.0.cmple(high) & low.cmple(grown.1)).all()
                || height.abs() - extent > self.reach
                || height.abs() + extent <= self.reach
        };
        let mut tried = 0;
        let mut touched = Vec::new();
        let mut edges = [0_u8; 2];
        let mut tell = |k: u32| {
            let other = &self.facets[k as usize];
            tried += 1;
            if k as usize != i && !apart(other.bounds.0, other.bounds.1) {
                let Some(touch) = touch(own, other, self.reach) else { return tried < most };
                for side in (0..2).filter(|&side| touch.rises[side]) {
                    edges[side] |= touch.edge.map_or(0, |k| 1 << k);
                }
                if let Some(line) = touch.line {
                    touched.push((k, line, touch.rises));
                    tried += LINE;
                }
            }
            tried < most
        };
        let all = self.over.near_while(apart, |t| {
            let (members, tree) = &self.trees[t as usize];
            let own_plane = t != REST && t == own.tree;
            own_plane || tree.near_while(apart, |k| tell(members[k as usize]))
        });
        touched.sort_unstable_by_key(|t| t.0);
        let found = [0, 1].map(|side| Contacts {
            lines: touched.iter().filter(|t| t.2[side]).map(|t| t.1).collect(),
            edges: edges[side],
        });
        Looked { found, tried, all }
    }
}

/// How one triangle touches another.
struct Touch {
    line: Option<Line>,
    edge: Option<usize>,
    /// Whether it rises over the front, and over the back.
    rises: [bool; 2],
}

/// The line along which triangle `other` touches or crosses `own`.
fn touch(own: &Facet, other: &Facet, reach: f64) -> Option<Touch> {
    // What hardly rises parts nothing.
    if own.normal.cross(other.normal).length_squared() < SAME_NORMAL * SAME_NORMAL {
        return None;
    }
    let (corners, p) = (own.corners, other.corners);
    let heights = p.map(|p| {
        let h = (p - corners[0]).dot(own.normal);
        if h.abs() <= reach { 0.0 } else { h }
    });
    let rises = [heights.iter().any(|&h| h > 0.0), heights.iter().any(|&h| h < 0.0)];
    let mut ends = [DVec3::ZERO; 3];
    let mut count = 0;
    let mut end = |p: DVec3| {
        ends[count] = p;
        count += 1;
    };
    (0..3).filter(|&k| heights[k] == 0.0).for_each(|k| end(p[k]));
    for k in 0..3 {
        let (a, b) = (heights[k], heights[(k + 1) % 3]);
        if a * b < 0.0 {
            end(p[k].lerp(p[(k + 1) % 3], a / (a - b)));
        }
    }
    let &[from, to] = &ends[..count] else { return None };
    let plane = Plane::of(corners);
    let [from, to] = [from, to].map(|p| plane.barycentric(p));
    let line = clip(from, to);
    let edge = if line.is_none() { edge_under(from, to) } else { None };
    // A neighbour that has the edge too does not stand on it.
    let edge = edge.filter(|&k| {
        [k, (k + 1) % 3].iter().any(|&c| p.iter().all(|q| q.distance(corners[c]) > reach))
    });
    (line.is_some() || edge.is_some()).then_some(Touch { line, edge, rises })
}
