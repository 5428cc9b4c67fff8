//! Who makes rows, and how they flow into a sink.

use thiserror::Error;

use crate::form_factors::{BLOCK, Row, RowSink, SinkError};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};

/// Why rows could not be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EngineError {
    /// A device failed.
    #[error("{0}")]
    Device(String),
    /// Patches are clusters of source triangles, which this engine cannot use.
    #[error("--engine {0} cannot use clusters of source triangles; use --cluster off")]
    Clusters(&'static str),
}

/// Makes rows of the matrix of form factors.
pub trait Engine: Send {
    /// Its name, as users know it.
    fn name(&self) -> &'static str;

    /// The device it runs on, in its own words; `None` for the processor.
    fn device(&self) -> Option<String> {
        None
    }

    /// Memory it takes to make `rows` rows at once, in bytes, without the rows themselves.
    fn bytes(&self, rows: usize) -> u64;

    /// Makes one row for each of `rows`, in `out` of the same length. The result depends neither on
    /// how rows are grouped nor on the number of threads.
    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError>;
}

/// Why a matrix was not made.
#[derive(Debug, Error)]
pub enum AssembleError {
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The sink failed.
    #[error(transparent)]
    Sink(#[from] SinkError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// No engine has more rows than this under way at once.
pub const ROWS_AT_ONCE: usize = 4 * BLOCK;

/// Has the rows of `ids` made and handed to `sink`, in order, block by block; advances `progress` by
/// one a row.
pub fn assemble(
    engine: &mut dyn Engine,
    ids: &[PatchId],
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let room = || vec![Row::default(); BLOCK.min(ids.len())];
    let (mut next, mut made) = (room(), room());
    let mut last: &[PatchId] = &[];
    // The sink takes one block while the engine makes the next.
    for block in ids.chunks(BLOCK).chain([&[][..]]) {
        let (filled, taken) = rayon::join(
            || engine.fill(block, &mut next[..block.len()]),
            || if last.is_empty() { Ok(()) } else { sink.take(last, &made[..last.len()]) },
        );
        filled?;
        taken?;
        progress.advance(last.len() as u64)?;
        std::mem::swap(&mut next, &mut made);
        last = block;
    }
    Ok(())
}
