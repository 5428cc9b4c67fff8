//! What the rows of all patches will take, foretold from some of them.

use super::engine::{Engine, EngineError};
use crate::form_factors::{Row, Weights, entry_bytes};
use crate::patches::{PatchId, Patches};

/// Rows made beforehand.
const ROWS: usize = 32;

/// Means over a sample of rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleOfRows {
    /// Entries of a row.
    pub entries: f64,
    /// Entries of a row with one a patch: hits of sampled rows added up.
    pub distinct: f64,
    /// Bytes of a row as it was made.
    pub bytes: f64,
    /// Share of rows that have any entry.
    pub seeing: f64,
}

impl SampleOfRows {
    /// The most that rows may take, without making any, if the engine knows.
    #[must_use]
    pub fn at_most(engine: &dyn Engine) -> Option<Self> {
        let entries = engine.most_entries()?;
        let bytes = entries * entry_bytes(&Weights::Each(Vec::new())) as f64;
        Some(Self { entries, distinct: entries, bytes, seeing: 1.0 })
    }

    /// Makes some rows of `patches`, spread evenly over their ids.
    pub fn of(engine: &mut dyn Engine, patches: &Patches) -> Result<Self, EngineError> {
        let ids: Vec<PatchId> =
            patches.ids().step_by(patches.len().div_ceil(ROWS).max(1)).collect();
        let mut rows = vec![Row::default(); ids.len()];
        engine.fill(&ids, &mut rows)?;
        let mean = |sum: u64| sum as f64 / ids.len().max(1) as f64;
        let entries = rows.iter().map(|r| r.columns.len() as u64).sum();
        let bytes = rows.iter().map(|r| r.columns.len() as u64 * entry_bytes(&r.weights)).sum();
        let seeing = rows.iter().filter(|r| !r.columns.is_empty()).count() as u64;
        let distinct = |row: &mut Row| {
            row.columns.sort_unstable();
            row.columns.dedup();
            row.columns.len() as u64
        };
        let distinct = rows.iter_mut().map(distinct).sum();
        Ok(Self {
            entries: mean(entries),
            distinct: mean(distinct),
            bytes: mean(bytes),
            seeing: mean(seeing),
        })
    }
}
