//! Where the rows of a matrix are: in memory, or in a store that the caller gives.

use std::fmt::Debug;
use std::io;

use crate::form_factors::{FormFactors, RowAccount, RowSink};
use crate::patches::PatchId;

/// Keeps rows of plain numbers that do not fit in memory, and reads them back.
pub trait RowStore: RowSink + Debug + Send + Sync {
    /// Replaces `columns` and `values` by the entries of a row taken before; by none without one.
    fn read(
        &self,
        id: PatchId,
        columns: &mut Vec<PatchId>,
        values: &mut Vec<f32>,
    ) -> io::Result<()>;
}

/// The rows of a matrix.
#[derive(Debug)]
pub(super) enum Storage {
    /// In memory.
    Memory(FormFactors),
    /// Elsewhere.
    Store {
        /// Where.
        store: Box<dyn RowStore>,
        /// What each row holds beside its entries.
        accounts: Vec<RowAccount>,
        /// Entries of all rows.
        entries: u64,
    },
}

impl Storage {
    /// Number of entries.
    pub fn entries(&self) -> u64 {
        match self {
            Self::Memory(factors) => factors.entries(),
            Self::Store { entries, .. } => *entries,
        }
    }

    /// What a patch's row holds beside its entries.
    pub fn account(&self, id: PatchId) -> RowAccount {
        match self {
            Self::Memory(factors) => factors.account(id),
            Self::Store { accounts, .. } => accounts[id.index()],
        }
    }

    /// Shows `look` the columns of a patch's row and their factors.
    pub fn row(&self, id: PatchId, look: impl FnOnce(&[PatchId], &[f32])) -> io::Result<()> {
        match self {
            Self::Memory(factors) => {
                let (columns, values) = factors.plain_row(id);
                look(columns, values);
            }
            Self::Store { store, .. } => {
                let (mut columns, mut values) = (Vec::new(), Vec::new());
                store.read(id, &mut columns, &mut values)?;
                look(&columns, &values);
            }
        }
        Ok(())
    }
}
