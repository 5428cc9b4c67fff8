//! From a scene to the irradiance of its patches: subdivide, make form factors, solve.

mod agreement;
mod balance;
mod dark;
mod error;
mod halves;
mod light;
mod memory;
mod options;
mod transport;

pub(crate) use balance::Balance;
pub use error::LightError;
pub use light::{Solution, light, light_by, light_shared};
pub use options::{
    Adaptive, CLUSTERED_PATCHES, Clustering, DEFAULT_PATCHES, LightOptions, MANY_SIDES,
    SAMPLED_PATCHES, Work,
};
pub(crate) use transport::{MeshOptions, Transport, lamps};
