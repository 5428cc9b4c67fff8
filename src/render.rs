//! The camera's picture: `L = L_e + ρ(x) H(x) / π` at every visible point.
//!
//! The picture is an item buffer too: what is seen is decided where form factors decide it. H is
//! gathered at each pixel ([`Renderer::gathering`]): a picture is a raster whose cells are lit
//! (`raster.rs`); samples of a cell that see one surface share a spot (`spots.rs`), and spots share
//! the rays of their surroundings (`smooth.rs`); each pixel's error is told (`known.rs`). Without a
//! gatherer it is the field's, a draft.

mod camera;
mod gathered;
mod known;
mod picture;
pub(crate) mod raster;
mod renderer;
mod smooth;
pub(crate) mod spots;

pub use camera::check;
pub use known::PixelErrors;
pub use picture::{Picture, PictureOptions, RenderError};
pub use renderer::{Renderer, Seen, Shares, Sight};
