//! Grids of many cell sizes: an item lies in few cells, and a query meets few items.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::scene::hash::{Mixed, mix};

/// A box in `D` dimensions.
#[derive(Debug, Clone, Copy)]
pub struct Bounds<const D: usize> {
    pub low: [f64; D],
    pub high: [f64; D],
}

impl<const D: usize> Bounds<D> {
    /// The box of some points.
    pub fn of(points: impl IntoIterator<Item = [f64; D]>) -> Self {
        let mut b = Self { low: [f64::INFINITY; D], high: [f64::NEG_INFINITY; D] };
        for p in points {
            for (axis, x) in p.into_iter().enumerate() {
                b.low[axis] = b.low[axis].min(x);
                b.high[axis] = b.high[axis].max(x);
            }
        }
        b
    }

    /// Whether two boxes have more than their borders in common.
    pub fn meets(&self, other: &Self) -> bool {
        (0..D).all(|a| self.low[a] < other.high[a] && other.low[a] < self.high[a])
    }

    /// The box made larger on all sides.
    pub fn grown(mut self, by: f64) -> Self {
        for axis in 0..D {
            self.low[axis] -= by;
            self.high[axis] += by;
        }
        self
    }

    /// The power of two that is the smallest cell size not below the longest side.
    fn level(&self) -> i32 {
        let longest = (0..D).map(|a| self.high[a] - self.low[a]).fold(0.0, f64::max);
        // Finer cells would overflow integer coordinates.
        longest.max(f64::MIN_POSITIVE).log2().ceil().clamp(-60.0, 1000.0) as i32
    }

    /// Calls `each` with the key of every cell at a level that the box touches.
    fn cells(&self, salt: u64, level: i32, mut each: impl FnMut(u64)) {
        let size = f64::from(level).exp2();
        let mut from = [0_i64; D];
        let mut to = [0_i64; D];
        for axis in 0..D {
            from[axis] = (self.low[axis] / size).floor() as i64;
            to[axis] = (self.high[axis] / size).floor() as i64;
        }
        let mut at = from;
        loop {
            each(mix(at.iter().map(|&i| i as u64).chain([salt, level as u64])));
            let mut axis = 0;
            loop {
                if axis == D {
                    return;
                }
                if at[axis] < to[axis] {
                    at[axis] += 1;
                    break;
                }
                at[axis] = from[axis];
                axis += 1;
            }
        }
    }
}

/// Items by the cells of their own size that they touch. Items with different salts never meet.
pub struct Grid {
    items: Vec<(u64, u32)>,
    cells: HashMap<u64, (u32, u32), Mixed>,
    levels: Vec<i32>,
}

impl Grid {
    /// A grid of items, each with its salt and bounds.
    pub fn new<const D: usize>(items: &[(u32, u64, Bounds<D>)]) -> Self {
        let mut levels: Vec<i32> = items.iter().map(|(.., b)| b.level()).collect();
        levels.sort_unstable();
        levels.dedup();
        let mut entries: Vec<(u64, u32)> = items
            .par_iter()
            .flat_map_iter(|(id, salt, bounds)| {
                let mut keys = Vec::with_capacity(4);
                bounds.cells(*salt, bounds.level(), |key| keys.push((key, *id)));
                keys
            })
            .collect();
        entries.par_sort_unstable();
        let mut cells = HashMap::with_capacity_and_hasher(entries.len() / 2, Mixed::default());
        let mut start = 0;
        for run in entries.chunk_by(|a, b| a.0 == b.0) {
            cells.insert(run[0].0, (start, start + run.len() as u32));
            start += run.len() as u32;
        }
        Self { items: entries, cells, levels }
    }

    /// Calls `each` with every item at least as large as `bounds` whose cells it touches, perhaps
    /// more than once, until `each` returns false.
    pub fn meet<const D: usize>(
        &self,
        salt: u64,
        bounds: &Bounds<D>,
        mut each: impl FnMut(u32) -> bool,
    ) {
        let own = bounds.level();
        let from = self.levels.partition_point(|&l| l < own);
        let mut go_on = true;
        for &level in &self.levels[from..] {
            bounds.cells(salt, level, |key| {
                let Some(&(start, end)) = self.cells.get(&key) else { return };
                let mut items = self.items[start as usize..end as usize].iter();
                go_on = go_on && items.all(|(_, id)| each(*id));
            });
            if !go_on {
                return;
            }
        }
    }
}
