//! Rows only where light can come: patches on sides that nothing lit sees get none.
//!
//! A row says what its patch sees, and whoever is seen sees back. So rows are made in waves: those
//! of the emitting sides first, then of the sides that they see, and so on through all that
//! reflect. Sides that face only emptiness or darkness are never reached.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::engine::{AssembleError, Engine};
use crate::form_factors::{FormFactors, KeptRows, OwnRows, RowSink, SinkError};
use crate::patches::{PatchId, Patches, side_index};
use crate::progress::Progress;

/// Has the rows made of all patches that light can reach from `seeds`. A patch passes light on if
/// `shines` says that it emits or reflects. Advances `progress` by one a row.
///
/// `seeds` are the patches that emit or are lit by something without a row (sky, lamps); the whole
/// sides that they lie on are reached. Rows are taken from `kept` and put there, if it is given
/// with a key that tells what they depend on.
pub fn assemble_lit(
    engine: &mut dyn Engine,
    patches: &Patches,
    seeds: impl IntoIterator<Item = PatchId>,
    shines: impl Fn(PatchId) -> bool + Sync,
    factors: &mut FormFactors,
    kept: Option<(&dyn KeptRows, &str)>,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let mut reached = vec![false; patches.splits().len()];
    let seen: Vec<AtomicBool> = patches.ids().map(|_| AtomicBool::new(false)).collect();
    let mut wave = Vec::new();
    let mut reach = |id: PatchId, wave: &mut Vec<PatchId>| {
        let cell = patches.cell(id);
        let side = &mut reached[side_index(cell.triangle, cell.side)];
        if !std::mem::replace(side, true) {
            wave.extend(patches.of_side(cell.triangle, cell.side));
        }
    };
    for id in seeds {
        reach(id, &mut wave);
    }
    while !wave.is_empty() {
        wave.sort_unstable();
        make_own(engine, &wave, factors, kept, progress)?;
        factors.share_accounts(&wave).map_err(SinkError::from)?;
        // Many rows see the same patches: most are marked already.
        wave.par_iter().filter(|&&id| shines(id)).for_each(|&id| {
            for &j in factors.row(id).iter().flat_map(|r| r.columns) {
                let seen = &seen[j.index()];
                if !seen.load(Ordering::Relaxed) {
                    seen.store(true, Ordering::Relaxed);
                }
            }
        });
        let mut by_any: Vec<bool> = seen.iter().map(|s| s.load(Ordering::Relaxed)).collect();
        factors.ranks().unite(&mut by_any).map_err(SinkError::from)?;
        let mut next = Vec::new();
        for j in patches.ids().filter(|j| by_any[j.index()]) {
            reach(j, &mut next);
        }
        wave = next;
    }
    Ok(())
}

/// Has those of some rows made that are this rank's work, unless they were kept.
fn make_own(
    engine: &mut dyn Engine,
    ids: &[PatchId],
    factors: &mut FormFactors,
    kept: Option<(&dyn KeptRows, &str)>,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    if factors.ranks().is_alone() && kept.is_none() {
        return engine.make(ids, factors, progress);
    }
    let mut missing = Vec::new();
    for part in factors.own(ids) {
        match kept.and_then(|(rows, key)| rows.take_up(key, part, factors, progress)) {
            Some(blocks) => {
                blocks.into_iter().try_for_each(|block| factors.take(block))?;
                progress.advance(part.len() as u64)?;
            }
            None => missing.push(part),
        }
    }
    let mut sink = OwnRows { factors, kept, parts: missing.iter() };
    engine.make(&sink.padded(), &mut sink, progress)
}
