//! Rows of form factors from what patches exchange, and where the rest of a row ends.

use rayon::prelude::*;

use super::model::Model;
use super::pairs::Pairs;
use super::tally::down;
use crate::engines::rays::{Rays, RaysOptions};
use crate::form_factors::{Row, RowAccount, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;
use crate::visibility::Bvh;

/// Rays that tell where the rest of a row ends: at first, and if some of it is then still open.
const RAYS: [usize; 2] = [256, 4096];

/// The rest of a row may exceed what rays find by this, and by three times their standard error,
/// before it is `lost`.
const ERROR: f64 = 1e-3;

/// Finds out where the rest of a row ends: 1 less the sum of its factors.
pub(super) struct Accounts<'a>([Rays<'a>; 2]);

impl<'a> Accounts<'a> {
    pub fn new(geometry: &'a Geometry, patches: &'a Patches, bvh: &'a Bvh, seed: u32) -> Self {
        Self(RAYS.map(|samples| Rays::new(geometry, patches, bvh, RaysOptions { samples, seed })))
    }

    /// The account of a row whose factors add up to `sum`; `rays` is reused.
    pub fn of(&self, id: PatchId, sum: f64, rays: &mut Row) -> RowAccount {
        let rest = 1.0 - sum;
        let mut account = RowAccount::default();
        for engine in &self.0 {
            engine.row(id, rays);
            let gone = rays.environment + rays.back;
            let noise = 3.0 * (gone * (1.0 - gone).max(0.0) / engine.samples() as f64).sqrt();
            let known = rest.clamp(0.0, gone + noise + ERROR);
            let scale = if gone > 0.0 { known / gone } else { 0.0 };
            let (environment, back) = (scale * rays.environment, scale * rays.back);
            account = RowAccount { environment, back, lost: rest - environment - back };
            if account.lost.abs() <= ERROR || rest <= 0.0 {
                break;
            }
        }
        account
    }
}

/// Makes the rows of patches, and their accounts.
pub(super) fn make(pairs: &Pairs<'_>, accounts: &Accounts<'_>, ids: &[PatchId], out: &mut [Row]) {
    let model = &pairs.model;
    let exchange = pairs.rows(ids);
    out.par_iter_mut().zip(ids).for_each_init(Row::default, |rays, (row, id)| {
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
        let account = accounts.of(*id, row.weights.sum(), rays);
        (row.environment, row.back) = (account.environment, account.back);
        row.lost = account.lost;
    });
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
