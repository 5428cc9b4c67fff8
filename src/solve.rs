//! Solvers of the energy balance `H = D + F (ρ H)`, one file a method.
//!
//! All of them solve the same stored system in double precision and stop at the same residual
//! `‖D + F ρ H - H‖ / ‖D‖` (Euclidean norms, the worst of the three channels). Results do not
//! depend on the number of threads.

mod direct;
mod energy;
mod gauss_seidel;
mod jacobi;
mod lu;
mod shooting;

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

pub use energy::EnergyBalance;

use crate::form_factors::FormFactors;
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};
use crate::scene::Rgb;
use crate::units::Bytes;

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
    /// Elimination: exact, and O(n³).
    Direct,
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
    /// Bytes that the dense matrix of [`Method::Direct`] may take. Default 4 GiB.
    pub memory: u64,
}

/// A residual that is small beside the noise of sampled rows.
pub const SAMPLED_TOLERANCE: f64 = 1e-4;

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::default(), tolerance: 1e-6, max_iterations: 1000, memory: 4 << 30 }
    }
}

/// How a solution was reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolveReport {
    /// The method.
    pub method: Method,
    /// Sweeps over all patches; for shooting, shots divided by patches, rounded up; for
    /// elimination, how often the matrix was factorised (once for each distinct reflectance).
    pub iterations: u32,
    /// Residual reached.
    pub residual: f64,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// The residual did not fall below the tolerance.
    #[error(
        "the solver did not converge: residual {residual:.2e} after {iterations} iterations, \
         {tolerance:.0e} wanted"
    )]
    NoConvergence {
        /// Iterations made.
        iterations: u32,
        /// Residual reached.
        residual: f64,
        /// Residual wanted.
        tolerance: f64,
    },
    /// The dense matrix of [`Method::Direct`] does not fit in memory.
    #[error(
        "solving {patches} patches exactly takes {}, {} are allowed",
        Bytes(*needed), Bytes(*allowed)
    )]
    TooLarge {
        /// Patches with a row: unknowns of the system.
        patches: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
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

impl System<'_> {
    /// `ρ H` of patch `i`.
    fn reflected(&self, h: &[Rgb], i: usize) -> Rgb {
        self.rho[i] * h[i]
    }

    /// `D + F ρ H` of every patch with a row, `D` of those without; to within a small part of `tolerance`,
    /// a share of the whole.
    pub fn gather(&self, h: &[Rgb], tolerance: f64) -> Vec<Rgb> {
        let reflected = self.factors.values(tolerance, |i| self.reflected(h, i));
        self.direct
            .par_iter()
            .enumerate()
            .map(|(i, d)| *d + self.factors.gather_values(PatchId(i as u32), &reflected))
            .collect()
    }

    /// The residual of `h`, to within a small part of `tolerance`.
    pub fn residual(&self, h: &[Rgb], tolerance: f64) -> f64 {
        let next = self.gather(h, tolerance);
        relative(&next, h, self.direct)
    }
}

