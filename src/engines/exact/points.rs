//! Points of a polygon, spread evenly over its area or over the solid angle under which it appears.

use glam::DVec3;

use super::polygon::{Polygon, area};
use crate::engines::sampling::on_triangle;

/// A polygon as triangles, to draw points of it.
pub(super) struct Area {
    /// In m².
    pub area: f64,
    /// Corner and two edges of each.
    triangles: [[DVec3; 3]; 3],
    /// Fraction of the area up to the end of each, and the inverse of its own.
    upto: [f64; 3],
    inverse: [f64; 3],
}

impl Area {
    pub fn new(p: &Polygon) -> Self {
        let total = p.area();
        let mut me = Self {
            area: total,
            triangles: [[DVec3::ZERO; 3]; 3],
            upto: [2.0; 3],
            inverse: [0.0; 3],
        };
        let mut sum = 0.0;
        for (k, [a, b, c]) in p.fan().enumerate().take(3) {
            let fraction = area([a, b, c]) / total;
            sum += fraction;
            me.triangles[k] = [a, b - a, c - a];
            me.inverse[k] = if fraction > 0.0 { 1.0 / fraction } else { 0.0 };
            me.upto[k] = if k + 3 == p.corners().len() { 2.0 } else { sum };
        }
        me
    }

    /// The point with coordinates in the unit square, uniform in area.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let k = self.upto.iter().position(|&end| u < end).unwrap_or(0);
        let before = if k > 0 { self.upto[k - 1] } else { 0.0 };
        let u = ((u - before) * self.inverse[k]).min(1.0);
        let (s, t) = on_triangle(u, v);
        let [a, b, c] = self.triangles[k];
        a + b * s + c * t
    }
}

/// The point of a polygon of up to five corners with coordinates in the unit square, uniform in the
/// solid angle about `x`, and that angle in sr; `None` if it has none.
pub(super) fn point_by_angle(q: &Polygon, x: DVec3, u: f64, v: f64) -> Option<(DVec3, f64)> {
    let mut seen = [None; 3];
    seen.iter_mut().zip(q.fan()).for_each(|(seen, t)| *seen = Apparent::new(t, x));
    let triangles = || seen.iter().flatten();
    let total: f64 = triangles().map(|p| p.angle).sum();
    let mut left = u * total;
    let hit = triangles().find(|p| {
        left -= p.angle;
        left <= 0.0
    });
    let triangle = hit.or(triangles().last())?;
    let d = triangle.direction((left / triangle.angle + 1.0).clamp(0.0, 1.0), v);
    let t = q.normal.dot(q.corners()[0] - x) / q.normal.dot(d);
    t.is_finite().then_some((x + d * t, total))
}

/// A triangle seen from a point, as a spherical triangle.
#[derive(Debug, Clone, Copy)]
struct Apparent {
    /// Unit directions to the corners.
    corners: [DVec3; 3],
    /// Sine and cosine of the angle at the first corner.
    sine: f64,
    cosine: f64,
    /// Cosine of the side from the first to the second corner.
    side: f64,
    /// Solid angle in sr.
    angle: f64,
}

impl Apparent {
    /// The triangle with corners `t` from `x`; none if it has no solid angle.
    fn new(t: [DVec3; 3], x: DVec3) -> Option<Self> {
        let [a, b, c] = t.map(|p| (p - x).normalize_or_zero());
        let [ab, bc, ca] = [a.cross(b), b.cross(c), c.cross(a)];
        let (across, along) = (ca.cross(ab).length(), -ca.dot(ab));
        let unit = 1.0 / (across * across + along * along).sqrt();
        let (sine, cosine) = (across * unit, along * unit);
        // Van Oosterom & Strackee (1983): accurate for small triangles, too.
        let volume = a.dot(bc).abs();
        let angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let fine = angle > 1e-9 && sine > 0.0;
        fine.then_some(Self { corners: [a, b, c], sine, cosine, side: a.dot(b), angle })
    }

    /// The direction with coordinates in the unit square, uniform in solid angle: Arvo (1995).
    fn direction(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.corners;
        // Sine and cosine of the angle of what is cut off, less that at the first corner.
        let (s, t) = (u * self.angle).sin_cos();
        let (s, t) = (s * self.cosine - t * self.sine, t * self.cosine + s * self.sine);
        let (p, q) = (t - self.cosine, s + self.sine * self.side);
        let along = ((q * t - p * s) * self.cosine - q) / ((q * s + p * t) * self.sine);
        let along = along.clamp(-1.0, 1.0);
        let end = a * along + across(c, a) * (1.0 - along * along).sqrt();
        let z = 1.0 - v * (1.0 - end.dot(b));
        b * z + across(end, b) * (1.0 - z * z).max(0.0).sqrt()
    }
}

/// The unit vector across `to`, towards `p`.
fn across(p: DVec3, to: DVec3) -> DVec3 {
    (p - to * p.dot(to)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn directions_are_spread_evenly() {
        let t = [dvec3(0.0, 0.0, 1.0), dvec3(2.0, 0.3, 1.0), dvec3(0.2, 1.5, 0.7)];
        let whole = Apparent::new(t, DVec3::ZERO).unwrap();
        // The triangles on both sides of a line through a corner get their fractions of the points.
        let middle = 0.3 * t[1] + 0.7 * t[2];
        let part = Apparent::new([t[0], t[1], middle], DVec3::ZERO).unwrap();
        let rest = Apparent::new([t[0], middle, t[2]], DVec3::ZERO).unwrap();
        assert!((part.angle + rest.angle - whole.angle).abs() < 1e-12);
        let (wall, mut count, n) = (t[0].cross(middle), 0, 200);
        let normal = (t[1] - t[0]).cross(t[2] - t[0]);
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
                let d = whole.direction(at(i), at(j));
                assert!((d.length() - 1.0).abs() < 1e-9);
                let p = d * (normal.dot(t[0]) / normal.dot(d));
                for k in 0..3 {
                    let edge = t[(k + 1) % 3] - t[k];
                    assert!(normal.dot(edge.cross(p - t[k])) > -1e-9);
                }
                count += i32::from(wall.dot(d) * wall.dot(t[1]) > 0.0);
            }
        }
        let fraction = f64::from(count) / f64::from(n * n);
        assert!((fraction - part.angle / whole.angle).abs() < 2e-3, "{fraction}");
    }
}
