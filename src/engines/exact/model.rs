//! The scene as the engine keeps it: the pieces that patches consist of, the hierarchy over
//! patches, and what may lie between them.

use glam::DVec3;
use rayon::prelude::*;

use super::blockers::Blockers;
use super::coverings::Coverings;
use super::culling::Culling;
use super::far::{CLOSELY, FarPatches, exchange_with};
use super::pieces::{Fragment, Piece, PieceId, extent, fragments};
use super::places::Place;
use super::polygon::{area, facing};
use super::samples::sobol;
use super::tree::{Extent, Node, Tree};
use super::triangles::Triangles;
use super::unoccluded::exchange;
use crate::patches::{PatchId, Patches};
use crate::progress::{Cancelled, Progress};
use crate::scene::Geometry;
use crate::simd::LANES;
use crate::visibility::{Bvh, Lanes, ROUNDING};

/// Heights below this fraction of the scene's radius are none: what lies in one plane exchanges
/// nothing.
const COPLANAR: f64 = 1e-10;

/// Blockers within this fraction of the scene's radius touch.
const TOUCHING: f64 = 0.1 * ROUNDING;

/// A scene prepared for the engine.
pub(super) struct Model<'a> {
    pub bvh: &'a Bvh,
    pub tree: Tree,
    pub blockers: Blockers,
    pub culling: Culling,
    pub far: FarPatches,
    /// All pieces.
    pub shapes: Triangles,
    pub coplanar: f64,
    pub touching: f64,
    /// The root-mean-square factor, estimated with nothing in the way.
    pub rms_factor: f64,
    /// Rows spread over the hierarchy, and the sum of the squares of the factors of each, with
    /// nothing in the way.
    pub sampled_rows: Vec<(Place, f64)>,
    /// Mean number of patches that others face, of which they see some.
    pub faced: f64,
    /// The points of all shadow rays.
    pub samples: Vec<[f32; 4]>,
    pieces: Vec<Piece>,
    /// Where the pieces of each patch begin, in the order of the tree, and where the last end.
    starts: Vec<u32>,
    /// [`Patches::own_area`] of each patch, in the order of the tree.
    areas: Vec<f64>,
    /// What of it no other face lies on: the area of the pieces.
    seen_areas: Vec<f64>,
    /// The place of each patch in the order of the tree.
    places: Vec<Place>,
}

impl<'a> Model<'a> {
    pub fn new(
        geometry: &Geometry,
        patches: &Patches,
        bvh: &'a Bvh,
        error: f64,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let (coplanar, touching) = (COPLANAR * bvh.scale(), TOUCHING * bvh.scale());
        let blockers = Blockers::new(geometry, touching);
        let mut of_patches: Vec<Vec<Fragment>> =
            patches.ids().map(|id| fragments(geometry, patches, id)).collect();
        progress.advance(0)?;
        let mut tree = hierarchy(&of_patches, touching);
        progress.advance(0)?;
        let coverings = Coverings::find(&blockers, ROUNDING * bvh.scale(), progress)?;
        coverings.warn(&blockers, progress);
        let seen_areas = leave_out_covered(&mut of_patches, &blockers, &coverings);
        progress.advance(0)?;
        let mut places = vec![Place(0); tree.order.len()];
        for (at, id) in (0..).zip(&tree.order) {
            places[id.index()] = Place(at);
        }
        let in_order = || tree.order.iter().map(|id| &of_patches[id.index()]);
        let mut starts = vec![0];
        for fragments in in_order() {
            starts.push(starts[starts.len() - 1] + fragments.len() as u32);
        }
        let areas: Vec<f64> = tree.order.iter().map(|&id| patches.own_area(id)).collect();
        let seen_area = |(&id, &area): (&PatchId, &f64)| seen_areas[id.index()].unwrap_or(area);
        let seen_areas = tree.order.iter().zip(&areas).map(seen_area).collect();
        let flat: Vec<Fragment> = in_order().flatten().copied().collect();
        let piece = |f: &Fragment| Piece::new(f, bvh);
        let pieces: Vec<Piece> = flat.par_iter().map(piece).collect();
        for node in &mut tree.nodes {
            let range = node.places.range();
            node.patch_area = areas[range.clone()].iter().sum::<f64>() / range.len() as f64;
        }
        let culling = Culling::new(&blockers.polygons, &blockers.tree, bvh);
        let mut me = Self {
            bvh,
            tree,
            blockers,
            culling,
            far: FarPatches::new(error),
            shapes: Triangles::default(),
            coplanar,
            touching,
            rms_factor: 1.0,
            sampled_rows: Vec::new(),
            faced: 0.0,
            samples: sobol(),
            pieces,
            starts,
            areas,
            seen_areas,
            places,
        };
        me.add_shapes();
        let sampled = me.sample_rows(progress)?;
        let faced = sampled.iter().map(|row| row.2 as f64).sum::<f64>();
        me.faced = faced / sampled.len().max(1) as f64;
        me.sampled_rows = sampled.into_iter().map(|row| (row.0, row.1)).collect();
        me.rms_factor = me.find_rms_factor();
        Ok(me)
    }

