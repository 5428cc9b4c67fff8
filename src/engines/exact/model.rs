//! What the engine keeps of a scene: the pieces that patches consist of, the hierarchy over patches,
//! and what may lie between them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::blockers::Blockers;
use super::far::{CLOSELY, Columns, exchange_with};
use super::samples::sobol;
use super::shaft::BlockerTree;
use super::tree::{Extent, Tree};
use super::triangles::Triangles;
use super::unoccluded::{Polygon, exchange, facing};
use crate::patches::{PatchId, Patches, at_barycentric};
use crate::scene::{Geometry, Side, TriangleId};
use crate::visibility::{Bvh, LANES, ROUNDING};

/// Heights below this share of the scene's radius are none: what lies in one plane exchanges nothing.
const COPLANAR: f64 = 1e-10;

/// Blockers within this share of the scene's radius touch.
const TOUCHING: f64 = 0.1 * ROUNDING;

/// A triangle of a patch.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub polygon: Polygon,
    /// The solid triangle that it lies on.
    pub own: Option<u32>,
    /// Capped bodies that it is inside of.
    pub inside: Vec<u32>,
}

/// A scene made ready.
pub(super) struct Model<'a> {
    pub bvh: &'a Bvh,
    pub tree: Tree,
    pub blockers: Blockers,
    pub blocker_tree: BlockerTree,
    pub columns: Columns,
    /// All pieces.
    pub shapes: Triangles,
    pub coplanar: f64,
    pub touching: f64,
    /// What factors are like: their root-mean-square.
    pub typical: f64,
    /// Rows spread over the hierarchy, by places, and the sum of the squares of the factors of each,
    /// were nothing in the way.
    pub some_squares: Vec<(u32, f64)>,
    /// Points of a four-dimensional Sobol' sequence, scrambled as Owen (1995) does.
    pub samples: Vec<[f32; 4]>,
    pieces: Vec<Piece>,
    /// Where the pieces of each patch begin, in the order of the tree, and where the last end.
    starts: Vec<u32>,
    /// [`Patches::own_area`] of each patch, in the order of the tree.
    pub areas: Vec<f64>,
    /// Place in the order of the tree of each patch.
    pub place: Vec<u32>,
}

impl<'a> Model<'a> {
    pub fn new(geometry: &Geometry, patches: &Patches, bvh: &'a Bvh, error: f64) -> Self {
        let (coplanar, touching) = (COPLANAR * bvh.scale(), TOUCHING * bvh.scale());
        let blockers = Blockers::new(geometry, touching);
        let parts: Vec<Vec<Part>> = patches.ids().map(|id| parts(geometry, patches, id)).collect();
        let corners: Vec<Vec<DVec3>> =
            parts.iter().map(|parts| parts.iter().flat_map(|p| p.corners).collect()).collect();
        let extents: Vec<Extent> = parts
            .iter()
            .zip(&corners)
            .map(|(parts, corners)| {
                let first = parts.first().map_or(DVec3::ZERO, |p| p.normal);
                let flat = parts.iter().all(|p| p.normal.dot(first) > 1.0 - 1e-9);
                let low = corners.iter().fold(DVec3::INFINITY, |l, &c| l.min(c));
                let high = corners.iter().fold(DVec3::NEG_INFINITY, |h, &c| h.max(c));
                Extent { low, high, normal: if flat { first } else { DVec3::ZERO } }
            })
            .collect();
        let mut tree = Tree::new(&extents, |p| &corners[p as usize], touching);
        let mut place = vec![0; tree.order.len()];
        for (at, &p) in (0..).zip(&tree.order) {
            place[p as usize] = at;
        }
        let piece = |part: &Part| {
            let inner = part.corners.iter().sum::<DVec3>() / 3.0 + part.normal * (10.0 * touching);
            let holds = |b: &u32| blockers.bodies[*b as usize].holds(inner);
            Piece {
                polygon: Polygon::triangle(part.corners, part.normal),
                own: bvh.solid(part.triangle),
                inside: (0..blockers.bodies.len() as u32).filter(holds).collect(),
            }
        };
        let in_order = || tree.order.iter().map(|&p| &parts[p as usize]);
        let (mut starts, mut areas) = (vec![0], Vec::with_capacity(place.len()));
        for (parts, &p) in in_order().zip(&tree.order) {
            starts.push(starts[starts.len() - 1] + parts.len() as u32);
            areas.push(patches.own_area(PatchId(p)));
        }
        let pieces: Vec<Part> = in_order().flatten().copied().collect();
        let pieces: Vec<Piece> = pieces.par_iter().map(piece).collect();
        for k in 0..tree.nodes.len() {
            let (from, to) = (tree.nodes[k].from as usize, tree.nodes[k].to as usize);
            let range = starts[from] as usize..starts[to] as usize;
            let mut inside: Vec<u32> =
                pieces[range].iter().flat_map(|p: &Piece| p.inside.iter().copied()).collect();
            inside.sort_unstable();
            inside.dedup();
            tree.nodes[k].inside = inside;
            tree.nodes[k].patch = areas[from..to].iter().sum::<f64>() / (to - from) as f64;
        }
        let blocker_tree = BlockerTree::new(&blockers);
        let mut me = Self {
            bvh,
            tree,
            blockers,
            blocker_tree,
            columns: Columns::default(),
            shapes: Triangles::default(),
            coplanar,
            touching,
            typical: 1.0,
            some_squares: Vec::new(),
            samples: sobol(),
            pieces,
            starts,
            areas,
            place,
        };
        me.columns = Columns::new(error);
        let scale = bvh.scale();
        let local = |p: &Piece| {
            let corner = |k: usize| (p.polygon.corners()[k] - bvh.center()) / scale;
            ([0, 1, 2].map(corner), p.polygon.normal)
        };
        for at in 0..me.len() {
            let triangles: Vec<_> = me.pieces(at).iter().map(local).collect();
            me.columns.push(&triangles, me.areas[at] / (scale * scale));
            triangles.iter().for_each(|t| me.shapes.push(t.0, t.1));
        }
        me.columns.pad();
        me.shapes.pad();
        me.some_squares = me.find_squares();
        me.typical = me.find_typical();
        me
    }

