//! Form factors: which share of the light that leaves patch i arrives at patch j.
//!
//! Thermal engineers say view factor. [Engines](crate::engines) make whole rows; rows flow in blocks
//! into a [`RowSink`]; [`FormFactors`] is the sink that keeps them. Every row accounts for
//! everything:
//!
//! ```text
//! Σ_j F_ij + environment + back + lost = 1
//! ```

pub mod closure;
pub mod kernel;
mod rows;
mod stored;
pub(crate) mod tally;
mod threshold;

pub use closure::{Closure, ClosureError, close};
pub(crate) use rows::sum;
pub use rows::{BLOCK, ONE, Row, RowSink, SinkError, Weights};
pub(crate) use stored::Band;
pub use stored::{FormFactors, Merger, RowAccount, StoredRow, Values, entry_bytes};
pub use threshold::drop_below;
