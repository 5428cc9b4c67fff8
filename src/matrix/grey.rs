//! The exchange between grey surfaces: what arrives on all ways, by reflection too.

use rayon::prelude::*;
use thiserror::Error;

use super::lumped::Lumped;
use super::rows::Rows;
use crate::progress::{Cancelled, Progress};
use crate::solve::direct_bytes;
use crate::solve::lu::Lu;
use crate::units::Bytes;

/// Why there are no factors of grey surfaces.
#[derive(Debug, Error)]
pub enum GreyError {
    /// The dense matrix does not fit in memory.
    #[error(
        "factors between {surfaces} grey surfaces take about {}, {} are allowed",
        Bytes(*needed), Bytes(*allowed)
    )]
    Memory {
        /// Number of surfaces.
        surfaces: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// What arrives by reflection too: rows of `F (I - diag(ρ) F)⁻¹`, ρ = 1 - ε.
pub(crate) struct Reflected<'a>(Lu<'a>);

impl<'a> Reflected<'a> {
    /// `factors` are those of a matrix, row by row, and are used up; ε are the emittances, 0..1.
    pub fn new(
        factors: &'a mut [f64],
        emittances: &[f64],
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let n = emittances.len();
        // Row by row is column by column of the transpose, which makes rows of the result.
        for (i, row) in factors.chunks_exact_mut(n.max(1)).enumerate() {
            row.iter_mut().for_each(|f| *f *= emittances[i] - 1.0);
            row[i] += 1.0;
        }
        Ok(Self(Lu::new(factors, n, progress)?))
    }

    /// Replaces a row of F by that of the product.
    pub fn row(&self, row: &mut [f64]) {
        self.0.solve(row);
    }
}

/// Bytes of a factor of the result: its column and itself.
const ENTRY_BYTES: u64 = 12;

/// The total exchange factors of grey diffuse surfaces, which count reflection between them too
/// (script-F; Hottel & Sarofim 1967, "Radiative Transfer"):
///
/// ```text
/// 𝓕 = diag(ε) F (I - diag(ρ) F)⁻¹ diag(ε),   ρ = 1 - ε
/// ```
///
/// The net heat flow from i to j is σ A_i 𝓕_ij (T_i⁴ - T_j⁴). `emittances` are those of the rows,
/// above 0 and at most 1. A row of an enclosure sums to its emittance, and what is reciprocal stays
/// so. Takes at most `memory` bytes.
///
/// # Errors
/// If it does not fit in memory, or `progress` stops it.
pub fn grey(
    factors: &Lumped,
    emittances: &[f64],
    memory: u64,
    progress: &dyn Progress,
) -> Result<Lumped, GreyError> {
    let n = factors.len();
    let entries = n as u64 * n as u64;
    let needed = direct_bytes(n) + ENTRY_BYTES * entries;
    let too_large = || GreyError::Memory { surfaces: n, needed, allowed: memory };
    if needed > memory {
        return Err(too_large());
    }
    let mut matrix = Vec::new();
    matrix.try_reserve_exact(n * n).map_err(|_| too_large())?;
    matrix.resize(n * n, 0.0);
    progress.stage("emittances", n as u64);
    for (i, row) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
        factors.entries_of(i).for_each(|(j, f)| row[j] = f);
    }
    let reflected = Reflected::new(&mut matrix, emittances, progress)?;
    let rows = (0..n).into_par_iter().map(|i| {
        let mut row = vec![0.0; n];
        factors.entries_of(i).for_each(|(j, f)| row[j] = f);
        reflected.row(&mut row);
        progress.advance(1)?;
        let own = emittances[i];
        let seen = (0_u32..).zip(row.iter().zip(emittances)).filter(|e| *e.1.0 > 0.0);
        Ok(seen.map(|(j, (z, other))| (j, own * z * other)).unzip())
    });
    let rows = rows.collect::<Result<_, Cancelled>>()?;
    Ok(Lumped { rows, ..factors.clone() })
}
