//! The camera's picture: `L = L_e + ρ(x) H(x) / π` at every visible point.
//!
//! The picture is an item buffer too: what is seen is decided where form factors decide it.

mod camera;
mod picture;
mod gathered;
mod renderer;
mod smooth;
mod spots;

pub use camera::check;
pub use picture::{Picture, PictureOptions, RenderError};
pub use renderer::{Renderer, Seen, Shares, Sight};
