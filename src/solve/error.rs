//! Why there is no solution.

use thiserror::Error;

use crate::progress::Cancelled;
use crate::ranks::RanksError;
use crate::units::Bytes;

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// The residual did not fall below the tolerance.
    #[error(
        "the solver did not converge: residual {residual:.2e} after {iterations} iterations, \
         {tolerance:.0e} wanted"
    )]
    NoConvergence {
        /// Iterations made.
        iterations: u32,
        /// Residual reached.
        residual: f64,
        /// Residual wanted.
        tolerance: f64,
    },
    /// The dense matrix of [`Direct`](super::Method::Direct) does not fit in memory.
    #[error(
        "solving {patches} patches exactly takes {}, {} are allowed",
        Bytes(*needed), Bytes(*allowed)
    )]
    TooLarge {
        /// Patches with a row: unknowns of the system.
        patches: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// Processes that share the work cannot go on.
    #[error(transparent)]
    Ranks(#[from] RanksError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}
