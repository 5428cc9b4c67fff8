//! Block Gauss-Seidel: patches gather with the newest values of all blocks before theirs.

use rayon::prelude::*;

use super::{Method, SolveError, SolveOptions, SolveReport, System, relative};
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::scene::Rgb;

/// Patches that gather at once. Fixed, so that the number of threads changes nothing; small
/// enough that a sweep over a few thousand patches gains from newest values.
const BLOCK: usize = 512;

/// `H_i ← D_i + Σ_j F_ij ρ_j H_j`, block after block, from a first guess.
pub(super) fn solve(
    system: &System<'_>,
    guess: &[Rgb],
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    let mut h = guess.to_vec();
    let mut reflected = system.reflected(&h);
    let mut residual = f64::INFINITY;
    for iterations in 1..=options.max_iterations {
        let before = h.clone();
        for start in (0..h.len()).step_by(BLOCK) {
            let end = h.len().min(start + BLOCK);
            h[start..end].par_iter_mut().enumerate().for_each(|(k, h)| {
                let i = start + k;
                *h = system.direct[i] + system.factors.gather(PatchId(i as u32), &reflected);
            });
            for i in start..end {
                reflected[i] = system.rho[i] * h[i];
            }
        }
        // A sweep's change is near the residual; only when it is small is the residual worth a
        // product of its own.
        residual = relative(&h, &before, system.direct);
        if residual <= options.tolerance {
            residual = system.residual(&h);
            if residual <= options.tolerance {
                return Ok((h, SolveReport { method: Method::GaussSeidel, iterations, residual }));
            }
        }
        if progress.advance(1).is_break() {
            return Err(SolveError::Cancelled);
        }
    }
    Err(SolveError::NoConvergence {
        iterations: options.max_iterations,
        residual,
        tolerance: options.tolerance,
    })
}
