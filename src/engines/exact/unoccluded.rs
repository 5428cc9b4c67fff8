//! The exchange between two plane polygons with nothing between them.
//!
//! ```text
//! S = A_a F_ab = ∫_a ∫_b K dA dA        K = cos θ_a cos θ_b / (π r²)
//! ```
//!
//! What lies behind the other polygon's plane is clipped away first. Then, from far to near:
//!
//! - points on both: a rule of degree 5 on each (Radon 1948);
//! - points on the smaller, Lambert's closed form for the larger ([`point_to_polygon`]);
//! - Stokes' theorem on both (Sparrow 1963, "A new and simpler formulation for radiative angle
//!   factors"), which holds for polygons that touch, share an edge or nearly so:
//!
//! ```text
//! S = 1/2π Σ_e Σ_f ê·f̂ ∫_e ∫_f ln r ds dt
//! ```
//!
//! The inner integral has a closed form; the outer one is summed by Gauss' rule with points drawn
//! towards the ends, where it may have a singular derivative, and halved until two rules agree.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::form_factors::kernel::point_to_polygon;

/// A plane convex polygon with a front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    /// Unit length; corners run counter-clockwise about it.
    pub normal: DVec3,
    corners: [DVec3; MOST_CORNERS],
    len: usize,
}

/// A triangle that two planes have cut has at most so many.
const MOST_CORNERS: usize = 5;

/// Points on both serve from so many sums of radii between the centres: their error is below 1e-5
/// of S there.
const FAR: f64 = 2.2;

/// Points on the smaller serve if its radius is at most this share of its distance from the larger.
const SMALL: f64 = 0.35;

/// The contour integrals may err by this share of the smaller area.
const TOLERANCE: f64 = 1e-8;

/// An edge is halved at most so often.
const DEEPEST: u32 = 16;

impl Polygon {
    pub fn triangle([a, b, c]: [DVec3; 3], normal: DVec3) -> Self {
        Self { normal, corners: [a, b, c, a, a], len: 3 }
    }

    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }

    /// The triangles of a fan about the first corner.
    pub fn fan(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        (2..self.len).map(|k| [self.corners[0], self.corners[k - 1], self.corners[k]])
    }

    pub fn area(&self) -> f64 {
        self.fan().map(area).sum()
    }

    /// The part more than `coplanar` in front of the plane through `point`; `None` if there is none.
    pub fn before(&self, point: DVec3, normal: DVec3, coplanar: f64) -> Option<Self> {
        let height = |v: DVec3| {
            let h = normal.dot(v - point);
            if h.abs() <= coplanar { 0.0 } else { h }
        };
        if self.corners().iter().all(|&v| height(v) <= 0.0) {
            return None;
        }
        let mut part = Self { len: 0, ..*self };
        let mut put = |v: DVec3| {
            if let Some(corner) = part.corners.get_mut(part.len) {
                *corner = v;
                part.len += 1;
            }
        };
        let mut from = self.corners[self.len - 1];
        for &to in self.corners() {
            let (h0, h1) = (height(from), height(to));
            if h0 * h1 < 0.0 {
                put(from + (to - from) * (h0 / (h0 - h1)));
            }
            if h1 >= 0.0 {
                put(to);
            }
            from = to;
        }
        (part.len > 2).then_some(part)
    }

    /// Mean of the corners.
    pub fn centre(&self) -> DVec3 {
        self.corners().iter().sum::<DVec3>() / self.len as f64
    }

    fn radius(&self, centre: DVec3) -> f64 {
        self.corners().iter().map(|v| v.distance_squared(centre)).fold(0.0, f64::max).sqrt()
    }

    /// Distance of a point.
    fn distance(&self, p: DVec3) -> f64 {
        let mut inside = true;
        let mut nearest = f64::INFINITY;
        let mut from = self.corners[self.len - 1];
        for &to in self.corners() {
            let edge = to - from;
            inside &= self.normal.cross(edge).dot(p - from) >= 0.0;
            let t = (edge.dot(p - from) / edge.length_squared()).clamp(0.0, 1.0);
            nearest = nearest.min((from + edge * t).distance_squared(p));
            from = to;
        }
        if inside { self.normal.dot(p - from).abs() } else { nearest.sqrt() }
    }
}

