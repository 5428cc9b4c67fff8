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
//! - Stokes' theorem on both (`contour`), which holds for polygons that touch, share an edge or
//!   nearly so.

use std::f64::consts::PI;

use glam::DVec3;

use super::contour::by_contours;
use super::polygon::{Polygon, area};
use crate::form_factors::kernel::point_to_polygon;

/// If the centres are farther apart than this many sums of radii, points on both are used: their
/// error is below 1e-5 of S there.
const FAR: f64 = 2.2;

/// If the radius of the smaller is at most this fraction of its distance from the larger, points on
/// the smaller are used.
const SMALL: f64 = 0.35;

/// S in m² of two polygons that lie in front of each other, as
/// [`facing`](super::polygon::facing) leaves them, to `tolerance` m² a pair of edges; never
/// negative and never more than either area.
pub(super) fn exchange(a: &Polygon, b: &Polygon, tolerance: f64) -> f64 {
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
            by_contours(small, large, tolerance)
        }
    };
    s.clamp(0.0, most)
}

/// The seven points of a rule of degree 5 on a triangle, with their weights (Radon 1948).
fn radon([a, b, c]: [DVec3; 3]) -> [(DVec3, f64); 7] {
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

#[cfg(test)]
mod tests {
    use super::super::polygon::facing;
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
                    sum += exchange(&p, &q, 1e-10);
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
                    .map(|(p, q)| exchange(&p, &q, 1e-10))
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
                    sum += facing(&p, q, 1e-12).map_or(0.0, |(p, q)| exchange(&p, &q, 1e-10));
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
        let mut back = a;
        back.normal = -Z;
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