    fn find_squares(&self) -> Vec<(u32, f64)> {
        const ROWS: usize = 256;
        let n = self.len();
        let scale2 = self.bvh.scale().powi(2);
        let square_sum = |row: &mut Vec<_>, i: usize| {
            row.resize(n.div_ceil(LANES), [0.0; LANES]);
            exchange_with(&self.columns, i, 0, row);
            let each = row.as_flattened()[..n].iter().enumerate().filter(|e| *e.1 != 0.0);
            let squares = each.map(|(j, &s)| {
                let s = if s == CLOSELY { self.unoccluded(i, j) } else { f64::from(s) * scale2 };
                (s / self.areas[i]).powi(2)
            });
            (i as u32, squares.sum())
        };
        let step = n.div_ceil(ROWS).max(1);
        let rows: Vec<usize> = (0..n).step_by(step).map(|i| (i + step / 2).min(n - 1)).collect();
        rows.into_par_iter().map_init(Vec::new, square_sum).collect()
    }

    /// The root-mean-square of all factors, were nothing in the way.
    fn find_typical(&self) -> f64 {
        let sum: f64 = self.some_squares.iter().map(|row| row.1).sum();
        match sum > 0.0 {
            true => (sum / (self.some_squares.len() * self.len()) as f64).sqrt(),
            // Patches that see nothing, all of them: as if each saw all others alike.
            false => 1.0 / self.len().max(1) as f64,
        }
    }

    /// S of a pair with nothing in the way; of patches of several pieces, that of the first of them
    /// stands for all.
    fn unoccluded(&self, i: usize, j: usize) -> f64 {
        let (Some(p), Some(q)) = (self.pieces(i).first(), self.pieces(j).first()) else {
            return 0.0;
        };
        let Some((a, b)) = facing(&p.polygon, &q.polygon, self.coplanar) else { return 0.0 };
        let share = |k: usize, p: &Piece| self.areas[k] / p.polygon.area();
        let s = exchange(&a, &b) * share(i, p) * share(j, q);
        if i == j { 0.0 } else { s.min(self.areas[i]).min(self.areas[j]) }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// The pieces of the patch at a place in the order of the tree.
    pub fn pieces(&self, at: usize) -> &[Piece] {
        &self.pieces[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Whether a patch is one triangle.
    pub fn is_simple(&self, at: usize) -> bool {
        self.pieces(at).len() == 1
    }

    /// Number among all pieces of one of a patch, as likely as it is large if `u` is uniform in 0..1.
    pub fn piece_at(&self, at: usize, u: f64) -> usize {
        let (first, pieces) = (self.starts[at] as usize, self.pieces(at));
        if pieces.len() < 2 {
            return first;
        }
        let mut left = u * self.areas[at];
        let hit = pieces.iter().position(|p| {
            left -= p.polygon.area();
            left < 0.0
        });
        first + hit.unwrap_or(0)
    }

    /// One of all pieces.
    pub fn piece(&self, number: usize) -> &Piece {
        &self.pieces[number]
    }

    /// Bytes of memory that it takes, about.
    pub fn bytes(&self) -> u64 {
        let pieces = self.pieces.len() * (size_of::<Piece>() + 60);
        let nodes = self.tree.nodes.len() * size_of::<super::tree::Node>();
        let polygons = self.blockers.polygons.len() * 300;
        (pieces + nodes + polygons + self.len() * 120) as u64
    }
}

/// A triangle that belongs to a patch.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// The source triangle that it lies on.
    triangle: TriangleId,
    /// Counter-clockwise about the normal.
    corners: [DVec3; 3],
    /// Unit normal of the side.
    normal: DVec3,
}

/// All that belongs to a patch.
fn parts(geometry: &Geometry, patches: &Patches, id: PatchId) -> Vec<Part> {
    let part = |triangle, side, [a, b, c]: [DVec3; 3]| {
        let corners = match side {
            Side::Front => [a, b, c],
            Side::Back => [a, c, b],
        };
        Part { triangle, corners, normal: geometry.normal(triangle, side) }
    };
    let cell = patches.cell(id);
    let source = geometry.corners(cell.triangle);
    match patches.parts(id) {
        Some(parts) => parts
            .map(|uv| {
                let at = |p: DVec2| at_barycentric(source, DVec3::new(1.0 - p.x - p.y, p.x, p.y));
                part(cell.triangle, cell.side, uv.map(at))
            })
            .collect(),
        None => patches.pieces(id).map(|c| part(c.triangle, c.side, c.corners(geometry))).collect(),
    }
}
