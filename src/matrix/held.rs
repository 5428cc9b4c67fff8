//! Where the rows of a matrix are: in memory, or on a shelf that the caller gives.

use std::fmt::Debug;
use std::io;

use crate::form_factors::{FormFactors, RowAccount, RowSink};
use crate::patches::PatchId;

/// Where rows of shares go that do not fit in memory, and are read again.
pub trait Shelf: RowSink + Debug + Send + Sync {
    /// Replaces `columns` and `values` by the entries of a row taken before; by none without one.
    fn read(&self, id: PatchId, columns: &mut Vec<u32>, values: &mut Vec<f32>) -> io::Result<()>;
}

/// The rows of a matrix.
#[derive(Debug)]
pub(super) enum Held {
    /// In memory.
    Memory(FormFactors),
    /// Elsewhere.
    Shelf {
        /// Where.
        shelf: Box<dyn Shelf>,
        /// What each row holds beside its entries.
        accounts: Vec<RowAccount>,
        /// Entries of all rows.
        entries: u64,
    },
}

impl Held {
    /// Number of entries.
    pub fn entries(&self) -> u64 {
        match self {
            Self::Memory(factors) => factors.entries(),
            Self::Shelf { entries, .. } => *entries,
        }
    }

    /// What a patch's row holds beside its entries.
    pub fn account(&self, id: PatchId) -> RowAccount {
        match self {
            Self::Memory(factors) => factors.account(id),
            Self::Shelf { accounts, .. } => accounts[id.index()],
        }
    }

    /// Shows `look` the columns of a patch's row and their factors.
    pub fn row(&self, id: PatchId, look: impl FnOnce(&[u32], &[f32])) -> io::Result<()> {
        match self {
            Self::Memory(factors) => {
                let (columns, values) = factors.share(id);
                look(columns, values);
            }
            Self::Shelf { shelf, .. } => {
                let (mut columns, mut values) = (Vec::new(), Vec::new());
                shelf.read(id, &mut columns, &mut values)?;
                look(&columns, &values);
            }
        }
        Ok(())
    }
}
