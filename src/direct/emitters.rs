//! Direct light from emitting surfaces, analytic: Lambert's formula times the visible fraction,
//! averaged over the receiver.
//!
//! Which emitters are analytic is fixed for each receiver before anything is sampled, by
//! [`Emitters::is_analytic`]: all but those that are too near or too large, which the rays of its
//! row find well enough. The same rule tells which hits of its rays carry emission, so that no
//! emitter counts twice and none is left out. With D(i) the emitters that are analytic for receiver
//! i,
//!
//! ```text
//! H_i = H_direct(D(i)) + Σ_j F_ij (B_j - [j ∈ D(i)] E_j)
//! ```
//!
//! The unoccluded irradiance of each group of emitters is a sum over all its triangles: by
//! Lambert's formula where a triangle is near, by its centre where it is far. Of that sum the
//! visible fraction arrives, a ratio of two sums over the same pairs of points: each weighted by
//! the kernel K = cos θ cos θ' / (π r²), blocked pairs left out above and counted below. Pairs are
//! drawn in proportion to what each triangle would send (Shirley, Wang & Zimmerman 1996, "Monte
//! Carlo techniques for direct lighting calculations"), so that thousands of emitting triangles
//! cost no more than a few; where the first pairs neither all see each other nor all do not, more
//! are drawn.

mod cut;
mod irradiance;
mod lanes;
mod pairs;
mod receiver;
mod set;
mod single;
mod solid_angle;
mod sources;
mod together;
mod tree;
mod workspace;

pub use receiver::{Receiver, ReceiverPoint};
pub use set::Emitters;
pub use workspace::Workspace;
