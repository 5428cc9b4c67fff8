//! Patches: the pieces of surface that exchange light.
//!
//! A patch is a cell of the triangular grid that repeated 1-to-4 midpoint splits lay on one side
//! of a source triangle. At level `l` a side of the source is cut into `n = 2^l` strips along each
//! barycentric coordinate; a cell is known by the integer parts `(i, j, k)` of `n` times the
//! barycentric coordinates of its points: `i + j + k = n - 1` in cells that stand like their source
//! triangle, `n - 2` in those that are upside down. The parent of `(i, j, k)` is `(i/2, j/2, k/2)`.
//!
//! Ids are consecutive: the fronts of all source triangles in file order, then the backs. Within
//! one uniformly split side the id follows from the barycentric coordinates in O(1).
//!
//! Where source triangles are smaller than one wants patches, a patch may be a cluster of several
//! whole ones ([`Patches::clustered`]); each of its members then looks up to the same id.

mod adaptive;
mod box_tree;
mod cell;
mod clustered;
mod contact;
mod cut;
mod parts;
mod sets;

use glam::{DVec2, DVec3};
use thiserror::Error;

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

pub use adaptive::SplitCells;
pub(crate) use box_tree::BoxTree;
pub use cell::Cell;
use clustered::Members;
pub use clustered::{MAX_ANGLE, MAX_DIAMETER};
use contact::{ContactLines, Plane};
use cut::Cuts;
use parts::Parts;
pub(crate) use sets::Sets;

use crate::scene::{Geometry, Side, TriangleId};

/// Index of a patch, and of its row and column in the matrix of form factors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PatchId(pub u32);

impl PatchId {
    /// The index as `usize`.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A point on one side of a source triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The source triangle.
    pub triangle: TriangleId,
    /// The side of it.
    pub side: Side,
    /// Barycentric coordinates of the corners `b` and `c`: the point is `a + u (b - a) + v (c - a)`.
    pub uv: DVec2,
}

impl SurfacePoint {
    /// Barycentric coordinates of all three corners.
    #[must_use]
    pub fn barycentric(&self) -> DVec3 {
        DVec3::new(1.0 - self.uv.x - self.uv.y, self.uv.x, self.uv.y)
    }

    /// Position in metres.
    #[must_use]
    pub fn position(&self, geometry: &Geometry) -> DVec3 {
        at_barycentric(geometry.corners(self.triangle), self.barycentric())
    }
}

/// The point of a triangle with the given barycentric coordinates.
#[must_use]
pub fn at_barycentric([a, b, c]: [DVec3; 3], l: DVec3) -> DVec3 {
    a * l.x + b * l.y + c * l.z
}

/// Why a scene cannot be split as asked.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PatchesError {
    /// The largest area is zero, negative or not a number.
    #[error("the patch size must be a positive area in m²")]
    BadArea,
    /// More patches than ids, or a single triangle split too finely.
    #[error("the patch size is too small for this scene: {count} patches (at most {MAX_PATCHES})")]
    TooMany {
        /// How many patches it would take (at least).
        count: u64,
    },
}

/// More patches than this are refused: ids must leave room for marks in an item buffer.
pub const MAX_PATCHES: u64 = 1 << 30;

/// A side of a source triangle is split at most this often (grid coordinates fit 16 bits).
pub const MAX_LEVEL: u8 = 14;

/// What one side of a source triangle is cut into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// It has no patch: a back that does not reflect, or a triangle that takes no part.
    None,
    /// A uniform grid of `4^level` patches that begins at `first`; all members of a cluster have the
    /// same `first` and level 0.
    Uniform {
        /// Id of the first patch.
        first: u32,
        /// Number of splits.
        level: u8,
    },
    /// Cells of several levels with consecutive ids.
    Adaptive {
        /// Id of the first patch.
        first: u32,
        /// Number of patches.
        count: u32,
        /// Number of splits of the finest grid that they are made of.
        level: u8,
    },
}

