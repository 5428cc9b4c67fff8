//! How many shadow rays the error asked for takes, estimated from the error of some rows.

use rayon::prelude::*;

use super::pairs::Pairs;
use super::places::{Place, Wanted};
use super::tally::{down, unfixed};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};

/// The number of rays that pairs need for the error asked for, over the usual one.
pub(super) fn ray_scale(pairs: &Pairs<'_>, progress: &dyn Progress) -> Result<f64, Cancelled> {
    /// One row in this many is tried, but not more than the latter.
    const ONE_OF: usize = 64;
    const MOST_ROWS: usize = 32;
    /// The error of stratified rays falls as this power of their number, about.
    const FALL: f64 = 0.63;
    const MOST: f64 = 16.0;
    /// The part of the error that pairs may make: some is left for the rules, and for what the
    /// sample does not tell.
    const PART: f64 = 0.75;
    let n = pairs.model.len();
    let rows = (n / ONE_OF).clamp(1, MOST_ROWS);
    let step = n.div_ceil(rows).max(1);
    let wanted: Vec<bool> = (0..n).map(|at| at % step == step / 2).collect();
    let task = pairs.task(Wanted::Sample(&wanted));
    let tiles = pairs.tiles(&wanted);
    tiles.par_iter().try_for_each(|&tiles| {
        progress.advance(0)?;
        pairs.tile(&task, tiles, |_, _, _| {});
        Ok(())
    })?;
    let found = pairs.take_tally();
    let rows = wanted.iter().filter(|w| **w).count();
    let squares = seen_squares(pairs, rows, progress)? * task.wanted.pairs(n) as f64;
    pairs.take_tally();
    if squares <= 0.0 || found.ray_errors == 0 {
        return Ok(1.0);
    }
    let of_all = |errors: u128| unfixed(errors) / squares;
    let allowed = (PART * pairs.effort.error).powi(2);
    let left = (allowed - of_all(found.errors - found.ray_errors)).max(0.5 * allowed);
    Ok((of_all(found.ray_errors) / left).powf(0.5 / FALL).clamp(1.0 / MOST, MOST))
}

/// The mean sum of the squares of both factors of a pair, over the square of the root-mean-square
/// factor with nothing in the way: twice the visible fraction of the squares. Few rows hold most of
/// the squares; rows are chosen as often as they hold much.
fn seen_squares(pairs: &Pairs<'_>, rows: usize, progress: &dyn Progress) -> Result<f64, Cancelled> {
    let model = &pairs.model;
    let of = &model.sampled_rows;
    let total: f64 = of.iter().map(|row| row.1).sum();
    let (mut upto, mut chosen) = (0.0, Vec::new());
    for &(at, squares) in of.iter().filter(|row| row.1 > 0.0) {
        upto += squares;
        while chosen.len() < rows && upto >= total * (chosen.len() as f64 + 0.5) / rows as f64 {
            chosen.push((at, squares));
        }
    }
    let ids: Vec<PatchId> = chosen.iter().map(|row| model.tree.order[row.0.index()]).collect();
    let seen = pairs.sample(&ids, progress)?;
    let square_sum = |at: Place| {
        let inverse = 1.0 / model.area(at);
        let factors = seen.of(at).iter().map(|&s| f64::from(down(f64::from(s) * inverse)));
        factors.map(|f| f * f).sum::<f64>()
    };
    let fractions = chosen.iter().map(|&(at, squares)| square_sum(at) / squares);
    Ok(2.0 * fractions.sum::<f64>() / chosen.len().max(1) as f64)
}
