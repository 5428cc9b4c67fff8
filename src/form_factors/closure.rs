//! Closure: the form factors of an enclosure made consistent, so that every row sums to 1 and every
//! pair is reciprocal.
//!
//! Exchange areas `S_ij = A_i F_ij` of an enclosure are symmetric and sum to `A_i`. Those of an
//! engine are nearly so. First they are made symmetric, `S_ij = (A_i F_ij + A_j F_ji) / 2`, which
//! changes nothing where they are; then one positive number a patch scales them:
//!
//! ```text
//! F_ij = d_i S_ij d_j / A_i        Σ_j F_ij = 1        A_i F_ij = A_j F_ji
//! ```
//!
//! Such `d` are unique but for special patterns, and keep what is positive positive and what is
//! zero zero (Sinkhorn & Knopp 1967, "Concerning nonnegative matrices and doubly stochastic
//! matrices"; symmetric matrices: Csima & Datta 1972, "The DAD theorem for symmetric non-negative
//! matrices"). For form factors van Leersum (1989) and Lawson (1995, "An improved method for
//! smoothing approximate exchange areas") reach the same two conditions by other iterations. The
//! scales are found by Newton's method ([`scaling`]).

mod error;
mod exchange;
pub mod scaling;

pub use error::ClosureError;

use super::stored::FormFactors;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::visibility::COVERED;

/// A row that loses more than this to the environment and to backs belongs to no enclosure.
pub const OPEN: f64 = 0.01;

/// How a matrix was closed.
///
/// `F_ij = left_i S_ij right_j` in double precision, where `S` are the stored exchange areas: the
/// same number for both factors of a pair, so that `A_i F_ij = A_j F_ji` but for the rounding of
/// two products.
#[derive(Debug, Clone)]
pub struct Closure {
    /// Of each patch: scale over area, in the unit of the stored exchange areas.
    pub left: Vec<f64>,
    /// Of each patch: its scale d; 1 for those that exchange nothing.
    pub right: Vec<f64>,
    /// Patches that lie under something: their rows and columns are zero.
    pub covered: Vec<PatchId>,
    /// RMS of `A_i F_ij - A_j F_ji` over RMS of `A_i F_ij`, before.
    pub asymmetry: f64,
    /// Newton steps taken.
    pub steps: usize,
    /// Largest `|Σ_j F_ij - 1|` left.
    pub residual: f64,
    /// Form factors that the threshold left out.
    pub dropped: u64,
}

/// Closes the matrix of an enclosure: `factors` become exchange areas, to be scaled as the
/// [`Closure`] says. Pairs whose form factors are both below `threshold` (0..1) are dropped before,
/// but for the largest of a row.
///
/// `areas` (m²) are those of the patches; every row is stored as shares. Patches more than half of
/// whose view is covered by backs are left out and named.
pub fn close(
    factors: &mut FormFactors,
    areas: &[f64],
    threshold: f64,
    progress: &dyn Progress,
) -> Result<Closure, ClosureError> {
    let ids = || (0..factors.len() as u32).map(PatchId);
    let account = |i: PatchId| factors.account(i);
    let covered: Vec<bool> = ids().map(|i| account(i).back > COVERED).collect();
    let taken = |i: &PatchId| factors.has_row(*i) && !covered[i.index()];
    let lost = |i: PatchId| (i, account(i).environment + account(i).back);
    let open: Vec<(PatchId, f64)> = ids().filter(taken).map(lost).filter(|l| l.1 > OPEN).collect();
    if !open.is_empty() {
        return Err(ClosureError::Open(open));
    }
    let taken: Vec<bool> = ids().map(|i| taken(&i)).collect();
    let unit = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let sums: Vec<f64> = areas.iter().map(|a| a / unit).collect();
    let asymmetry = exchange::symmetrise(factors, &sums, &taken, progress)?;
    let before = factors.entries();
    if threshold > 0.0 {
        exchange::drop_pairs(factors, &sums, threshold)?;
    }
    let dropped = before - factors.entries();
    let rows = factors.plain_rows();
    let found = scaling::scale(&rows, &sums, &taken, progress).map_err(|e| match e {
        scaling::ScalingError::Stalled(rows) => {
            ClosureError::Stalled(rows.into_iter().map(|(i, s)| (PatchId(i as u32), s)).collect())
        }
        scaling::ScalingError::Cancelled(cancelled) => cancelled.into(),
    })?;
    Ok(Closure {
        left: found.scales.iter().zip(&sums).map(|(d, a)| d / a).collect(),
        right: found.scales,
        covered: (0_u32..).zip(&covered).filter(|c| *c.1).map(|c| PatchId(c.0)).collect(),
        asymmetry,
        steps: found.steps,
        residual: found.residual,
        dropped,
    })
}

#[cfg(test)]
mod tests;
