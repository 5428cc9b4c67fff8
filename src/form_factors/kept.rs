//! Rows that outlive the process which made them.

use std::io;

use super::block::RowBlock;
use super::sink::{RowSink, SinkError};
use super::stored::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;

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

/// A sink that keeps rows in memory and elsewhere, strip by strip as their last row comes.
pub(crate) struct Keeping<'a, 'b> {
    /// Where they are kept in memory.
    pub factors: &'a mut FormFactors,
    /// Where else, and what they depend on.
    pub rows: (&'b dyn KeptRows, &'b str),
    /// The patches of each strip, in the order in which rows come.
    pub parts: std::vec::IntoIter<&'b [PatchId]>,
}

impl RowSink for Keeping<'_, '_> {
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        self.factors.take(block)?;
        let (rows, key) = self.rows;
        while let Some(&part) = self.parts.as_slice().first() {
            if part.last().is_some_and(|&last| !self.factors.has_row(last)) {
                break;
            }
            rows.keep(key, part, self.factors).map_err(SinkError::Store)?;
            self.parts.next();
        }
        Ok(())
    }

    fn room(&self) -> Option<u64> {
        self.factors.room()
    }
}
