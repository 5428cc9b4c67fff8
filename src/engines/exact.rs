//! Exact form factors: the unoccluded factor of each pair in closed form or by a rule of bounded
//! error, times its visible share.
//!
//! ```text
//! A_i F_ij = A_j F_ji = S_ij = v ∫_i ∫_j K dA dA        K = cos θ_i cos θ_j / (π r²)
//! v = ∫∫ K V dA dA / ∫∫ K dA dA
//! ```
//!
//! 1. Patches go into a hierarchy (`tree`), blockers are joined to large convex polygons (`blockers`).
//! 2. Between two tiles of the hierarchy, blockers are sorted out from above (`shaft`, `tile`): most
//!    pairs are proved to see each other whole, or not at all.
//! 3. The unoccluded part is summed over points for far pairs, 16 at a time (`far`), and integrated
//!    along contours for near and touching ones (`unoccluded`).
//! 4. Of pairs in part hidden, the visible share is found by clipping, in closed form on one of the
//!    patches; where many blockers overlap, by shadow rays (`visible`, `cover`), which between touching
//!    patches go by solid angle (`points`). Where sorting out many small blockers would take longer
//!    than rays, far pairs get rays alone: the fewer, the less their factor weighs among all, and packed
//!    over neighbouring pairs (`probes`). How many in all follows from what a sample of rows errs by;
//!    the errors of all pairs add up to [`Exact::estimate`].
//!
//! What something stands on is cut along the contact ([`Patches::own_area`]); far pairs take such a patch
//! for one triangle of the same second moments (`triangles`).
//!
//! Each pair is evaluated once, in the order of the hierarchy, and S is stored rounded towards zero:
//! so reciprocity holds to stored precision, and 0 ≤ S ≤ min(A_i, A_j) always.
//!
//! # What a row does not know
//! `environment` and `back` of a row whose sampled rays end there share what the factors leave of 1,
//! in the proportion of these rays, but no more than the rays allow for; the rest is `lost`, and may be
//! negative. Where no ray ends there, all that the factors leave is `lost`: the error of the row.
//!
//! # Deviations
//! - Far pairs behind crowds of small blockers (`probes`) get few shadow rays, whose points are uniform
//!   and not weighted by the kernel; pairs whose first rays, and those of their neighbours, all agree
//!   are not looked at again, so faint half-shadows lean towards all or nothing.

mod blockers;
mod cover;
mod far;
mod matrix;
mod model;
mod points;
mod probes;
mod shaft;
#[cfg(test)]
mod tests;
mod tile;
mod tree;
mod triangles;
mod unoccluded;
mod visible;

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::engine::{AssembleError, Engine, EngineError, PairsReport, in_blocks};
use super::rays::{Rays, RaysOptions};
use crate::form_factors::{Row, RowAccount, RowSink, Weights};
use crate::patches::{PatchId, Patches};
use crate::progress::Progress;
use crate::scene::Geometry;
use crate::visibility::Bvh;
use model::Model;
use tile::{Counts, Task, Work, down};

/// How exact form factors are to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactOptions {
    /// Root-mean-square error of the factors aimed at, as a share of their root-mean-square. Default
    /// 1e-3.
    pub error: f64,
    /// Other seeds give other shadow rays. Default 0.
    pub seed: u32,
}

impl Default for ExactOptions {
    fn default() -> Self {
        Self { error: 1e-3, seed: 0 }
    }
}

impl ExactOptions {
    /// The error that is worked towards.
    fn error(&self) -> f64 {
        self.error.clamp(1e-6, 1.0)
    }
}

/// Rays that tell where the rest of a row ends: first so many, and more if they leave some of it open.
const ACCOUNT_RAYS: [usize; 2] = [256, 4096];

/// The rest of a row may exceed what rays find by this share of 1, and by three times their standard
/// error, before it is `lost`.
const ACCOUNT_ERROR: f64 = 1e-3;

/// The exact engine.
pub struct Exact<'a> {
    model: Model<'a>,
    rays: [Rays<'a>; 2],
    options: ExactOptions,
    /// How many times more rays than usual pairs get.
    scale: f64,
    work: Mutex<Vec<Work>>,
    counts: Mutex<Counts>,
}

