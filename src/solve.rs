//! Solvers of the energy balance `H = D + F (ρ H)`, one file a method.
//!
//! All of them solve the same stored system in double precision and stop at the same residual
//! `‖D + F ρ H - H‖ / ‖D‖` (Euclidean norms, the worst of the three channels). Results do not
//! depend on the number of threads.

mod direct;
mod energy;
mod error;
mod gauss_seidel;
mod jacobi;
pub(crate) mod lu;
mod options;
mod report;
mod shooting;
mod system;

pub use direct::bytes as direct_bytes;
pub use energy::EnergyBalance;
pub use error::SolveError;
pub use options::{Method, SAMPLED_TOLERANCE, SolveOptions};
pub use report::SolveReport;
pub use system::System;

use crate::progress::Progress;
use crate::scene::Rgb;

/// Irradiance H of each patch, W/m².
pub fn solve(
    system: &System<'_>,
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    match options.method {
        Method::GaussSeidel => gauss_seidel::solve(system, system.direct, options, progress),
        Method::Jacobi => jacobi::solve(system, options, progress),
        Method::Shooting => shooting::solve(system, options, progress),
        Method::Direct => direct::solve(system, options, progress),
    }
}

/// The same by [`Method::GaussSeidel`], from a guess that is near.
pub fn solve_near(
    system: &System<'_>,
    guess: &[Rgb],
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    gauss_seidel::solve(system, guess, options, progress)
}

#[cfg(test)]
mod tests;
