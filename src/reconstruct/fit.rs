//! Linear functions in space that fit the values of patches.

use glam::{DMat3, DVec3};

use crate::patches::PatchId;
use crate::scene::Rgb;

/// Weight of a vanishing gradient in the fit, relative to the spread of the centres: enough to hold
/// it where centres lie on a line or are a single one.
const DAMPING: f64 = 0.02;

/// An extrapolated value may leave the range of the values around it by this fraction of the range.
const OVERSHOOT: f64 = 0.5;

/// A linear function in space, kept near the range of the values that it was fitted to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linear {
    /// Weighted mean of the values, and the place of it, seen from the point that was fitted at.
    mean: Rgb,
    mean_offset: DVec3,
    /// Gradient of each channel.
    slope: [DVec3; 3],
    low: Rgb,
    high: Rgb,
}

impl Linear {
    /// Value at an offset from the point that was fitted at.
    pub fn at(&self, offset: DVec3) -> Rgb {
        let d = offset - self.mean_offset;
        let value = DVec3::from_array(self.slope.map(|s| s.dot(d))) + self.mean;
        value.clamp(self.low, self.high)
    }

    fn constant(value: Rgb) -> Self {
        let slope = [DVec3::ZERO; 3];
        Self { mean: value, mean_offset: DVec3::ZERO, slope, low: value, high: value }
    }
}

/// The linear function that fits the `ring`'s values best, those near `at` counting more.
pub(super) fn fit(at: DVec3, ring: &[PatchId], centres: &[DVec3], values: &[Rgb]) -> Linear {
    if ring.is_empty() {
        return Linear::constant(Rgb::ZERO);
    }
    let offsets = || ring.iter().map(|i| (centres[i.index()] - at, values[i.index()]));
    let nearest = offsets()
        .map(|(d, _)| d.length_squared())
        .filter(|&d| d > 0.0)
        .fold(f64::INFINITY, f64::min);
    let weight = |d: DVec3| 1.0 / (d.length_squared() + nearest).max(f64::MIN_POSITIVE);
    if nearest == f64::INFINITY {
        return Linear::constant(values[ring[0].index()]);
    }
    let (mut total, mut mean, mut mean_offset) = (0.0, Rgb::ZERO, DVec3::ZERO);
    let (mut low, mut high) = (Rgb::INFINITY, Rgb::NEG_INFINITY);
    for (d, h) in offsets() {
        let w = weight(d);
        total += w;
        mean += h * w;
        mean_offset += d * w;
        (low, high) = (low.min(h), high.max(h));
    }
    mean /= total;
    mean_offset /= total;
    let mut spread = DMat3::ZERO;
    let mut slope = [DVec3::ZERO; 3];
    for (d, h) in offsets() {
        let (w, d, h) = (weight(d), d - mean_offset, h - mean);
        spread += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * w;
        for c in 0..3 {
            slope[c] += d * (h[c] * w);
        }
    }
    let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
    if trace <= 0.0 {
        return Linear::constant(mean);
    }
    let inverse = (spread + DMat3::from_diagonal(DVec3::splat(DAMPING * trace))).inverse();
    let slack = (high - low) * OVERSHOOT;
    Linear {
        mean,
        mean_offset,
        slope: slope.map(|s| inverse * s),
        low: (low - slack).max(Rgb::ZERO),
        high: high + slack,
    }
}
