//! The patches of a scene: what each is, and which one a point belongs to.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use super::cell::{Cell, index_in_grid};
use super::contact::ContactLines;
use super::crossed::CrossedPatches;
use super::fragments::Fragments;
use super::line::Plane;
use super::members::Members;
use super::point::{PatchId, SurfacePoint, side_index};
use super::split::Split;
use crate::scene::{Geometry, Side, TriangleId};

/// The patches of a scene. Never changes.
#[derive(Debug, Clone)]
pub struct Patches {
    /// Two per source triangle: front, back.
    pub(super) splits: Vec<Split>,
    /// Where each patch lies.
    pub(super) cells: Vec<Cell>,
    /// Area of each patch, m².
    pub(super) areas: Vec<f64>,
    /// The source triangles of patches that are clusters.
    pub(super) members: Members,
    pub(super) contacts: Arc<ContactLines>,
    pub(super) crossed: CrossedPatches,
    /// What belongs to patches that contacts divide, found when first asked for.
    pub(super) fragments: OnceLock<Fragments>,
    /// Points that stand for their patch where the centroid is covered.
    pub(super) origins: HashMap<PatchId, SurfacePoint>,
    /// Of an adaptive mesh, the uniform one that it coarsens.
    pub(super) finest: Option<Finest>,
}

/// The uniform mesh under an adaptive one.
#[derive(Debug, Clone)]
pub(super) struct Finest {
    pub(super) patches: Arc<Patches>,
    /// The adaptive patch that each of the uniform ones is a part of.
    pub(super) patch_of: Vec<u32>,
}

impl Patches {
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

    /// The source triangles that a patch has parts of, ascending: several if it is a cluster. All
    /// lie on the side of its [`cell`](Self::cell).
    #[must_use]
    pub fn members(&self, id: PatchId) -> &[TriangleId] {
        match self.members.of(id) {
            range if range.is_empty() => std::slice::from_ref(&self.cells[id.index()].triangle),
            range => &self.members.triangles[range],
        }
    }

    /// The [`members`](Self::members) of a patch, each with its fraction of the patch's area, 0..1.
    pub fn area_fractions(&self, id: PatchId) -> impl Iterator<Item = (TriangleId, f64)> + '_ {
        let sums = self.members.cumulative.get(self.members.of(id)).unwrap_or_default();
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
        !self.members.of(id).is_empty()
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

    /// The patch that a point belongs to; `None` on a side that exchanges no light. Mostly the
    /// patch under it, or a neighbour if something that stands on the surface separates it from
    /// the centre of that patch.
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
        let id = PatchId(first + index_in_grid(level, l));
        Some(self.owner(id, l))
    }

    /// The point that stands for a patch where one must: its centroid, unless that is covered.
    #[must_use]
    pub fn origin(&self, id: PatchId) -> SurfacePoint {
        self.origins.get(&id).copied().unwrap_or_else(|| self.center(id))
    }

    /// The patches of the uniform mesh that look-ups go through whose origin is not their centroid,
    /// ascending, and where on their triangle it is.
    pub(crate) fn moved_origins(&self) -> Vec<(PatchId, DVec2)> {
        let finest = self.finest.as_ref().map_or(self, |f| &f.patches);
        let mut moved: Vec<_> = finest.origins.iter().map(|(id, p)| (*id, p.uv)).collect();
        moved.sort_by_key(|m| m.0);
        moved
    }

    /// The uniform mesh that look-ups go through, and for each of its patches the one of this mesh;
    /// `None` for a uniform mesh, which is its own.
    #[must_use]
    pub fn finest(&self) -> Option<(&Self, &[u32])> {
        self.finest.as_ref().map(|f| (&*f.patches, &f.patch_of[..]))
    }

    /// Whether points of some patch of this side belong to others, so that [`owner`](Self::owner)
    /// matters.
    #[inline(always)]
    pub(crate) fn has_crossed(&self, side: usize) -> bool {
        self.crossed.on_side(side)
    }

    /// Whether some points of this patch belong to others.
    #[inline(always)]
    pub(crate) fn is_crossed(&self, id: PatchId) -> bool {
        self.crossed.is_crossed(id)
    }

    /// The patch that a point in the cell of patch `id` belongs to, by its barycentric coordinates.
    pub(crate) fn owner(&self, id: PatchId, l: DVec3) -> PatchId {
        self.crossed.owner(id, || self.cell(id).local(l), DVec2::new(l.y, l.z))
    }

    /// How contacts cut a patch, for a twin of [`owner`](Self::owner).
    #[cfg(feature = "gpu")]
    pub(crate) fn crossed(&self, id: PatchId) -> Option<&super::crossed::CrossedPatch> {
        self.crossed.of(id)
    }

    /// Whether something stands on or passes through the surface near a patch.
    pub(crate) fn has_contact(&self, id: PatchId) -> bool {
        let cell = self.cell(id);
        /// Strips from the centre within which a contact concerns a patch: two rings about it.
        const REACH: f64 = 2.0;
        let reach = REACH / f64::from(cell.strips());
        let centre = cell.point(DVec3::splat(1.0 / 3.0)).uv;
        let within = [centre - reach, centre + reach];
        self.contacts.any(side_index(cell.triangle, cell.side), within, |l| l.near(centre, reach))
    }

    /// Whether something stands on edge `k` of a side that no neighbour there shares.
    pub(crate) fn edge_is_stood_on(&self, side: usize, k: u8) -> bool {
        self.contacts.on_edge(side, k)
    }

    /// Whether nothing that stands on the surface separates the origins of two patches near each
    /// other.
    pub(crate) fn see_each_other(&self, geometry: &Geometry, a: PatchId, b: PatchId) -> bool {
        let ends = [a, b].map(|i| self.origin(i).position(geometry));
        [a, b].iter().all(|&i| {
            let cell = self.cell(i);
            let side = side_index(cell.triangle, cell.side);
            if !self.contacts.any_on(side) {
                return true;
            }
            let plane = Plane::of(geometry.corners(cell.triangle));
            let [p, q] = ends.map(|e| plane.uv(e));
            // Lines that end beside the way count where rounding says so.
            let slack = 1e-6 * (q - p).length();
            let within = [p.min(q) - slack, p.max(q) + slack];
            !self.contacts.any(side, within, |l| l.separates(p, q))
        })
    }

    /// The point of a patch with coordinates `u` in the unit square, uniform in area.
    #[must_use]
    pub fn sample(&self, id: PatchId, u: DVec2) -> SurfacePoint {
        let cell = self.cell(id);
        match self.members.at_fraction(id, u.x) {
            Some((triangle, x)) => cell.on(triangle).sample(DVec2::new(x, u.y)),
            None => cell.sample(u),
        }
    }

    /// The centroid of a patch; of a cluster, that of the member that stands for it.
    #[must_use]
    pub fn center(&self, id: PatchId) -> SurfacePoint {
        self.cell(id).point(DVec3::splat(1.0 / 3.0))
    }

    /// A fingerprint of where patches lie.
    pub(crate) fn fingerprint(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for id in self.ids() {
            let cell = self.cell(id);
            hasher.update(&cell.triangle.0.to_le_bytes());
            hasher.update(&cell.index().to_le_bytes());
            hasher.update(&[cell.level, cell.side as u8]);
            for t in self.members(id) {
                hasher.update(&t.0.to_le_bytes());
            }
        }
        hasher.finalize().to_hex().to_string()
    }
}
