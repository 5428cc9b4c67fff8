//! Progress and cancellation: one small trait that the caller gives in.

use std::error::Error;

/// The caller asked the work to stop. Every error of long work can be this, at some depth:
/// [`is_cancelled`] tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Hears how far work is, and may stop it.
///
/// The library never prints: a program shows what it hears here.
pub trait Progress: Sync {
    /// A stage begins that will [`advance`](Progress::advance) by `total` units in all (0 if
    /// unknown).
    fn stage(&self, name: &str, total: u64);

    /// `n` more units are done.
    ///
    /// # Errors
    /// [`Cancelled`] asks the work to stop as soon as it can.
    fn advance(&self, n: u64) -> Result<(), Cancelled>;

    /// Something about the result that the user should know: what is left out of it, and how much.
    fn warn(&self, message: &str) {
        let _ = message;
    }
}

/// Hears nothing and never stops.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, _n: u64) -> Result<(), Cancelled> {
        Ok(())
    }
}

/// Whether an error, or what caused it, is that the caller [cancelled](Cancelled).
#[must_use]
pub fn is_cancelled(error: &(dyn Error + 'static)) -> bool {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if error.is::<Cancelled>() {
            return true;
        }
        cause = error.source();
    }
    false
}
