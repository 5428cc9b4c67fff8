//! Rows one after another, as they flow from an engine into a sink and are kept there.

use std::collections::TryReserveError;
use std::ops::Range;

use super::rows::{Row, RowAccount, Weights, factor_to};
use crate::patches::PatchId;

/// Rows flow from engine to sink in blocks of about this many.
pub const BLOCK: usize = 256;

/// Some rows, one after another.
#[derive(Debug, Clone, Default)]
pub struct RowBlock {
    /// The patches whose rows these are.
    pub ids: Vec<PatchId>,
    /// What each row holds beside its entries.
    pub accounts: Vec<RowAccount>,
    /// Where each row begins, and where the last ends.
    pub(crate) starts: Vec<usize>,
    /// Where the second half of each row begins; empty if rows are not sampled.
    pub(crate) halves: Vec<usize>,
    /// The patches that the rows see.
    pub(crate) columns: Vec<PatchId>,
    /// The form factor to each.
    pub(crate) weights: Weights,
}

/// One row of a block.
#[derive(Debug, Clone, Copy)]
pub struct RowView<'a> {
    /// The patches seen, as in a [`Row`].
    pub columns: &'a [PatchId],
    /// The weights of the block.
    pub(crate) weights: &'a Weights,
    /// Where the row begins in it.
    pub(crate) start: usize,
}

impl RowView<'_> {
    /// Patches and form factors in turn.
    pub fn entries(&self) -> impl Iterator<Item = (PatchId, f64)> + '_ {
        let weight = |k| self.weights.get(self.start + k);
        self.columns.iter().enumerate().map(move |(k, &j)| (j, weight(k)))
    }

    /// The form factor to one patch.
    #[must_use]
    pub fn factor_to(&self, j: PatchId) -> f64 {
        factor_to(self.columns, j, |k| self.weights.get(self.start + k), self.weights)
    }

    /// Sum of the form factors.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.entries().map(|e| e.1).sum()
    }

    /// Bytes that the entries take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.columns.len() as u64 * entry_bytes(self.weights)
    }

    /// Where it lies in its block.
    pub(crate) fn range(&self) -> Range<usize> {
        self.start..self.start + self.columns.len()
    }
}

impl RowBlock {
    /// The `rows` of the patches `ids`.
    ///
    /// # Errors
    /// If the system has no more memory.
    pub fn of(ids: &[PatchId], rows: &[Row]) -> Result<Self, TryReserveError> {
        let entries: usize = rows.iter().map(|r| r.columns.len()).sum();
        let mut me = Self { ids: ids.to_vec(), starts: vec![0], ..Self::default() };
        me.columns.try_reserve_exact(entries)?;
        if let Some(Weights::Each(_)) = rows.first().map(|r| &r.weights) {
            me.weights = Weights::Each(Vec::new());
        }
        me.weights.try_reserve_exact(entries)?;
        for row in rows {
            if let Weights::Equal { .. } = row.weights {
                me.halves.push(me.columns.len() + row.half);
            }
            me.columns.extend_from_slice(&row.columns);
            me.weights.append(&row.weights);
            me.starts.push(me.columns.len());
            me.accounts.push(row.account());
        }
        Ok(me)
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Number of entries of all rows.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Bytes that the entries take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.columns.len() as u64 * entry_bytes(&self.weights)
    }

    /// The same without rows that repeat the one before.
    pub(super) fn without_repeats(self) -> Self {
        if self.ids.windows(2).all(|w| w[0] != w[1]) {
            return self;
        }
        let mut me = Self { starts: vec![0], ..Self::default() };
        let mut entries = Vec::new();
        for (k, &id) in self.ids.iter().enumerate() {
            if me.ids.last() == Some(&id) {
                continue;
            }
            let (from, to) = (self.starts[k], self.starts[k + 1]);
            me.ids.push(id);
            me.accounts.push(self.accounts[k]);
            me.halves.extend(self.halves.get(k).map(|half| entries.len() + half - from));
            entries.extend(from..to);
            me.starts.push(entries.len());
        }
        me.columns = entries.iter().map(|&k| self.columns[k]).collect();
        me.weights = self.weights.of(&entries);
        me
    }

    /// Row `k` of the block.
    #[must_use]
    pub fn row(&self, k: usize) -> RowView<'_> {
        let (from, to) = (self.starts[k], self.starts[k + 1]);
        RowView { columns: &self.columns[from..to], weights: &self.weights, start: from }
    }
}

/// Bytes of one stored entry: column and weight.
#[must_use]
pub fn entry_bytes(weights: &Weights) -> u64 {
    size_of::<PatchId>() as u64 + weights.bytes()
}
