//! Block Gauss-Seidel: patches gather with the newest values of all blocks before theirs; sweeps
//! are combined as Anderson (1965) does. Where ranks share the work, those of one strip alone are
//! the newest, and each sweep ends with all ranks hearing of all values.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::system::relative;
use super::{Method, SolveError, SolveOptions, SolveReport, System};
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::ranks::RanksError;
use crate::scene::Rgb;

/// Patches that gather at once. Fixed, so that the number of threads changes nothing; small
/// enough that a sweep over a few thousand patches gains from newest values.
const BLOCK: usize = 512;

/// Sweeps combined with the newest. More gain little.
const DEPTH: usize = 4;

/// `H_i ← D_i + Σ_j F_ij ρ_j H_j`, block after block, from a first guess.
pub(super) fn solve(
    system: &System<'_>,
    guess: &[Rgb],
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    let mut h = guess.to_vec();
    let mut mixer = Mixer::default();
    let mut residual = f64::INFINITY;
    for iterations in 1..=options.max_iterations {
        let swept = sweep(system, &h, options.tolerance)?;
        // A sweep's change is near the residual; only when it is small is the residual worth a
        // product of its own.
        residual = relative(&swept, &h, system.direct);
        if residual <= options.tolerance {
            residual = system.residual(&swept, options.tolerance)?;
            if residual <= options.tolerance {
                let method = Method::GaussSeidel;
                return Ok((swept, SolveReport { method, iterations, residual }));
            }
        }
        h = mixer.mix(h, swept);
        progress.advance(1)?;
    }
    Err(SolveError::NoConvergence {
        iterations: options.max_iterations,
        residual,
        tolerance: options.tolerance,
    })
}

/// One sweep over all patches. Where ranks share them, a patch gathers the newest values of its own
/// strip and those of the last sweep of others.
fn sweep(system: &System<'_>, before: &[Rgb], tolerance: f64) -> Result<Vec<Rgb>, RanksError> {
    let mut reflected = system.factors.values(tolerance, |i| system.reflected(before, i));
    let mut swept = Vec::with_capacity(before.len());
    let ids = system.factors.ids();
    let mut last: &[PatchId] = &[];
    for strip in system.factors.own(&ids) {
        for i in last.iter().map(|i| i.index()) {
            reflected.set(i, system.reflected(before, i));
        }
        last = strip;
        for block in strip.chunks(BLOCK) {
            let first = swept.len();
            swept.par_extend(block.par_iter().map(|&i| system.gathered(i, &reflected)));
            for (i, h) in block.iter().zip(&swept[first..]) {
                reflected.set(i.index(), system.rho[i.index()] * *h);
            }
        }
    }
    system.factors.share_values(swept, tolerance)
}

/// Anderson's (1965) mixing: of the last sweeps that combination, its weights adding up to 1, whose
/// changes cancel best. On a linear system it is GMRES in disguise (Walker & Ni 2011), so that the
/// many bounces of a bright room cost few sweeps.
#[derive(Default)]
struct Mixer {
    /// Differences between one sweep and the next: of what came out, and of its change.
    past: VecDeque<(Vec<Rgb>, Vec<Rgb>)>,
    /// What came out of the last sweep, and its change.
    last: Option<(Vec<Rgb>, Vec<Rgb>)>,
}

impl Mixer {
    /// Where the next sweep begins, after one from `before` to `after`; each channel on its own.
    fn mix(&mut self, before: Vec<Rgb>, after: Vec<Rgb>) -> Vec<Rgb> {
        let minus = |a: &[Rgb], b: &[Rgb]| -> Vec<Rgb> {
            a.par_iter().zip(b).map(|(a, b)| *a - *b).collect()
        };
        let change = minus(&after, &before);
        if let Some((swept, changed)) = self.last.take() {
            self.past.push_back((minus(&after, &swept), minus(&change, &changed)));
            if self.past.len() > DEPTH {
                self.past.pop_front();
            }
        }
        let weights = least_squares(&self.past, &change);
        let mut mixed = after.clone();
        for ((swept, _), weight) in self.past.iter().zip(weights) {
            mixed.par_iter_mut().zip(swept).for_each(|(m, s)| *m -= *s * weight);
        }
        self.last = Some((after, change));
        mixed
    }
}

/// The weight of each past difference whose changes, so weighted, come nearest to `change`, by
/// modified Gram-Schmidt; zero where differences say nothing new.
fn least_squares(past: &VecDeque<(Vec<Rgb>, Vec<Rgb>)>, change: &[Rgb]) -> Vec<Rgb> {
    let n = past.len();
    let mut rest = change.to_vec();
    let mut basis: Vec<Vec<Rgb>> = Vec::with_capacity(n);
    // Upper triangle: how much of each basis vector is in each difference.
    let mut upper = vec![vec![Rgb::ZERO; n]; n];
    let mut projections = vec![Rgb::ZERO; n];
    for (k, (_, difference)) in past.iter().enumerate() {
        let mut vector = difference.clone();
        let size = dot(&vector, &vector);
        for (j, b) in basis.iter().enumerate() {
            upper[j][k] = dot(b, &vector);
            let along = upper[j][k];
            vector.par_iter_mut().zip(b).for_each(|(v, b)| *v -= *b * along);
        }
        let norm = dot(&vector, &vector);
        // A difference that is a combination of others to within rounding carries no direction.
        let new = Rgb::from_array(std::array::from_fn(|c| {
            if norm[c] > 1e-14 * size[c] { norm[c].sqrt().recip() } else { 0.0 }
        }));
        vector.par_iter_mut().for_each(|v| *v *= new);
        upper[k][k] =
            Rgb::from_array(std::array::from_fn(
                |c| {
                    if new[c] > 0.0 { new[c].recip() } else { 0.0 }
                },
            ));
        let projection = dot(&vector, &rest);
        rest.par_iter_mut().zip(&vector).for_each(|(r, v)| *r -= *v * projection);
        projections[k] = projection;
        basis.push(vector);
    }
    let mut weights = vec![Rgb::ZERO; n];
    for k in (0..n).rev() {
        let known: Rgb = (k + 1..n).map(|j| upper[k][j] * weights[j]).sum();
        let left = projections[k] - known;
        weights[k] = Rgb::from_array(std::array::from_fn(|c| {
            if upper[k][k][c] > 0.0 { left[c] / upper[k][k][c] } else { 0.0 }
        }));
    }
    weights
}

/// The scalar product, channel by channel, summed in a fixed order.
fn dot(a: &[Rgb], b: &[Rgb]) -> Rgb {
    /// Summed by one thread at a time.
    const CHUNK: usize = 4096;
    let sums: Vec<Rgb> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| *a * *b).sum())
        .collect();
    sums.into_iter().sum()
}
