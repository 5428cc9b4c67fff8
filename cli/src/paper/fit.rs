//! How time grows with the number of patches.

/// Exponent `p` and factor `c` of `t = c n^p`, by least squares on logarithms; `None` if there are
/// fewer than two different `n`.
pub fn power_law(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let logs: Vec<(f64, f64)> = points.iter().map(|&(n, t)| (n.ln(), t.ln())).collect();
    let k = logs.len() as f64;
    let mean = logs.iter().fold((0.0, 0.0), |m, l| (m.0 + l.0 / k, m.1 + l.1 / k));
    let (mut along, mut spread) = (0.0, 0.0);
    for (x, y) in logs {
        along += (x - mean.0) * (y - mean.1);
        spread += (x - mean.0) * (x - mean.0);
    }
    let p = along / spread;
    let c = (mean.1 - p * mean.0).exp();
    (p.is_finite() && c.is_finite()).then_some((p, c))
}

/// `n^1.23`, or nothing.
pub fn growth(points: &[(f64, f64)]) -> String {
    power_law(points).map_or_else(String::new, |(p, _)| format!("n^{p:.2}"))
}

/// The gain `T = (v2 - v1) / v1 · 100 %` of speed `v = 1 / t`.
pub fn gain(before: f64, after: f64) -> f64 {
    (before / after - 1.0) * 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_again() {
        let points = [10.0, 70.0, 300.0].map(|n: f64| (n, 0.2 * n.powf(1.7)));
        let (p, c) = power_law(&points).unwrap();
        assert!((p - 1.7).abs() < 1e-12 && (c - 0.2).abs() < 1e-12);
        assert_eq!(power_law(&points[..1]), None);
        assert_eq!(gain(3.0, 1.0), 200.0);
    }
}
