//! Patches: the pieces of surface that exchange light.
//!
//! A patch is a cell of the triangular grid that repeated 1-to-4 midpoint splits lay on one side
//! of a source triangle. At level `l` a side of the source is cut into `n = 2^l` strips along each
//! barycentric coordinate; a cell is known by the integer parts `(i, j, k)` of `n` times the
//! barycentric coordinates of its points: `i + j + k = n - 1` in cells that stand like their source
//! triangle, `n - 2` in those that are upside down. The parent of `(i, j, k)` is `(i/2, j/2, k/2)`.
//!
//! Ids are consecutive: the fronts of all source triangles in file order, then the backs. Within
//! one uniformly split side the id follows from the barycentric coordinates in O(1).
//!
//! Where source triangles are smaller than one wants patches, a patch may be a cluster of several
//! whole ones ([`Patches::clustered`]); each of its members then looks up to the same id.

mod adaptive;
mod cell;
mod clustered;
mod contact;
mod crossed;
mod crossing;
mod fragments;
mod line;
mod members;
mod mesh;
mod point;
mod split;
mod subdivide;
mod territory;
#[cfg(test)]
mod tests;
mod touching;
mod warning;

pub use adaptive::SplitCells;
pub use cell::Cell;
pub use clustered::{MAX_ANGLE, MAX_DIAMETER};
pub(crate) use contact::ContactLines;
pub use mesh::Patches;
pub use point::{PatchId, SurfacePoint, at_barycentric, side_index};
pub(crate) use split::level_for;
pub use split::{MAX_LEVEL, MAX_PATCHES, PatchesError, Split};
pub(crate) use warning::warn_of_contacts;
