//! The matrix of form factors, kept row by row, and the driver that has it made.

use std::ops::ControlFlow;

use thiserror::Error;

use super::rows::{Engine, EngineError, Row, RowSink, SinkError, Weights};
use super::tally::Tally;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::scene::Rgb;

/// What a row holds beside its entries.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RowAccount {
    /// Share that escapes.
    pub environment: f64,
    /// Share that ends on backs which do not reflect.
    pub back: f64,
    /// Share lost numerically.
    pub lost: f64,
}

/// Rows of form factors in memory. A patch that nobody asked for has no row; its entries are zero.
#[derive(Debug, Clone)]
pub struct FormFactors {
    blocks: Vec<Block>,
    /// Block and row within it of each patch.
    place: Vec<Option<(u32, u32)>>,
    accounts: Vec<RowAccount>,
    entries: u64,
    limit: u64,
}

#[derive(Debug, Clone)]
struct Block {
    /// Where each row begins, and where the last ends.
    starts: Vec<usize>,
    columns: Vec<u32>,
    weights: Weights,
}

/// One stored row.
#[derive(Debug, Clone, Copy)]
pub struct StoredRow<'a> {
    /// The patches seen, ascending.
    pub columns: &'a [u32],
    weights: &'a Weights,
    start: usize,
}

impl StoredRow<'_> {
    /// The row with the columns that are parts of one patch added up: `patch_of` each column, or
    /// `u32::MAX` to leave it out. Fixed-point sums are exact.
    pub fn merged(&self, patch_of: &[u32], merger: &mut Merger) -> (Vec<u32>, Weights) {
        let at = self.start..self.start + self.columns.len();
        let patches = self.columns.iter().map(|&j| patch_of[j as usize]);
        let (mut columns, mut fixed, mut each) = (Vec::new(), Vec::new(), Vec::new());
        match self.weights {
            Weights::Fixed(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| merger.fixed.add(patch, w));
                merger.fixed.write(&mut columns, &mut fixed);
                (columns, Weights::Fixed(fixed))
            }
            Weights::Each(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| merger.each.add(patch, f64::from(w)));
                merger.each.write(&mut columns, &mut each);
                (columns, Weights::Each(each.into_iter().map(|w| w as f32).collect()))
            }
        }
    }

    /// Patches and form factors in turn.
    pub fn entries(&self) -> impl Iterator<Item = (PatchId, f64)> + '_ {
        self.columns
            .iter()
            .enumerate()
            .map(|(k, &j)| (PatchId(j), self.weights.get(self.start + k)))
    }
}

/// Room to add up the entries of a row that belong to one patch.
#[derive(Debug, Default)]
pub struct Merger {
    fixed: Tally<u32>,
    each: Tally<f64>,
}

impl Merger {
    /// Room for so many patches.
    #[must_use]
    pub fn new(patches: usize) -> Self {
        let mut me = Self::default();
        me.fixed.resize(patches);
        me.each.resize(patches);
        me
    }
}

/// Bytes of one stored entry: column and weight.
pub const ENTRY_BYTES: u64 = 8;

impl FormFactors {
    /// Room for the rows of `patches` patches in at most `limit` bytes.
    #[must_use]
    pub fn new(patches: usize, limit: u64) -> Self {
        Self {
            blocks: Vec::new(),
            place: vec![None; patches],
            accounts: vec![RowAccount::default(); patches],
            entries: 0,
            limit,
        }
    }

    /// Number of patches, with and without a row.
    #[must_use]
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Whether there is no patch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// Number of entries stored.
    #[must_use]
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// Number of rows stored.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.place.iter().flatten().count()
    }

    /// Whether a patch has a row.
    #[must_use]
    pub fn has_row(&self, id: PatchId) -> bool {
        self.place[id.index()].is_some()
    }

    /// What a patch's row holds beside its entries; all zero without a row.
    #[must_use]
    pub fn account(&self, id: PatchId) -> RowAccount {
        self.accounts[id.index()]
    }

    /// A patch's row.
    #[must_use]
    pub fn row(&self, id: PatchId) -> Option<StoredRow<'_>> {
        let (block, row) = self.place[id.index()]?;
        let block = &self.blocks[block as usize];
        let (from, to) = (block.starts[row as usize], block.starts[row as usize + 1]);
        Some(StoredRow { columns: &block.columns[from..to], weights: &block.weights, start: from })
    }

    /// The form factor from patch `i` to patch `j`.
    #[must_use]
    pub fn factor(&self, i: PatchId, j: PatchId) -> f64 {
        self.row(i)
            .and_then(|r| Some(r.weights.get(r.start + r.columns.binary_search(&j.0).ok()?)))
            .unwrap_or(0.0)
    }

    /// `Σ_j F_ij x_j`; zero without a row.
    #[must_use]
    pub fn gather(&self, id: PatchId, x: &[Rgb]) -> Rgb {
        let Some(row) = self.row(id) else { return Rgb::ZERO };
        let (from, to) = (row.start, row.start + row.columns.len());
        match row.weights {
            Weights::Fixed(w) => {
                let mut sum = Rgb::ZERO;
                for (&j, &w) in row.columns.iter().zip(&w[from..to]) {
                    sum += x[j as usize] * f64::from(w);
                }
                sum / f64::from(super::delta::ONE)
            }
            Weights::Each(w) => row
                .columns
                .iter()
                .zip(&w[from..to])
                .map(|(&j, &w)| x[j as usize] * f64::from(w))
                .sum(),
        }
    }

    /// Sum of a row's entries, without its account.
    #[must_use]
    pub fn row_sum(&self, id: PatchId) -> f64 {
        self.row(id).map_or(0.0, |r| r.entries().map(|e| e.1).sum())
    }
}

