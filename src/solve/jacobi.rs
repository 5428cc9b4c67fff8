//! Jacobi iteration: every patch gathers with the values of the last iteration.

use super::system::relative;
use super::{Method, SolveError, SolveOptions, SolveReport, System};
use crate::progress::Progress;
use crate::scene::Rgb;

/// `H_i ← D_i + Σ_j F_ij ρ_j H_j` for all i at once; the change of an iteration is the residual of
/// the values before it.
pub(super) fn solve(
    system: &System<'_>,
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    let mut h = system.direct.to_vec();
    let mut residual = f64::INFINITY;
    for iterations in 0..=options.max_iterations {
        let next = system.gather(&h, options.tolerance)?;
        residual = relative(&next, &h, system.direct);
        if residual <= options.tolerance {
            return Ok((h, SolveReport { method: Method::Jacobi, iterations, residual }));
        }
        h = next;
        progress.advance(1)?;
    }
    Err(SolveError::NoConvergence {
        iterations: options.max_iterations,
        residual,
        tolerance: options.tolerance,
    })
}