    /// Adds all patches and pieces for kernels, in units of the scene's radius about its centre.
    fn add_shapes(&mut self) {
        let (centre, scale) = (self.bvh.center(), self.bvh.scale());
        let local = |p: &Piece| {
            let corner = |k: usize| (p.polygon.corners()[k] - centre) / scale;
            ([0, 1, 2].map(corner), p.polygon.normal)
        };
        for at in (0..self.len() as u32).map(Place) {
            let triangles: Vec<_> = self.pieces(at).iter().map(local).collect();
            self.far.push(&triangles, self.seen_areas[at.index()] / (scale * scale));
            triangles.iter().for_each(|t| self.shapes.push(t.0, t.1));
        }
        self.far.pad();
        self.shapes.pad();
    }

    /// Rows spread over the hierarchy, the sum of the squares of the factors of each, and how many
    /// these are, with nothing in the way.
    fn sample_rows(&self, progress: &dyn Progress) -> Result<Vec<(Place, f64, usize)>, Cancelled> {
        const ROWS: usize = 256;
        let n = self.len();
        let square_sum = |row: &mut Vec<_>, i: Place| {
            progress.advance(0)?;
            let inverse = 1.0 / self.area(i);
            let squares = self.unoccluded_row(i, row).flatten().map(|s| (s * inverse).powi(2));
            let (sum, count) = squares.fold((0.0, 0), |(sum, count), s| (sum + s, count + 1));
            Ok((i, sum, count))
        };
        let step = n.div_ceil(ROWS).max(1);
        let place = |i: usize| Place((i + step / 2).min(n - 1) as u32);
        let rows: Vec<Place> = (0..n).step_by(step).map(place).collect();
        rows.into_par_iter().map_init(Vec::new, square_sum).collect()
    }

    fn find_rms_factor(&self) -> f64 {
        let sum: f64 = self.sampled_rows.iter().map(|row| row.1).sum();
        match sum > 0.0 {
            true => (sum / (self.sampled_rows.len() * self.len()) as f64).sqrt(),
            // No patch sees any other: as if each saw all others equally.
            false => 1.0 / self.len().max(1) as f64,
        }
    }

