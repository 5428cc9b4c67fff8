//! Delta form factors: the share of a hemicube's light that each of its pixels receives.

use std::f64::consts::PI;

use crate::form_factors::ONE;

/// Form factor from a point to a parallel rectangle at distance 1 with one corner on its axis and
/// sides `x` and `y`. Odd in both.
#[must_use]
pub fn parallel_rectangle(x: f64, y: f64) -> f64 {
    let (a, b) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / a * (y / a).atan() + y / b * (x / b).atan()) / (2.0 * PI)
}

/// Form factor from a point to a perpendicular rectangle at distance 1 whose foot lies in the
/// point's plane: from the axis `width` to one side (odd), `height` upwards.
#[must_use]
pub fn perpendicular_rectangle(width: f64, height: f64) -> f64 {
    let h = (1.0 + height * height).sqrt();
    (width.atan() - (width / h).atan() / h) / (2.0 * PI)
}

/// Delta form factors of a hemicube in units of 1 / [`ONE`], row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeltaFormFactors {
    /// Pixels along the top.
    pub resolution: usize,
    /// `resolution`² weights of the top.
    pub top: Vec<u32>,
    /// `resolution` × `resolution / 2` weights of each of the four sides.
    pub side: Vec<u32>,
}

impl DeltaFormFactors {
    /// The exact point-to-rectangle factor of each pixel, rounded such that top + 4 sides is
    /// exactly [`ONE`]. Rounding is carried forward from pixel to pixel. `resolution` is even.
    #[must_use]
    pub fn new(resolution: usize) -> Self {
        let n = resolution;
        let at = |i: usize| -1.0 + 2.0 * i as f64 / n as f64;
        let cell = |f: fn(f64, f64) -> f64, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| {
            (f(x1, y1) - f(x0, y1)) - (f(x1, y0) - f(x0, y0))
        };
        let grid = |f: fn(f64, f64) -> f64, rows: std::ops::Range<usize>| -> Vec<f64> {
            rows.flat_map(|j| (0..n).map(move |i| cell(f, [at(i), at(i + 1)], [at(j), at(j + 1)])))
                .collect()
        };
        let side = grid(perpendicular_rectangle, n / 2..n);
        let top = grid(parallel_rectangle, 0..n);
        let one = f64::from(ONE);
        let side_total = (side.iter().sum::<f64>() * one).round();
        let side = to_fixed_point(&side, side_total);
        let top = to_fixed_point(&top, 4.0_f64.mul_add(-side_total, one));
        Self { resolution, top, side }
    }
}

/// Integers in proportion to `weights` whose sum is exactly `total`.
fn to_fixed_point(weights: &[f64], total: f64) -> Vec<u32> {
    let scale = total / weights.iter().sum::<f64>();
    let (mut sum, mut given) = (0.0, 0.0);
    let last = weights.len() - 1;
    let mut fixed: Vec<u32> = weights[..last]
        .iter()
        .map(|w| {
            sum += w * scale;
            let weight = sum.round() - given;
            given += weight;
            weight as u32
        })
        .collect();
    fixed.push((total - given) as u32);
    fixed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_point_factors() {
        assert!((parallel_rectangle(1.0, 1.0) - 0.138_531_606).abs() < 1e-9);
        assert!((perpendicular_rectangle(1.0, 1.0) - 0.055_734_197).abs() < 1e-9);
    }

    #[test]
    fn weights_sum_to_exactly_one() {
        for n in (16..=256).step_by(2).chain([500, 512, 1000, 1024]) {
            let d = DeltaFormFactors::new(n);
            let sum = |w: &[u32]| w.iter().map(|&w| u64::from(w)).sum::<u64>();
            assert_eq!(sum(&d.top) + 4 * sum(&d.side), u64::from(ONE), "{n}");
            assert_eq!((d.top.len(), d.side.len()), (n * n, n * n / 2));
            assert!(d.side.iter().all(|&w| w < u32::MAX / 16));
        }
    }

    #[test]
    fn weights_follow_the_cosine_law_of_their_direction() {
        // dF = dA / (π (x² + y² + 1)²) on top, z dA / (π (y² + z² + 1)²) on a side.
        let n = 128;
        let d = DeltaFormFactors::new(n);
        let area = (2.0 / n as f64).powi(2);
        let at = |i: usize| -1.0 + (2.0 * i as f64 + 1.0) / n as f64;
        for (i, j) in [(3, 90), (64, 64), (127, 0)] {
            let (x, y) = (at(i), at(j));
            let exact = area / (PI * (x * x + y * y + 1.0).powi(2));
            let got = f64::from(d.top[j * n + i]) / f64::from(ONE);
            assert!((got / exact - 1.0).abs() < 1e-3, "top {i} {j}: {got} {exact}");
        }
        for (i, j) in [(3, 40), (64, 20), (127, 63)] {
            let (y, z) = (at(i), at(j + n / 2));
            let exact = z * area / (PI * (y * y + z * z + 1.0).powi(2));
            let got = f64::from(d.side[j * n + i]) / f64::from(ONE);
            assert!((got / exact - 1.0).abs() < 1e-3, "side {i} {j}: {got} {exact}");
        }
    }
}
