//! Progress of one piece of the work: a stretch of the bar.

use std::sync::atomic::{AtomicU64, Ordering};

use hemicube::progress::{Cancelled, Progress};

use crate::failure::Failure;
use crate::terminal::Bar;

/// A stretch of the bar.
pub struct Stretch<'a> {
    bar: &'a Bar,
    weight: u64,
    total: u64,
    done: AtomicU64,
}

impl<'a> Stretch<'a> {
    /// `weight` units of the bar for `total` units of work.
    pub fn new(bar: &'a Bar, weight: u64, total: usize) -> Self {
        Self { bar, weight, total: (total as u64).max(1), done: AtomicU64::new(0) }
    }

    /// The work is done, however much it was.
    pub fn finish(&self) -> Result<(), Failure> {
        Ok(self.advance(self.total)?)
    }
}

impl Progress for Stretch<'_> {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, n: u64) -> Result<(), Cancelled> {
        let before = self.done.fetch_add(n, Ordering::Relaxed);
        let reached = |done: u64| self.weight * done.min(self.total) / self.total;
        self.bar.advance(reached(before + n) - reached(before))
    }
}