    /// S of a patch with each, in the order of the tree, with nothing in the way; `None` where they
    /// face away from each other. `row` is reused.
    pub fn unoccluded_row<'b>(
        &'b self,
        i: Place,
        row: &'b mut Vec<Lanes>,
    ) -> impl Iterator<Item = Option<f64>> + 'b {
        let n = self.len();
        row.resize(n.div_ceil(LANES), [0.0; LANES]);
        exchange_with(&self.far, i, Place(0), row);
        let scale2 = self.bvh.scale().powi(2);
        let each = (0..).map(Place).zip(&row.as_flattened()[..n]);
        each.map(move |(j, &s)| match s {
            0.0 => None,
            CLOSELY => Some(self.unoccluded(i, j)),
            s => Some(f64::from(s.abs()) * scale2),
        })
    }

    /// S of a pair with nothing in the way; of patches of several pieces, that of the first of them
    /// stands for all.
    fn unoccluded(&self, i: Place, j: Place) -> f64 {
        let (Some(p), Some(q)) = (self.pieces(i).first(), self.pieces(j).first()) else {
            return 0.0;
        };
        let Some((a, b)) = facing(&p.polygon, &q.polygon, self.coplanar) else { return 0.0 };
        let whole = |at: Place, p: &Piece| self.seen_areas[at.index()] / p.polygon.area();
        let s = exchange(&a, &b, 1e-5 * self.area(i).min(self.area(j))) * whole(i, p) * whole(j, q);
        if i == j { 0.0 } else { s.min(self.area(i)).min(self.area(j)) }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Where a patch is in the order of the tree.
    pub fn place(&self, id: PatchId) -> Place {
        self.places[id.index()]
    }

    /// [`Patches::own_area`] of the patch at a place, in m².
    pub fn area(&self, at: Place) -> f64 {
        self.areas[at.index()]
    }

    /// The share of a patch that other faces lie on, 0..1.
    pub fn covered(&self, id: PatchId) -> f64 {
        let at = self.place(id).index();
        (1.0 - self.seen_areas[at] / self.areas[at]).clamp(0.0, 1.0)
    }

    /// The larger factor of a pair that exchanges S m², over the root-mean-square factor.
    pub fn relative_factor(&self, [i, j]: [Place; 2], s: f64) -> f64 {
        s / self.area(i).min(self.area(j)) / self.rms_factor
    }

    /// The pieces of the patch at a place: none if something covers it.
    pub fn pieces(&self, at: Place) -> &[Piece] {
        &self.pieces[self.starts[at.index()] as usize..self.starts[at.index() + 1] as usize]
    }

    /// Whether a patch is one triangle.
    pub fn is_simple(&self, at: Place) -> bool {
        self.pieces(at).len() == 1
    }

    /// A piece of a patch, with a probability proportional to its area if `u` is uniform in 0..1.
    pub fn piece_at(&self, at: Place, u: f64) -> PieceId {
        let (first, pieces) = (self.starts[at.index()], self.pieces(at));
        if pieces.len() < 2 {
            return PieceId(first);
        }
        let mut left = u * self.seen_areas[at.index()];
        let hit = pieces.iter().position(|p| {
            left -= p.polygon.area();
            left < 0.0
        });
        PieceId(first + hit.unwrap_or(0) as u32)
    }

    /// One of all pieces.
    pub fn piece(&self, id: PieceId) -> &Piece {
        &self.pieces[id.0 as usize]
    }

    /// About how many bytes of memory it takes.
    pub fn bytes(&self) -> u64 {
        let pieces = self.pieces.len() * (size_of::<Piece>() + 60);
        let nodes = self.tree.nodes.len() * size_of::<Node>();
        let polygons = self.blockers.polygons.len() * 300;
        (pieces + nodes + polygons + self.culling.bytes() + self.len() * 120) as u64
    }
}

/// Leaves out of the triangles of patches what other faces lie on; what area is left of those where
/// that is something, in m².
fn leave_out_covered(
    of_patches: &mut [Vec<Fragment>],
    blockers: &Blockers,
    coverings: &Coverings,
) -> Vec<Option<f64>> {
    let of_patch = |fragments: &mut Vec<Fragment>| {
        let mut left = Vec::new();
        let mut covered = false;
        for fragment in fragments.iter() {
            let on = blockers.of_triangle(fragment.triangle);
            match on.and_then(|on| coverings.uncovered(fragment, on, blockers)) {
                Some(parts) => (covered, _) = (true, left.extend(parts)),
                None => left.push(*fragment),
            }
        }
        covered.then(|| {
            *fragments = left;
            fragments.iter().map(|f| area(f.corners)).sum()
        })
    };
    of_patches.par_iter_mut().map(of_patch).collect()
}

/// The hierarchy over patches that consist of these triangles.
fn hierarchy(of_patches: &[Vec<Fragment>], touching: f64) -> Tree {
    let corners: Vec<Vec<DVec3>> =
        of_patches.iter().map(|f| f.iter().flat_map(|f| f.corners).collect()).collect();
    let extents: Vec<Extent> = of_patches.iter().map(|f| extent(f)).collect();
    Tree::new(&extents, |id| &corners[id.index()], touching)
}
