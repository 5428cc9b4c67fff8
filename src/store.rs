//! Solutions of a scene, one per source of light, each at unit white: light of other lamps is then
//! a sum, and costs no form factors and no solution.
//!
//! Light is linear in what emits. With H_k the irradiance that source k alone brings about at unit
//! white, and e_k what it emits,
//!
//! ```text
//! H = Σ_k e_k H_k            channel by channel
//! ```
//!
//! So has been done for lighting of the stage since Dorsey, Sillion & Greenberg (1991), "Design and
//! simulation of opera lighting and projection effects". Another reflectance changes H_k, but
//! neither form factors nor D_k, what arrives straight: H = D + F (ρ H) is solved once more for the
//! sum D = Σ_k e_k D_k.

mod error;
mod mixing;
mod solving;
mod source;

pub use error::{GroupError, MixError};
pub use mixing::Store;
pub use source::{Emitter, Group, Member, Source, emitters, sources};
