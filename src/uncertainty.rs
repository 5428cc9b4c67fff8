//! How well irradiance is known: what sampling leaves open, and what the size of patches blurs.
//!
//! **Noise.** Where rows are sampled, two independent halves of the rays are carried through the
//! whole solution; half of what they differ in is as large as the standard error of their mean. One
//! patch's difference has one degree of freedom, so squares are averaged over at least 16
//! neighbours.
//!
//! **Refinement.** A smooth field goes through the patches' values as well as it can. Where light
//! changes within a patch, at borders of shadows above all, it passes them by: the squares of these
//! distances, averaged over the same neighbours and less what noise alone would make them, tell
//! what patches of that size cannot show. It is an estimate and no bound: a shadow smaller than a
//! patch may leave no trace.
//!
//! The two are added, not their squares, as neither is independent of the surface.

mod estimate;
mod neighbours;
mod within;

pub use estimate::Uncertainty;
pub(crate) use within::IN_COMMON;
pub use within::{light_within, light_within_shared};
