//! Changes to rows that are stored as shares ([`Weights::Each`]), in the memory that they have.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Block, FormFactors, Part, RowAccount, entry_bytes};
use crate::form_factors::Weights;
use crate::form_factors::rows::{Row, SinkError};
use crate::patches::PatchId;

/// The columns of a row and its weights.
pub(crate) type RowMut<'a> = (&'a [u32], &'a mut [f32]);

impl FormFactors {
    /// The rows of some of `patches` patches, in at most `limit` bytes: which, and what each holds beside
    /// its entries; where in `columns` and `weights` each begins, and where the last ends. Takes the
    /// memory that these have.
    pub(crate) fn of_shares(
        patches: usize,
        limit: u64,
        (ids, accounts): (&[PatchId], &[RowAccount]),
        starts: Vec<usize>,
        columns: Vec<u32>,
        weights: Vec<f32>,
    ) -> Result<Self, SinkError> {
        let mut me = Self::new(patches, limit);
        for (row, (id, account)) in (0..).zip(ids.iter().zip(accounts)) {
            me.place[id.index()] = Some((0, row));
            me.accounts[id.index()] = *account;
        }
        let weights = Weights::Each(weights);
        me.entries = columns.len() as u64;
        me.bytes = me.entries * entry_bytes(&weights);
        me.part = Part::All;
        me.blocks.push(Arc::new(Block { starts, halves: Vec::new(), columns, weights }));
        me.within_limit(0)?;
        Ok(me)
    }

    /// All rows by patch, their weights to be changed; patches without a row have an empty one, as have
    /// those whose weights are not [`Weights::Each`].
    pub(crate) fn rows_mut(&mut self) -> Vec<RowMut<'_>> {
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

    /// All rows by patch, as in [`rows_mut`](Self::rows_mut).
    pub(crate) fn shares(&self) -> Vec<(&[u32], &[f32])> {
        (0..self.len() as u32).map(|i| self.share(PatchId(i))).collect()
    }

    /// A patch's row, likewise.
    pub(crate) fn share(&self, id: PatchId) -> (&[u32], &[f32]) {
        let row = |&(block, row): &(u32, u32)| {
            let block = &self.blocks[block as usize];
            let range = block.starts[row as usize]..block.starts[row as usize + 1];
            let Weights::Each(weights) = &block.weights else { return None };
            Some((&block.columns[range.clone()], &weights[range]))
        };
        self.place[id.index()].as_ref().and_then(row).unwrap_or_default()
    }

    /// A patch's row to be handed on, likewise.
    pub(crate) fn row_of_shares(&self, id: PatchId) -> Row {
        let ((columns, weights), account) = (self.share(id), self.account(id));
        Row {
            columns: columns.to_vec(),
            weights: Weights::Each(weights.to_vec()),
            half: 0,
            environment: account.environment,
            back: account.back,
            lost: account.lost,
        }
    }

    /// Makes every row anew, block by block: `write` appends what becomes of a row's columns and
    /// weights. All weights are [`Weights::Each`] before and after.
    pub(crate) fn rewrite(
        &mut self,
        write: impl Fn(PatchId, &[u32], &[f32], &mut Vec<u32>, &mut Vec<f32>) + Sync,
    ) -> Result<(), SinkError> {
        let mut ids: Vec<Vec<PatchId>> =
            self.blocks.iter().map(|b| vec![PatchId(0); b.starts.len() - 1]).collect();
        for (id, place) in self.place.iter().enumerate() {
            if let Some((block, row)) = *place {
                ids[block as usize][row as usize] = PatchId(id as u32);
            }
        }
        self.blocks.par_iter_mut().zip(ids).for_each(|(block, ids)| {
            let Weights::Each(old) = &block.weights else { return };
            let (mut columns, mut weights, mut starts) = (Vec::new(), Vec::new(), vec![0]);
            for (ends, id) in block.starts.windows(2).zip(ids) {
                let range = ends[0]..ends[1];
                write(id, &block.columns[range.clone()], &old[range], &mut columns, &mut weights);
                starts.push(columns.len());
            }
            columns.shrink_to_fit();
            weights.shrink_to_fit();
            let weights = Weights::Each(weights);
            *block = Arc::new(Block { starts, halves: Vec::new(), columns, weights });
        });
        self.entries = self.blocks.iter().map(|b| b.columns.len() as u64).sum();
        self.bytes =
            self.blocks.iter().map(|b| b.columns.len() as u64 * entry_bytes(&b.weights)).sum();
        self.within_limit(0)
    }

    /// Fails if the rows with `more` bytes would take more than is allowed.
    pub(crate) fn within_limit(&self, more: u64) -> Result<(), SinkError> {
        if self.bytes + more > self.limit {
            return Err(SinkError::Memory { limit_mib: self.limit >> 20 });
        }
        Ok(())
    }
}