impl<'a> Exact<'a> {
    /// An engine for these patches; `bvh` is of the same geometry.
    #[must_use]
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        options: ExactOptions,
    ) -> Self {
        let rays = |samples| {
            let options = RaysOptions { samples, seed: options.seed };
            Rays::new(geometry, patches, bvh, options)
        };
        let mut me = Self {
            model: Model::new(geometry, patches, bvh, options.error()),
            rays: ACCOUNT_RAYS.map(rays),
            options,
            scale: 1.0,
            work: Mutex::new(Vec::new()),
            counts: Mutex::new(Counts::default()),
        };
        me.scale = me.find_scale();
        me
    }

    /// How many times more rays than usual, or fewer, pairs need for the error asked for: what some
    /// rows err by with the usual number tells.
    fn find_scale(&self) -> f64 {
        /// Rows that are tried: one of so many, and at most these.
        const ONE_OF: usize = 64;
        const MOST_ROWS: usize = 32;
        /// The error of stratified rays falls as this power of their number, about.
        const FALL: f64 = 0.63;
        const MOST: f64 = 16.0;
        let n = self.model.len();
        let rows = (n / ONE_OF).clamp(1, MOST_ROWS);
        let step = n.div_ceil(rows).max(1);
        let wanted: Vec<bool> = (0..n).map(|at| at % step == step / 2).collect();
        let task = self.task(Some(&wanted));
        self.tasks(&wanted).par_iter().for_each(|&(a, b)| {
            self.with_work(|work| task.tile(a, b, work, |_, _, _| {}));
        });
        let found = self.take_counts();
        let rows = wanted.iter().filter(|w| **w).count();
        let squares = self.seen_squares(rows) * task.pairs() as f64;
        self.take_counts();
        if squares <= 0.0 || found.ray_errors == 0 {
            return 1.0;
        }
        let of_all = |errors: u128| tile::unfixed(errors) / squares;
        let allowed = task.error.powi(2);
        let left = (allowed - of_all(found.errors - found.ray_errors)).max(0.5 * allowed);
        (of_all(found.ray_errors) / left).powf(0.5 / FALL).clamp(1.0 / MOST, MOST)
    }

    /// The mean sum of the squares of both factors of a pair, over the square of what factors are like
    /// with nothing in the way: twice the share of the squares that is seen. Few rows hold most of the
    /// squares; those tell, each by its squares.
    fn seen_squares(&self, rows: usize) -> f64 {
        let of = &self.model.some_squares;
        let total: f64 = of.iter().map(|row| row.1).sum();
        let (mut upto, mut chosen) = (0.0, Vec::new());
        for &(at, squares) in of.iter().filter(|row| row.1 > 0.0) {
            upto += squares;
            while chosen.len() < rows && upto >= total * (chosen.len() as f64 + 0.5) / rows as f64 {
                chosen.push((PatchId(self.model.tree.order[at as usize]), squares));
            }
        }
        let ids: Vec<PatchId> = chosen.iter().map(|row| row.0).collect();
        let mut seen = vec![Row::default(); ids.len()];
        self.make_rows(&ids, &mut seen);
        let square_sum = |row: &Row| row.entries().map(|(_, f)| f * f).sum::<f64>();
        let shares = seen.iter().zip(&chosen).map(|(row, chosen)| square_sum(row) / chosen.1);
        2.0 * shares.sum::<f64>() / chosen.len().max(1) as f64
    }

    /// What was done so far, which is forgotten.
    fn take_counts(&self) -> Counts {
        std::mem::take(&mut *self.counts.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The pairs of tiles that hold pairs of wanted patches.
    fn tasks(&self, wanted: &[bool]) -> Vec<(u32, u32)> {
        let tree = &self.model.tree;
        let asked = |t: u32| {
            let node = &tree.nodes[t as usize];
            wanted[node.from as usize..node.to as usize].iter().any(|&w| w)
        };
        let asked: Vec<(u32, bool)> = tree.tiles.iter().map(|&t| (t, asked(t))).collect();
        let mut tasks = Vec::new();
        for (k, &(a, all)) in asked.iter().enumerate() {
            tasks.extend(asked[k..].iter().filter(|b| all || b.1).map(|&(b, _)| (a, b)));
        }
        tasks
    }

    /// Pairs that exchange anything, those of them with a possible blocker, and shadow rays so far.
    #[must_use]
    pub fn counts(&self) -> [u64; 3] {
        let c = *self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        [c.pairs, c.partly, c.rays]
    }

    /// Root-mean-square error of all factors found so far over their root-mean-square, as far as the
    /// points and rays that visible shares come from tell by their differences.
    #[must_use]
    pub fn estimate(&self) -> f64 {
        let c = *self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        if c.squares > 0 { (c.errors as f64 / c.squares as f64).sqrt() } else { 0.0 }
    }

    fn task<'b>(&'b self, wanted: Option<&'b [bool]>) -> Task<'b> {
        let error = self.options.error();
        Task { model: &self.model, error, scale: self.scale, seed: self.options.seed, wanted }
    }

    /// Works with room of its own.
    fn with_work<T>(&self, f: impl FnOnce(&mut Work) -> T) -> T {
        let rooms = || self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let room = rooms().pop();
        let mut work = room.unwrap_or_default();
        let result = f(&mut work);
        let counts = std::mem::take(&mut work.counts);
        let mut all = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        *all = all.and(counts);
        drop(all);
        rooms().push(work);
        result
    }

    /// Finds out where what the factors of a row leave of 1, if they add up to `sum`, ends.
    fn account(&self, id: PatchId, sum: f64, rays: &mut Row) -> RowAccount {
        let rest = 1.0 - sum;
        let mut account = RowAccount::default();
        for engine in &self.rays {
            engine.row(id, rays);
            let gone = rays.environment + rays.back;
            let noise = 3.0 * (gone * (1.0 - gone).max(0.0) / engine.samples() as f64).sqrt();
            let known = rest.clamp(0.0, gone + noise + ACCOUNT_ERROR);
            let share = if gone > 0.0 { known / gone } else { 0.0 };
            let (environment, back) = (share * rays.environment, share * rays.back);
            account = RowAccount { environment, back, lost: rest - environment - back };
            if account.lost.abs() <= ACCOUNT_ERROR || rest <= 0.0 {
                break;
            }
        }
        account
    }
}

impl Engine for Exact<'_> {
    fn name(&self) -> &'static str {
        "exact"
    }

    fn bytes(&self, rows: usize) -> u64 {
        let work = rayon::current_num_threads() * (1 << 20);
        self.model.bytes() + (work + rows * self.model.len() * 4) as u64
    }

    fn pairs(&self) -> Option<PairsReport> {
        let [evaluated, partly_hidden, shadow_rays] = self.counts();
        Some(PairsReport { evaluated, partly_hidden, shadow_rays, error: self.estimate() })
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        self.make_rows(rows, out);
        Ok(())
    }

    /// All rows are made together where they are kept, each pair evaluated once.
    fn make(
        &mut self,
        ids: &[PatchId],
        sink: &mut dyn RowSink,
        progress: &dyn Progress,
    ) -> Result<(), AssembleError> {
        match sink.room() {
            Some(room) if ids.len() == self.model.len() => self.all(room, sink, progress),
            _ => in_blocks(self, ids, sink, progress),
        }
    }
}