impl Split {
    /// Number of splits of the finest patches; `None` without patches.
    #[must_use]
    pub fn level(self) -> Option<u8> {
        match self {
            Self::None => None,
            Self::Uniform { level, .. } | Self::Adaptive { level, .. } => Some(level),
        }
    }
}

/// The patches of a scene. Never changes.
#[derive(Debug, Clone)]
pub struct Patches {
    /// Two per source triangle: front, back.
    splits: Vec<Split>,
    /// Where each patch lies.
    cells: Vec<Cell>,
    /// Area of each patch, m².
    areas: Vec<f64>,
    /// The source triangles of patches that are clusters.
    members: Members,
    contacts: Arc<ContactLines>,
    cuts: Cuts,
    /// What belongs to patches where contacts part them, found when first asked for.
    parts: OnceLock<Parts>,
    /// Points that stand for their patch where the centroid is covered.
    origins: HashMap<PatchId, SurfacePoint>,
    /// Of an adaptive mesh, the uniform one that it coarsens.
    finest: Option<Finest>,
}

/// The uniform mesh under an adaptive one.
#[derive(Debug, Clone)]
struct Finest {
    patches: Arc<Patches>,
    /// The adaptive patch that each of the uniform ones is a part of.
    patch_of: Vec<u32>,
}

impl Patches {
    /// Splits every exchanging side 1 to 4 at the edge midpoints until no area exceeds `max_area`
    /// (m²): the paper's uniform subdivision.
    pub fn uniform(geometry: &Geometry, max_area: f64) -> Result<Self, PatchesError> {
        let levels = uniform_levels(geometry, max_area)?;
        let contacts = ContactLines::find(geometry);
        Ok(Self::build(geometry, &levels, contacts, &[]))
    }

    /// Splits source triangles larger than `max_area` (m²) like [`uniform`](Self::uniform), and joins
    /// smaller ones: connected triangles of the same `label` (an opaque number a triangle; none for
    /// those beyond its end) and sidedness become one patch, a cluster, while
    ///
    /// - its area is at most `max_area`,
    /// - the normals of its members differ from their mean by at most [`MAX_ANGLE`],
    /// - its extent is at most [`MAX_DIAMETER`] `√max_area`.
    ///
    /// Triangles that something stands on or passes through stay patches of their own, and no cluster
    /// crosses an edge on which something stands.
    pub fn clustered(
        geometry: &Geometry,
        max_area: f64,
        label: &[u32],
    ) -> Result<Self, PatchesError> {
        let levels = uniform_levels(geometry, max_area)?;
        let contacts = ContactLines::find(geometry);
        let whole = |t: TriangleId| levels[t.index()] == 0;
        let clusters = clustered::clusters(geometry, &contacts, whole, max_area, label);
        Ok(Self::build(geometry, &levels, contacts, &clusters))
    }

    /// The patches of sides split to `levels`, or joined to the numbered `clusters` (by side).
    fn build(geometry: &Geometry, levels: &[u8], contacts: ContactLines, clusters: &[u32]) -> Self {
        let mut patches = Self {
            splits: vec![Split::None; 2 * geometry.len()],
            cells: Vec::new(),
            areas: Vec::new(),
            members: Members::default(),
            contacts: Arc::new(contacts),
            cuts: Cuts::default(),
            parts: OnceLock::new(),
            origins: HashMap::new(),
            finest: None,
        };
        let mut id_of: HashMap<u32, u32> = HashMap::new();
        for side in Side::BOTH {
            for triangle in geometry.ids().filter(|&t| geometry.exchanges(t, side)) {
                let level = levels[triangle.index()];
                let mut first = patches.cells.len() as u32;
                let s = side_index(triangle, side);
                if let Some(&cluster) = clusters.get(s).filter(|&&c| c != clustered::NONE) {
                    first = *id_of.entry(cluster).or_insert(first);
                }
                patches.splits[s] = Split::Uniform { first, level };
                let area = geometry.area(triangle);
                if let Some(known) = patches.areas.get_mut(first as usize) {
                    *known += area;
                    continue;
                }
                let count = 1_u32 << (2 * u32::from(level));
                patches.cells.extend(Cell::grid(triangle, side, level));
                patches.areas.resize(patches.cells.len(), area / f64::from(count));
            }
        }
        if !id_of.is_empty() {
            patches.gather_members(geometry, clusters);
        }
        patches.cuts = Cuts::find(&patches, &patches.contacts);
        patches
    }

