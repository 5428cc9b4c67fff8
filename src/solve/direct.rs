//! Exact solution by elimination, O(n³): [`Lu`] factors of the dense matrix.

use super::lu::Lu;
use super::{Method, SolveError, SolveOptions, SolveReport, System};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};
use crate::scene::Rgb;

/// Bytes of one number of the dense matrix.
const NUMBER: u64 = 8;

/// Share of the matrix's memory that the elimination needs beside it, at most.
const BESIDE: f64 = 0.1;

/// Bytes that the solution for that many unknowns takes beside their rows.
#[must_use]
pub fn bytes(unknowns: usize) -> u64 {
    let matrix = NUMBER * unknowns as u64 * unknowns as u64;
    matrix + (BESIDE * matrix as f64) as u64
}

/// `(I - F diag(ρ_c)) H_c = D_c` for the patches with a row; the others have `H = D` and move to
/// the right-hand side. Channels with equal reflectances share one factorisation.
pub(super) fn solve(
    system: &System<'_>,
    options: &SolveOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Rgb>, SolveReport), SolveError> {
    let unknowns: Vec<PatchId> = (0..system.factors.len() as u32)
        .map(PatchId)
        .filter(|&i| system.factors.has_row(i))
        .collect();
    let n = unknowns.len();
    let needed = bytes(n);
    let too_large = || SolveError::TooLarge { patches: n, needed, allowed: options.memory };
    if needed > options.memory {
        return Err(too_large());
    }
    let mut matrix = Vec::new();
    matrix.try_reserve_exact(n * n).map_err(|_| too_large())?;
    matrix.resize(n * n, 0.0);

    let mut h = system.direct.to_vec();
    let mut open = vec![0, 1, 2];
    let mut factorisations = 0;
    while let Some(&channel) = open.first() {
        let equal =
            |c: &usize| unknowns.iter().all(|i| rho(system, *i, *c) == rho(system, *i, channel));
        let (channels, rest): (Vec<usize>, Vec<usize>) = open.iter().partition(|c| equal(c));
        open = rest;
        eliminate(system, &unknowns, &channels, &mut matrix, &mut h, progress)?;
        factorisations += 1;
        progress.advance(1)?;
    }
    let residual = system.residual(&h, options.tolerance)?;
    // A singular system (a closed room that absorbs nothing) has no finite solution.
    if residual <= options.tolerance {
        Ok((h, SolveReport { method: Method::Direct, iterations: factorisations, residual }))
    } else {
        Err(SolveError::NoConvergence {
            iterations: factorisations,
            residual,
            tolerance: options.tolerance,
        })
    }
}

fn rho(system: &System<'_>, i: PatchId, channel: usize) -> f64 {
    system.rho[i.index()][channel]
}

/// Solves for the given channels, which have the same reflectances.
fn eliminate(
    system: &System<'_>,
    unknowns: &[PatchId],
    channels: &[usize],
    matrix: &mut [f64],
    h: &mut [Rgb],
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    let n = unknowns.len();
    let mut place = vec![None; system.factors.len()];
    for (k, i) in unknowns.iter().enumerate() {
        place[i.index()] = Some(k);
    }
    matrix.fill(0.0);
    let mut right = vec![0.0; n * channels.len()];
    for (row, &i) in unknowns.iter().enumerate() {
        matrix[row * n + row] = 1.0;
        for (c, &channel) in channels.iter().enumerate() {
            right[c * n + row] = system.direct[i.index()][channel];
        }
        for (j, f) in system.factors.row(i).iter().flat_map(|r| r.entries()) {
            let f = f * rho(system, j, channels[0]);
            if let Some(column) = place[j.index()] {
                matrix[column * n + row] -= f;
            } else {
                for (c, &channel) in channels.iter().enumerate() {
                    right[c * n + row] += f * system.direct[j.index()][channel];
                }
            }
        }
    }
    let factors = Lu::new(matrix, n, progress)?;
    right.chunks_exact_mut(n.max(1)).for_each(|x| factors.solve(x));
    for (row, i) in unknowns.iter().enumerate() {
        for (c, &channel) in channels.iter().enumerate() {
            h[i.index()][channel] = right[c * n + row];
        }
    }
    Ok(())
}
