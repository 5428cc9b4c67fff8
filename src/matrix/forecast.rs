//! What a matrix will be like, before it is made.

use crate::engines::{Engine, EngineError, ROWS_AT_ONCE, SampleOfRows};
use crate::form_factors::BLOCK;
use crate::patches::Patches;

/// What a matrix will be like, foretold from a sample of its rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Rows, and columns, of the matrix before lumping.
    pub rows: usize,
    /// Entries that are not zero.
    pub entries: u64,
    /// Bytes that making it in memory takes.
    pub whole: u64,
    /// Bytes that making it takes if its rows go elsewhere.
    pub in_blocks: u64,
    /// Bytes that are allowed.
    pub allowed: u64,
}

/// Bytes of an entry in memory.
pub(super) const ENTRY_BYTES: u64 = 8;

/// Bytes a patch takes beside its row: cells, areas, scales, and the sample that reciprocity is
/// measured on.
pub(super) const PATCH_BYTES: u64 = 1000;

/// A matrix that takes no more bytes than this fits anywhere.
const EASILY: u64 = 1 << 30;

impl Forecast {
    /// Whether it fits in memory.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.whole <= self.allowed
    }

    /// Bytes that the rows themselves may take in memory.
    pub(super) fn room(&self) -> u64 {
        let beside = self.whole.saturating_sub(ENTRY_BYTES * self.entries);
        self.allowed - beside.min(self.allowed)
    }

    /// Bytes taken whatever the rows are like.
    pub(super) fn least(engine: &dyn Engine, patches: &Patches) -> u64 {
        beside(engine, patches, BLOCK)
    }

    /// Foretells what all of `rows` will be like: from the most that they may take, if that fits by
    /// far, or else from a few rows, which are made beforehand.
    pub(super) fn new(
        engine: &mut dyn Engine,
        patches: &Patches,
        rows: usize,
        allowed: u64,
    ) -> Result<Self, EngineError> {
        // Pairs of patches are kept until both their rows are handed over.
        let at_once = if engine.pairs().is_some() { ROWS_AT_ONCE } else { BLOCK };
        let [whole, in_blocks] = [at_once, BLOCK].map(|rows| beside(engine, patches, rows));
        let most = SampleOfRows::at_most(engine).filter(|most| {
            let bytes = most.bytes * patches.len() as f64;
            bytes <= EASILY.min(allowed / 4) as f64
        });
        let sample = match most {
            Some(most) => most,
            None => SampleOfRows::of(engine, patches)?,
        };
        // A block is there as it was made, with one entry a patch, and as it is kept.
        let under_way = |rows: usize| {
            let entries = sample.entries + 2.0 * sample.distinct;
            ENTRY_BYTES * (entries * rows.min(patches.len()) as f64) as u64
        };
        let entries = (sample.distinct * patches.len() as f64) as u64;
        Ok(Self {
            rows,
            entries,
            whole: whole + under_way(at_once) + ENTRY_BYTES * entries,
            in_blocks: in_blocks + under_way(BLOCK),
            allowed,
        })
    }
}

/// Bytes taken beside the rows while so many are made at once.
fn beside(engine: &dyn Engine, patches: &Patches, rows: usize) -> u64 {
    PATCH_BYTES * patches.len() as u64 + engine.bytes(rows.min(patches.len()))
}