    /// Lists the members of clusters and moves their cells to those that stand for them.
    fn gather_members(&mut self, geometry: &Geometry, clusters: &[u32]) {
        let member = |s: &usize| clusters[*s] != clustered::NONE;
        let patch = |split: &Split| match split {
            Split::Uniform { first, .. } => *first as usize,
            Split::None | Split::Adaptive { .. } => 0,
        };
        let mut starts = vec![0_u32; self.cells.len() + 1];
        for s in (0..self.splits.len()).filter(member) {
            starts[patch(&self.splits[s]) + 1] += 1;
        }
        for p in 0..self.cells.len() {
            starts[p + 1] += starts[p];
        }
        let mut next = starts.clone();
        let mut triangles = vec![TriangleId(0); starts[self.cells.len()] as usize];
        for s in (0..self.splits.len()).filter(member) {
            let at = &mut next[patch(&self.splits[s])];
            triangles[*at as usize] = TriangleId((s / 2) as u32);
            *at += 1;
        }
        let mut shares = vec![1.0; triangles.len()];
        for (p, cell) in self.cells.iter_mut().enumerate() {
            let range = starts[p] as usize..starts[p + 1] as usize;
            let members = &triangles[range.clone()];
            if members.is_empty() {
                continue;
            }
            let mut sum = 0.0;
            for (share, &t) in shares[range].iter_mut().zip(members) {
                sum += geometry.area(t);
                *share = sum / self.areas[p];
            }
            let best = clustered::representative(geometry, cell.side, members);
            *cell = Cell::whole(members[best], cell.side);
        }
        self.members = Members { starts, triangles, shares };
    }

