//! Progress and cancellation: one small trait that the caller gives in.

use std::ops::ControlFlow;

/// Hears how long work proceeds and may stop it.
///
/// The library never prints: a program shows what it hears here, and returns
/// [`ControlFlow::Break`] from [`advance`](Progress::advance) to cancel.
pub trait Progress: Sync {
    /// A stage begins that will [`advance`](Progress::advance) by `total` units in all (0 if unknown).
    fn stage(&self, name: &str, total: u64);

    /// `n` more units are done. `Break` asks the work to stop as soon as it can.
    fn advance(&self, n: u64) -> ControlFlow<()>;
}

/// Hears nothing and never stops.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, _n: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
