//! How a mesh is made: sides split evenly, and small triangles joined.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use super::cell::Cell;
use super::clustered::{self, ALONE};
use super::contact::ContactLines;
use super::crossed::CrossedPatches;
use super::crossing::find_crossed;
use super::members::Members;
use super::mesh::Patches;
use super::point::{PatchId, SurfacePoint, side_index};
use super::split::{PatchesError, Split, exchanging_areas, level_for, uniform_levels};
use crate::progress::{Cancelled, Progress, Silent};
use crate::scene::{Geometry, Side, TriangleId};

impl Patches {
    /// Splits every exchanging side 1 to 4 at the edge midpoints until no area exceeds `max_area`
    /// (m²): the paper's uniform subdivision.
    pub fn uniform(geometry: &Geometry, max_area: f64) -> Result<Self, PatchesError> {
        Self::uniform_heard(geometry, max_area, &Silent)
    }

    /// [`uniform`](Self::uniform), which `progress` may stop.
    pub fn uniform_heard(
        geometry: &Geometry,
        max_area: f64,
        progress: &dyn Progress,
    ) -> Result<Self, PatchesError> {
        let (levels, _) = uniform_levels(geometry, max_area)?;
        let contacts = ContactLines::find(geometry, progress)?;
        Ok(Self::build(geometry, &levels, contacts, &[], progress)?)
    }

    /// How many patches [`uniform`](Self::uniform) makes.
    ///
    /// # Errors
    /// As [`uniform`](Self::uniform).
    pub fn uniform_count(geometry: &Geometry, max_area: f64) -> Result<u64, PatchesError> {
        Ok(uniform_levels(geometry, max_area)?.1)
    }

    /// Splits source triangles larger than `max_area` (m²) like [`uniform`](Self::uniform), and
    /// joins smaller ones: connected triangles of the same `label` (an opaque number a triangle;
    /// none for those beyond its end) and sidedness become one patch, a cluster, while
    ///
    /// - its area is at most `max_area`,
    /// - the normals of its members differ from their mean by at most
    ///   [`MAX_ANGLE`](super::MAX_ANGLE),
    /// - its extent is at most [`MAX_DIAMETER`](super::MAX_DIAMETER) `√max_area`.
    ///
    /// Triangles that something stands on or passes through stay patches of their own, and no
    /// cluster crosses an edge on which something stands.
    pub fn clustered(
        geometry: &Geometry,
        max_area: f64,
        label: &[u32],
    ) -> Result<Self, PatchesError> {
        Self::clustered_heard(geometry, max_area, label, &Silent)
    }

    /// [`clustered`](Self::clustered), which `progress` may stop.
    pub fn clustered_heard(
        geometry: &Geometry,
        max_area: f64,
        label: &[u32],
        progress: &dyn Progress,
    ) -> Result<Self, PatchesError> {
        let (levels, _) = uniform_levels(geometry, max_area)?;
        let contacts = ContactLines::find(geometry, progress)?;
        progress.advance(0)?;
        let whole = |t: TriangleId| levels[t.index()] == 0 && !geometry.is_whole(t);
        let clusters = clustered::clusters(geometry, &contacts, whole, max_area, label);
        progress.advance(0)?;
        Ok(Self::build(geometry, &levels, contacts, &clusters, progress)?)
    }

    /// The patches of sides split to `levels`, or joined to the numbered `clusters` (by side).
    fn build(
        geometry: &Geometry,
        levels: &[u8],
        contacts: ContactLines,
        clusters: &[u32],
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let mut patches = Self {
            splits: vec![Split::None; 2 * geometry.len()],
            cells: Vec::new(),
            areas: Vec::new(),
            members: Members::default(),
            contacts: Arc::new(contacts),
            crossed: CrossedPatches::default(),
            fragments: OnceLock::new(),
            origins: HashMap::new(),
            finest: None,
        };
        let mut id_of: HashMap<u32, u32> = HashMap::new();
        for side in Side::BOTH {
            for triangle in geometry.ids().filter(|&t| geometry.exchanges(t, side)) {
                let level = levels[triangle.index()];
                let mut first = patches.cells.len() as u32;
                let s = side_index(triangle, side);
                if let Some(&cluster) = clusters.get(s).filter(|&&c| c != ALONE) {
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
        progress.advance(0)?;
        patches.crossed = find_crossed(&patches, &patches.contacts, progress)?;
        Ok(patches)
    }

    /// Lists the members of clusters and moves their cells to those that stand for them.
    fn gather_members(&mut self, geometry: &Geometry, clusters: &[u32]) {
        let member = |s: &usize| clusters[*s] != ALONE;
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
        let mut cumulative = vec![1.0; triangles.len()];
        for (p, cell) in self.cells.iter_mut().enumerate() {
            let range = starts[p] as usize..starts[p + 1] as usize;
            let members = &triangles[range.clone()];
            if members.is_empty() {
                continue;
            }
            let mut sum = 0.0;
            for (up_to, &t) in cumulative[range].iter_mut().zip(members) {
                sum += geometry.area(t);
                *up_to = sum / self.areas[p];
            }
            let best = clustered::representative(geometry, cell.side, members);
            *cell = Cell::whole(members[best], cell.side);
        }
        self.members = Members { starts, triangles, cumulative };
    }

    /// The same patches, some of them with another [`origin`](Self::origin) (on the patch itself).
    ///
    /// # Errors
    /// If `progress` stops it.
    pub fn with_origins(
        mut self,
        origins: HashMap<PatchId, SurfacePoint>,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        self.origins = origins;
        self.crossed = find_crossed(&self, &self.contacts, progress)?;
        self.fragments = OnceLock::new();
        Ok(self)
    }

    /// How many source triangles touch or cross so many others that contacts of them may be left
    /// out.
    #[must_use]
    pub fn contacts_left_out(&self) -> usize {
        self.contacts.unfinished
    }

    /// The largest area (m²) that yields at least `more` patches beyond one a side of each source
    /// triangle, as near as halving finds.
    #[must_use]
    pub fn area_adding(geometry: &Geometry, more: u64) -> f64 {
        let sides: Vec<(f64, u64)> = geometry
            .ids()
            .filter(|&t| geometry.is_solid(t) && !geometry.is_whole(t))
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

    /// How many patches [`clustered`](Self::clustered) makes of flat surfaces, about; bends and
    /// many small parts add to it.
    #[must_use]
    pub fn clustered_count(geometry: &Geometry, max_area: f64) -> f64 {
        exchanging_areas(geometry)
            .map(|area| match level_for(area, max_area) {
                0 => area / (clustered::FILL * max_area),
                level => f64::from(2 * u32::from(level.min(20))).exp2(),
            })
            .sum()
    }

    /// The largest area (m²) for which [`clustered_count`](Self::clustered_count) is at least
    /// `count`.
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
}
