//! Why a matrix was not made.

use thiserror::Error;

use super::stored::SameWith;
use crate::engines::{AssembleError, EngineError};
use crate::form_factors::SinkError;
use crate::patches::PatchesError;
use crate::progress::Cancelled;
use crate::units::Bytes;

/// Why a matrix was not made.
#[derive(Debug, Error)]
pub enum MatrixError {
    /// The model could not be subdivided.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// The engine cannot be had, or failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The rows could not be kept.
    #[error(transparent)]
    Sink(#[from] SinkError),
    /// The model is to be an enclosure, and is inside out.
    #[error("most faces see nothing while their backs see surfaces: the normals point outwards")]
    InsideOut,
    /// The matrix is not that of an enclosure.
    #[error("the model is no enclosure: {0} lose more than 1 % to the environment or to backs")]
    Open(String),
    /// No scales close the matrix.
    #[error("no scaling makes all rows sum to 1; furthest off are {0}")]
    Stalled(String),
    /// The model is not the one that the [plan](super::Plan) was made for.
    #[error("is not the model that the plan was made for ({scene})")]
    Foreign {
        /// The scene that it was made for.
        scene: String,
        /// What would make it this geometry's, if anything does.
        same_with: Option<SameWith>,
    },
    /// Patches or tiles of the model are not those of the plan.
    #[error("the plan is of other patches than this version makes of the model: make it anew")]
    Replan,
    /// A plan is for the exact engine alone.
    #[error("only the exact engine makes a matrix in parts")]
    Parts,
    /// There is no such row.
    #[error("there is no row {row}: the matrix has {rows}, counted from 0")]
    NoRow {
        /// The number that was asked for.
        row: usize,
        /// Number of rows.
        rows: usize,
    },
    /// The engine does not say what escapes, which closing the matrix needs to know.
    #[error("the classical engine does not know what escapes, so its matrix cannot be closed")]
    NoAccount,
    /// It does not fit in memory.
    #[error(
        "the form factors of {patches} patches take about {}, {} are allowed",
        Bytes(*needed), Bytes(*allowed)
    )]
    Memory {
        /// Number of patches.
        patches: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
        /// Whether its rows need not be in memory at all, but can go to a store
        /// ([`make_where`](super::make_where)).
        can_go_to_a_store: bool,
    },
    /// The caller found out from the [`Forecast`](super::Forecast) that it does not want it.
    #[error("{0}")]
    Unwanted(String),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

impl From<AssembleError> for MatrixError {
    fn from(error: AssembleError) -> Self {
        match error {
            AssembleError::Engine(e) => e.into(),
            AssembleError::Sink(e) => e.into(),
            AssembleError::Cancelled(e) => e.into(),
        }
    }
}
