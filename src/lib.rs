//! Radiosity: the energy-conserving exchange of diffuse light between surfaces.
//!
//! **scene → patches → form factors → irradiance → picture**
//!
//! ```text
//! H = D + F (ρ H)        irradiance; D is what arrives straight from emitters
//! B = E + ρ H            radiosity, derived where needed, never stored
//! ```
//!
//! The modules come in the order light travels; each uses only those above it.

pub mod units;
pub mod progress;
mod simd;
pub mod scene;
pub mod patches;
pub mod visibility;
pub mod form_factors;
pub mod engines;
pub mod direct;
pub mod solve;
pub mod refine;
pub mod reconstruct;
pub mod report;
pub mod solution;
pub mod uncertainty;
pub mod matrix;
pub mod gather;
pub mod render;
pub mod tone;
pub mod export;
