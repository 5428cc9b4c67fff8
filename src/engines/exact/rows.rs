//! Rows of form factors from what patches exchange, and where the rest of a row ends.

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use rayon::prelude::*;

use super::model::Model;
use super::pairs::Pairs;
use super::tally::down;
use crate::engines::rays::{Rays, RaysOptions};
use crate::form_factors::{Row, RowAccount, Weights};
use crate::patches::{PatchId, Patches};
use crate::progress::{Cancelled, Progress};
use crate::scene::Geometry;
use crate::visibility::Bvh;

/// Rays that tell where the rest of a row ends: at first, and if some of it is then still open.
const RAYS: [usize; 2] = [256, 4096];

/// The rest of a row may exceed what rays find by this, and by three times their standard error,
/// before it is `lost`.
const ERROR: f64 = 1e-3;

/// Finds out where the rest of a row ends: 1 less the sum of its factors.
pub(super) struct Accounts<'a> {
    rays: [Rays<'a>; 2],
    /// Sum of the squares of what is lost, in units of 2⁻⁴⁰, and number of rows.
    lost: AtomicU64,
    rows: AtomicU64,
    /// The bits of the largest sum of a row above 1; those of positive numbers are in their order.
    excess: AtomicU64,
}

/// The rounding of a row of numbers in single precision.
const SINGLE: f64 = 1e-6;

/// One as a sum of squares is kept.
const ONE: f64 = (1_u64 << 40) as f64;

impl<'a> Accounts<'a> {
    pub fn new(geometry: &'a Geometry, patches: &'a Patches, bvh: &'a Bvh, seed: u32) -> Self {
        let rays =
            RAYS.map(|samples| Rays::new(geometry, patches, bvh, RaysOptions { samples, seed }));
        Self { rays, lost: AtomicU64::new(0), rows: AtomicU64::new(0), excess: AtomicU64::new(0) }
    }

    /// The account of a row whose factors add up to `sum`; `rays` is reused. What other faces lie
    /// on sees their backs, and is seen as a back.
    pub fn of(&self, model: &Model<'_>, id: PatchId, sum: f64, rays: &mut Row) -> RowAccount {
        let covered = model.covered(id);
        let rest = 1.0 - covered - sum;
        let mut account = RowAccount::default();
        for engine in &self.rays {
            engine.row(id, rays);
            // Rays do not tell which part of a patch that is covered in part they end on.
            let partly = rays.columns.iter().filter(|&&j| model.covered(j) > 0.0).count();
            let back = rays.back + partly as f64 / engine.samples() as f64;
            let gone = rays.environment + rays.back;
            let noise = 3.0 * (gone * (1.0 - gone).max(0.0) / engine.samples() as f64).sqrt();
            let known = rest.clamp(0.0, rays.environment + back + noise + ERROR);
            let more = (known - gone).clamp(0.0, back - rays.back);
            let scale = if gone > 0.0 { (known - more) / gone } else { 0.0 };
            let (environment, back) = (scale * rays.environment, scale * rays.back + more);
            let lost = rest - environment - back;
            account = RowAccount { environment, back: covered + back, lost };
            if account.lost.abs() <= ERROR || rest <= 0.0 {
                break;
            }
        }
        self.lost.fetch_add((ONE * account.lost.powi(2).min(1.0)) as u64, Relaxed);
        self.rows.fetch_add(1, Relaxed);
        // What is kept in single precision may add up to a little more.
        let excess = if sum > 1.0 { sum - 1.0 + SINGLE } else { 0.0 };
        self.excess.fetch_max(excess.to_bits(), Relaxed);
        account
    }

    /// Root-mean-square of what rows lost so far, as factors that all err by the same fraction of
    /// themselves lose that fraction; but not less than any row exceeds 1 by.
    pub fn proven(&self) -> f64 {
        let rows = self.rows.load(Relaxed).max(1) as f64;
        let lost = (self.lost.load(Relaxed) as f64 / ONE / rows).sqrt();
        lost.max(f64::from_bits(self.excess.load(Relaxed)))
    }
}

/// Makes the rows of patches, and their accounts.
pub(super) fn make(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    ids: &[PatchId],
    out: &mut [Row],
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    let model = &pairs.model;
    let exchange = pairs.rows(ids, progress)?;
    out.par_iter_mut().zip(ids).try_for_each_init(Row::default, |rays, (row, id)| {
        progress.advance(0)?;
        let exchange = exchange.of(model.place(*id));
        row.half = 0;
        let mut weights = match std::mem::take(&mut row.weights) {
            Weights::Each(w) => w,
            Weights::Fixed(_) | Weights::Equal { .. } => Vec::new(),
        };
        row.columns.clear();
        weights.clear();
        entries(model, *id, exchange, &mut row.columns, &mut weights);
        row.weights = Weights::Each(weights);
        let account = accounts.of(model, *id, row.weights.sum(), rays);
        (row.environment, row.back) = (account.environment, account.back);
        row.lost = account.lost;
        Ok(())
    })
}

/// Appends the columns and form factors of a patch, from what it exchanges with each.
pub(super) fn entries(
    model: &Model<'_>,
    id: PatchId,
    exchange: &[f32],
    columns: &mut Vec<PatchId>,
    weights: &mut Vec<f32>,
) {
    let inverse = 1.0 / model.area(model.place(id));
    let from = columns.len();
    let count = exchange.iter().filter(|s| **s > 0.0).count();
    // Every entry is written, and the next one overwrites it if it is zero: a branch would be
    // mispredicted as often as not.
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
