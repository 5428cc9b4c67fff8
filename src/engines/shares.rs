//! The whole matrix: a row of every patch, whatever the light, with one entry a pair.

use std::sync::Mutex;
use std::sync::PoisonError;

use rayon::prelude::*;

use super::engine::{AssembleError, Engine, assemble};
use crate::form_factors::tally::Tally;
use crate::form_factors::{FormFactors, Row, RowSink, SinkError, Weights};
use crate::patches::{PatchId, Patches};
use crate::progress::Progress;

/// Has the rows of all patches made and kept in at most `limit` bytes, as shares
/// ([`Weights::Each`]) in ascending order of columns: the hits of sampled rows are added up, one
/// entry a patch. Advances `progress` by one a row.
pub fn assemble_whole(
    engine: &mut dyn Engine,
    patches: &Patches,
    limit: u64,
    progress: &dyn Progress,
) -> Result<FormFactors, AssembleError> {
    let mut factors = FormFactors::new(patches.len(), limit);
    assemble_shares(engine, patches, &mut factors, progress)?;
    Ok(factors)
}

/// The same with the rows handed to `sink`, in order, block by block.
pub fn assemble_shares(
    engine: &mut dyn Engine,
    patches: &Patches,
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let ids: Vec<PatchId> = patches.ids().collect();
    let shares = Shares { tallies: Mutex::default(), patches: patches.len() };
    let mut whole = Whole { sink, shares };
    assemble(engine, &ids, &mut whole, progress)
}

/// Takes rows of any form and hands them on as shares.
struct Whole<'a> {
    sink: &'a mut dyn RowSink,
    shares: Shares,
}

/// Makes shares of rows of any form.
struct Shares {
    /// Room to add up hits, for each thread.
    tallies: Mutex<Vec<Tally<u32>>>,
    patches: usize,
}

impl RowSink for Whole<'_> {
    fn take(&mut self, ids: &[PatchId], rows: &[Row]) -> Result<(), SinkError> {
        let shares = &self.shares;
        let shares: Vec<Row> = rows.par_iter().map(|row| shares.of(row)).collect();
        self.sink.take(ids, &shares)
    }
}

impl Shares {
    fn of(&self, row: &Row) -> Row {
        let mut columns = row.columns.clone();
        let weights = match &row.weights {
            Weights::Each(w) => w.clone(),
            Weights::Fixed(w) => (0..w.len()).map(|k| row.weights.get(k) as f32).collect(),
            Weights::Equal { rays, .. } => self.added_up(row, *rays, &mut columns),
        };
        Row { columns, weights: Weights::Each(weights), half: 0, ..row.clone_account() }
    }

    fn added_up(&self, row: &Row, rays: u32, columns: &mut Vec<u32>) -> Vec<f32> {
        let locked = || self.tallies.lock().unwrap_or_else(PoisonError::into_inner);
        let mut tally = locked().pop().unwrap_or_default();
        tally.resize(self.patches);
        row.columns.iter().for_each(|&j| tally.add(j, 1));
        let mut hits = Vec::new();
        tally.write(columns, &mut hits);
        locked().push(tally);
        hits.into_iter().map(|hits| (f64::from(hits) / f64::from(rays)) as f32).collect()
    }
}

impl Row {
    /// A row without entries that has the same account.
    fn clone_account(&self) -> Self {
        let Self { environment, back, lost, .. } = *self;
        Self { environment, back, lost, ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_every_form_become_shares_with_one_entry_a_patch() {
        let one = crate::form_factors::ONE;
        let row = |columns: &[u32], weights| Row {
            columns: columns.to_vec(),
            weights,
            back: 0.25,
            ..Row::default()
        };
        let rows = [
            row(&[2, 0, 2, 2, 1, 2], Weights::Equal { entries: 6, rays: 8 }),
            row(&[0, 2], Weights::Fixed(vec![one / 8, one / 2])),
            row(&[0, 2], Weights::Each(vec![0.125, 0.5])),
        ];
        let mut factors = FormFactors::new(3, 1 << 10);
        let mut whole =
            Whole { sink: &mut factors, shares: Shares { tallies: Mutex::default(), patches: 3 } };
        whole.take(&[PatchId(0), PatchId(1), PatchId(2)], &rows).unwrap();
        let shares = factors.shares();
        assert_eq!(shares[0], (&[0, 1, 2][..], &[0.125, 0.125, 0.5][..]));
        assert_eq!(shares[1], (&[0, 2][..], &[0.125, 0.5][..]));
        assert_eq!(shares[2], shares[1]);
        assert_eq!(factors.account(PatchId(1)).back, 0.25);
    }
}
