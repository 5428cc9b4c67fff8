//! Classical radiosity: every pair of patches, its visibility tested against every patch; O(n³).
//!
//! The baseline that Kulyasov & Nikulin (2012) measure hemicubes against, step 2 of the classical
//! algorithm (Goral, Torrance, Greenberg & Battaile 1984, "Modeling the interaction of light
//! between diffuse surfaces"). For each pair of patches:
//!
//! ```text
//! F_ij = V_ij × (Lambert's form factor from the centre of i to all of j)
//! ```
//!
//! V_ij = 1 if each centre lies in front of the other patch's plane and no patch of the scene
//! blocks the segment between the centres, else 0. It is plain on purpose, no acceleration
//! structure, but not slow: rows in parallel, 16 triangles at a time, up to the first blocker, and
//! one V for both F_ij and F_ji.
//!
//! # What a row does not know
//! A pair is visible or not as a whole and the centre stands for all of i, so rows do not sum to
//! one, not even in a closed scene: `lost` is 1 - Σ_j F_ij and may be negative. What escapes or
//! ends on backs is not told apart from it: `environment` and `back` are 0, so this engine knows no
//! sky and no covered patches.
//!
//! # Deviations
//! - Both sides of a double-sided triangle are one blocker, and backs that do not reflect block.
//! - The paper does not say how it computes the factor of a visible pair; Lambert's formula is the
//!   exact one for the centre.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::engine::{Engine, EngineError};
use crate::form_factors::kernel::point_to_polygon;
use crate::form_factors::{Row, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, Side, Sides, TriangleId};
use crate::visibility::{Blockers, Sight};

/// The classical engine.
///
/// The visibility of a pair is computed once, with whichever of its two rows is made first, and
/// kept (n² / 8 bytes for all rows). The whole matrix so takes half the tests that its rows would
/// take one by one: who estimates its time from a few rows should count half of theirs for it, and
/// begin with a new engine.
pub struct Classical {
    has_clusters: bool,
    patches: Vec<Facet>,
    blockers: Blockers,
    /// Of each patch whose row has been made: which patches it sees, a bit each.
    known: Vec<Option<Box<[u64]>>>,
    /// Rows in `known`.
    kept: usize,
    tests: AtomicU64,
}

/// One side of a patch.
#[derive(Debug, Clone, Copy)]
struct Facet {
    centre: DVec3,
    normal: DVec3,
    corners: [DVec3; 3],
    /// The centre, for tests of visibility.
    local: Vec3,
}

/// Visibilities are kept in at most so many bytes: enough for all of 64k patches.
const MOST_KEPT: u64 = 512 << 20;

/// What a patch looks for, and what it finds: buffers of one thread.
#[derive(Default)]
struct Looks {
    sight: Sight,
    asked: Vec<u32>,
    ends: Vec<Vec3>,
    blocked: Vec<bool>,
}

impl Classical {
    /// An engine for these patches; it makes no rows of clusters.
    #[must_use]
    pub fn new(geometry: &Geometry, patches: &Patches) -> Self {
        // The fronts of all solid triangles tile them: every patch once, not once a side. What only
        // blocks has no patches, and stands there as it is.
        let solid = || geometry.ids().filter(|&t| geometry.is_solid(t));
        let only_blocks = |t: &TriangleId| geometry.sides[t.index()] == Sides::None;
        let triangles: Vec<[DVec3; 3]> = solid()
            .flat_map(|t| patches.of_side(t, Side::Front))
            .map(|id| patches.cell(id).corners(geometry))
            .chain(solid().filter(only_blocks).map(|t| geometry.corners(t)))
            .collect();
        let blockers = Blockers::new(&triangles);
        let facets = patches
            .ids()
            .map(|id| {
                let cell = patches.cell(id);
                let centre = patches.center(id).position(geometry);
                Facet {
                    centre,
                    normal: geometry.normal(cell.triangle, cell.side),
                    corners: cell.corners(geometry),
                    local: blockers.local(centre),
                }
            })
            .collect();
        Self {
            patches: facets,
            blockers,
            has_clusters: patches.has_clusters(),
            known: vec![None; patches.len()],
            kept: 0,
            tests: AtomicU64::new(0),
        }
    }