/// Area of a triangle.
pub(super) fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The parts of two polygons in front of each other; `None` if they do not face each other. Heights
/// up to `coplanar` count as none.
pub(super) fn facing(a: &Polygon, b: &Polygon, coplanar: f64) -> Option<(Polygon, Polygon)> {
    let b_seen = b.before(a.corners[0], a.normal, coplanar)?;
    let a_seen = a.before(b.corners[0], b.normal, coplanar)?;
    Some((a_seen, b_seen))
}

/// S in m² of two polygons that lie in front of each other, as [`facing`] leaves them; never
/// negative and never more than either area.
pub(super) fn exchange(a: &Polygon, b: &Polygon) -> f64 {
    let (ca, cb) = (a.centre(), b.centre());
    let (ra, rb) = (a.radius(ca), b.radius(cb));
    let most = a.area().min(b.area());
    let s = if ca.distance_squared(cb) > (FAR * (ra + rb)).powi(2) {
        by_points(a, b)
    } else {
        let (small, large, centre, radius) = if ra <= rb { (a, b, ca, ra) } else { (b, a, cb, rb) };
        if radius <= SMALL * (large.distance(centre) - radius) {
            by_lambert(small, large)
        } else {
            by_contours(small, large, TOLERANCE * most)
        }
    };
    s.clamp(0.0, most)
}

/// The seven points of a rule of degree 5 on a triangle, with their weights (Radon 1948).
pub(super) fn radon([a, b, c]: [DVec3; 3]) -> [(DVec3, f64); 7] {
    const ROOT: f64 = 3.872_983_346_207_417;
    const NEAR: f64 = (6.0 - ROOT) / 21.0;
    const WIDE: f64 = (6.0 + ROOT) / 21.0;
    const W_NEAR: f64 = (155.0 - ROOT) / 1200.0;
    const W_WIDE: f64 = (155.0 + ROOT) / 1200.0;
    let sum = a + b + c;
    let at = |v: DVec3, s: f64| sum * s + v * (1.0 - 3.0 * s);
    [
        (sum / 3.0, 9.0 / 40.0),
        (at(a, NEAR), W_NEAR),
        (at(b, NEAR), W_NEAR),
        (at(c, NEAR), W_NEAR),
        (at(a, WIDE), W_WIDE),
        (at(b, WIDE), W_WIDE),
        (at(c, WIDE), W_WIDE),
    ]
}

fn by_points(a: &Polygon, b: &Polygon) -> f64 {
    let mut sum = 0.0;
    for p in a.fan() {
        for q in b.fan() {
            let mut mean = 0.0;
            for (x, wx) in radon(p) {
                for (y, wy) in radon(q) {
                    let r = y - x;
                    let r2 = r.length_squared();
                    let cosines = (a.normal.dot(r)).max(0.0) * (-b.normal.dot(r)).max(0.0);
                    mean += wx * wy * cosines / (r2 * r2);
                }
            }
            sum += mean * area(p) * area(q);
        }
    }
    sum / PI
}

fn by_lambert(small: &Polygon, large: &Polygon) -> f64 {
    let mean = |t: [DVec3; 3]| -> f64 {
        let at = |(x, w): (DVec3, f64)| w * point_to_polygon(x, small.normal, large.corners());
        radon(t).into_iter().map(at).sum()
    };
    small.fan().map(|t| area(t) * mean(t)).sum()
}

/// A directed edge: where it begins, its unit direction, its length.
struct Edge {
    from: DVec3,
    along: DVec3,
    length: f64,
}

fn edges(p: &Polygon) -> impl Iterator<Item = Edge> + '_ {
    (0..p.len).filter_map(|k| {
        let (from, to) = (p.corners[k], p.corners[(k + 1) % p.len]);
        let length = from.distance(to);
        (length > 0.0).then(|| Edge { from, along: (to - from) / length, length })
    })
}

fn by_contours(a: &Polygon, b: &Polygon, tolerance: f64) -> f64 {
    let mut sum = 0.0;
    for e in edges(a) {
        for f in edges(b) {
            let cosine = e.along.dot(f.along);
            if cosine.abs() > 1e-14 {
                let (outer, inner) = if e.length <= f.length { (&e, &f) } else { (&f, &e) };
                sum += cosine * between(outer, inner, tolerance);
            }
        }
    }
    sum / TAU
}

