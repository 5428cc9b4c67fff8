//! Exact form factors: the unoccluded factor of each pair in closed form or by a rule of bounded
//! error, times its visible fraction.
//!
//! ```text
//! A_i F_ij = A_j F_ji = S_ij = v ∫_i ∫_j K dA dA        K = cos θ_i cos θ_j / (π r²)
//! v = ∫∫ K V dA dA / ∫∫ K dA dA
//! ```
//!
//! 1. *Unoccluded factor.* The `polygon`s of near and touching pairs are integrated
//!    (`unoccluded`), along their `contour`s if need be; far pairs are summed over points, 16 at a
//!    time (`triangles`, `far`).
//! 2. *Blockers.* Solid triangles are joined to large `convex` polygons, which make up surfaces
//!    (`blockers`). What a body stands on is covered (`coverings`), and exchanges nothing.
//! 3. *Hierarchy.* Patches, which consist of `pieces`, have `places` in a `tree`, and blockers are
//!    sorted out between two of its nodes (`shaft`), 16 at a time (`culling`). This is the scene as
//!    the engine keeps it (`model`).
//! 4. *Visible fraction.* Of a `pair` that is partly hidden, blockers are clipped (`clip`), and
//!    what they hide of one polygon has a closed form for each point of the other (`occluded`,
//!    `closed_form`). What connected blockers hide adds up (`sheets`); where several of them may
//!    overlap, they are subtracted one after the other (`union`). Where there are too many, or
//!    where that takes more time than the factor is worth, shadow rays tell (`samples`, `points`,
//!    `pair_rays`); between touching patches these go by solid angle. `visible` chooses.
//! 5. *Many pairs.* Where sorting out many small blockers would take longer than rays, far pairs
//!    get rays alone: the fewer, the less their factor weighs among all (`effort`), and packed
//!    over neighbouring pairs (`shadow_rays`).
//! 6. *Tiles.* From two tiles of the hierarchy down to two patches, most pairs are proved to see
//!    each other completely, or not at all (`sight`); the others are evaluated (`tile`), their
//!    errors added up (`tally`), and all tiles shared out among threads (`pairs`).
//! 7. *Error.* A sample of rows tells how many rays the error asked for takes (`budget`);
//!    [`Exact::estimate`] is what all pairs err by, and a check by other rays (`check`) may raise
//!    it.
//! 8. *Rows.* What pairs exchange becomes form factors: of some rows (`rows`), or of all at once
//!    (`matrix`). Pairs of tiles (`tile_pairs`) may also be evaluated in parts, by several
//!    processes ([`Exact::evaluate`]), and joined ([`Exact::joining`]).
//!
//! A patch that something stands on is cut along the contact ([`Patches::own_area`]); in far pairs
//! it counts as one triangle of the same second moments (`triangles`).
//!
//! Each pair is evaluated once, in the order of the hierarchy, and S is stored rounded towards
//! zero: so reciprocity holds to stored precision, and 0 ≤ S ≤ min(A_i, A_j) always.
//!
//! # What a row does not know
//! Sampled rays tell where the rest of a row ends, which is 1 less the sum of its factors. It is
//! divided among `environment` and `back` in the proportion of these rays, as far as the rays allow
//! for it. What then is left is `lost`, and may be negative: the error of the row.
//!
//! # Deviations
//! - Far pairs behind crowds of small blockers (`shadow_rays`) get few shadow rays, whose points
//!   are uniform and not weighted by the kernel; pairs whose first rays, and those of their
//!   neighbours, all agree are not looked at again, so faint half-shadows lean towards all or
//!   nothing.

mod blockers;
mod budget;
mod check;
mod clip;
mod closed_form;
mod contour;
mod convex;
mod coverings;
mod culling;
mod effort;
mod far;
mod fractions;
mod matrix;
mod model;
mod occluded;
mod pair;
mod pair_rays;
mod pairs;
mod pieces;
mod places;
mod points;
mod polygon;
mod rows;
mod samples;
mod shadow_rays;
mod shaft;
mod sheets;
mod sight;
mod tally;
#[cfg(test)]
mod tests;
mod tile;
mod tile_pairs;
mod tree;
mod triangles;
mod union;
mod unoccluded;
mod visible;

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::engine::{AssembleError, Engine, EngineError, PairsReport, in_blocks};
use crate::form_factors::{Row, RowSink};
use crate::patches::{PatchId, Patches};
use crate::progress::{Cancelled, Progress};
use crate::scene::Geometry;
use crate::visibility::Bvh;
use budget::ray_scale;
use check::disagreement;
use model::Model;
use pairs::Pairs;
use rows::Accounts;
pub use tally::PairsTally;
pub use tile_pairs::{FoundPairs, TilePairs};

/// How exact form factors are to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactOptions {
    /// Root-mean-square error of the factors aimed at, as a share of their root-mean-square.
    /// Default 1e-3.
    pub error: f64,
    /// Other seeds give other shadow rays. Default 0.
    pub seed: u32,
    /// [`Tiling::ray_scale`], if it is known. Default: it is found from some rows.
    pub ray_scale: Option<f64>,
}

impl Default for ExactOptions {
    fn default() -> Self {
        Self { error: 1e-3, seed: 0, ray_scale: None }
    }
}

/// How the pairs of patches are cut into pairs of tiles, and how much work they get.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tiling {
    /// Number of tiles, of at most 128 patches each.
    pub tiles: u32,
    /// Fingerprint of which patches are in which tile, in hexadecimal.
    pub order: String,
    /// The number of shadow rays of a pair over the usual one, 1/16..16: it is what the error asked
    /// for takes.
    pub ray_scale: f64,
}