impl Exact<'_> {
    /// Makes the rows of patches, and their accounts.
    fn make_rows(&self, rows: &[PatchId], out: &mut [Row]) {
        let n = self.model.len();
        let mut wanted = vec![false; n];
        // Which of `rows` a place in the order of the tree is.
        let mut row_of = vec![u32::MAX; n];
        for (k, id) in (0..).zip(rows) {
            let place = self.model.place[id.index()] as usize;
            (wanted[place], row_of[place]) = (true, k);
        }
        let tree = &self.model.tree;
        let tasks = self.tasks(&wanted);
        let mut dense: Vec<Vec<f32>> = vec![vec![0.0; n]; rows.len()];
        let task = self.task(Some(&wanted));
        let mut found: Vec<Vec<(u32, u32, f32)>> = Vec::new();
        for tasks in tasks.chunks(256) {
            tasks
                .par_iter()
                .map(|&(a, b)| {
                    let mut entries = Vec::new();
                    self.with_work(|work| {
                        task.tile(a, b, work, |i, j, s| entries.push((i as u32, j as u32, s)));
                    });
                    entries
                })
                .collect_into_vec(&mut found);
            for &(i, j, s) in found.iter().flatten() {
                for (from, to) in [(i, j), (j, i)] {
                    if let Some(row) = dense.get_mut(row_of[from as usize] as usize) {
                        row[tree.order[to as usize] as usize] = s;
                    }
                }
            }
        }
        out.par_iter_mut().zip(rows).for_each_init(Row::default, |rays, (row, id)| {
            // A row asked for twice is filled in once.
            let dense = &dense[row_of[self.model.place[id.index()] as usize] as usize];
            self.write(*id, dense, row);
            let account = self.account(*id, row.weights.sum(), rays);
            (row.environment, row.back) = (account.environment, account.back);
            row.lost = account.lost;
        });
    }

    /// Makes the row of a patch from its exchange with each.
    fn write(&self, id: PatchId, exchange: &[f32], row: &mut Row) {
        row.half = 0;
        let mut weights = match std::mem::take(&mut row.weights) {
            Weights::Each(w) => w,
            Weights::Fixed(_) | Weights::Equal { .. } => Vec::new(),
        };
        row.columns.clear();
        weights.clear();
        self.entries(id, exchange, &mut row.columns, &mut weights);
        row.weights = Weights::Each(weights);
    }

    /// Appends the columns and form factors of a patch that exchanges so much with each.
    fn entries(
        &self,
        id: PatchId,
        exchange: &[f32],
        columns: &mut Vec<PatchId>,
        weights: &mut Vec<f32>,
    ) {
        let inverse = 1.0 / self.model.areas[self.model.place[id.index()] as usize];
        let from = columns.len();
        let count = exchange.iter().filter(|s| **s > 0.0).count();
        // Without a branch that no one can foresee: what is nothing is written over by the next.
        columns.resize(from + count + 1, PatchId(0));
        weights.resize(from + count + 1, 0.0);
        let mut k = from;
        for (j, &s) in (0..).zip(exchange) {
            columns[k] = PatchId(j);
            weights[k] = down(f64::from(s) * inverse);
            k += usize::from(s > 0.0);
        }
        columns.truncate(k);
        weights.truncate(k);
    }
}