    /// How often a segment has been tested against a triangle so far.
    #[must_use]
    pub fn tests(&self) -> u64 {
        self.tests.load(Ordering::Relaxed)
    }

    /// Words of a bit a patch.
    fn words(&self) -> usize {
        self.patches.len().div_ceil(64)
    }

    /// Whether each of two patches has the other's centre before it. Both must: the segment
    /// between the centres leaves through one front and arrives at the other.
    fn face(&self, a: &Facet, b: &Facet) -> bool {
        let along = b.centre - a.centre;
        let coplanar = self.blockers.rounding();
        a.normal.dot(along) > coplanar && b.normal.dot(along) < -coplanar
    }

    /// The patches that face patch `i`, ascending.
    fn facing(&self, i: u32) -> impl Iterator<Item = u32> + '_ {
        let from = &self.patches[i as usize];
        self.patches.iter().zip(0..).filter(|(to, _)| self.face(from, to)).map(|(_, j)| j)
    }

    /// What patch `i` sees of all that face it and of which `unknown` says to find out, a bit a
    /// patch.
    fn look(&self, i: u32, unknown: impl Fn(u32) -> bool, looks: &mut Looks) -> Box<[u64]> {
        let Looks { sight, asked, ends, blocked } = looks;
        asked.clear();
        asked.extend(self.facing(i).filter(|&j| unknown(j)));
        ends.clear();
        ends.extend(asked.iter().map(|&j| self.patches[j as usize].local));
        let mut seen = vec![0; self.words()].into_boxed_slice();
        if !asked.is_empty() {
            self.blockers.look(self.patches[i as usize].local, sight);
            let tests = self.blockers.blocked(sight, ends, blocked);
            self.tests.fetch_add(tests, Ordering::Relaxed);
            for (&j, _) in asked.iter().zip(blocked.iter()).filter(|(_, blocked)| !**blocked) {
                set(&mut seen, j);
            }
        }
        seen
    }

    /// Writes the row of patch `i`, which sees what `sees` says.
    fn write(&self, i: u32, sees: impl Fn(u32) -> bool, row: &mut Row) {
        row.columns.clear();
        let mut weights = match std::mem::take(&mut row.weights) {
            Weights::Each(w) => w,
            Weights::Fixed(_) | Weights::Equal { .. } => Vec::new(),
        };
        weights.clear();
        let from = &self.patches[i as usize];
        for j in self.facing(i).filter(|&j| sees(j)) {
            let to = &self.patches[j as usize];
            let factor = point_to_polygon(from.centre, from.normal, &to.corners) as f32;
            if factor > 0.0 {
                row.columns.push(PatchId(j));
                weights.push(factor);
            }
        }
        row.weights = Weights::Each(weights);
        (row.environment, row.back) = (0.0, 0.0);
        row.lost = 1.0 - row.weights.sum();
    }
}

fn set(bits: &mut [u64], i: u32) {
    bits[i as usize / 64] |= 1 << (i % 64);
}

fn is_set(bits: &[u64], i: u32) -> bool {
    bits[i as usize / 64] >> (i % 64) & 1 == 1
}

