//! Irradiance at any point, on a surface or in the air: a final gather at the point itself.
//!
//! ```text
//! H(x) = H_direct(D(x)) + H_lamps + 1/N Σ [ρ(y) H(y) + E(y) where y ∉ D(x)] + π L_sky · escaped
//! ```
//!
//! y is what each of N rays meets whose density is proportional to the cosine. H(y) is the
//! irradiance of the patch there if that is far away; near by, the ray goes on (`bounce.rs`). D(x)
//! are the emitters that are analytic for the point ([`Emitters::is_analytic`]): their light comes
//! by Lambert's formula and shadow rays, so their emission does not count where a ray meets them.
//! Patches are seen only from away, where their size blurs what is seen and not what is measured;
//! the shadow at the point itself is as sharp as it is, and so is what lies beside it.
//!
//! Pictures measure the same at each pixel, with few rays, and share what neighbours find
//! (`pixels.rs`, `render/smooth.rs`).
//!
//! # Errors
//!
//! Rays come in 16 sets that know nothing of each other, each with its own shadow rays. What is
//! left of their differences in the mean is known from Student's distribution. To this the error of
//! the solution is added. Its noise is told by its two halves, which differ by twice the standard
//! error of their mean: patch by patch in quadrature, in proportion to the rays that meet it, and
//! once more for what all of them have in common. What the size of patches blurs
//! ([`Uncertainty::refinement`]) has little in common, as a field passes by values on both sides:
//! it is added in quadrature, and a quarter of it once more.
//!
//! # Limits
//!
//! - Rays begin [`CLEARANCE`] above the point. A shadow that none of the first shadow rays finds
//!   (1/8 of all) is an error that is not stated.
//! - Far away, reflectance and emission are means over source triangles; textures are looked up
//!   where rays land near by.
//! - Of a solution by rows that are not sampled only the error is known that is due to the size of
//!   patches.
//! - Points more than a few radii away from the scene lose shadows, in single precision.
//!
//! [`Emitters::is_analytic`]: crate::direct::Emitters::is_analytic
//! [`Uncertainty::refinement`]: crate::uncertainty::Uncertainty::refinement

mod bounce;
mod calm;
mod estimate;
mod gatherer;
mod options;
mod outlook;
mod pixels;
mod points;
mod surfaces;
mod table;

pub(crate) use calm::{Calm, Known};
pub use estimate::{Estimate, Place, Probe};
pub use gatherer::{CLEARANCE, Gatherer};
pub(crate) use options::NOISE;
pub use options::{FEWEST_RAYS, GatherOptions, MOST_RAYS};
pub(crate) use pixels::{Buffers, Near, Receiving, Reflected};
pub(crate) use surfaces::Surfaces;
pub use table::{COLUMNS, MEASURED, Table, TableError};
