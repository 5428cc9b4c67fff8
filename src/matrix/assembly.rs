//! How the rows of a matrix come about: kept in memory, or handed on to a store.

use super::forecast::Forecast;
use super::options::MatrixOptions;
use super::storage::{RowStore, Storage};
use crate::engines::{AssembleError, Engine, PairsReport};
use crate::form_factors::{
    Account, FormFactors, RowAccount, RowBlock, RowSink, RowsReport, SinkError, Tallied, drop_below,
};
use crate::patches::{PatchId, Patches};
use crate::progress::Progress;

/// All rows, as they were made.
pub(super) struct Assembled {
    pub storage: Storage,
    /// Sum of each row's entries.
    pub sums: Vec<f64>,
    /// Rows that lose more than half to backs.
    pub covered: Vec<PatchId>,
    /// Where the threshold has been applied already: what restores each row's sum.
    pub restored: Option<Vec<f64>>,
    pub pairs: Option<PairsReport>,
    pub account: RowsReport,
    pub lost: Option<(f64, (PatchId, f64))>,
}

/// Has a row of every patch made: in memory, or for the store. `areas` (m²) are those of the
/// patches.
pub(super) fn assemble(
    engine: &mut dyn Engine,
    patches: &Patches,
    areas: &[f64],
    options: &MatrixOptions,
    (forecast, store): (&Forecast, Option<Box<dyn RowStore>>),
    progress: &dyn Progress,
) -> Result<Assembled, AssembleError> {
    let n = patches.len();
    let before = engine.pairs();
    progress.stage("form factors", n as u64);
    let ids: Vec<PatchId> = patches.ids().collect();
    let mut account = Account::new(areas, &ids);
    let (storage, restored) = match store {
        None => {
            let mut factors = FormFactors::new(n, forecast.room());
            engine.make(&ids, &mut Tallied::new(&mut factors, n), progress)?;
            account.add_all(&factors);
            (Storage::Memory(factors), None)
        }
        Some(mut store) => {
            let mut passing = Passing {
                store: &mut *store,
                account: &mut account,
                threshold: options.threshold,
                accounts: vec![RowAccount::default(); n],
                restored: vec![1.0; n],
                entries: 0,
            };
            engine.make(&ids, &mut Tallied::new(&mut passing, n), progress)?;
            let Passing { accounts, restored, entries, .. } = passing;
            (Storage::Store { store, accounts, entries }, Some(restored))
        }
    };
    // Rows of the forecast do not count.
    let pairs = before.zip(engine.pairs()).map(|(before, after)| PairsReport {
        evaluated: after.evaluated - before.evaluated,
        partly_hidden: after.partly_hidden - before.partly_hidden,
        shadow_rays: after.shadow_rays - before.shadow_rays,
        ..after
    });
    let (report, lost) = (account.report(), account.lost());
    let Account { sums, covered, .. } = account;
    Ok(Assembled { storage, sums, covered, restored, pairs, account: report, lost })
}

/// Thins out blocks of rows and hands them on.
struct Passing<'a, 'b> {
    store: &'a mut dyn RowStore,
    account: &'a mut Account<'b>,
    threshold: f64,
    accounts: Vec<RowAccount>,
    restored: Vec<f64>,
    entries: u64,
}

impl RowSink for Passing<'_, '_> {
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        for (k, (&id, &account)) in block.ids.iter().zip(&block.accounts).enumerate() {
            self.account.add(id, block.row(k), account);
            self.accounts[id.index()] = account;
        }
        if self.threshold == 0.0 {
            self.entries += block.entries() as u64;
            return self.store.take(block);
        }
        let ids = block.ids.clone();
        let mut rows = FormFactors::new(self.accounts.len(), u64::MAX);
        rows.take(block)?;
        let restored = drop_below(&mut rows, self.threshold)?;
        self.entries += rows.entries();
        ids.iter().for_each(|id| self.restored[id.index()] = restored[id.index()]);
        rows.into_blocks().try_for_each(|block| self.store.take(block))
    }
}
