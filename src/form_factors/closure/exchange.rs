//! Form factors made symmetric exchange areas, in the memory that they have.

use super::error::ClosureError;
use crate::form_factors::block::BLOCK;
use crate::form_factors::sink::SinkError;
use crate::form_factors::stored::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;

/// Turns the form factors of the `taken` patches into exchange areas in the unit of `areas`: `S_ij
/// = (A_i F_ij + A_j F_ji) / 2`, one number for both; those of others are dropped. Returns the RMS
/// of their difference over that of `A_i F_ij`.
pub fn symmetrise(
    factors: &mut FormFactors,
    areas: &[f64],
    taken: &[bool],
    progress: &dyn Progress,
) -> Result<f64, ClosureError> {
    // Asked between blocks of rows.
    let go_on = |i: usize| match i.is_multiple_of(BLOCK) {
        true => progress.advance(0).map_err(ClosureError::from),
        false => Ok(()),
    };
    if taken.contains(&false) {
        factors.rewrite(|i, columns, weights, kept_columns, kept| {
            let both = |j: PatchId| taken[i.index()] && taken[j.index()];
            for (&j, &w) in columns.iter().zip(weights).filter(|e| both(*e.0)) {
                kept_columns.push(j);
                kept.push(w);
            }
        })?;
    }
    complete_pattern(factors, go_on)?;
    let mut rows = factors.plain_rows_mut();
    // Row j meets the rows before it in their order, which is that of its own columns.
    let mut next = vec![0; rows.len()];
    let (mut difference, mut size) = (0.0, 0.0);
    for i in 0..rows.len() {
        go_on(i)?;
        let (columns, weights) = std::mem::take(&mut rows[i]);
        for (&j, weight) in columns.iter().zip(weights.iter_mut()).skip(next[i]) {
            let there = areas[i] * f64::from(*weight);
            if j.index() == i {
                *weight = stored(there);
                continue;
            }
            let back = &mut rows[j.index()].1[next[j.index()]];
            next[j.index()] += 1;
            let here = areas[j.index()] * f64::from(*back);
            difference += 2.0 * (there - here).powi(2);
            size += there * there + here * here;
            *weight = stored(0.5 * (there + here));
            *back = *weight;
        }
    }
    Ok(if size > 0.0 { (difference / size).sqrt() } else { 0.0 })
}

/// In single precision; what is positive stays so.
fn stored(exchange: f64) -> f32 {
    let rounded = exchange as f32;
    if exchange > 0.0 { rounded.clamp(f32::MIN_POSITIVE, f32::MAX) } else { rounded }
}

/// Gives row j an entry i, zero, where row i alone has an entry j.
fn complete_pattern(
    factors: &mut FormFactors,
    go_on: impl Fn(usize) -> Result<(), ClosureError>,
) -> Result<(), ClosureError> {
    let rows = factors.plain_rows();
    let mut missing: Vec<Vec<PatchId>> = vec![Vec::new(); rows.len()];
    let mut next = vec![0; rows.len()];
    let mut count = 0;
    for (i, (columns, _)) in (0..).map(PatchId).zip(&rows) {
        go_on(i.index())?;
        for &j in *columns {
            let (other, next) = (rows[j.index()].0, &mut next[j.index()]);
            while other.get(*next).is_some_and(|&k| k < i) {
                *next += 1;
            }
            if other.get(*next) != Some(&i) {
                missing[j.index()].push(i);
                count += 1;
            }
        }
    }
    if count == 0 {
        return Ok(());
    }
    /// Of an entry, and of its place in a list that grows by doubling.
    const BYTES: u64 = 16;
    factors.within_limit(BYTES * count)?;
    factors.rewrite(|i, columns, weights, all_columns, all| {
        let more = &missing[i.index()];
        let (mut at, mut new) = (0, 0);
        while at < columns.len() || new < more.len() {
            let take_new = columns.get(at).is_none_or(|c| more.get(new).is_some_and(|m| m < c));
            all_columns.push(if take_new { more[new] } else { columns[at] });
            all.push(if take_new { 0.0 } else { weights[at] });
            new += usize::from(take_new);
            at += usize::from(!take_new);
        }
    })?;
    Ok(())
}

/// Drops exchange areas whose form factors are below `threshold` both ways, except the largest of
/// each row.
pub fn drop_pairs(
    factors: &mut FormFactors,
    areas: &[f64],
    threshold: f64,
) -> Result<(), SinkError> {
    let rows = factors.plain_rows();
    let largest = |w: &[f32]| f64::from(w.iter().copied().fold(0.0, f32::max));
    // The least exchange area that stays on account of each row.
    let least: Vec<f64> =
        rows.iter().zip(areas).map(|(r, a)| (threshold * a).min(largest(r.1))).collect();
    factors.rewrite(|i, columns, weights, kept_columns, kept| {
        for (&j, &w) in columns.iter().zip(weights) {
            if f64::from(w) >= least[i.index()].min(least[j.index()]) {
                kept_columns.push(j);
                kept.push(w);
            }
        }
    })
}
