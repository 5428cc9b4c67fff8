//! How the rows of a matrix come about: foretold from a sample, then made whole or in bands.

use super::held::{Held, Shelf};
use super::ledger::{ENTRY_BYTES, Ledger};
use super::report::PairsReport;
use super::{MatrixError, MatrixOptions};
use crate::engines::{
    AssembleError, Engine, EngineError, Exact, ROWS_AT_ONCE, assemble_shares, assemble_whole,
};
use crate::form_factors::{BLOCK, FormFactors, Row, RowAccount, RowSink, SinkError, drop_below};
use crate::patches::{PatchId, Patches};
use crate::progress::Progress;
use crate::report::EngineReport;
use crate::scene::Geometry;
use crate::solution::EngineOptions;
use crate::visibility::Bvh;

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
    pub in_bands: u64,
    /// Bytes that are allowed.
    pub allowed: u64,
}

impl Forecast {
    /// Whether it fits in memory.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.whole <= self.allowed
    }
}

/// Who makes the rows.
pub(super) enum Maker<'a> {
    /// Each pair once.
    Exact(Box<Exact<'a>>),
    /// Row by row.
    Rows(Box<dyn Engine + 'a>),
}

impl<'a> Maker<'a> {
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        options: &MatrixOptions,
    ) -> Result<Self, MatrixError> {
        Ok(match options.engine {
            EngineOptions::Exact(exact) => {
                Self::Exact(Box::new(Exact::new(geometry, patches, bvh, exact)))
            }
            other => Self::Rows(other.engine(geometry, patches, bvh, options.memory)?),
        })
    }

    fn engine(&mut self) -> &mut (dyn Engine + 'a) {
        match self {
            Self::Exact(exact) => &mut **exact,
            Self::Rows(engine) => &mut **engine,
        }
    }

    /// What the report says of it.
    pub fn report(&mut self, options: &EngineOptions) -> EngineReport {
        options.report(self.engine())
    }

    fn pairs(&self) -> Option<PairsReport> {
        let Self::Exact(exact) = self else { return None };
        let [evaluated, partly_hidden, shadow_rays] = exact.counts();
        Some(PairsReport { evaluated, partly_hidden, shadow_rays, error: exact.estimate() })
    }

    /// Makes a few rows to foretell what all will be like.
    pub fn forecast(
        &mut self,
        patches: &Patches,
        rows: usize,
        allowed: u64,
    ) -> Result<Forecast, MatrixError> {
        /// Rows made beforehand to learn how many entries a row has.
        const SAMPLE: usize = 32;
        /// Bytes a patch takes beside its row: cells, areas, scales, and the sample that reciprocity is
        /// measured on.
        const PATCH_BYTES: u64 = 1000;
        let n = patches.len();
        let at_once = match self {
            Self::Exact(_) => ROWS_AT_ONCE,
            Self::Rows(_) => BLOCK,
        };
        let engine = self.engine();
        let beside = |rows: usize| PATCH_BYTES * n as u64 + engine.bytes(rows.min(n));
        let least = beside(BLOCK);
        if least > allowed {
            return Err(MatrixError::Memory { rows: n, needed: least, allowed, remedy: FEWER });
        }
        let (whole, in_bands) = (beside(at_once), least);
        let ids: Vec<PatchId> = patches.ids().step_by(n.div_ceil(SAMPLE).max(1)).collect();
        let mut made = vec![Row::default(); ids.len()];
        engine.fill(&ids, &mut made).map_err(|e: EngineError| MatrixError::Assemble(e.into()))?;
        let listed: usize = made.iter().map(|row| row.columns.len()).sum();
        let distinct = |row: &mut Row| {
            row.columns.sort_unstable();
            row.columns.dedup();
            row.columns.len()
        };
        let kept: usize = made.iter_mut().map(distinct).sum();
        let of = |entries: usize, rows: usize| {
            (entries as f64 * rows as f64 / ids.len().max(1) as f64) as u64
        };
        // A block is there as it was made, as shares, and as it is kept.
        let under_way = |rows: usize| ENTRY_BYTES * of(listed + 2 * kept, rows.min(n));
        let entries = of(kept, n);
        Ok(Forecast {
            rows,
            entries,
            whole: whole + under_way(at_once) + ENTRY_BYTES * entries,
            in_bands: in_bands + under_way(BLOCK),
            allowed,
        })
    }

    /// Makes all rows: in memory, or in bands that go to the shelf.
    pub fn make(
        &mut self,
        patches: &Patches,
        options: &MatrixOptions,
        forecast: &Forecast,
        shelf: Option<Box<dyn Shelf>>,
        areas: &[f64],
        progress: &dyn Progress,
    ) -> Result<Made, MatrixError> {
        let n = patches.len();
        let before = self.pairs();
        let entries_bytes = ENTRY_BYTES * forecast.entries;
        let limit =
            options.memory - forecast.whole.saturating_sub(entries_bytes).min(options.memory);
        progress.stage("form factors", n as u64);
        let failed = |e: AssembleError| match e {
            AssembleError::Cancelled(cancelled) => cancelled.into(),
            AssembleError::Sink(e) => sink_failure(e, n, options),
            e => MatrixError::Assemble(e),
        };
        let mut ledger = Ledger::new(areas);
        let (held, restored) = match shelf {
            None => {
                let factors = match self {
                    Self::Exact(exact) => exact.matrix(limit, progress),
                    Self::Rows(engine) => assemble_whole(&mut **engine, patches, limit, progress),
                };
                let factors = factors.map_err(failed)?;
                for id in patches.ids() {
                    let (columns, values) = factors.share(id);
                    ledger.add(id, columns, values, factors.account(id));
                }
                (Held::Memory(factors), None)
            }
            Some(mut shelf) => {
                let mut bands = Bands {
                    shelf: &mut *shelf,
                    ledger: &mut ledger,
                    threshold: options.threshold,
                    accounts: vec![RowAccount::default(); n],
                    restored: vec![1.0; n],
                    entries: 0,
                };
                assemble_shares(self.engine(), patches, &mut bands, progress).map_err(failed)?;
                let Bands { accounts, restored, entries, .. } = bands;
                (Held::Shelf { shelf, accounts, entries }, Some(restored))
            }
        };
        let pairs = before.zip(self.pairs()).map(|(before, after)| PairsReport {
            evaluated: after.evaluated - before.evaluated,
            partly_hidden: after.partly_hidden - before.partly_hidden,
            shadow_rays: after.shadow_rays - before.shadow_rays,
            error: after.error,
        });
        let (sums, covered) =
            (std::mem::take(&mut ledger.sums), std::mem::take(&mut ledger.covered));
        Ok(Made {
            held,
            sums,
            covered,
            restored,
            pairs,
            account: ledger.report(),
            lost: ledger.lost(),
        })
    }
}

