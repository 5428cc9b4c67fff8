//! The energy balance `H = D + F (ρ H)` as a linear system, and its residual.

use rayon::prelude::*;

use crate::form_factors::FormFactors;
use crate::patches::PatchId;
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
    pub fn gather(&self, h: &[Rgb], tolerance: f64) -> Vec<Rgb> {
        let reflected = self.factors.values(tolerance, |i| self.reflected(h, i));
        self.direct
            .par_iter()
            .enumerate()
            .map(|(i, d)| *d + self.factors.gather_values(PatchId(i as u32), &reflected))
            .collect()
    }

    /// The residual of `h`, to within a small fraction of `tolerance`.
    pub fn residual(&self, h: &[Rgb], tolerance: f64) -> f64 {
        let next = self.gather(h, tolerance);
        relative(&next, h, self.direct)
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
