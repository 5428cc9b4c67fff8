//! Why a scene could not be lit.

use thiserror::Error;

use crate::engines::{AssembleError, EngineError};
use crate::form_factors::SinkError;
use crate::patches::PatchesError;
use crate::progress::Cancelled;
use crate::ranks::RanksError;
use crate::refine::factor::RefineError;
use crate::solve::SolveError;
use crate::units::Bytes;

/// Why a scene could not be lit.
#[derive(Debug, Error)]
pub enum LightError {
    /// It could not be subdivided.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// The adaptive subdivision failed.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The engine cannot be had, or failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The rows could not be kept.
    #[error(transparent)]
    Sink(#[from] SinkError),
    /// The system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Processes that share the work cannot go on.
    #[error(transparent)]
    Ranks(#[from] RanksError),
    /// What is asked for is done by one process alone.
    #[error(
        "several processes share rows of sampled rays alone, without adaptive subdivision, and \
         solve by Gauss-Seidel"
    )]
    Alone,
    /// The engine does not know how much of the sky a patch sees.
    #[error("the classical engine knows no sky")]
    NoSky,
    /// It would not fit in memory.
    #[error(
        "{patches} patches take about {}, {} are allowed", Bytes(*needed), Bytes(*allowed)
    )]
    Memory {
        /// Number of patches.
        patches: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
        /// A patch size that should fit, m², where a larger one helps.
        proposal: Option<f64>,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

impl From<AssembleError> for LightError {
    fn from(error: AssembleError) -> Self {
        match error {
            AssembleError::Engine(e) => e.into(),
            AssembleError::Sink(e) => e.into(),
            AssembleError::Cancelled(e) => e.into(),
        }
    }
}
