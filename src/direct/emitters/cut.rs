//! A cut through the hierarchy of emitters, in blocks of vectors.

use std::ops::Range;

use super::lanes::{Block, Entry};
use crate::simd::LANES;

/// Nodes of the hierarchy that stand for all emitters, as seen by receivers that lie together.
#[derive(Debug, Default)]
pub(super) struct Cut {
    pub blocks: Vec<Block>,
    /// Sources of each entry.
    pub sources: Vec<[(u32, u32); LANES]>,
    /// Groups that are seen: number, and blocks.
    pub groups: Vec<(usize, Range<usize>)>,
    /// Entries in use of the last block.
    used: usize,
}

impl Cut {
    /// Forgets all entries.
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.sources.clear();
        self.groups.clear();
    }

    /// Begins a group, whose entries fill blocks of their own; yields its first block.
    pub fn begin(&mut self) -> usize {
        self.used = LANES;
        self.blocks.len()
    }

    /// Ends group `number`, which begins at block `first`; one without entries is not seen.
    pub fn end(&mut self, number: usize, first: usize) {
        if self.blocks.len() > first {
            self.groups.push((number, first..self.blocks.len()));
        }
    }

    /// Adds an entry to the group; `analytic`: for all receivers, whatever its unit.
    pub fn push(&mut self, entry: &Entry, sources: &Range<u32>, analytic: bool) {
        if self.used == LANES {
            self.blocks.push(Block::EMPTY);
            self.sources.push([(0, 0); LANES]);
            self.used = 0;
        }
        let (at, l) = (self.blocks.len() - 1, self.used);
        self.blocks[at].set(l, entry, analytic);
        self.sources[at][l] = (sources.start, sources.end);
        self.used += 1;
    }
}

/// A group of emitters as a receiver sees it.
pub(super) struct Group<'a> {
    pub number: usize,
    pub cut: &'a Cut,
    /// Its blocks in the cut.
    pub blocks: Range<usize>,
}

impl Group<'_> {
    /// About what it may send to the receiver at most: the sum of its weights.
    pub fn sum(&self, sums: &[f32]) -> f64 {
        sums[self.blocks.clone()].iter().map(|b| f64::from(*b)).sum()
    }
}