    /// The largest area (m²) that yields at least `more` patches beyond one a side of each source
    /// triangle, as near as halving finds.
    #[must_use]
    pub fn area_adding(geometry: &Geometry, more: u64) -> f64 {
        let sides: Vec<(f64, u64)> = geometry
            .ids()
            .filter(|&t| geometry.is_solid(t))
            .map(|t| {
                let count = Side::BOTH.iter().filter(|&&s| geometry.exchanges(t, s)).count();
                (geometry.area(t), count as u64)
            })
            .collect();
        let count = |max_area: f64| -> u64 {
            sides.iter().map(|&(a, n)| n << (2 * u32::from(level_for(a, max_area).min(20)))).sum()
        };
        let largest = sides.iter().map(|s| s.0).fold(0.0, f64::max);
        if largest <= 0.0 {
            return 1.0;
        }
        let target = count(largest) + more;
        let (mut low, mut high) = (largest * 1e-12, largest);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if count(middle) >= target { low = middle } else { high = middle }
        }
        low
    }

    /// How many patches [`clustered`](Self::clustered) makes of flat surfaces, about; bends and many
    /// small parts add to it.
    #[must_use]
    pub fn clustered_count(geometry: &Geometry, max_area: f64) -> f64 {
        exchanging_areas(geometry)
            .map(|area| match level_for(area, max_area) {
                0 => area / (clustered::FILL * max_area),
                level => f64::from(2 * u32::from(level.min(20))).exp2(),
            })
            .sum()
    }

    /// The largest area (m²) for which [`clustered_count`](Self::clustered_count) is at least `count`.
    #[must_use]
    pub fn clustered_area(geometry: &Geometry, count: f64) -> f64 {
        let total: f64 = exchanging_areas(geometry).sum();
        if total <= 0.0 {
            return 1.0;
        }
        let (mut low, mut high) = (total * 1e-12, total);
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            if Self::clustered_count(geometry, middle) >= count {
                low = middle
            } else {
                high = middle
            }
        }
        low
    }

    /// Number of patches.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is no patch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// All ids in order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = PatchId> + use<> {
        (0..self.cells.len() as u32).map(PatchId)
    }

    /// Where a patch lies on its source triangle; of a cluster, the member that stands for it: one
    /// near its middle that faces as the whole does.
    #[must_use]
    pub fn cell(&self, id: PatchId) -> Cell {
        self.cells[id.index()]
    }

    /// The source triangles that a patch has parts of, ascending: several if it is a cluster. All lie
    /// on the side of its [`cell`](Self::cell).
    #[must_use]
    pub fn members(&self, id: PatchId) -> &[TriangleId] {
        match self.members.of(id.index()) {
            range if range.is_empty() => std::slice::from_ref(&self.cells[id.index()].triangle),
            range => &self.members.triangles[range],
        }
    }

    /// The [`members`](Self::members) of a patch, each with its share of the patch's area, 0..1.
    pub fn shares(&self, id: PatchId) -> impl Iterator<Item = (TriangleId, f64)> + '_ {
        let sums = self.members.shares.get(self.members.of(id.index())).unwrap_or_default();
        let mut before = 0.0;
        self.members(id).iter().enumerate().map(move |(k, &t)| {
            let sum = sums.get(k).copied().unwrap_or(1.0);
            (t, sum - std::mem::replace(&mut before, sum))
        })
    }

    /// The pieces that a patch is made of: its one cell, or whole sides if it is a cluster.
    pub fn pieces(&self, id: PatchId) -> impl Iterator<Item = Cell> + '_ {
        let cell = self.cell(id);
        self.members(id).iter().map(move |&t| cell.on(t))
    }

    /// Whether a patch consists of several source triangles.
    #[must_use]
    pub fn is_cluster(&self, id: PatchId) -> bool {
        !self.members.of(id.index()).is_empty()
    }

    /// Whether any patch does.
    #[must_use]
    pub fn has_clusters(&self) -> bool {
        !self.members.triangles.is_empty()
    }

    /// Area of a patch in m².
    #[must_use]
    pub fn area(&self, id: PatchId) -> f64 {
        self.areas[id.index()]
    }

    /// How one side of a source triangle is cut.
    #[must_use]
    pub fn split_of(&self, triangle: TriangleId, side: Side) -> Split {
        self.splits[side_index(triangle, side)]
    }

    /// How every side is cut: index `2 t` is the front of triangle `t`, `2 t + 1` its back.
    #[must_use]
    pub fn splits(&self) -> &[Split] {
        &self.splits
    }

    /// The patches of one side of a source triangle.
    pub fn of_side(
        &self,
        triangle: TriangleId,
        side: Side,
    ) -> impl ExactSizeIterator<Item = PatchId> + use<> {
        match self.split_of(triangle, side) {
            Split::None => 0..0,
            Split::Uniform { first, level } => first..first + (1 << (2 * u32::from(level))),
            Split::Adaptive { first, count, .. } => first..first + count,
        }
        .map(PatchId)
    }

    /// The patch that a point belongs to; `None` on a side that exchanges no light. Mostly the patch
    /// under it, or a neighbour if something that stands on the surface parts it from the centre of
    /// that patch.
    #[must_use]
    pub fn at(&self, p: SurfacePoint) -> Option<PatchId> {
        if let Some(finest) = &self.finest {
            let id = finest.patches.at(p)?;
            return Some(PatchId(finest.patch_of[id.index()]));
        }
        let Split::Uniform { first, level } = self.split_of(p.triangle, p.side) else {
            return None;
        };
        let l = p.barycentric();
        let id = PatchId(first + cell::index_in_grid(level, l));
        Some(self.owner(id, l))
    }

    /// The point that stands for a patch where one must: its centroid, unless that is covered.
    #[must_use]
    pub fn origin(&self, id: PatchId) -> SurfacePoint {
        self.origins.get(&id).copied().unwrap_or_else(|| self.center(id))
    }

    /// The same patches, some of them with another [`origin`](Self::origin) (on the patch itself).
    #[must_use]
    pub fn with_origins(mut self, origins: HashMap<PatchId, SurfacePoint>) -> Self {
        self.origins = origins;
        self.cuts = Cuts::find(&self, &self.contacts);
        self.parts = OnceLock::new();
        self
    }

    /// The uniform mesh that look-ups go through, and for each of its patches the one of this mesh;
    /// `None` for a uniform mesh, which is its own.
    #[must_use]
    pub fn finest(&self) -> Option<(&Self, &[u32])> {
        self.finest.as_ref().map(|f| (&*f.patches, &f.patch_of[..]))
    }

    /// Whether something parts patches of this side, so that [`owner`](Self::owner) matters.
    #[inline(always)]
    pub(crate) fn has_cuts(&self, side: usize) -> bool {
        self.cuts.on_side(side)
    }

    /// Whether something parts this patch.
    #[inline(always)]
    pub(crate) fn is_cut(&self, id: PatchId) -> bool {
        self.cuts.is_cut(id)
    }

    /// The patch that a point in the cell of patch `id` belongs to, by its barycentric coordinates.
    pub(crate) fn owner(&self, id: PatchId, l: DVec3) -> PatchId {
        self.cuts.owner(id, || self.cell(id).local(l), DVec2::new(l.y, l.z))
    }

    /// How contacts cut a patch, for a twin of [`owner`](Self::owner).
    #[cfg(feature = "gpu")]
    pub(crate) fn cut_of(&self, id: PatchId) -> Option<&cut::CutPatch> {
        self.cuts.of(id)
    }

    /// Whether something stands on or passes through the surface near a patch.
    pub(crate) fn has_contact(&self, id: PatchId) -> bool {
        let cell = self.cell(id);
        let lines = self.contacts.of(side_index(cell.triangle, cell.side));
        /// Strips from the centre within which a contact concerns a patch: two rings about it.
        const REACH: f64 = 2.0;
        let reach = REACH / f64::from(cell.strips());
        let centre = cell.point(DVec3::splat(1.0 / 3.0)).uv;
        lines.iter().any(|l| l.near(centre, reach))
    }

    /// Whether something stands on edge `k` of a side that no neighbour there shares.
    pub(crate) fn edge_is_stood_on(&self, side: usize, k: u8) -> bool {
        self.contacts.on_edge(side, k)
    }

    /// Whether nothing that stands on the surface parts the origins of two patches near each other.
    pub(crate) fn see_each_other(&self, geometry: &Geometry, a: PatchId, b: PatchId) -> bool {
        let ends = [a, b].map(|i| self.origin(i).position(geometry));
        [a, b].iter().all(|&i| {
            let cell = self.cell(i);
            let lines = self.contacts.of(side_index(cell.triangle, cell.side));
            if lines.is_empty() {
                return true;
            }
            let plane = Plane::of(geometry.corners(cell.triangle));
            let [p, q] = ends.map(|e| plane.uv(e));
            !lines.iter().any(|l| l.parts(p, q))
        })
    }

    /// The point of a patch with coordinates `u` in the unit square, uniform in area.
    #[must_use]
    pub fn sample(&self, id: PatchId, u: DVec2) -> SurfacePoint {
        let cell = self.cell(id);
        match self.members.at_share(id.index(), u.x) {
            Some((triangle, x)) => cell.on(triangle).sample(DVec2::new(x, u.y)),
            None => cell.sample(u),
        }
    }

    /// The centroid of a patch; of a cluster, that of the member that stands for it.
    #[must_use]
    pub fn center(&self, id: PatchId) -> SurfacePoint {
        self.cell(id).point(DVec3::splat(1.0 / 3.0))
    }
}

