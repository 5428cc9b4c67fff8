//! Chance that can be repeated.

use std::ops::Range;

/// Numbers that follow from a seed (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
/// generators").
pub struct Random(u64);

impl Random {
    /// Those of one case of a kind of input.
    pub fn of(seed: u64, kind: &str, number: u64) -> Self {
        let mut random = Self(seed);
        for byte in kind.bytes() {
            random.0 = random.next() ^ u64::from(byte);
        }
        random.0 = random.next() ^ number;
        random
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number below `count`; 0 if there is none.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    /// True once in so many times.
    pub fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// One of several; there must be one.
    pub fn pick<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }

    /// A place in so many things; every other time near their beginning, where headers are.
    pub fn place(&mut self, count: usize) -> usize {
        let near = if self.one_in(2) { count.min(128) } else { count };
        self.below(near)
    }

    /// Some of so many things that follow each other; mostly few.
    pub fn piece(&mut self, count: usize) -> Range<usize> {
        let from = self.place(count);
        let most = 1 << self.below(12);
        from..(from + 1 + self.below(most)).min(count)
    }
}