impl Tiling {
    /// Number of pairs of tiles, those of a tile with itself included.
    #[must_use]
    pub fn pairs(&self) -> u64 {
        let tiles = u64::from(self.tiles);
        tiles * (tiles + 1) / 2
    }
}

/// What the rules for far pairs err by, as a fraction of the error asked for.
const RULES: f64 = 0.3;

/// The exact engine.
pub struct Exact<'a> {
    pairs: Pairs<'a>,
    accounts: Accounts<'a>,
    /// Hears what takes long, and may stop it.
    progress: &'a dyn Progress,
    /// What a check by rays proved, once it is asked for.
    proven: OnceLock<f64>,
    /// Where pairs come from that were evaluated elsewhere.
    found: Option<&'a dyn FoundPairs>,
}

impl<'a> Exact<'a> {
    /// An engine for these patches; `bvh` is of the same geometry.
    ///
    /// # Errors
    /// If `progress` stops it: what it prepares takes as long as many rows.
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        options: ExactOptions,
        progress: &'a dyn Progress,
    ) -> Result<Self, Cancelled> {
        let ExactOptions { error, seed, ray_scale: known } = options;
        let error = error.clamp(1e-6, 1.0);
        let model = Model::new(geometry, patches, bvh, error, progress)?;
        let mut pairs = Pairs::new(model, error, seed);
        pairs.effort.scale = known.map_or_else(|| ray_scale(&pairs, progress), Ok)?;
        let accounts = Accounts::new(geometry, patches, bvh, seed);
        Ok(Self { pairs, accounts, progress, proven: OnceLock::new(), found: None })
    }

    /// The same engine, which makes all rows together from pairs that were evaluated elsewhere.
    #[must_use]
    pub fn joining(self, found: &'a dyn FoundPairs) -> Self {
        Self { found: Some(found), ..self }
    }

    /// How pairs are cut into pairs of tiles.
    #[must_use]
    pub fn tiling(&self) -> Tiling {
        let tree = &self.pairs.model.tree;
        let mut hasher = blake3::Hasher::new();
        for tile in tree.tiles() {
            let patches = tree.patches(tree.tile(tile));
            hasher.update(&(patches.len() as u32).to_le_bytes());
            patches.iter().for_each(|id| {
                hasher.update(&id.0.to_le_bytes());
            });
        }
        Tiling {
            tiles: tree.tiles().count() as u32,
            order: hasher.finalize().to_hex().to_string(),
            ray_scale: self.pairs.effort.scale,
        }
    }

    /// Evaluates pairs of tiles, by their numbers: column by column of the upper triangle, 0 up to
    /// [`Tiling::pairs`]. What each exchanges depends on nothing but its number, and takes at most
    /// `room` bytes together. Advances `progress` by one a pair of tiles.
    ///
    /// # Errors
    /// If there is not as much room, or `progress` stops it.
    pub fn evaluate(
        &self,
        numbers: &[u64],
        room: u64,
        progress: &dyn Progress,
    ) -> Result<(Vec<TilePairs>, PairsTally), AssembleError> {
        matrix::evaluate(&self.pairs, numbers, room, progress)
    }

    /// Pairs that exchange anything, those of them with a possible blocker, and shadow rays so far.
    #[must_use]
    pub fn counts(&self) -> [u64; 3] {
        let c = self.pairs.tally();
        [c.pairs, c.partly, c.rays]
    }

    /// Root-mean-square error of all factors found so far over their root-mean-square: as far as
    /// the points and rays that visible fractions come from tell by their differences, but not less
    /// than what rows lose, than any of them exceeds 1 by, or than what rays prove that share
    /// nothing with how pairs are evaluated.
    #[must_use]
    pub fn estimate(&self) -> f64 {
        let c = self.pairs.tally();
        if c.squares == 0 {
            return 0.0;
        }
        let by_pairs = c.errors as f64 / c.squares as f64;
        let by_rules = if c.partly > 0 { (RULES * self.pairs.effort.error).powi(2) } else { 0.0 };
        let proven = *self.proven.get_or_init(|| disagreement(&self.pairs));
        (by_pairs + by_rules).sqrt().max(self.accounts.proven()).max(proven)
    }
}

impl Engine for Exact<'_> {
    fn name(&self) -> &'static str {
        "exact"
    }

    fn bytes(&self, rows: usize) -> u64 {
        let work = rayon::current_num_threads() * (1 << 20);
        self.pairs.model.bytes() + (work + rows * self.pairs.model.len() * 4) as u64
    }

    fn most_entries(&self) -> Option<f64> {
        Some(self.pairs.model.faced)
    }

    fn pairs(&self) -> Option<PairsReport> {
        let [evaluated, partly_hidden, shadow_rays] = self.counts();
        let rounding = self.pairs.model.touching;
        Some(PairsReport {
            evaluated,
            partly_hidden,
            shadow_rays,
            error: self.estimate(),
            rounding,
        })
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        Ok(rows::make(&self.pairs, &self.accounts, rows, out, self.progress)?)
    }

    /// All rows are made together where they are kept, each pair evaluated once.
    fn make(
        &mut self,
        ids: &[PatchId],
        sink: &mut dyn RowSink,
        progress: &dyn Progress,
    ) -> Result<(), AssembleError> {
        let all = ids.len() == self.pairs.model.len();
        match (self.found, sink.room()) {
            (Some(found), _) if all => {
                matrix::join(&self.pairs, &self.accounts, found, sink, progress)
            }
            (None, Some(room)) if all => {
                matrix::make(&self.pairs, &self.accounts, room, sink, progress)
            }
            _ => in_blocks(self, ids, sink, progress),
        }
    }
}
