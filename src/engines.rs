//! Engines: who makes the rows of form factors.
//!
//! An engine sees [`Geometry`](crate::scene::Geometry) and [`Patches`](crate::patches::Patches)
//! alone, no materials, so that stored form factors serve any light. Rows flow in blocks into a
//! [`RowSink`](crate::form_factors::RowSink).

pub mod classical;
pub mod delta;
mod engine;
pub mod exact;
mod forecast;
pub mod hemicube;
#[cfg(feature = "gpu")]
pub mod hemicube_gpu;
mod lookup;
mod options;
pub mod rays;
pub(crate) mod sampling;
mod waves;

pub use classical::Classical;
pub use engine::{AssembleError, Engine, EngineError, PairsReport, ROWS_AT_ONCE};
pub use exact::{Exact, ExactOptions, FoundPairs, PairsTally, TilePairs, Tiling};
pub use forecast::SampleOfRows;
pub use hemicube::{Draw, Hemicube, HemicubeError, HemicubeOptions, Item, Net};
#[cfg(feature = "gpu")]
pub use hemicube_gpu::{AdapterReport, Gpu, GpuError, GpuSeconds, HemicubeGpu};
pub use options::{EngineOptions, EngineReport};
pub use rays::{Rays, RaysOptions};
pub use waves::assemble_lit;
