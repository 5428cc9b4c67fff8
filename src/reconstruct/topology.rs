//! Which edges of source triangles are smooth.

use crate::patches::{Patches, Sets, side_index};
use crate::scene::edges::{EdgeUse, edge_uses, shared};
use crate::scene::{Geometry, Side, TriangleId};

/// Two triangles whose normals differ by more than this angle (radians) meet in a crease.
const CREASE: f64 = 0.6;

/// An edge of one side of a source triangle as part of a chain of vertices.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ChainUse {
    /// Which edge; shared by the two sides of a smooth one.
    pub edge: u32,
    /// Whether this side runs along it the other way.
    pub reversed: bool,
}

/// Edges and corners of all sides that have patches.
#[derive(Debug, Clone)]
pub(super) struct Topology {
    /// Three a side; edge k runs from corner k to corner k + 1.
    pub edges: Vec<[ChainUse; 3]>,
    /// Number of splits of each edge: the larger of its two sides'.
    pub levels: Vec<u8>,
    /// Whether each edge is shared by two sides.
    pub smooth: Vec<bool>,
    /// Class of each corner of each side: corners of one class are one vertex.
    pub corners: Vec<[u32; 3]>,
    /// Number of classes.
    pub classes: u32,
}

impl Topology {
    pub fn new(geometry: &Geometry, patches: &Patches) -> Self {
        let sides = patches.splits().len();
        let level = |s: usize| patches.splits()[s].level();
        let mut me = Self {
            edges: vec![[ChainUse::default(); 3]; sides],
            levels: Vec::new(),
            smooth: Vec::new(),
            corners: Vec::new(),
            classes: 0,
        };
        let mut classes = Sets::new(3 * sides);
        let (uses, _) = edge_uses(geometry);
        for ends in shared(&uses) {
            let pairs = pairs_of(geometry, patches, ends);
            for end in ends {
                for side in Side::BOTH {
                    let s = side_index(end.triangle, side);
                    let Some(own) = level(s) else { continue };
                    let partner = pairs.iter().find_map(|&(a, b)| match (a, b) {
                        (a, b) if a == (end.triangle, side) => Some(b),
                        (a, b) if b == (end.triangle, side) => Some(a),
                        _ => None,
                    });
                    let partner = partner.map(|(t, side)| side_index(t, side));
                    let partner = partner.and_then(|p| level(p).map(|l| (p, l)));
                    match partner {
                        // The first of the two makes the edge for both.
                        Some((p, _)) if p < s => {}
                        Some((p, other)) => {
                            let edge = me.edge(own.max(other), true);
                            me.edges[s][usize::from(end.k)] =
                                ChainUse { edge, reversed: end.reversed };
                            let far = ends.iter().find(|e| e.triangle.index() == p / 2);
                            if let Some(far) = far {
                                me.edges[p][usize::from(far.k)] =
                                    ChainUse { edge, reversed: far.reversed };
                                for (a, b) in corners(end).into_iter().zip(corners(far)) {
                                    classes.join((3 * s + a) as u32, (3 * p + b) as u32);
                                }
                            }
                        }
                        None => {
                            let edge = me.edge(own, false);
                            me.edges[s][usize::from(end.k)] =
                                ChainUse { edge, reversed: end.reversed };
                        }
                    }
                }
            }
        }
        let mut class = vec![u32::MAX; 3 * sides];
        me.corners = (0..sides)
            .map(|s| {
                [0, 1, 2].map(|k| {
                    let root = classes.find((3 * s + k) as u32) as usize;
                    if class[root] == u32::MAX && level(s).is_some() {
                        class[root] = me.classes;
                        me.classes += 1;
                    }
                    class[root]
                })
            })
            .collect();
        me
    }

    fn edge(&mut self, level: u8, smooth: bool) -> u32 {
        self.levels.push(level);
        self.smooth.push(smooth);
        (self.levels.len() - 1) as u32
    }
}

/// The corners of an edge at its smaller and its larger welded vertex.
fn corners(end: &EdgeUse) -> [usize; 2] {
    let (k, next) = (usize::from(end.k), usize::from(end.k + 1) % 3);
    if end.reversed { [next, k] } else { [k, next] }
}

type SideOf = (TriangleId, Side);

/// The pairs of sides that are smooth across an edge: no crease, and nothing stands on it.
fn pairs_of(geometry: &Geometry, patches: &Patches, ends: &[EdgeUse]) -> Vec<(SideOf, SideOf)> {
    let &[a, b] = ends else { return Vec::new() };
    let same_winding = a.reversed != b.reversed;
    let turn = if same_winding { 1.0 } else { -1.0 };
    let normal = |e: EdgeUse| geometry.normal(e.triangle, Side::Front);
    if turn * normal(a).dot(normal(b)) < CREASE.cos() {
        return Vec::new();
    }
    let across = |side: Side| match (side, same_winding) {
        (Side::Front, true) | (Side::Back, false) => Side::Front,
        (Side::Back, true) | (Side::Front, false) => Side::Back,
    };
    let free = |e: EdgeUse, s: Side| !patches.edge_is_stood_on(side_index(e.triangle, s), e.k);
    Side::BOTH
        .into_iter()
        .filter(|&s| free(a, s) && free(b, across(s)))
        .map(|s| ((a.triangle, s), (b.triangle, across(s))))
        .collect()
}