/// `∫_e ∫_f ln r dt ds`, less the length of f times that of e: around closed contours that adds up to
/// nothing.
fn between(e: &Edge, f: &Edge, tolerance: f64) -> f64 {
    // The integrand may bend where e passes by an end of f.
    let mut cuts = [0.0, 0.0, 0.0, e.length];
    let mut count = 1;
    for end in [f.from, f.from + f.along * f.length] {
        let s = e.along.dot(end - e.from);
        if s > 1e-9 * e.length && s < e.length * (1.0 - 1e-9) {
            cuts[count] = s;
            count += 1;
        }
    }
    if count == 3 && cuts[1] > cuts[2] {
        cuts.swap(1, 2);
    }
    cuts[count] = e.length;
    (0..count).map(|k| piece(e, f, cuts[k], cuts[k + 1], tolerance, DEEPEST)).sum()
}

fn piece(e: &Edge, f: &Edge, from: f64, to: f64, tolerance: f64, depth: u32) -> f64 {
    let coarse = graded(e, f, from, to, &GAUSS_8);
    let fine = graded(e, f, from, to, &GAUSS_12);
    if (fine - coarse).abs() <= tolerance || depth == 0 {
        return fine;
    }
    let middle = 0.5 * (from + to);
    piece(e, f, from, middle, 0.5 * tolerance, depth - 1)
        + piece(e, f, middle, to, 0.5 * tolerance, depth - 1)
}

/// Positive points and weights of Gauss' rule on -1..1.
const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_361_9),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

const GAUSS_12: [(f64, f64); 6] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_4, 0.203_167_426_723_065_9),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_2),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_4),
    (0.981_560_634_246_719_2, 0.047_175_336_386_511_8),
];

/// Gauss' rule in t with s = from + (to - from) t³ (10 - 15 t + 6 t²), which is flat at both ends.
fn graded(e: &Edge, f: &Edge, from: f64, to: f64, rule: &[(f64, f64)]) -> f64 {
    let mut sum = 0.0;
    for &(x, w) in rule {
        for t in [0.5 - 0.5 * x, 0.5 + 0.5 * x] {
            let s = from + (to - from) * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
            let slope = 30.0 * t * t * (1.0 - t) * (1.0 - t);
            sum += w * slope * logarithm(e.from + e.along * s, f);
        }
    }
    0.5 * (to - from) * sum
}

