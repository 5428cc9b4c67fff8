//! Heat by radiation between grey diffuse surfaces: what temperatures settle, and which net fluxes
//! flow.
//!
//! ```text
//! J_i = ε_i E_k + (1 - ε_i) H_i              E_k = σ T_k⁴: what a black body at node k emits
//! A_i H_i = Σ_j S_ij J_j + S_ie E_e          S_ij = A_i F_ij = A_j F_ji
//! q_i = ε_i (E_k - H_i) = J_i - H_i          net flux that leaves side i
//! ```
//!
//! These are the equations of a network of conductors, and are solved as such (A.K. Oppenheim 1956,
//! "Radiation analysis by the network method", Trans. ASME 78, 725-735). Each
//! [node](HeatInput::node_of) has either a temperature or a heat that is supplied to it; one side
//! of a face is a node of its own, and the two sides of a thin face share one. Sunlight is a second
//! band of the same form, whose absorbed part is heat of the first. [`gebhart`] tells where what
//! each side emits is absorbed.
//!
//! ```
//! use hemicube::heat::{Condition, Exchange, HeatInput, balance};
//! use hemicube::{MatrixOptions, Scene, Silent};
//!
//! // A closed box: one face is hot, one cold, all others let nothing through.
//! let matrix = Scene::builtin("furnace")?.form_factors(&MatrixOptions::default(), &Silent)?;
//! let areas: Vec<f64> = (0..12).map(|i| matrix.area(i)).collect();
//! let exchange = Exchange::new(&matrix, &areas, false, 1 << 30, &Silent)?;
//! let mut conditions = [Condition::Heat(0.0); 12];
//! conditions[0] = Condition::Temperature(400.0);
//! conditions[3] = Condition::Temperature(300.0);
//! let each: Vec<u32> = (0..12).collect();
//! let input = HeatInput {
//!     exchange: &exchange,
//!     emissivity: &[0.9; 12],
//!     node_of: &each,
//!     conditions: &conditions,
//!     environment: None,
//!     sunlight: None,
//!     surface_of: &each,
//!     surfaces: 12,
//!     error: matrix.report.pairs.map_or(0.0, |pairs| pairs.error),
//! };
//! let found = balance(&input, &Silent)?;
//! println!("{} W from hot to cold", found.supplied);
//! # assert!(found.supplied > 0.0 && found.imbalance < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod balance;
mod deviation;
mod error;
mod exchange;
mod gebhart;
mod network;
mod state;
mod sunlight;

pub use balance::balance;
pub use error::HeatError;
pub use exchange::Exchange;
pub use gebhart::{Gebhart, gebhart};
pub use state::{Condition, HeatBalance, HeatInput, SideHeat, SurfaceHeat};
pub use sunlight::{Sunlight, Sunlit};

/// The Stefan-Boltzmann constant, W/(m² K⁴) (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// What a black body of that temperature in K emits, W/m².
#[must_use]
pub fn emissive_power(temperature: f64) -> f64 {
    STEFAN_BOLTZMANN * temperature.powi(4)
}

/// The temperature in K of a black body that emits so much, W/m².
#[must_use]
pub fn temperature(emissive_power: f64) -> f64 {
    (emissive_power.max(0.0) / STEFAN_BOLTZMANN).sqrt().sqrt()
}

#[cfg(test)]
mod tests;
