//! Why a matrix cannot be closed.

use thiserror::Error;

use crate::form_factors::sink::SinkError;
use crate::patches::PatchId;
use crate::progress::Cancelled;

/// Why a matrix cannot be closed.
#[derive(Debug, Error)]
pub enum ClosureError {
    /// Rows lose more than [`OPEN`](super::OPEN) to the environment and to backs: each with that
    /// share.
    #[error("{} patches lose more than 1 % to the environment or to backs", .0.len())]
    Open(Vec<(PatchId, f64)>),
    /// No scales make these rows sum to 1: the worst, each with the sum that it keeps.
    #[error("no scaling closes {} patches", .0.len())]
    Stalled(Vec<(PatchId, f64)>),
    /// No memory.
    #[error(transparent)]
    Sink(#[from] SinkError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}