/// `∫_f ln r dt` from a point, plus the length of f.
fn logarithm(x: DVec3, f: &Edge) -> f64 {
    let to = f.from - x;
    let u0 = f.along.dot(to);
    let u1 = u0 + f.length;
    let h2 = (to - f.along * u0).length_squared();
    let part = |u: f64| {
        let r2 = u * u + h2;
        if r2 > 0.0 { 0.5 * u * r2.ln() } else { 0.0 }
    };
    let h = h2.sqrt();
    let angle = if h > 0.0 { (h * f.length).atan2(h2 + u0 * u1) } else { 0.0 };
    part(u1) - part(u0) + h * angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn polygon(t: [DVec3; 3]) -> Polygon {
        Polygon::triangle(t, (t[1] - t[0]).cross(t[2] - t[0]).normalize())
    }

    fn rectangle([o, u, v]: [DVec3; 3]) -> [Polygon; 2] {
        [polygon([o, o + u, o + u + v]), polygon([o, o + u + v, o + v])]
    }

    fn between_rectangles(a: [DVec3; 3], b: [DVec3; 3]) -> f64 {
        let mut sum = 0.0;
        for p in rectangle(a) {
            for q in rectangle(b) {
                if let Some((p, q)) = facing(&p, &q, 1e-12) {
                    sum += exchange(&p, &q);
                }
            }
        }
        sum
    }

    const O: DVec3 = DVec3::ZERO;
    const X: DVec3 = DVec3::X;
    const Y: DVec3 = DVec3::Y;
    const Z: DVec3 = DVec3::Z;

    #[test]
    fn rectangles_have_their_known_factors() {
        let opposite = between_rectangles([O, X, Y], [Z, Y, X]);
        assert!((opposite - 0.199_824_895_7).abs() < 1e-8, "{opposite}");
        let adjacent = between_rectangles([O, X, Y], [O, Z, X]);
        assert!((adjacent - 0.200_043_776_1).abs() < 1e-8, "{adjacent}");
        let wide = between_rectangles([O, 2.0 * X, Y], [Z, Y, 2.0 * X]) / 2.0;
        assert!((wide - 0.285_875_384_9).abs() < 1e-8, "{wide}");
    }

    #[test]
    fn the_same_at_any_scale_and_place() {
        for scale in [1e-4, 1e4] {
            let at = dvec3(0.3, -2.0, 5.0);
            let m = |v: [DVec3; 3]| [v[0] * scale + at, v[1] * scale, v[2] * scale];
            let s = between_rectangles(m([O, X, Y]), m([O, Z, X])) / (scale * scale);
            assert!((s - 0.200_043_776_1).abs() < 1e-7, "{scale} {s}");
        }
    }

    #[test]
    fn all_ways_agree_where_they_meet() {
        let a = polygon([O, X, Y]);
        for k in 0..40 {
            let turn = f64::from(k) * 0.7;
            let way = dvec3(turn.cos(), turn.sin(), 1.2 + 0.5 * turn.cos()).normalize();
            let u = way.any_orthonormal_vector();
            for distance in [2.0, 3.6, 6.0] {
                let o = way * distance;
                let b = polygon([o, o + way.cross(u) * 0.8, o + u * 0.9]);
                let Some((p, q)) = facing(&a, &b, 1e-12) else { continue };
                let exact = by_contours(&p, &q, 1e-13);
                let points = by_points(&p, &q);
                let lambert = by_lambert(&p, &q);
                let near = |x: f64, share: f64| assert!((x - exact).abs() < share * exact);
                near(lambert, 1e-4);
                if distance > 3.0 {
                    near(points, 2e-5);
                    near(lambert, 1e-5);
                }
            }
        }
    }

    #[test]
    fn tiny_against_huge_at_all_distances() {
        let huge = rectangle([dvec3(-0.5, -0.5, 0.0), X, Y]);
        for distance in [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4] {
            for size in [1e-4, 1e-2] {
                let o = dvec3(0.1, 0.05, distance);
                let tiny = polygon([o, o + Y * size, o + X * size]);
                let s: f64 = huge
                    .iter()
                    .filter_map(|h| facing(&tiny, h, 1e-12))
                    .map(|(p, q)| exchange(&p, &q))
                    .sum();
                // The mean of Lambert's form over a fine grid of the tiny one.
                let (mut mean, n) = (0.0, 24);
                for i in 0..n {
                    for j in 0..n - i {
                        let at = |i: f64, j: f64| o + (Y * i + X * j) * (size / f64::from(n));
                        let (i, j) = (f64::from(i), f64::from(j));
                        let mut add = |p: DVec3| {
                            for h in &huge {
                                mean += point_to_polygon(p, -Z, h.corners());
                            }
                        };
                        add(at(i + 1.0 / 3.0, j + 1.0 / 3.0));
                        if i + j + 1.5 < f64::from(n) {
                            add(at(i + 2.0 / 3.0, j + 2.0 / 3.0));
                        }
                    }
                }
                let mean = mean / f64::from(n * n);
                let f = s / tiny.area();
                assert!((f - mean).abs() < 2e-6 * mean + 1e-15, "{distance} {size}: {f} {mean}");
            }
        }
    }

    #[test]
    fn slivers_add_up() {
        // A floor cut into slivers of aspect 1e4 beside a wall that it touches.
        let wall = rectangle([O, Z, X]);
        let mut sum = 0.0;
        for k in 0..20 {
            let o = Y * (f64::from(k) * 1e-4);
            for p in rectangle([o, X, Y * 1e-4]) {
                for q in &wall {
                    sum += facing(&p, q, 1e-12).map_or(0.0, |(p, q)| exchange(&p, &q));
                }
            }
        }
        let whole = between_rectangles([O, X, Y * 2e-3], [O, Z, X]);
        assert!((sum - whole).abs() < 1e-6 * whole, "{sum} {whole}");
    }

    #[test]
    fn what_faces_away_exchanges_nothing() {
        let a = polygon([O, X, Y]);
        let coplanar = polygon([X + Y, O, Y * 3.0].map(|v| v + Y));
        assert!(facing(&a, &coplanar, 1e-12).is_none());
        let below = polygon([-Z, X - Z, Y - Z]);
        assert!(facing(&a, &below, 1e-12).is_none());
        let back = Polygon { normal: -Z, ..a };
        assert!(facing(&a, &back, 1e-12).is_none());
    }

    #[test]
    fn what_straddles_counts_where_it_is_seen() {
        let floor = [O, X, Y];
        let whole = between_rectangles(floor, [dvec3(0.0, 0.5, -0.4), Z * 1.4, X]);
        let above = between_rectangles(floor, [dvec3(0.0, 0.5, 0.0), Z, X]);
        assert!((whole - above).abs() < 1e-8 && above > 0.05, "{whole} {above}");
    }
}