/// What came of it.
pub(super) struct Made {
    pub held: Held,
    /// Sum of each row's entries as they were made.
    pub sums: Vec<f64>,
    /// Rows that lose more than half to backs.
    pub covered: Vec<PatchId>,
    /// Where the threshold has been applied already: what restores each row's sum.
    pub restored: Option<Vec<f64>>,
    pub pairs: Option<PairsReport>,
    pub account: crate::report::RowsReport,
    pub lost: Option<(f64, (PatchId, f64))>,
}

/// Thins out bands of rows and hands them on.
struct Bands<'a, 'b> {
    shelf: &'a mut dyn Shelf,
    ledger: &'a mut Ledger<'b>,
    threshold: f64,
    accounts: Vec<RowAccount>,
    restored: Vec<f64>,
    entries: u64,
}

impl RowSink for Bands<'_, '_> {
    fn take(&mut self, ids: &[PatchId], rows: &[Row]) -> Result<(), SinkError> {
        let mut band = FormFactors::new(self.accounts.len(), u64::MAX);
        band.take(ids, rows)?;
        for &id in ids {
            let (columns, values) = band.share(id);
            self.ledger.add(id, columns, values, band.account(id));
            self.accounts[id.index()] = band.account(id);
        }
        if self.threshold == 0.0 {
            self.entries += band.entries();
            return self.shelf.take(ids, rows);
        }
        let restored = drop_below(&mut band, self.threshold)?;
        self.entries += band.entries();
        for &id in ids {
            self.restored[id.index()] = restored[id.index()];
            self.shelf.take(&[id], &[band.row_of_shares(id)])?;
        }
        Ok(())
    }
}

/// What to do about a matrix that does not fit.
pub(super) const FEWER: &str = "allow more with --memory, or use fewer patches";

/// The same where it could go to a file.
pub(super) const TO_A_FILE: &str = "allow more with --memory, use fewer patches, or write them to a file with -o, which need not fit";

/// The same where it is to be closed.
pub(super) const NOT_CLOSED: &str = "--enclosure needs them all in memory: allow more with --memory, use fewer \
     patches, or leave --enclosure out, and they go through a file";

pub(super) fn sink_failure(error: SinkError, rows: usize, options: &MatrixOptions) -> MatrixError {
    let allowed = options.memory;
    match error {
        SinkError::Shelf(e) => MatrixError::Shelf(e),
        _ => MatrixError::Memory { rows, needed: allowed, allowed, remedy: FEWER },
    }
}
