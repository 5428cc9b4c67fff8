//! The seam between who makes rows and who takes them.

use serde::Serialize;
use thiserror::Error;

use super::hemicube::HemicubeError;
#[cfg(feature = "gpu")]
use super::hemicube_gpu::GpuError;
use crate::form_factors::{BLOCK, Row, RowBlock, RowSink, SinkError};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};

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

    /// Whether a row is the view from the patch's centre, so that it serves every mesh with a patch
    /// of that centre; otherwise it is a mean over the patch.
    fn sees_from_centres(&self) -> bool {
        false
    }

    /// The most entries that rows may have on average, nearly, if it is known without making any.
    fn most_entries(&self) -> Option<f64> {
        None
    }

    /// What was done pair by pair so far, by an engine that evaluates pairs of patches for both
    /// their rows: all rows together cost it less than many one by one.
    fn pairs(&self) -> Option<PairsReport> {
        None
    }

    /// How many rows it makes in a fraction of a second: the caller can stop it after them.
    fn rows_before_a_stop(&self) -> usize {
        BLOCK
    }

    /// Makes one row for each of `rows`, in `out` of the same length. The result does not depend on
    /// the number of threads, and but for rounding it does not depend on which rows are made with
    /// each other: sampled ones share packets of rays.
    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError>;

    /// Makes the rows of `ids` and hands them to `sink`, block by block; advances `progress` by one
    /// a row. The rows are those of [`fill`](Self::fill).
    fn make(
        &mut self,
        ids: &[PatchId],
        sink: &mut dyn RowSink,
        progress: &dyn Progress,
    ) -> Result<(), AssembleError> {
        in_blocks(self, ids, sink, progress)
    }
}

/// No engine has more rows than this under way at once.
pub const ROWS_AT_ONCE: usize = 4 * BLOCK;

/// Makes rows in the order of `ids`, some at a time.
pub(super) fn in_blocks<E: Engine + ?Sized>(
    engine: &mut E,
    ids: &[PatchId],
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let room = || vec![Row::default(); BLOCK.min(ids.len())];
    let (mut next, mut made) = (room(), room());
    let mut last: &[PatchId] = &[];
    // The sink takes one block while the engine makes the next.
    for block in ids.chunks(BLOCK).chain([&[][..]]) {
        let taking = || match last.is_empty() {
            true => Ok(()),
            false => sink.take(RowBlock::of(last, &made[..last.len()])?),
        };
        let part = engine.rows_before_a_stop().clamp(1, BLOCK);
        let filling = || -> Result<(), AssembleError> {
            for (ids, rows) in block.chunks(part).zip(next.chunks_mut(part)) {
                engine.fill(ids, &mut rows[..ids.len()])?;
                progress.advance(0)?;
            }
            Ok(())
        };
        let (filled, taken) = rayon::join(filling, taking);
        filled?;
        taken?;
        progress.advance(last.len() as u64)?;
        std::mem::swap(&mut next, &mut made);
        last = block;
    }
    Ok(())
}

/// Pairs of patches evaluated one by one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairsReport {
    /// Pairs that exchange anything; through a file, those of different bands count twice.
    pub evaluated: u64,
    /// Those of them with something in between that may hide a part.
    pub partly_hidden: u64,
    /// Rays that were to tell how much it hides.
    pub shadow_rays: u64,
    /// Estimate of the root-mean-square error of the form factors over their root-mean-square, 0 or
    /// more: as the points and rays that visible fractions come from tell by their differences,
    /// raised where rows lose more, where one exceeds 1 by more, or where other rays prove more.
    pub error: f64,
    /// How far coordinates are taken to be rounded, m: planes of neighbours that are closer are
    /// one, and what lies closer touches.
    pub rounding: f64,
}

/// Why an engine cannot be had, or could not make rows.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EngineError {
    /// The hemicubes' options are wrong.
    #[error(transparent)]
    Hemicube(#[from] HemicubeError),
    /// The graphics device cannot be used.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A device failed.
    #[error("{0}")]
    Device(String),
    /// Patches are clusters of source triangles, which this engine cannot use.
    #[error("the {0} engine cannot use clusters of source triangles")]
    Clusters(&'static str),
    /// Pairs that were evaluated elsewhere cannot be had, or are not this model's.
    #[error("{0}")]
    Found(String),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// Why the rows of a matrix were not made.
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