/// Index of a side among the two per source triangle: `2 t` front, `2 t + 1` back.
#[must_use]
pub fn side_index(triangle: TriangleId, side: Side) -> usize {
    2 * triangle.index() + side as usize
}

/// Number of 1-to-4 splits after which `area` is at most `max_area`.
#[must_use]
pub(crate) fn level_for(area: f64, max_area: f64) -> u8 {
    let mut level = 0;
    let mut a = area;
    while a > max_area && level < 60 {
        a *= 0.25;
        level += 1;
    }
    level
}

/// Area of each side that exchanges light, m².
fn exchanging_areas(geometry: &Geometry) -> impl Iterator<Item = f64> + '_ {
    geometry.ids().filter(|&t| geometry.is_solid(t)).flat_map(move |t| {
        let area = geometry.area(t);
        Side::BOTH.into_iter().filter(move |&s| geometry.exchanges(t, s)).map(move |_| area)
    })
}

fn uniform_levels(geometry: &Geometry, max_area: f64) -> Result<Vec<u8>, PatchesError> {
    if max_area.is_nan() || max_area <= 0.0 {
        return Err(PatchesError::BadArea);
    }
    let mut count = 0_u64;
    let mut levels = Vec::with_capacity(geometry.len());
    for t in geometry.ids() {
        let level = if geometry.is_solid(t) { level_for(geometry.area(t), max_area) } else { 0 };
        let sides = Side::BOTH.iter().filter(|&&s| geometry.exchanges(t, s)).count() as u64;
        count = count.saturating_add(sides << (2 * u32::from(level.min(28))));
        if level > MAX_LEVEL || count > MAX_PATCHES {
            return Err(PatchesError::TooMany { count });
        }
        levels.push(level);
    }
    Ok(levels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides, Surface};

    fn triangle(sides: Sides) -> Geometry {
        let mut b = SceneBuilder::new("triangle");
        let m = b.material(Material::default());
        let s = b.surface(Surface { name: "t".into(), node: 0, primitive: 0 });
        let v = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.5, 3.0, 1.0)]
            .map(|p| b.vertex(p));
        b.triangle(v, None, s, m, sides);
        b.finish().geometry
    }

    #[test]
    fn splits_until_the_area_is_at_most_the_size() {
        let g = triangle(Sides::One);
        let area = g.area(TriangleId(0));
        assert_eq!(Patches::uniform(&g, area).unwrap().len(), 1);
        assert_eq!(Patches::uniform(&g, area * 0.999).unwrap().len(), 4);
        assert_eq!(Patches::uniform(&g, area / 16.0).unwrap().len(), 16);
        assert_eq!(Patches::uniform(&g, 0.0).unwrap_err(), PatchesError::BadArea);
        assert!(matches!(Patches::uniform(&g, 1e-30), Err(PatchesError::TooMany { .. })));
    }

    #[test]
    fn area_is_kept_and_every_center_finds_its_patch() {
        let g = triangle(Sides::Two);
        let p = Patches::uniform(&g, 0.01).unwrap();
        let total: f64 = p.ids().map(|i| p.area(i)).sum();
        assert!((total - 2.0 * g.area(TriangleId(0))).abs() < 1e-12);
        for id in p.ids() {
            assert_eq!(p.at(p.center(id)), Some(id));
            for (x, y) in [(0.01, 0.01), (0.99, 0.01), (0.99, 0.99), (0.5, 0.5)] {
                assert_eq!(p.at(p.sample(id, DVec2::new(x, y))), Some(id));
            }
            let [a, b, c] = p.cell(id).corners(&g);
            let area = 0.5 * (b - a).cross(c - a).length();
            assert!((area - p.area(id)).abs() < 1e-12);
            let up = (b - a).cross(c - a).normalize().dot(g.normal(TriangleId(0), Side::Front));
            assert!(up > 0.999, "cells keep the winding of their source");
        }
    }

    #[test]
    fn one_sided_backs_have_no_patch() {
        let g = triangle(Sides::One);
        let p = Patches::uniform(&g, 0.5).unwrap();
        let back =
            SurfacePoint { triangle: TriangleId(0), side: Side::Back, uv: DVec2::splat(0.2) };
        assert_eq!(p.at(back), None);
    }

    #[test]
    fn the_area_for_more_patches_yields_them() {
        let g = triangle(Sides::One);
        let area = Patches::area_adding(&g, 1000);
        let n = Patches::uniform(&g, area).unwrap().len();
        assert!((1000..=4096).contains(&n), "{n}");
    }
}
