//! Form factors: which share of the light that leaves patch i arrives at patch j.
//!
//! Thermal engineers say view factor. An engine makes whole rows; rows flow in blocks into a
//! [`RowSink`]; [`FormFactors`] is the sink that keeps them. Every row accounts for everything:
//!
//! ```text
//! Σ_j F_ij + environment + back + lost = 1
//! ```

pub mod classical;
pub mod closure;
pub mod delta;
pub mod exact;
pub mod hemicube;
#[cfg(feature = "gpu")]
pub mod hemicube_gpu;
pub mod kernel;
mod lit;
mod lookup;
pub mod rays;
mod rows;
pub(crate) mod sampling;
mod stored;
mod tally;
mod threshold;
mod whole;

pub use classical::Classical;
pub use closure::{Closure, ClosureError, close};
pub use exact::{Exact, ExactOptions};
pub use hemicube::{Draw, Hemicube, HemicubeError, HemicubeOptions};
#[cfg(feature = "gpu")]
pub use hemicube_gpu::{AdapterReport, Gpu, GpuError, GpuSeconds, HemicubeGpu};
pub use lit::assemble_lit;
pub use rays::{Rays, RaysOptions};
pub use rows::{Engine, EngineError, Row, RowSink, SinkError, Weights};
pub use stored::{
    AssembleError, BLOCK, FormFactors, Merger, ROWS_AT_ONCE, RowAccount, Values, assemble,
    entry_bytes,
};
pub use threshold::drop_below;
pub use whole::{assemble_shares, assemble_whole};
