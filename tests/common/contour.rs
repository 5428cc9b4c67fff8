//! What two plane convex polygons exchange where nothing is in between, by integrals along their
//! outlines: an oracle that shares no code with the engines.
//!
//! ```text
//! S_12 = A_1 F_12 = 1 / (2 π) ∮ ∮ ln r dx_1 · dx_2
//! ```
//!
//! Hottel & Sarofim (1967), "Radiative transfer". The integral along an edge of the second outline
//! has a closed form; that along an edge of the first goes by Takahasi & Mori (1974), "Double
//! exponential formulas for numerical integration", which bears the logarithms where edges meet.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

/// What two polygons exchange, m². Of each only what lies before the other's plane counts; fronts
/// are where corners run counter-clockwise.
pub fn exchange(a: &[DVec3], b: &[DVec3]) -> f64 {
    let (a, b) = (before(a, plane_of(b)), before(b, plane_of(a)));
    if a.len() < 3 || b.len() < 3 {
        return 0.0;
    }
    // The unit of length cancels if outlines are closed; taken out it costs fewer digits.
    let scale = a.iter().chain(&b).map(|v| v.distance(a[0])).fold(0.0, f64::max);
    let edges = |p: &[DVec3]| -> Vec<[DVec3; 2]> {
        let at = |k: usize| (p[k % p.len()] - a[0]) / scale;
        (0..p.len()).map(|k| [at(k), at(k + 1)]).collect()
    };
    let (edges_a, edges_b) = (edges(&a), edges(&b));
    let mut sum = 0.0;
    for &e in &edges_a {
        for &f in &edges_b {
            sum += along_both(e, f);
        }
    }
    // Outlines run the same way round their normals, which face each other.
    (sum / TAU * scale * scale).max(0.0)
}

/// Unit normal n and d of the plane n · x = d of a polygon.
fn plane_of(p: &[DVec3]) -> (DVec3, f64) {
    let middle = p.iter().sum::<DVec3>() / p.len() as f64;
    let area: DVec3 =
        (0..p.len()).map(|k| (p[k] - middle).cross(p[(k + 1) % p.len()] - middle)).sum();
    let n = area.normalize();
    (n, n.dot(middle))
}

/// What of a convex polygon lies before a plane.
fn before(p: &[DVec3], (n, d): (DVec3, f64)) -> Vec<DVec3> {
    let size = p.iter().map(|v| v.distance(p[0])).fold(0.0, f64::max);
    // Corners that are meant to lie in the plane: rounding of a rotation and of single precision.
    let touch = 1e-12 * size;
    let height: Vec<f64> = p.iter().map(|v| n.dot(*v) - d).collect();
    if height.iter().all(|&h| h <= touch) {
        return Vec::new();
    }
    let mut kept = Vec::with_capacity(p.len() + 1);
    for k in 0..p.len() {
        let next = (k + 1) % p.len();
        let [h, g] = [height[k], height[next]];
        if h >= -touch {
            kept.push(p[k]);
        }
        if h.abs() > touch && g.abs() > touch && h * g < 0.0 {
            kept.push(p[k].lerp(p[next], h / (h - g)));
        }
    }
    kept
}

/// ∫ ∫ ln r dx_1 · dx_2 along two edges.
fn along_both([a, b]: [DVec3; 2], f: [DVec3; 2]) -> f64 {
    let (e, g) = (b - a, f[1] - f[0]);
    let (length, other) = (e.length(), g.length());
    let cosine = e.dot(g) / (length * other);
    if length == 0.0 || other == 0.0 || cosine.abs() < 1e-15 {
        return 0.0;
    }
    // Where an end of the other edge comes near, the integrand bends: pieces end there.
    let mut cuts = vec![0.0, 1.0];
    for end in f {
        let t = (end - a).dot(e) / (length * length);
        let away = (end - (a + e * t)).length();
        if t > 0.0 && t < 1.0 && away < 0.2 * length {
            cuts.push(t);
        }
    }
    cuts.sort_by(f64::total_cmp);
    let pieces = cuts.windows(2).map(|w| piece(a + e * w[0], a + e * w[1], f));
    pieces.sum::<f64>() * cosine
}

/// ∫ of the closed form along a piece of an edge.
fn piece(a: DVec3, b: DVec3, f: [DVec3; 2]) -> f64 {
    let at = |(near, end): (f64, bool)| if end { b + (a - b) * near } else { a + (b - a) * near };
    let values = points().map(|(near, end, weight)| weight * logarithm(at((near, end)), f));
    values.sum::<f64>() * (b - a).length()
}

/// Points of an interval, each as a fraction of it, counted from its end if so marked, and a
/// weight; the weights sum to 1.
pub fn points() -> impl Iterator<Item = (f64, bool, f64)> {
    /// Points lie evenly in the variable s of x = tanh(π/2 sinh s), |s| <= 3.2; beyond it weights
    /// are below 10⁻¹⁵.
    const HALF: i32 = 24;
    const STEP: f64 = 3.2 / HALF as f64;
    (-HALF..=HALF).map(|k| {
        let s = STEP * f64::from(k);
        let inner = FRAC_PI_2 * s.sinh();
        let weight = 0.5 * FRAC_PI_2 * s.cosh() / inner.cosh().powi(2) * STEP;
        // From the nearer end, so that no digits are lost beside it.
        let near = 0.5 * (-inner.abs()).exp() / inner.cosh();
        (near, k >= 0, weight)
    })
}

/// ∫ f dx from `a` to `b`, where f may be singular at the ends.
pub fn integral(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let at = |near: f64, end: bool| if end { b + (a - b) * near } else { a + (b - a) * near };
    points().map(|(near, end, weight)| weight * f(at(near, end))).sum::<f64>() * (b - a)
}

/// ∫ ln r along an edge, as seen from a point.
fn logarithm(x: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let length = (b - a).length();
    let u = (b - a) / length;
    let along = (x - a).dot(u);
    let away = (x - a - u * along).length();
    let upper = |t: f64| {
        let square = t * t + away * away;
        if square == 0.0 {
            return 0.0;
        }
        let turn = if away > 0.0 { away * (t / away).atan() } else { 0.0 };
        0.5 * t * square.ln() - t + turn
    };
    upper(length - along) - upper(-along)
}
