//! What is seen: the one place that answers it.
//!
//! Source triangles are projected through a pinhole on a plane and the nearest one under each pixel
//! is kept: an item buffer (Weghorst, Hooper & Greenberg 1984). The same buffer serves the five
//! faces of a hemicube and the tiles of a camera's picture.
//!
//! Rays that do not share a pinhole, as those that begin all over a patch, go through a hierarchy
//! of boxes in packets ([`Bvh`]).
//!
//! Projection uses homogeneous two-dimensional edge functions (Olano & Greer 1997, "Triangle scan
//! conversion using 2D homogeneous coordinates"): nothing is clipped, triangles may pass beside or
//! behind the pinhole, and an edge shared by two triangles gives exactly opposite values on both,
//! so that no pixel falls between them.

mod bodies;
mod bvh;
mod covered;
mod hemisphere;
mod item_buffer;
mod occluders;
mod segments;
mod surroundings;

pub(crate) use bodies::Bodies;
pub use bvh::{Bvh, Hits, Lanes, Met, Packet};
pub use covered::{COVERED, covered_triangles, uncover};
pub(crate) use hemisphere::{DIRECTIONS, seen_from, share_of};
#[cfg(feature = "gpu")]
pub(crate) use item_buffer::turn;
pub use item_buffer::{Edges, Face, ItemBuffer, PatchArea};
pub(crate) use item_buffer::{back, each_face};
pub use occluders::{Frame, Occluders, View};
pub(crate) use occluders::{code, faces_of};
pub use segments::{Blockers, ROUNDING, Sight};
pub use surroundings::{Glimpse, Surroundings, looks_inside_out, solid_angle_fraction};

/// What an item buffer holds where nothing was drawn.
pub const NOTHING: u32 = u32::MAX;