impl RowSink for FormFactors {
    fn take(&mut self, ids: &[PatchId], rows: &[Row]) -> Result<(), SinkError> {
        let entries: usize = rows.iter().map(|r| r.columns.len()).sum();
        self.entries += entries as u64;
        if self.entries * ENTRY_BYTES > self.limit {
            return Err(SinkError::Memory { limit_mib: self.limit >> 20 });
        }
        let mut starts = vec![0];
        let mut columns = Vec::new();
        columns.try_reserve_exact(entries)?;
        let mut weights = match rows.first().map(|r| &r.weights) {
            Some(Weights::Each(_)) => Weights::Each(Vec::new()),
            _ => Weights::default(),
        };
        weights.try_reserve_exact(entries)?;
        for (row, (&id, r)) in ids.iter().zip(rows).enumerate() {
            columns.extend_from_slice(&r.columns);
            weights.append(&r.weights);
            starts.push(columns.len());
            self.place[id.index()] = Some((self.blocks.len() as u32, row as u32));
            self.accounts[id.index()] =
                RowAccount { environment: r.environment, back: r.back, lost: r.lost };
        }
        self.blocks.push(Block { starts, columns, weights });
        Ok(())
    }
}

/// Why a matrix was not made.
#[derive(Debug, Error)]
pub enum AssembleError {
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The sink failed.
    #[error(transparent)]
    Sink(#[from] SinkError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// Rows flow from engine to sink in blocks of this many.
pub const BLOCK: usize = 256;

/// Has the rows of `ids` made and handed to `sink`, in order, block by block; advances `progress` by
/// one a row.
pub fn assemble(
    engine: &mut dyn Engine,
    ids: &[PatchId],
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let mut rows = vec![Row::default(); BLOCK.min(ids.len())];
    for block in ids.chunks(BLOCK) {
        let rows = &mut rows[..block.len()];
        engine.fill(block, rows)?;
        sink.take(block, rows)?;
        if let ControlFlow::Break(()) = progress.advance(block.len() as u64) {
            return Err(AssembleError::Cancelled);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::delta::ONE;

    fn row(columns: &[u32], weights: Weights) -> Row {
        Row { columns: columns.to_vec(), weights, lost: 0.25, ..Row::default() }
    }

    fn check(f: &FormFactors) {
        let x = [Rgb::splat(1.0), Rgb::new(2.0, 4.0, 8.0), Rgb::splat(8.0)];
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
        assert_eq!((f.len(), f.rows(), f.entries()), (3, 2, 3));
        near(f.factor(PatchId(0), PatchId(1)), 0.5);
        near(f.factor(PatchId(0), PatchId(2)), 0.25);
        near(f.factor(PatchId(2), PatchId(0)), 0.75);
        assert_eq!(f.factor(PatchId(1), PatchId(0)), 0.0);
        near(f.gather(PatchId(0), &x).y, 0.5 * 4.0 + 0.25 * 8.0);
        near(f.gather(PatchId(2), &x).x, 0.75);
        near(f.row_sum(PatchId(0)), 0.75);
        assert_eq!(f.account(PatchId(2)).lost, 0.25);
    }

    #[test]
    fn rows_of_either_form_are_kept_and_gathered() {
        let fixed = |w: &[u32]| Weights::Fixed(w.to_vec());
        let quarter = ONE / 4 + 1;
        let a = [fixed(&[2 * quarter, quarter]), fixed(&[3 * quarter])];
        let b = [Weights::Each(vec![0.5, 0.25]), Weights::Each(vec![0.75])];
        let mixed = [[a[0].clone(), b[1].clone()], [b[0].clone(), a[1].clone()]];
        for [first, second] in [a, b].into_iter().chain(mixed) {
            assert!((first.sum() - 0.75).abs() < 1e-7 && first.len() == 2 && !first.is_empty());
            let mut f = FormFactors::new(3, 1 << 10);
            let rows = [row(&[1, 2], first), row(&[0], second)];
            f.take(&[PatchId(0), PatchId(2)], &rows).unwrap();
            check(&f);
        }
    }
}