impl Engine for Classical {
    fn name(&self) -> &'static str {
        "classical"
    }

    fn sees_from_centres(&self) -> bool {
        true
    }

    fn bytes(&self, rows: usize) -> u64 {
        let threads = rows.min(rayon::current_num_threads());
        let per_thread = self.blockers.sight_bytes() + 17 * self.patches.len();
        let per_row = 8 * self.words();
        let kept = (per_row as u64 * self.patches.len() as u64).min(MOST_KEPT);
        (threads * per_thread + rows * per_row) as u64 + kept
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        if self.has_clusters {
            return Err(EngineError::Clusters(self.name()));
        }
        const ABSENT: u32 = u32::MAX;
        let mut place = vec![ABSENT; self.patches.len()];
        for (at, id) in (0..).zip(rows) {
            place[id.index()] = at;
        }
        let me = &*self;
        let order = |j: u32| place[j as usize];
        // A pair with a row made before, or earlier in this block, is known from there.
        let earlier = |at: u32, j: u32| order(j) != ABSENT && order(j) < at;
        let mut seen: Vec<Box<[u64]>> = (0..rows.len() as u32)
            .into_par_iter()
            .map_init(Looks::default, |looks, at| {
                let unknown = |j: u32| me.known[j as usize].is_none() && !earlier(at, j);
                me.look(rows[at as usize].0, unknown, looks)
            })
            .collect();
        out.par_iter_mut().zip(0..rows.len() as u32).for_each(|(row, at)| {
            let i = rows[at as usize].0;
            let sees = |j: u32| match &me.known[j as usize] {
                Some(known) => is_set(known, i),
                None if earlier(at, j) => is_set(&seen[order(j) as usize], i),
                None => is_set(&seen[at as usize], j),
            };
            me.write(i, sees, row);
        });
        for ((id, row), mut seen) in rows.iter().zip(out).zip(seen.drain(..)) {
            if 8 * (self.words() * (self.kept + 1)) as u64 > MOST_KEPT {
                break;
            }
            for j in &row.columns {
                set(&mut seen, j.0);
            }
            self.kept += usize::from(self.known[id.index()].replace(seen).is_none());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    fn fill(engine: &mut Classical, ids: &[PatchId]) -> Vec<Row> {
        let mut rows = vec![Row::default(); ids.len()];
        engine.fill(ids, &mut rows).unwrap();
        rows
    }

    #[test]
    fn rows_do_not_depend_on_their_grouping_and_share_visibility() {
        let g = builtin::build("cornell-box").unwrap().geometry;
        let p = Patches::uniform(&g, 2.0).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        let mut whole = Classical::new(&g, &p);
        let rows = fill(&mut whole, &ids);

        let mut blocks = Classical::new(&g, &p);
        let by_blocks: Vec<Row> = ids.chunks(37).flat_map(|b| fill(&mut blocks, b)).collect();
        assert_eq!(rows, by_blocks);
        assert_eq!(fill(&mut blocks, &ids[10..20]), rows[10..20], "made again");

        let mut alone = 0;
        for &id in &ids {
            let mut engine = Classical::new(&g, &p);
            assert_eq!(fill(&mut engine, &[id])[0], rows[id.index()]);
            alone += engine.tests();
        }
        // Half the pairs; not half the tests to the digit, since a sum over both directions of a
        // pair is the same number.
        assert_eq!((blocks.tests(), 2 * whole.tests()), (whole.tests(), alone));
    }

    #[test]
    fn visibility_is_mutual() {
        let g = builtin::build("cornell-box").unwrap().geometry;
        let p = Patches::uniform(&g, 1.0).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        let rows = fill(&mut Classical::new(&g, &p), &ids);
        let mut occluded = 0;
        for (i, row) in ids.iter().zip(&rows) {
            for &j in &row.columns {
                assert!(rows[j.index()].factor_to(*i) > 0.0);
            }
            assert!((row.total() - 1.0).abs() < 1e-12);
            occluded += usize::from(row.columns.len() < ids.len() / 4);
        }
        assert!(occluded > 0, "some patches see little");
    }

    #[test]
    fn a_row_is_lamberts_formula_where_nothing_blocks() {
        let g = builtin::build("furnace").unwrap().geometry;
        let p = Patches::uniform(&g, 0.03).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        let rows = fill(&mut Classical::new(&g, &p), &ids);
        for (i, row) in ids.iter().zip(&rows) {
            // The cube is convex: each centre sees all of the five other walls.
            let wall = |id: PatchId| p.cell(id).triangle.index() / 2;
            let others = ids.iter().filter(|j| wall(**j) != wall(*i)).count();
            assert_eq!(row.columns.len(), others);
            assert!(row.lost.abs() < 1e-6, "{}", row.lost);
            let cell = p.cell(*i);
            let (centre, normal) = (p.center(*i).position(&g), g.normal(cell.triangle, cell.side));
            for (j, factor) in row.entries() {
                let exact = point_to_polygon(centre, normal, &p.cell(j).corners(&g));
                assert!((factor / exact - 1.0).abs() < 1e-6, "{i:?} {j:?}: {factor} {exact}");
            }
        }
    }
}
