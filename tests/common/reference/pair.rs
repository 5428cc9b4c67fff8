//! What two triangles exchange.

use std::f64::consts::PI;

use glam::DVec3;

use super::super::contour::exchange;
use super::super::random::{Even, Random};
use super::tracer::Tracer;

/// What two triangles exchange, as found by rays.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// S_ij = A_i F_ij = A_j F_ji, m².
    pub exchange: f64,
    /// Standard error of it, m².
    pub error: f64,
    /// S_ij if nothing were in between, m²: by integrals along the outlines.
    pub open: f64,
    /// The same by the points that the rays go between, and the standard error of it, m².
    pub sampled: [f64; 2],
    /// Rays that count, and those of them that arrive.
    pub rays: [u64; 2],
}

/// What triangles `i` and `j` exchange.
///
/// ```text
/// S = v S_open        v = Σ w V / Σ w        w: kernel over density
/// ```
///
/// In each of `turns` independent turns, `points` pairs of points are drawn evenly: where the
/// triangles are near each other, a point of the smaller one and a direction, uniform in the solid
/// angle of the other; else a point of either. Differences between turns tell the standard error.
pub fn pair(
    tracer: &Tracer,
    [i, j]: [usize; 2],
    [turns, points]: [u32; 2],
    random: &mut Random,
) -> Pair {
    let (i, j) = if tracer.area(i) <= tracer.area(j) { (i, j) } else { (j, i) };
    let open = exchange(&tracer.corners(i), &tracer.corners(j));
    let (mut weights, mut seen) = (Vec::new(), Vec::new());
    let mut rays = [0, 0];
    let near = are_near(tracer.corners(i), tracer.corners(j));
    for _ in 0..turns {
        let (mut all, mut clear) = (0.0, 0.0);
        let mut even = Even::new(random);
        for _ in 0..points {
            let u = even.point();
            let drawn = if near { by_angle(tracer, i, j, u) } else { by_area(tracer, i, j, u) };
            let Some((x, y, weight)) = drawn else { continue };
            all += weight;
            rays[0] += 1;
            if tracer.clear(x, y, i, j) {
                clear += weight;
                rays[1] += 1;
            }
        }
        weights.push(tracer.area(i) * all / f64::from(points));
        seen.push(tracer.area(i) * clear / f64::from(points));
    }
    let n = f64::from(turns);
    let [mean, mean_seen] = [&weights, &seen].map(|x| x.iter().sum::<f64>() / n);
    let error_of = |off: &dyn Fn(usize) -> f64| {
        let squares: f64 = (0..weights.len()).map(|k| off(k).powi(2)).sum();
        (squares / (n * (n - 1.0))).sqrt()
    };
    // Where no point counts nothing is known.
    let visible = if mean > 0.0 { mean_seen / mean } else { 0.5 };
    let of_fraction = error_of(&|k| seen[k] - visible * weights[k]) / mean.max(f64::MIN_POSITIVE);
    // Where all rays agree, the next might not.
    let least = if rays[0] > 0 { 1.0 / rays[0] as f64 } else { 0.5 };
    let sampled = [mean, error_of(&|k| weights[k] - mean)];
    Pair { exchange: visible * open, error: of_fraction.max(least) * open, open, sampled, rays }
}

/// Whether the kernel varies much over two triangles.
fn are_near(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let ball = |t: [DVec3; 3]| {
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        (middle, t.iter().map(|v| v.distance(middle)).fold(0.0, f64::max))
    };
    let ((p, r), (q, s)) = (ball(a), ball(b));
    p.distance(q) < 3.0 * (r + s)
}

type Drawn = Option<(DVec3, DVec3, f64)>;

/// A point of either triangle, and cos θ cos θ' / (π r²) times the area of the second.
fn by_area(tracer: &Tracer, i: usize, j: usize, u: [f64; 4]) -> Drawn {
    let (x, y) = (tracer.point(i, u[0], u[1]), tracer.point(j, u[2], u[3]));
    let d = y - x;
    let (a, b) = (d.dot(tracer.normal(i)), -d.dot(tracer.normal(j)));
    let square = d.length_squared();
    (a > 0.0 && b > 0.0).then(|| (x, y, a * b / (PI * square * square) * tracer.area(j)))
}

/// A point of the first triangle, one of the second, uniform in solid angle, and cos θ / π times
/// the solid angle of the second.
fn by_angle(tracer: &Tracer, i: usize, j: usize, u: [f64; 4]) -> Drawn {
    let x = tracer.point(i, u[0], u[1]);
    let n = tracer.normal(j);
    let height = (x - tracer.corners(j)[0]).dot(n);
    if height <= 0.0 {
        return None;
    }
    let (direction, angle) = in_solid_angle(tracer.corners(j).map(|v| v - x), u[2], u[3])?;
    let cosine = direction.dot(tracer.normal(i));
    let along = -height / direction.dot(n);
    let fine = cosine > 0.0 && along.is_finite() && along > 0.0;
    fine.then(|| (x, x + direction * along, cosine * angle / PI))
}

/// A unit direction, uniform in the solid angle of a triangle about the origin, and that angle
/// (Arvo 1995, "Stratified sampling of spherical triangles").
fn in_solid_angle(corners: [DVec3; 3], u: f64, v: f64) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(|v| v.normalize_or_zero());
    // Van Oosterom & Strackee 1983, "The solid angle of a plane triangle".
    let triple = a.dot(b.cross(c)).abs();
    let angle = 2.0 * triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    let corner = |p: DVec3, q: DVec3, r: DVec3| {
        let [s, t] = [p.cross(q).normalize_or_zero(), p.cross(r).normalize_or_zero()];
        s.cross(t).length().atan2(s.dot(t))
    };
    let alpha = corner(a, b, c);
    let (sin, cos) = (u * angle - alpha).sin_cos();
    let (sin_alpha, cos_alpha) = alpha.sin_cos();
    let p = cos - cos_alpha;
    let q = sin + sin_alpha * a.dot(b);
    let along = ((q * cos - p * sin) * cos_alpha - q) / ((q * sin + p * cos) * sin_alpha);
    let along = along.clamp(-1.0, 1.0);
    let across = |x: DVec3, y: DVec3| (x - y * x.dot(y)).normalize_or_zero();
    let d = a * along + across(c, a) * (1.0 - along * along).sqrt();
    let z = 1.0 - v * (1.0 - d.dot(b));
    let found = b * z + across(d, b) * (1.0 - z * z).max(0.0).sqrt();
    found.is_finite().then_some((found, angle))
}
