//! Light baked into a model: an atlas of texels over all surfaces, and colours of vertices.
//!
//! Sides are cut along contact lines (`cut.rs`), joined to nearly flat charts (`charts.rs`), and
//! packed (`pack.rs`) into a raster of texels (`atlas.rs`), which is lit as pixels of a picture are
//! (`baked.rs`). Texels that no surface covers take what lies beside them (`fill.rs`). Colours of
//! vertices are read from the atlas, on a mesh that is refined where light asks for it
//! (`vertices.rs`).

mod atlas;
mod baked;
mod charts;
mod cut;
mod facet;
mod fill;
mod layers;
mod layout;
mod options;
mod pack;
mod sides;
mod texels;
mod vertices;

pub use atlas::{BakeError, MOST_TEXELS};
pub use baked::Bake;
pub use facet::Facet;
pub use layers::Layers;
pub use layout::{Layout, NodeLayout};
pub use options::BakeOptions;
