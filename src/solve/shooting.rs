//! Shooting: the patch with the largest unshot flux distributes it along its column.
//!
//! Cohen, Chen, Wallace & Greenberg (1988), "A progressive refinement approach to fast radiosity
//! image generation", here on stored columns F_ji, so that it solves the same system as gathering.

use super::system::relative;
use super::{Method, SolveError, SolveOptions, SolveReport, System};
use crate::form_factors::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::scene::Rgb;

/// The matrix column by column.
struct Columns {
    starts: Vec<usize>,
    rows: Vec<PatchId>,
    weights: Vec<f32>,
}

impl Columns {
    fn new(f: &FormFactors) -> Self {
        let n = f.len();
        let stored = || (0..n as u32).map(PatchId).filter_map(|i| Some((i, f.row(i)?)));
        let mut starts = vec![0; n + 1];
        for (_, row) in stored() {
            for j in row.columns {
                starts[j.index() + 1] += 1;
            }
        }
        for j in 0..n {
            starts[j + 1] += starts[j];
        }
        let mut next = starts.clone();
        let (mut rows, mut weights) = (vec![PatchId(0); starts[n]], vec![0.0; starts[n]]);
        for (i, row) in stored() {
            for (j, w) in row.entries() {
                let at = &mut next[j.index()];
                rows[*at] = i;
                weights[*at] = w as f32;
                *at += 1;
            }
        }
        Self { starts, rows, weights }
    }

    fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let at = self.starts[j]..self.starts[j + 1];
        self.rows[at.clone()].iter().zip(&self.weights[at]).map(|(i, &w)| (i.index(), f64::from(w)))
    }
}

/// Shots between two looks at the residual, at least.
const CHECK: usize = 64;

pub(super) fn solve(
    system: &System<'_>,
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    let n = system.direct.len();
    let columns = Columns::new(system.factors);
    let report = |shots: usize, residual| SolveReport {
        method: Method::Shooting,
        iterations: shots.div_ceil(n.max(1)) as u32,
        residual,
    };
    let mut h = system.direct.to_vec();
    // Irradiance received and not yet reflected.
    let mut unshot = h.clone();
    // A correction of rounding may be negative: its size decides.
    let flux =
        |unshot: Rgb, i: usize| (system.rho[i] * unshot).abs().max_element() * system.areas[i];
    let mut shots = 0;
    let mut residual = f64::INFINITY;
    loop {
        let pending: Vec<Rgb> = (0..n).map(|i| system.reflected(&unshot, i)).collect();
        // Undistributed reflections bound the residual, since no row sums to more than one.
        if relative(&pending, &vec![Rgb::ZERO; n], system.direct) <= options.tolerance {
            residual = system.residual(&h, options.tolerance)?;
            if residual <= options.tolerance {
                return Ok((h, report(shots, residual)));
            }
            // Columns hold single precision; begin again from what is left.
            let next = system.gather(&h, options.tolerance)?;
            for i in 0..n {
                unshot[i] = next[i] - h[i];
            }
            h = next;
        }
        if shots >= n.max(1) * options.max_iterations as usize {
            return Err(SolveError::NoConvergence {
                iterations: options.max_iterations,
                residual: residual.min(system.residual(&h, options.tolerance)?),
                tolerance: options.tolerance,
            });
        }
        for _ in 0..n.max(CHECK) {
            let Some(shooter) =
                (0..n).max_by(|&a, &b| flux(unshot[a], a).total_cmp(&flux(unshot[b], b)))
            else {
                break;
            };
            let shot = system.rho[shooter] * std::mem::take(&mut unshot[shooter]);
            for (i, f) in columns.column(shooter) {
                h[i] += shot * f;
                unshot[i] += shot * f;
            }
            shots += 1;
        }
        progress.advance(1)?;
    }
}
