//! The energy balance `H = D + F (ρ H)` as a linear system, and its residual.

use crate::form_factors::{FormFactors, Values};
use crate::patches::PatchId;
use crate::ranks::RanksError;
use crate::scene::Rgb;

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

impl System<'_> {
    /// `ρ H` of patch `i`.
    pub(super) fn reflected(&self, h: &[Rgb], i: usize) -> Rgb {
        self.rho[i] * h[i]
    }

    /// `D + F ρ H` of every patch with a row, `D` of those without; to within a small fraction of
    /// `tolerance`, which is relative to the whole.
    ///
    /// # Errors
    /// If ranks share the rows and cannot reach each other.
    pub fn gather(&self, h: &[Rgb], tolerance: f64) -> Result<Vec<Rgb>, RanksError> {
        let reflected = self.factors.values(tolerance, |i| self.reflected(h, i));
        let own = self.factors.of_own(|i| self.gathered(i, &reflected));
        self.factors.share_values(own, tolerance)
    }

    /// The same of one patch.
    pub(super) fn gathered(&self, i: PatchId, reflected: &Values) -> Rgb {
        self.direct[i.index()] + self.factors.gather_values(i, reflected)
    }

    /// The residual of `h`, to within a small fraction of `tolerance`.
    ///
    /// # Errors
    /// As [`gather`](Self::gather).
    pub fn residual(&self, h: &[Rgb], tolerance: f64) -> Result<f64, RanksError> {
        let next = self.gather(h, tolerance)?;
        Ok(relative(&next, h, self.direct))
    }
}

/// `‖a - b‖ / ‖scale‖`, the worst of three channels; 0 if all is dark, infinite if not a number.
pub(super) fn relative(a: &[Rgb], b: &[Rgb], scale: &[Rgb]) -> f64 {
    let mut sums = Rgb::ZERO;
    for (a, b) in a.iter().zip(b) {
        sums += (*a - *b) * (*a - *b);
    }
    let norm: Rgb = scale.iter().map(|s| *s * *s).sum();
    (0..3)
        .map(|c| if norm[c] > 0.0 { (sums[c] / norm[c]).sqrt() } else { sums[c].sqrt() })
        .fold(0.0, |worst, r| if r.is_nan() { f64::INFINITY } else { r.max(worst) })
}
