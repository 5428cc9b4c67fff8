//! Pairs of patches, evaluated on all threads: tile by tile of the hierarchy.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::model::Model;
use super::tile::{Counts, Task, Work};
use crate::patches::PatchId;

/// Evaluates pairs, and adds up what that took.
pub(super) struct Pairs<'a> {
    pub model: Model<'a>,
    /// The error that is worked towards.
    error: f64,
    seed: u32,
    /// How many times more shadow rays than usual pairs get.
    pub scale: f64,
    work: Mutex<Vec<Work>>,
    counts: Mutex<Counts>,
}

/// What some patches exchange with each, in m².
pub(super) struct ExchangeRows {
    /// Which row is of a place in the order of the tree.
    row_of: Vec<u32>,
    /// By the ids of patches.
    rows: Vec<Vec<f32>>,
}

impl ExchangeRows {
    /// The row of the patch at a place in the order of the tree, if it was asked for.
    pub fn of(&self, place: usize) -> &[f32] {
        self.rows.get(self.row_of[place] as usize).map_or(&[], |row| row)
    }
}

impl<'a> Pairs<'a> {
    pub fn new(model: Model<'a>, error: f64, seed: u32) -> Self {
        let (work, counts) = (Mutex::default(), Mutex::default());
        Self { model, error, seed, scale: 1.0, work, counts }
    }

    /// How the pairs of wanted patches are evaluated, or all.
    pub fn task<'b>(&'b self, wanted: Option<&'b [bool]>) -> Task<'b> {
        let Self { model, error, seed, scale, .. } = self;
        Task { model, error: *error, scale: *scale, seed: *seed, wanted }
    }

    /// Hands over `(i, j, S)` of the pairs of two tiles that exchange anything.
    pub fn tile(&self, task: &Task<'_>, [a, b]: [u32; 2], each: impl FnMut(usize, usize, f32)) {
        let all = || self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let reused = all().pop();
        let mut work = reused.unwrap_or_default();
        task.tile(a, b, &mut work, each);
        let counts = std::mem::take(&mut work.counts);
        let mut sum = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        *sum = sum.and(counts);
        drop(sum);
        all().push(work);
    }

    /// The pairs of tiles that hold pairs of wanted patches.
    pub fn tiles(&self, wanted: &[bool]) -> Vec<[u32; 2]> {
        let tree = &self.model.tree;
        let asked = |t: u32| {
            let node = &tree.nodes[t as usize];
            wanted[node.from as usize..node.to as usize].iter().any(|&w| w)
        };
        let asked: Vec<(u32, bool)> = tree.tiles.iter().map(|&t| (t, asked(t))).collect();
        let mut tiles = Vec::new();
        for (k, &(a, all)) in asked.iter().enumerate() {
            tiles.extend(asked[k..].iter().filter(|b| all || b.1).map(|&(b, _)| [a, b]));
        }
        tiles
    }

    /// What patches exchange with each.
    pub fn rows(&self, ids: &[PatchId]) -> ExchangeRows {
        let n = self.model.len();
        let mut wanted = vec![false; n];
        let mut row_of = vec![u32::MAX; n];
        for (k, id) in (0..).zip(ids) {
            let place = self.model.place[id.index()] as usize;
            (wanted[place], row_of[place]) = (true, k);
        }
        let order = &self.model.tree.order;
        let mut rows: Vec<Vec<f32>> = vec![vec![0.0; n]; ids.len()];
        let task = self.task(Some(&wanted));
        let mut found: Vec<Vec<(u32, u32, f32)>> = Vec::new();
        for tiles in self.tiles(&wanted).chunks(256) {
            tiles
                .par_iter()
                .map(|&tiles| {
                    let mut entries = Vec::new();
                    self.tile(&task, tiles, |i, j, s| entries.push((i as u32, j as u32, s)));
                    entries
                })
                .collect_into_vec(&mut found);
            for &(i, j, s) in found.iter().flatten() {
                for (from, to) in [(i, j), (j, i)] {
                    if let Some(row) = rows.get_mut(row_of[from as usize] as usize) {
                        row[order[to as usize] as usize] = s;
                    }
                }
            }
        }
        ExchangeRows { row_of, rows }
    }

    /// What was done so far.
    pub fn counts(&self) -> Counts {
        *self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was done so far, which is forgotten.
    pub fn take_counts(&self) -> Counts {
        std::mem::take(&mut *self.counts.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
