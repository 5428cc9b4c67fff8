//! Directions to a triangle, evenly spread over the solid angle under which it is seen.

use std::f64::consts::PI;

use glam::DVec3;

/// A unit direction from a point to a triangle, uniform in solid angle, by a point of the unit
/// square; and that solid angle, sr (Arvo 1995, "Stratified sampling of spherical triangles").
/// `None` where the triangle is seen edge on, or the point lies on it.
pub(super) fn toward(from: DVec3, corners: &[DVec3; 3], [u, v]: [f64; 2]) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(|p| (p - from).normalize_or_zero());
    let [ab, bc, ca] = [a.cross(b), b.cross(c), c.cross(a)].map(|n| n.try_normalize());
    let (ab, bc, ca) = (ab?, bc?, ca?);
    let angle = |p: DVec3, q: DVec3| (-p.dot(q)).clamp(-1.0, 1.0).acos();
    let (alpha, beta, gamma) = (angle(ab, ca), angle(bc, ab), angle(ca, bc));
    let area = alpha + beta + gamma - PI;
    /// Smaller ones are lost in rounding.
    const LEAST: f64 = 1e-9;
    if area < LEAST {
        return None;
    }
    // The part beside a, of that share of the area, ends at a point of the edge from a to c.
    let (s, t) = (u * area - alpha).sin_cos();
    let (sin, cos) = alpha.sin_cos();
    let (x, y) = (t - cos, s + sin * a.dot(b));
    let q = ((y * t - x * s) * cos - y) / ((y * s + x * t) * sin);
    let q = if q.is_finite() { q.clamp(-1.0, 1.0) } else { 1.0 };
    let along = |from: DVec3, to: DVec3, cos: f64| {
        let across = (to - from * to.dot(from)).normalize_or_zero();
        from * cos + across * (1.0 - cos * cos).max(0.0).sqrt()
    };
    let end = along(a, c, q);
    let z = 1.0 - v * (1.0 - end.dot(b));
    Some((along(b, end, z), area))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use glam::dvec3;

    use super::*;
    use crate::engines::sampling::Random;
    use crate::form_factors::kernel::point_to_polygon;

    #[test]
    fn the_mean_cosine_is_lamberts_formula() {
        let corners = [dvec3(-1.0, 0.3, 0.4), dvec3(2.0, -0.5, 1.5), dvec3(0.2, 1.8, 0.7)];
        let mut random = Random::new(7);
        let count = 40_000;
        let mut sum = 0.0;
        for _ in 0..count {
            let (way, area) = toward(DVec3::ZERO, &corners, random.numbers()).unwrap();
            // Within the cone of the corners.
            let [a, b, c] = corners;
            let inside = [a.cross(b), b.cross(c), c.cross(a)].map(|n| n.dot(way));
            assert!(inside.iter().all(|i| *i > -1e-9) || inside.iter().all(|i| *i < 1e-9));
            sum += way.z * area / PI;
        }
        let exact = point_to_polygon(DVec3::ZERO, DVec3::Z, &corners);
        assert!((sum / f64::from(count) / exact - 1.0).abs() < 0.01, "{sum} {exact}");
    }

    #[test]
    fn nothing_is_drawn_where_nothing_is_seen() {
        let corners = [dvec3(1.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(1.0, 1.0, 0.0)];
        assert!(toward(DVec3::ZERO, &corners, [0.3, 0.6]).is_none());
        assert!(toward(corners[0], &corners, [0.3, 0.6]).is_none());
    }
}
