//! Form factors: which share of the light that leaves patch i arrives at patch j.
//!
//! Thermal engineers say view factor. [Engines](crate::engines) make whole rows; rows flow in
//! blocks into a [`RowSink`]; [`FormFactors`] is the sink that keeps them. Every row accounts for
//! everything:
//!
//! ```text
//! Σ_j F_ij + environment + back + lost = 1
//! ```

mod account;
mod block;
pub mod closure;
mod edit;
mod kept;
pub mod kernel;
mod merger;
mod products;
mod rows;
mod shared;
mod sink;
mod stored;
pub(crate) mod tally;
mod tallied;
mod threshold;

pub use account::{Account, RowsReport};
pub use block::{BLOCK, RowBlock, RowView, entry_bytes};
pub use closure::{Closure, ClosureError, close};
pub use kept::KeptRows;
pub(crate) use kept::OwnRows;
pub use merger::Merger;
pub use products::Values;
pub(crate) use rows::sum;
pub use rows::{ONE, Row, RowAccount, Weights};
pub use sink::{RowSink, SinkError};
pub use stored::FormFactors;
pub use tallied::Tallied;
pub use threshold::drop_below;
