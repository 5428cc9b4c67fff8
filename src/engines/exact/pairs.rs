//! Pairs of patches, evaluated on all threads: tile by tile of the hierarchy.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::effort::Effort;
use super::model::Model;
use super::places::{Place, TileId, Wanted};
use super::tally::PairsTally;
use super::tile::{Task, TileBuffers};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};

/// Evaluates pairs, and adds up what was done.
pub(super) struct Pairs<'a> {
    pub model: Model<'a>,
    pub effort: Effort,
    seed: u32,
    buffers: Mutex<Vec<TileBuffers>>,
    tally: Mutex<PairsTally>,
}

/// What pairs of patches exchange, in m².
type Exchanged = Vec<(Place, Place, f32)>;

/// What some patches exchange with each, in m².
pub(super) struct ExchangeRows {
    /// Which row is of a place.
    row_of: Vec<u32>,
    /// By the ids of patches.
    rows: Vec<Vec<f32>>,
}

impl ExchangeRows {
    /// The row of the patch at a place; empty if it was not asked for.
    pub fn of(&self, at: Place) -> &[f32] {
        self.rows.get(self.row_of[at.index()] as usize).map_or(&[], |row| row)
    }
}

impl<'a> Pairs<'a> {
    pub fn new(model: Model<'a>, error: f64, seed: u32) -> Self {
        let effort = Effort { error, scale: 1.0 };
        Self { model, effort, seed, buffers: Mutex::default(), tally: Mutex::default() }
    }

    /// How the pairs of wanted patches are evaluated.
    pub fn task<'b>(&'b self, wanted: Wanted<'b>) -> Task<'b> {
        Task { model: &self.model, effort: self.effort, seed: self.seed, wanted }
    }

    /// Hands over `(i, j, S)` of the pairs of two tiles that exchange anything.
    pub fn tile(&self, task: &Task<'_>, tiles: [TileId; 2], each: impl FnMut(Place, Place, f32)) {
        let all = || self.buffers.lock().unwrap_or_else(PoisonError::into_inner);
        let reused = all().pop();
        let mut buffers = reused.unwrap_or_default();
        task.tile(tiles, &mut buffers, each);
        let tally = std::mem::take(&mut buffers.tally);
        self.add_tally(tally);
        all().push(buffers);
    }

    /// The pairs of tiles that hold pairs of wanted patches.
    pub fn tiles(&self, wanted: &[bool]) -> Vec<[TileId; 2]> {
        let tree = &self.model.tree;
        let asked = |tile: TileId| wanted[tree.tile(tile).range()].iter().any(|&w| w);
        let asked: Vec<(TileId, bool)> = tree.tiles().map(|tile| (tile, asked(tile))).collect();
        let mut tiles = Vec::new();
        for (k, &(a, all)) in asked.iter().enumerate() {
            tiles.extend(asked[k..].iter().filter(|b| all || b.1).map(|&(b, _)| [a, b]));
        }
        tiles
    }

    /// What patches exchange with each.
    pub fn rows(
        &self,
        ids: &[PatchId],
        progress: &dyn Progress,
    ) -> Result<ExchangeRows, Cancelled> {
        self.exchange(ids, |wanted| Wanted::Rows(wanted), progress)
    }

    /// Nearly what patches exchange with each.
    pub fn sample(
        &self,
        ids: &[PatchId],
        progress: &dyn Progress,
    ) -> Result<ExchangeRows, Cancelled> {
        self.exchange(ids, |wanted| Wanted::Sample(wanted), progress)
    }

    fn exchange(
        &self,
        ids: &[PatchId],
        how: fn(&[bool]) -> Wanted<'_>,
        progress: &dyn Progress,
    ) -> Result<ExchangeRows, Cancelled> {
        let n = self.model.len();
        let mut wanted = vec![false; n];
        let mut row_of = vec![u32::MAX; n];
        for (k, &id) in (0..).zip(ids) {
            let at = self.model.place(id).index();
            (wanted[at], row_of[at]) = (true, k);
        }
        let order = &self.model.tree.order;
        let mut rows: Vec<Vec<f32>> = vec![vec![0.0; n]; ids.len()];
        let task = self.task(how(&wanted));
        for tiles in self.tiles(&wanted).chunks(256) {
            let found: Result<Vec<Exchanged>, Cancelled> = tiles
                .par_iter()
                .map(|&tiles| {
                    progress.advance(0)?;
                    let mut entries = Vec::new();
                    self.tile(&task, tiles, |i, j, s| entries.push((i, j, s)));
                    Ok(entries)
                })
                .collect();
            for &(i, j, s) in found?.iter().flatten() {
                for (from, to) in [(i, j), (j, i)] {
                    if let Some(row) = rows.get_mut(row_of[from.index()] as usize) {
                        row[order[to.index()].index()] = s;
                    }
                }
            }
        }
        Ok(ExchangeRows { row_of, rows })
    }

    /// Adds what was done elsewhere.
    pub fn add_tally(&self, more: PairsTally) {
        let mut sum = self.tally.lock().unwrap_or_else(PoisonError::into_inner);
        *sum = sum.and(more);
    }

    /// What was done so far.
    pub fn tally(&self) -> PairsTally {
        *self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was done so far, which is forgotten.
    pub fn take_tally(&self) -> PairsTally {
        std::mem::take(&mut *self.tally.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
