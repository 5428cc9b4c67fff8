//! Rows of a coarser mesh: columns that belong to one patch are added up.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::block::{RowBlock, RowView};
use super::rows::Weights;
use super::stored::{FormFactors, Half};
use super::tally::Tally;
use crate::patches::PatchId;

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

    /// Adds up the entries of `columns` by `patch_of`, their weights being those `at` a range.
    fn merge(
        &mut self,
        columns: &[PatchId],
        weights: &Weights,
        at: Range<usize>,
        patch_of: &[u32],
        (merged, sums): &mut (Vec<PatchId>, Weights),
    ) {
        let patches = columns.iter().map(|j| patch_of[j.index()]);
        match weights {
            Weights::Fixed(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| self.fixed.add(patch, w));
                let mut fixed = match std::mem::take(sums) {
                    Weights::Fixed(sums) => sums,
                    _ => Vec::new(),
                };
                self.fixed.write(merged, &mut fixed);
                *sums = Weights::Fixed(fixed);
            }
            Weights::Each(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| self.each.add(patch, f64::from(w)));
                let mut each = Vec::new();
                self.each.write(merged, &mut each);
                *sums = Weights::Each(each.into_iter().map(|w| w as f32).collect());
            }
            Weights::Equal { rays, .. } => {
                let entries = patches.filter(|&patch| patch != u32::MAX);
                entries.for_each(|patch| self.fixed.add(patch, 1));
                let (mut hits, share) = (Vec::new(), 1.0 / *rays as f32);
                self.fixed.write(merged, &mut hits);
                *sums = Weights::Each(hits.into_iter().map(|hits| hits as f32 * share).collect());
            }
        }
    }
}

impl RowView<'_> {
    /// The row with the columns that are parts of one patch added up: `patch_of` each column, or
    /// `u32::MAX` to leave it out. Fixed-point sums are exact.
    pub fn merged(&self, patch_of: &[u32], merger: &mut Merger) -> (Vec<PatchId>, Weights) {
        let mut merged = (Vec::new(), Weights::default());
        merger.merge(self.columns, self.weights, self.range(), patch_of, &mut merged);
        merged
    }
}

impl RowBlock {
    /// The same rows with the columns that are parts of one patch added up, in the same memory if
    /// weights keep their form.
    fn merged(mut self, patch_of: &[u32], merger: &mut Merger) -> Self {
        let mut row = (Vec::new(), Weights::default());
        let (mut end, mut others) = (0, Weights::default());
        for r in 0..self.starts.len() - 1 {
            let at = self.starts[r]..self.starts[r + 1];
            let columns = &self.columns[at.clone()];
            merger.merge(columns, &self.weights, at, patch_of, &mut row);
            // A row is never longer than what it is made of.
            self.starts[r] = end;
            self.columns[end..end + row.0.len()].copy_from_slice(&row.0);
            match (&mut self.weights, &row.1) {
                (Weights::Fixed(all), Weights::Fixed(w)) => {
                    all[end..end + w.len()].copy_from_slice(w);
                }
                (Weights::Each(all), Weights::Each(w)) => {
                    all[end..end + w.len()].copy_from_slice(w);
                }
                (_, w) => others.append(w),
            }
            end += row.0.len();
        }
        if let Some(last) = self.starts.last_mut() {
            *last = end;
        }
        self.columns.truncate(end);
        self.halves.clear();
        match &mut self.weights {
            Weights::Fixed(w) => w.truncate(end),
            Weights::Each(w) => w.truncate(end),
            Weights::Equal { .. } => self.weights = others,
        }
        self
    }
}

impl FormFactors {
    /// The rows of a mesh of `patches` that coarsens the one that these are of: columns that are
    /// parts of one patch are added up, `patch_of` each, and the row of a patch is that of
    /// `row_of(patch)`, a part of it. Takes the memory of the old rows.
    #[must_use]
    pub fn merged(
        self,
        patches: usize,
        patch_of: &[u32],
        row_of: impl Fn(PatchId) -> PatchId,
    ) -> Self {
        let place = |i| self.place[row_of(PatchId(i)).index()];
        let place = (0..patches as u32).map(place).collect();
        let blocks: Vec<Arc<RowBlock>> = self
            .blocks
            .into_par_iter()
            .map_init(
                || Merger::new(patches),
                |merger, block| Arc::new(Arc::unwrap_or_clone(block).merged(patch_of, merger)),
            )
            .collect();
        Self { blocks, place, limit: self.limit, half: Half::Both, ranks: self.ranks }
    }
}
