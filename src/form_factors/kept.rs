//! Rows of one rank, and rows that outlive the process which made them.

use std::io;
use std::iter::repeat_n;
use std::slice::Iter;

use super::block::RowBlock;
use super::sink::{RowSink, SinkError};
use super::stored::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::simd::LANES;

/// Keeps rows where a later run finds them.
pub trait KeptRows: Sync {
    /// The rows of just these patches, if they were kept under `key`, which tells all that they
    /// depend on; they are to become part of `factors`. What is there and of no use is warned of.
    fn take_up(
        &self,
        key: &str,
        ids: &[PatchId],
        factors: &FormFactors,
        progress: &dyn Progress,
    ) -> Option<Vec<RowBlock>>;

    /// Keeps the rows of these patches, which `factors` has.
    ///
    /// # Errors
    /// If that is not possible.
    fn keep(&self, key: &str, ids: &[PatchId], factors: &FormFactors) -> io::Result<()>;
}

/// Takes the rows of one rank, and keeps those of each strip once its last one comes.
///
/// Rows that are made together share packets of rays, which are rounded together: so that they are
/// the same whichever strips a rank has, none is made with one of another strip. To that end the
/// [last](Self::padded) of a strip is made several times, and taken once.
pub(crate) struct OwnRows<'a, 'b> {
    /// Where rows go.
    pub factors: &'a mut FormFactors,
    /// Where else, if anywhere, and what they depend on.
    pub kept: Option<(&'b dyn KeptRows, &'b str)>,
    /// The patches of each strip, in the order in which rows come.
    pub parts: Iter<'a, &'b [PatchId]>,
}

impl OwnRows<'_, '_> {
    /// Whose rows to make: of each strip a multiple of those that are made together.
    pub fn padded(&self) -> Vec<PatchId> {
        let padded = |part: &&[PatchId]| {
            let repeats = part.len().next_multiple_of(LANES) - part.len();
            let last = part.last().into_iter().flat_map(move |&last| repeat_n(last, repeats));
            part.iter().copied().chain(last).collect::<Vec<_>>()
        };
        self.parts.clone().flat_map(padded).collect()
    }
}

impl RowSink for OwnRows<'_, '_> {
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        self.factors.take(block.without_repeats())?;
        let Some((kept, key)) = self.kept else { return Ok(()) };
        while let Some(part) = self.parts.as_slice().first() {
            if part.last().is_some_and(|&last| !self.factors.has_row(last)) {
                break;
            }
            kept.keep(key, part, self.factors).map_err(SinkError::Store)?;
            self.parts.next();
        }
        Ok(())
    }

    fn room(&self) -> Option<u64> {
        self.factors.room()
    }
}
