//! Rows that are looked at and changed in the memory that they have, where they are stored as plain
//! numbers ([`Weights::Each`]), or thinned out.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::{RowBlock, RowView};
use super::rows::Weights;
use super::sink::SinkError;
use super::stored::FormFactors;
use crate::patches::PatchId;

/// The columns of a row and its weights.
pub(crate) type RowMut<'a> = (&'a [PatchId], &'a mut [f32]);

impl FormFactors {
    /// The same rows with the entries of those patches alone that `keep` names. Accounts stay as
    /// they are.
    pub(crate) fn thinned(&self, keep: impl Fn(PatchId) -> bool + Sync) -> Self {
        let of_block = |block: &Arc<RowBlock>| {
            let kept = |k: usize| keep(block.columns[k]);
            let mut starts = vec![0];
            let (mut halves, mut entries) = (Vec::new(), Vec::new());
            for (row, ends) in block.starts.windows(2).enumerate() {
                let half = block.halves.get(row).copied();
                let middle = half.unwrap_or(ends[1]);
                entries.extend((ends[0]..middle).filter(|&k| kept(k)));
                halves.extend(half.map(|_| entries.len()));
                entries.extend((middle..ends[1]).filter(|&k| kept(k)));
                starts.push(entries.len());
            }
            Arc::new(RowBlock {
                ids: block.ids.clone(),
                accounts: block.accounts.clone(),
                starts,
                halves,
                columns: entries.iter().map(|&k| block.columns[k]).collect(),
                weights: block.weights.of(&entries),
            })
        };
        let blocks = self.blocks.par_iter().map(of_block).collect();
        let (place, ranks) = (self.place.clone(), self.ranks.clone());
        Self { blocks, place, ranks, limit: self.limit, half: self.half }
    }

    /// All rows by patch, their weights to be changed; patches without a row have an empty one, as
    /// have those whose weights are not [`Weights::Each`].
    pub(crate) fn plain_rows_mut(&mut self) -> Vec<RowMut<'_>> {
        let mut blocks: Vec<Vec<Option<RowMut<'_>>>> = self
            .blocks
            .iter_mut()
            .map(|block| {
                let block = Arc::make_mut(block);
                let Weights::Each(weights) = &mut block.weights else { return Vec::new() };
                let (mut columns, mut weights) = (&block.columns[..], &mut weights[..]);
                let split = |ends: &[usize]| {
                    let (now, later) = columns.split_at(ends[1] - ends[0]);
                    columns = later;
                    let (w, rest) = std::mem::take(&mut weights).split_at_mut(now.len());
                    weights = rest;
                    Some((now, w))
                };
                block.starts.windows(2).map(split).collect()
            })
            .collect();
        let mut row = |place: &Option<(u32, u32)>| {
            let (block, row) = (*place)?;
            blocks[block as usize].get_mut(row as usize)?.take()
        };
        self.place.iter().map(|p| row(p).unwrap_or_default()).collect()
    }

    /// All rows by patch, as in [`plain_rows_mut`](Self::plain_rows_mut).
    pub(crate) fn plain_rows(&self) -> Vec<(&[PatchId], &[f32])> {
        (0..self.len() as u32).map(|i| self.plain_row(PatchId(i))).collect()
    }

    /// A patch's row, likewise.
    pub(crate) fn plain_row<'a>(&'a self, id: PatchId) -> (&'a [PatchId], &'a [f32]) {
        let row = |row: RowView<'a>| {
            let Weights::Each(weights) = row.weights else { return None };
            Some((row.columns, &weights[row.range()]))
        };
        self.row(id).and_then(row).unwrap_or_default()
    }

    /// Makes every row anew, block by block: `write` appends what becomes of a row's columns and
    /// weights. All weights are [`Weights::Each`] before and after.
    pub(crate) fn rewrite(
        &mut self,
        write: impl Fn(PatchId, &[PatchId], &[f32], &mut Vec<PatchId>, &mut Vec<f32>) + Sync,
    ) -> Result<(), SinkError> {
        self.blocks.par_iter_mut().for_each(|block| {
            let Weights::Each(old) = &block.weights else { return };
            let (mut columns, mut weights, mut starts) = (Vec::new(), Vec::new(), vec![0]);
            for (ends, &id) in block.starts.windows(2).zip(&block.ids) {
                let range = ends[0]..ends[1];
                write(id, &block.columns[range.clone()], &old[range], &mut columns, &mut weights);
                starts.push(columns.len());
            }
            columns.shrink_to_fit();
            weights.shrink_to_fit();
            let weights = Weights::Each(weights);
            let (ids, accounts) = (block.ids.clone(), block.accounts.clone());
            let halves = Vec::new();
            *block = Arc::new(RowBlock { ids, accounts, starts, halves, columns, weights });
        });
        self.within_limit(0)
    }
}