/// `‖a - b‖ / ‖scale‖`, the worst of three channels; 0 if all is dark, infinite if not a number.
fn relative(a: &[Rgb], b: &[Rgb], scale: &[Rgb]) -> f64 {
    let mut sums = Rgb::ZERO;
    for (a, b) in a.iter().zip(b) {
        sums += (*a - *b) * (*a - *b);
    }
    let norm: Rgb = scale.iter().map(|s| *s * *s).sum();
    (0..3)
        .map(|c| if norm[c] > 0.0 { (sums[c] / norm[c]).sqrt() } else { sums[c].sqrt() })
        .fold(0.0, |worst, r| if r.is_nan() { f64::INFINITY } else { r.max(worst) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{Row, RowBlock, RowSink, Weights};
    use crate::progress::Silent;

    const ALL: [Method; 4] =
        [Method::GaussSeidel, Method::Jacobi, Method::Shooting, Method::Direct];

    /// Three patches that see each other unevenly; row sums below one.
    fn three() -> FormFactors {
        let one = f64::from(u32::MAX);
        let mut f = FormFactors::new(3, 1 << 20);
        let row = |entries: &[(u32, f64)]| Row {
            columns: entries.iter().map(|e| PatchId(e.0)).collect(),
            weights: Weights::Fixed(entries.iter().map(|e| (e.1 * one) as u32).collect()),
            ..Row::default()
        };
        let rows = [row(&[(1, 0.5), (2, 0.5)]), row(&[(0, 0.25), (2, 0.6)]), row(&[(0, 0.9)])];
        f.take(RowBlock::of(&[0, 1, 2].map(PatchId), &rows).unwrap()).unwrap();
        f
    }

    #[test]
    fn every_method_solves_the_same_system() {
        let f = three();
        let rho = [Rgb::new(0.9, 0.5, 0.0), Rgb::splat(0.7), Rgb::new(0.2, 0.8, 0.6)];
        let direct = [Rgb::ZERO, Rgb::new(3.0, 0.0, 1.0), Rgb::new(0.0, 2.0, 0.0)];
        let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0, 2.0, 3.0] };
        let solutions: Vec<Vec<Rgb>> = ALL
            .into_iter()
            .map(|method| {
                let o = SolveOptions { method, tolerance: 1e-12, ..SolveOptions::default() };
                let (h, report) = solve(&system, &o, &Silent).unwrap();
                assert!(report.residual <= 1e-12);
                assert!(system.residual(&h, 1e-12) <= 1e-12);
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
            let o = SolveOptions {
                method,
                tolerance: 1e-14,
                max_iterations: 2,
                ..SolveOptions::default()
            };
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
        for method in ALL {
            let o = SolveOptions { method, ..SolveOptions::default() };
            assert_eq!(solve(&system, &o, &Silent).unwrap().0, [Rgb::ZERO; 3]);
        }
    }

    #[test]
    fn elimination_factorises_once_for_each_distinct_reflectance() {
        let f = three();
        let direct = [Rgb::new(1.0, 2.0, 3.0); 3];
        for (rho, expected) in [([0.5; 3], 1), ([0.5, 0.25, 0.5], 2), ([0.1, 0.2, 0.3], 3)] {
            let rho = [Rgb::from_array(rho); 3];
            let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0; 3] };
            let o = SolveOptions { method: Method::Direct, ..SolveOptions::default() };
            let (_, report) = solve(&system, &o, &Silent).unwrap();
            assert_eq!(report.iterations, expected);
            assert!(report.residual < 1e-14);
        }
    }

    #[test]
    fn patches_without_a_row_keep_their_direct_light_and_reflect_it() {
        let mut f = FormFactors::new(3, 1 << 20);
        let row = |columns: &[u32], weights: &[f32]| Row {
            columns: columns.iter().map(|&j| PatchId(j)).collect(),
            weights: Weights::Each(weights.to_vec()),
            ..Row::default()
        };
        let rows = [row(&[0, 1], &[0.5, 0.25]), row(&[2], &[0.5])];
        f.take(RowBlock::of(&[2, 0].map(PatchId), &rows).unwrap()).unwrap();
        let direct = [Rgb::splat(1.0), Rgb::splat(4.0), Rgb::ZERO];
        let rho = [Rgb::splat(0.5); 3];
        let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0; 3] };
        for method in ALL {
            let o = SolveOptions { method, tolerance: 1e-12, ..SolveOptions::default() };
            let (h, _) = solve(&system, &o, &Silent).unwrap();
            // h2 = .25 h0 + .125 × 4, h0 = 1 + .25 h2
            let h2 = 0.75 / (1.0 - 0.0625);
            for (h, expected) in h.iter().zip([1.0 + 0.25 * h2, 4.0, h2]) {
                assert!((h.x - expected).abs() < 1e-10, "{method:?}: {h} {expected}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_or_has_no_solution_is_refused() {
        let f = three();
        let system = System {
            factors: &f,
            rho: &[Rgb::splat(0.5); 3],
            direct: &[Rgb::ONE; 3],
            areas: &[1.0; 3],
        };
        let o = SolveOptions { method: Method::Direct, memory: 70, ..SolveOptions::default() };
        let error = solve(&system, &o, &Silent).unwrap_err();
        assert_eq!(error, SolveError::TooLarge { patches: 3, needed: 79, allowed: 70 });

        let mut closed = FormFactors::new(2, 1 << 20);
        let all = |j| Row { columns: vec![j], weights: Weights::Each(vec![1.0]), ..Row::default() };
        let rows = [all(PatchId(1)), all(PatchId(0))];
        closed.take(RowBlock::of(&[0, 1].map(PatchId), &rows).unwrap()).unwrap();
        let system = System {
            factors: &closed,
            rho: &[Rgb::ONE; 2],
            direct: &[Rgb::ONE; 2],
            areas: &[1.0; 2],
        };
        let o = SolveOptions { method: Method::Direct, ..SolveOptions::default() };
        assert!(matches!(solve(&system, &o, &Silent), Err(SolveError::NoConvergence { .. })));
    }
}
