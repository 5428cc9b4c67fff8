//! View factors in closed form, or as one integral of it.

use std::f64::consts::PI;

use super::super::contour::integral;

/// Rectangles in parallel planes at distance `z`, sides parallel: from `[x0, x1, y0, y1]` to
/// another. Howell's catalogue, C-13; Ehlert & Smith (1993).
pub fn parallel(from: [f64; 4], to: [f64; 4], z: f64) -> f64 {
    let g = |x: f64, y: f64| {
        let [p, q] = [x, y].map(|t| (t * t + z * z).sqrt());
        let r = x * x + y * y + z * z;
        (y * p * (y / p).atan() + x * q * (x / q).atan() - 0.5 * z * z * r.ln()) / (2.0 * PI)
    };
    let mut sum = 0.0;
    for [i, j, k, l] in (0..16).map(|n| [n & 1, n >> 1 & 1, n >> 2 & 1, n >> 3]) {
        let sign = if (i + j + k + l) % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * g(from[i] - to[k], from[2 + j] - to[2 + l]);
    }
    sum / ((from[1] - from[0]) * (from[3] - from[2]))
}

/// Rectangles at a right angle with a common edge of length `l`: from that of width `w` to that of
/// height `h`. Howell's catalogue, C-14; Hamilton & Morgan (1952).
pub fn perpendicular(w: f64, h: f64, l: f64) -> f64 {
    let (w, h) = (w / l, h / l);
    let (a, b) = (w * w, h * h);
    let r = (a + b).sqrt();
    let logs = ((1.0 + a) * (1.0 + b) / (1.0 + a + b)).ln()
        + a * (a * (1.0 + a + b) / ((1.0 + a) * (a + b))).ln()
        + b * (b * (1.0 + a + b) / ((1.0 + b) * (a + b))).ln();
    let angles = w * (1.0 / w).atan() + h * (1.0 / h).atan() - r * (1.0 / r).atan();
    (angles + 0.25 * logs) / (PI * w)
}

/// A point to a parallel rectangle a × b at distance `c` over one of its corners.
pub fn corner(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let [p, q] = [x, y].map(|t| (1.0 + t * t).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

/// A point to a rectangle upright on its plane: `w` along its foot, `h` high, at distance `d`, the
/// point before an end of the foot.
pub fn upright_corner(w: f64, h: f64, d: f64) -> f64 {
    let r = (h * h + d * d).sqrt();
    ((w / d).atan() - d / r * (w / r).atan()) / (2.0 * PI)
}

/// Coaxial parallel discs of radii `r` and `s` at distance `h`. Howell's catalogue, C-41; Hamilton
/// & Morgan (1952).
pub fn discs(r: f64, s: f64, h: f64) -> f64 {
    let (a, b) = (r / h, s / h);
    let x = 1.0 + (1.0 + b * b) / (a * a);
    0.5 * (x - (x * x - 4.0 * (b / a).powi(2)).sqrt())
}

/// The inside of a cylinder of radius `outer` to the outside of a coaxial one of radius `inner`,
/// both `length` long. Rea (1975).
pub fn cylinders(outer: f64, inner: f64, length: f64) -> f64 {
    let (r, h) = (outer / inner, length / inner);
    let (a, b) = (h * h + r * r - 1.0, h * h - r * r + 1.0);
    let root = ((a + 2.0).powi(2) - 4.0 * r * r).sqrt();
    let ends = root * (b / (r * a)).acos() + b * (1.0 / r).asin() - 0.5 * PI * a;
    (1.0 - ((b / a).acos() - ends / (2.0 * h)) / PI) / r
}

/// A sphere to a coaxial disc of radius `r`, `h` from its centre. Feingold & Gupta (1970).
pub fn sphere_to_disc(r: f64, h: f64) -> f64 {
    0.5 * (1.0 - 1.0 / (1.0 + (r / h).powi(2)).sqrt())
}

/// Two unit squares that face each other at distance 1, and between them, at that height over the
/// first, a rectangle that covers x and y from one number to another.
///
/// ```text
/// F = ∫ ∫ (w₀(u) w₀(v) - w_x(u) w_y(v)) / (π (1 + u² + v²)²) du dv
/// ```
///
/// u is how far a line between the squares goes along x, w₀ the length of what it may start from,
/// and w what of that leads through the rectangle.
pub fn behind(x: [f64; 2], y: [f64; 2], height: f64) -> f64 {
    let whole = |u: f64| [(-u).max(0.0), (1.0 - u).min(1.0)];
    let open = |u: f64| (whole(u)[1] - whole(u)[0]).max(0.0);
    let through = |u: f64, [low, high]: [f64; 2]| {
        let [from, to] = whole(u);
        (to.min(high - height * u) - from.max(low - height * u)).max(0.0)
    };
    // The lengths bend where two of their ends meet.
    let bends = |[low, high]: [f64; 2]| {
        let mut bends = vec![-1.0, 0.0, 1.0];
        for end in [low, high] {
            bends.extend([end / height, (end - 1.0) / height]);
            bends.extend([end / (height - 1.0), (1.0 - end) / (1.0 - height)]);
        }
        bends.retain(|b| (-1.0..=1.0).contains(b));
        bends.sort_by(f64::total_cmp);
        bends
    };
    let (by_x, by_y) = (bends(x), bends(y));
    let mut sum = 0.0;
    for u in by_x.windows(2).filter(|u| u[1] > u[0]) {
        for v in by_y.windows(2).filter(|v| v[1] > v[0]) {
            sum += integral(u[0], u[1], |u| {
                integral(v[0], v[1], |v| {
                    let seen = open(u) * open(v) - through(u, x) * through(v, y);
                    seen / (PI * (1.0 + u * u + v * v).powi(2))
                })
            });
        }
    }
    sum
}

/// Two walls of an L-shaped room, each 3 wide and 3 high, that meet in its outer corner; the inner
/// corner stands 1 from both. Upright lines at distances b and c from the outer corner exchange
///
/// ```text
/// b c H atan(H / s) / (π s³)        s² = b² + c²
/// ```
///
/// which has a closed integral over b. The line at c sees b up to 3, or c / (c - 1) beside the
/// inner corner.
pub fn l_shaped() -> f64 {
    const HIGH: f64 = 3.0;
    const WIDE: f64 = 3.0;
    let upper =
        |s: f64| -(HIGH / s).atan() / s - (s * s / (s * s + HIGH * HIGH)).ln() / (2.0 * HIGH);
    let line = |c: f64, to: f64| c * HIGH / PI * (upper(c.hypot(to)) - upper(c));
    let turn = WIDE / (WIDE - 1.0);
    let sum =
        integral(0.0, turn, |c| line(c, WIDE)) + integral(turn, WIDE, |c| line(c, c / (c - 1.0)));
    sum / (WIDE * HIGH)
}
