//! Rows as plain numbers, one entry a patch: what a matrix is made of, whatever the engine.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::block::RowBlock;
use super::rows::{ONE, Row, Weights};
use super::sink::{RowSink, SinkError};
use super::tally::Tally;

/// Takes rows of any form and hands them on as [`Weights::Each`] in ascending order of columns: the
/// hits of sampled rows are added up.
pub struct Tallied<'a> {
    sink: &'a mut dyn RowSink,
    adder: Adder,
}

/// Adds up the hits of rows.
struct Adder {
    patches: usize,
    /// Room for sums, for each thread.
    tallies: Mutex<Vec<Tally<u32>>>,
}

impl<'a> Tallied<'a> {
    /// Hands the rows of `patches` patches on to `sink`.
    pub fn new(sink: &'a mut dyn RowSink, patches: usize) -> Self {
        Self { sink, adder: Adder { patches, tallies: Mutex::default() } }
    }
}

impl Adder {
    /// The rows of a block whose weights are all alike.
    fn added_up(&self, block: &RowBlock, rays: u32) -> Result<RowBlock, SinkError> {
        let locked = || self.tallies.lock().unwrap_or_else(PoisonError::into_inner);
        let row = |k: usize| {
            let mut tally = locked().pop().unwrap_or_default();
            tally.resize(self.patches);
            block.row(k).columns.iter().for_each(|&j| tally.add(j.0, 1));
            let (mut columns, mut hits) = (Vec::new(), Vec::new());
            tally.write(&mut columns, &mut hits);
            locked().push(tally);
            let factor = |hits| (f64::from(hits) / f64::from(rays)) as f32;
            Row {
                columns,
                weights: Weights::Each(hits.into_iter().map(factor).collect()),
                ..Row::of_account(block.accounts[k])
            }
        };
        let rows: Vec<Row> = (0..block.len()).into_par_iter().map(row).collect();
        Ok(RowBlock::of(&block.ids, &rows)?)
    }
}

impl RowSink for Tallied<'_> {
    fn take(&mut self, mut block: RowBlock) -> Result<(), SinkError> {
        match &mut block.weights {
            Weights::Each(_) => {}
            Weights::Fixed(w) => {
                let factor = |w: &u32| (f64::from(*w) / f64::from(ONE)) as f32;
                block.weights = Weights::Each(w.par_iter().map(factor).collect());
            }
            Weights::Equal { rays, .. } => {
                let rays = *rays;
                block = self.adder.added_up(&block, rays)?;
            }
        }
        self.sink.take(block)
    }

    fn room(&self) -> Option<u64> {
        self.sink.room()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::FormFactors;
    use crate::patches::PatchId;

    #[test]
    fn rows_of_every_form_become_plain_numbers_with_one_entry_a_patch() {
        let row = |columns: &[u32], weights| Row {
            columns: columns.iter().map(|&j| PatchId(j)).collect(),
            weights,
            back: 0.25,
            ..Row::default()
        };
        let rows = [
            row(&[2, 0, 2, 2, 1, 2], Weights::Equal { entries: 6, rays: 8 }),
            row(&[0, 2], Weights::Fixed(vec![ONE / 8, ONE / 2])),
            row(&[0, 2], Weights::Each(vec![0.125, 0.5])),
        ];
        let mut factors = FormFactors::new(3, 1 << 10);
        let mut tallied = Tallied::new(&mut factors, 3);
        for (i, row) in (0..).zip(rows) {
            tallied.take(RowBlock::of(&[PatchId(i)], &[row]).unwrap()).unwrap();
        }
        let plain = factors.plain_rows();
        let columns = |of: &[u32]| -> Vec<PatchId> { of.iter().map(|&j| PatchId(j)).collect() };
        assert_eq!(plain[0], (&columns(&[0, 1, 2])[..], &[0.125, 0.125, 0.5][..]));
        assert_eq!(plain[1], (&columns(&[0, 2])[..], &[0.125, 0.5][..]));
        assert_eq!(plain[2], plain[1]);
        assert_eq!(factors.account(PatchId(1)).back, 0.25);
    }
}
