//! Rows that ranks share: each makes those of its own strips, and hears of the others what lighting
//! needs of them.

use rayon::prelude::*;

use super::block::RowBlock;
use super::rows::{RowAccount, Weights};
use super::stored::FormFactors;
use crate::patches::PatchId;
use crate::ranks::{Ranks, RanksError, Wire, strips};
use crate::scene::Rgb;

impl FormFactors {
    /// Who shares the work.
    #[must_use]
    pub fn ranks(&self) -> &Ranks {
        &self.ranks
    }

    /// All patches.
    pub(crate) fn ids(&self) -> Vec<PatchId> {
        (0..self.len() as u32).map(PatchId).collect()
    }

    /// Number of rows that are this rank's work: of others' it has no entries.
    #[must_use]
    pub fn own_rows(&self) -> usize {
        let ids = self.ids();
        self.own(&ids).into_iter().flatten().filter(|i| self.has_row(**i)).count()
    }

    /// The patches of each strip among some, ascending; alone all in one.
    fn parts<'a>(&self, ids: &'a [PatchId]) -> Vec<&'a [PatchId]> {
        if self.ranks.is_alone() {
            return vec![ids];
        }
        let before = |end: usize| ids.partition_point(|i| i.index() < end);
        strips(self.len()).map(|strip| &ids[before(strip.start)..before(strip.end)]).collect()
    }

    /// Of some patches, ascending, those of each strip that is this rank's work.
    pub(crate) fn own<'a>(&self, ids: &'a [PatchId]) -> Vec<&'a [PatchId]> {
        self.ranks.own(self.parts(ids)).filter(|part| !part.is_empty()).collect()
    }

    /// A value for each of some patches, ascending, of which each rank found those of its
    /// [own](Self::own).
    pub(crate) fn share<T: Wire>(
        &self,
        ids: &[PatchId],
        own: Vec<T>,
    ) -> Result<Vec<T>, RanksError> {
        let counts: Vec<usize> = self.parts(ids).iter().map(|part| part.len()).collect();
        self.ranks.share(&counts, own)
    }

    /// A value for each patch, likewise, in what precision suits results that need not be better
    /// than `tolerance`, a share of the whole.
    pub(crate) fn share_values(
        &self,
        own: Vec<Rgb>,
        tolerance: f64,
    ) -> Result<Vec<Rgb>, RanksError> {
        /// Rounding to single precision is far below this, whatever is reflected how often.
        const SINGLE: f64 = 1e-5;
        if self.ranks.is_alone() {
            return Ok(own);
        }
        let ids = self.ids();
        if tolerance >= SINGLE {
            let own = own.iter().map(|v| v.as_vec3().to_array()).collect();
            let all = self.share::<[f32; 3]>(&ids, own)?;
            return Ok(all.into_iter().map(|v| Rgb::from_array(v.map(f64::from))).collect());
        }
        self.share_exactly(own)
    }

    /// The same to the last bit.
    pub(crate) fn share_exactly(&self, own: Vec<Rgb>) -> Result<Vec<Rgb>, RanksError> {
        if self.ranks.is_alone() {
            return Ok(own);
        }
        let own = own.iter().map(|v| v.to_array()).collect();
        Ok(self.share(&self.ids(), own)?.into_iter().map(Rgb::from_array).collect())
    }

    /// What is found of each patch from its row, of all that are this rank's work.
    pub(crate) fn of_own(&self, find: impl Fn(PatchId) -> Rgb + Sync) -> Vec<Rgb> {
        let ids = self.ids();
        self.own(&ids).into_par_iter().flatten().map(|&i| find(i)).collect()
    }

    /// Lets all ranks know the accounts of some patches' rows, ascending, of which each has made
    /// its own.
    pub(crate) fn share_accounts(&mut self, ids: &[PatchId]) -> Result<(), RanksError> {
        if self.ranks.is_alone() {
            return Ok(());
        }
        let account = |&i: &PatchId| {
            let RowAccount { environment, back, lost } = self.account(i);
            [environment, back, lost, self.rays(i)]
        };
        let own = self.own(ids).into_iter().flatten().map(account).collect();
        let accounts = self.share::<[f64; 4]>(ids, own)?;
        let mut others = RowBlock { starts: vec![0], ..RowBlock::default() };
        for (&id, [environment, back, lost, rays]) in ids.iter().zip(accounts) {
            if !self.has_row(id) {
                others.ids.push(id);
                others.accounts.push(RowAccount { environment, back, lost });
                others.starts.push(0);
                others.halves.push(0);
                others.weights = Weights::Equal { entries: 0, rays: rays as u32 };
            }
        }
        if !others.is_empty() {
            self.keep(others);
        }
        Ok(())
    }

    /// Rays of a patch's row; 0 if it is not sampled.
    fn rays(&self, id: PatchId) -> f64 {
        match self.row(id).map(|row| row.weights) {
            Some(Weights::Equal { rays, .. }) => f64::from(*rays),
            _ => 0.0,
        }
    }

    /// How many entries each of some rows has, ascending, and how many its first half.
    pub(crate) fn lengths(&self, ids: &[PatchId]) -> Result<Vec<[u32; 2]>, RanksError> {
        let own = self.own(ids).into_iter().flatten();
        self.share(ids, own.map(|&i| self.lengths_of(i)).collect())
    }

    /// The same of one row that is here.
    pub(crate) fn lengths_of(&self, id: PatchId) -> [u32; 2] {
        let entries = self.row(id).map_or(0, |row| row.columns.len());
        [entries, self.half_of_row(id).unwrap_or(0)].map(|n| n as u32)
    }

    /// What some rows see, ascending, one after the other: for rank 0, while the others ask for the
    /// same. `lengths` are [theirs](Self::lengths).
    pub(crate) fn columns(
        &self,
        ids: &[PatchId],
        lengths: &[[u32; 2]],
    ) -> Result<Vec<u32>, RanksError> {
        let mut lengths = lengths.iter().map(|l| l[0] as usize);
        let counts: Vec<usize> =
            self.parts(ids).iter().map(|part| lengths.by_ref().take(part.len()).sum()).collect();
        let own = self.own(ids).into_iter().flatten().filter_map(|&i| self.row(i));
        self.ranks.collect(&counts, own.flat_map(|r| r.columns.iter().map(|j| j.0)).collect())
    }
}
