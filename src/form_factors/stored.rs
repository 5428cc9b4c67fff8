//! The matrix of form factors, kept row by row.

use std::sync::Arc;

use super::block::{RowBlock, RowView};
use super::rows::RowAccount;
use super::sink::{RowSink, SinkError};
use crate::patches::PatchId;
use crate::ranks::Ranks;

/// Rows of form factors in memory. A patch that nobody asked for has no row; its entries are zero.
///
/// Where [ranks](crate::ranks) share the work, each has the entries of its own rows alone, and of
/// the others' the account.
#[derive(Debug, Clone)]
pub struct FormFactors {
    pub(super) blocks: Vec<Arc<RowBlock>>,
    /// Block and row within it of each patch.
    pub(super) place: Vec<Option<(u32, u32)>>,
    pub(super) limit: u64,
    pub(super) half: Half,
    pub(super) ranks: Ranks,
}

/// Which entries of sampled rows count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Half {
    Both,
    First,
    Second,
}

impl FormFactors {
    /// Room for the rows of `patches` patches in at most `limit` bytes.
    #[must_use]
    pub fn new(patches: usize, limit: u64) -> Self {
        Self::of_ranks(patches, limit, Ranks::default())
    }

    /// The same where `ranks` share the work, and the limit is that of each.
    #[must_use]
    pub fn of_ranks(patches: usize, limit: u64, ranks: Ranks) -> Self {
        Self { blocks: Vec::new(), place: vec![None; patches], limit, half: Half::Both, ranks }
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
        self.blocks.iter().map(|b| b.entries() as u64).sum()
    }

    /// Bytes that they take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.blocks.iter().map(|b| b.bytes()).sum()
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
        self.place[id.index()].map_or(RowAccount::default(), |(block, row)| {
            self.blocks[block as usize].accounts[row as usize]
        })
    }

    /// A patch's row.
    #[must_use]
    #[inline]
    pub fn row(&self, id: PatchId) -> Option<RowView<'_>> {
        let (block, row) = self.place[id.index()]?;
        Some(self.blocks[block as usize].row(row as usize))
    }

    /// The form factor from patch `i` to patch `j`.
    #[must_use]
    pub fn factor(&self, i: PatchId, j: PatchId) -> f64 {
        self.row(i).map_or(0.0, |r| r.factor_to(j))
    }

    /// Sum of a row's entries, without its account.
    #[must_use]
    pub fn row_sum(&self, id: PatchId) -> f64 {
        self.row(id).map_or(0.0, |r| r.sum())
    }

    /// The rows as they were taken.
    pub(crate) fn into_blocks(self) -> impl Iterator<Item = RowBlock> {
        self.blocks.into_iter().map(Arc::unwrap_or_clone)
    }

    /// Keeps a block.
    pub(super) fn keep(&mut self, block: RowBlock) {
        for (row, id) in (0..).zip(&block.ids) {
            self.place[id.index()] = Some((self.blocks.len() as u32, row));
        }
        self.blocks.push(Arc::new(block));
    }

    /// Fails if the rows with `more` bytes would take more than is allowed.
    pub(super) fn within_limit(&self, more: u64) -> Result<(), SinkError> {
        if self.bytes() + more > self.limit {
            return Err(SinkError::Memory { allowed: self.limit });
        }
        Ok(())
    }
}

impl RowSink for FormFactors {
    /// Keeps the rows without copying them.
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        self.within_limit(block.bytes())?;
        self.keep(block);
        Ok(())
    }

    fn room(&self) -> Option<u64> {
        Some(self.limit.saturating_sub(self.bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{ONE, Row, Weights};
    use crate::scene::Rgb;

    fn row(columns: &[u32], weights: Weights) -> Row {
        Row {
            columns: columns.iter().map(|&j| PatchId(j)).collect(),
            weights,
            lost: 0.25,
            ..Row::default()
        }
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
            f.take(RowBlock::of(&[PatchId(0), PatchId(2)], &rows).unwrap()).unwrap();
            check(&f);
        }
    }
}
