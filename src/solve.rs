//! Solvers of the energy balance `H = D + F (ρ H)`, one file a method.
//!
//! All of them solve the same stored system in double precision and stop at the same residual
//! `‖D + F ρ H - H‖ / ‖D‖` (Euclidean norms, the worst of the three channels). Results do not
//! depend on the number of threads.

mod energy;
mod gauss_seidel;
mod jacobi;
mod shooting;

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

pub use energy::EnergyBalance;

use crate::form_factors::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::scene::Rgb;

/// How the energy balance is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Gathering with the newest values, block after block.
    #[default]
    GaussSeidel,
    /// Gathering with the values of the last iteration.
    Jacobi,
    /// Distributing the largest unshot flux first.
    Shooting,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// The method. Default: Gauss-Seidel.
    pub method: Method,
    /// The residual to reach. Default 1e-6.
    pub tolerance: f64,
    /// Give up after so many iterations (sweeps; n shots count as one). Default 1,000.
    pub max_iterations: u32,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::default(), tolerance: 1e-6, max_iterations: 1000 }
    }
}

/// How a solution was reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolveReport {
    /// The method.
    pub method: Method,
    /// Sweeps over all patches; for shooting, shots divided by patches, rounded up.
    pub iterations: u32,
    /// Residual reached.
    pub residual: f64,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// The residual did not fall below the tolerance.
    #[error(
        "the solver did not converge: residual {residual:.2e} after {iterations} iterations, {tolerance:.0e} wanted; lower --max-reflectance, or use --solver gauss-seidel"
    )]
    NoConvergence {
        /// Iterations made.
        iterations: u32,
        /// Residual reached.
        residual: f64,
        /// Residual wanted.
        tolerance: f64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// The system to solve: `H = D + F (ρ H)`, one entry a patch in each slice.
#[derive(Debug, Clone, Copy)]
pub struct System<'a> {
    /// Form factors F.
    pub factors: &'a FormFactors,
    /// Reflectance ρ, 0..1.
    pub rho: &'a [Rgb],
    /// Direct irradiance D, W/m².
    pub direct: &'a [Rgb],
    /// Patch areas, m²; only the order of shooting depends on them.
    pub areas: &'a [f64],
}

/// Irradiance H of each patch, W/m².
pub fn solve(
    system: &System<'_>,
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    match options.method {
        Method::GaussSeidel => gauss_seidel::solve(system, options, progress),
        Method::Jacobi => jacobi::solve(system, options, progress),
        Method::Shooting => shooting::solve(system, options, progress),
    }
}

impl System<'_> {
    /// `ρ H` of every patch.
    fn reflected(&self, h: &[Rgb]) -> Vec<Rgb> {
        h.iter().zip(self.rho).map(|(h, rho)| *h * *rho).collect()
    }

    /// `D + F x` of every patch with a row, `D` of those without.
    fn gather(&self, x: &[Rgb]) -> Vec<Rgb> {
        self.direct
            .par_iter()
            .enumerate()
            .map(|(i, d)| *d + self.factors.gather(PatchId(i as u32), x))
            .collect()
    }

    /// The residual of `h`.
    pub fn residual(&self, h: &[Rgb]) -> f64 {
        let next = self.gather(&self.reflected(h));
        relative(&next, h, self.direct)
    }
}

/// `‖a - b‖ / ‖scale‖`, the worst of three channels; 0 if all is dark.
fn relative(a: &[Rgb], b: &[Rgb], scale: &[Rgb]) -> f64 {
    let mut sums = Rgb::ZERO;
    for (a, b) in a.iter().zip(b) {
        sums += (*a - *b) * (*a - *b);
    }
    let norm: Rgb = scale.iter().map(|s| *s * *s).sum();
    (0..3)
        .map(|c| if norm[c] > 0.0 { (sums[c] / norm[c]).sqrt() } else { sums[c].sqrt() })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{Row, RowSink, Weights};
    use crate::progress::Silent;

    /// Three patches that see each other unevenly; row sums below one.
    fn three() -> FormFactors {
        let one = f64::from(u32::MAX);
        let mut f = FormFactors::new(3, 1 << 20);
        let row = |entries: &[(u32, f64)]| Row {
            columns: entries.iter().map(|e| e.0).collect(),
            weights: Weights::Fixed(entries.iter().map(|e| (e.1 * one) as u32).collect()),
            ..Row::default()
        };
        let rows = [row(&[(1, 0.5), (2, 0.5)]), row(&[(0, 0.25), (2, 0.6)]), row(&[(0, 0.9)])];
        f.take(&[PatchId(0), PatchId(1), PatchId(2)], &rows).unwrap();
        f
    }

    #[test]
    fn every_method_solves_the_same_system() {
        let f = three();
        let rho = [Rgb::new(0.9, 0.5, 0.0), Rgb::splat(0.7), Rgb::new(0.2, 0.8, 0.6)];
        let direct = [Rgb::ZERO, Rgb::new(3.0, 0.0, 1.0), Rgb::new(0.0, 2.0, 0.0)];
        let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0, 2.0, 3.0] };
        let solutions: Vec<Vec<Rgb>> = [Method::GaussSeidel, Method::Jacobi, Method::Shooting]
            .into_iter()
            .map(|method| {
                let o = SolveOptions { method, tolerance: 1e-12, ..SolveOptions::default() };
                let (h, report) = solve(&system, &o, &Silent).unwrap();
                assert!(report.residual <= 1e-12);
                assert!(system.residual(&h) <= 1e-12);
                h
            })
            .collect();
        for h in &solutions[1..] {
            for (a, b) in h.iter().zip(&solutions[0]) {
                assert!((*a - *b).abs().max_element() < 1e-10);
            }
        }
    }

    #[test]
    fn running_out_of_iterations_is_an_error() {
        let f = three();
        let rho = [Rgb::splat(0.9); 3];
        let system = System { factors: &f, rho: &rho, direct: &[Rgb::ONE; 3], areas: &[1.0; 3] };
        for method in [Method::GaussSeidel, Method::Jacobi, Method::Shooting] {
            let o = SolveOptions { method, tolerance: 1e-14, max_iterations: 2 };
            assert!(
                matches!(solve(&system, &o, &Silent), Err(SolveError::NoConvergence { .. })),
                "{method:?}"
            );
        }
    }

    #[test]
    fn darkness_stays_dark() {
        let f = three();
        let system = System {
            factors: &f,
            rho: &[Rgb::splat(0.5); 3],
            direct: &[Rgb::ZERO; 3],
            areas: &[1.0; 3],
        };
        for method in [Method::GaussSeidel, Method::Jacobi, Method::Shooting] {
            let o = SolveOptions { method, ..SolveOptions::default() };
            assert_eq!(solve(&system, &o, &Silent).unwrap().0, [Rgb::ZERO; 3]);
        }
    }
}
