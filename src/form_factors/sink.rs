//! Where rows go.

use std::collections::TryReserveError;
use std::io;

use thiserror::Error;

use super::block::RowBlock;
use crate::ranks::RanksError;
use crate::units::Bytes;

/// Takes rows as engines make them.
pub trait RowSink: Send {
    /// Takes a block of rows. Blocks come in any order, each patch's row once.
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError>;

    /// Bytes that rows may take where they are kept in memory; `None` if they are passed on. An
    /// engine that makes rows together may hold as much until it hands them over.
    fn room(&self) -> Option<u64> {
        None
    }
}

/// Why rows could not be taken.
#[derive(Debug, Error)]
pub enum SinkError {
    /// The rows do not fit in the memory allowed.
    #[error("the form factors take more than {}", Bytes(*allowed))]
    Memory {
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// The system has no more memory.
    #[error("out of memory: {0}")]
    Allocation(#[from] TryReserveError),
    /// Where rows are kept outside memory, that failed.
    #[error(transparent)]
    Store(io::Error),
    /// Where processes share the rows, they cannot go on.
    #[error(transparent)]
    Ranks(#[from] RanksError),
}
