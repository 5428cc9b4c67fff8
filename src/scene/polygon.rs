//! Triangles of a polygon: a fan if it is convex, ears otherwise.
//!
//! Meisters 1975, "Polygons Have Ears". A simple polygon of n corners always yields n - 2
//! triangles; so does a crossed or flat one, some of whose triangles are then degenerate or
//! overlap.

use glam::{DVec2, DVec3};

/// Ear clipping takes quadratic time: larger polygons that are not convex are fanned.
pub const MOST_CORNERS: usize = 2048;

/// A corner whose sine is below this is straight: its ear would be degenerate.
const STRAIGHT: f64 = 1e-9;

/// Corner indices of the `n - 2` triangles of a polygon, wound as the polygon is, and whether
/// they tile it (they may not if it is too large and not convex).
pub fn triangulate(corners: &[DVec3]) -> (Vec<[usize; 3]>, bool) {
    let n = corners.len();
    if n < 3 {
        return (Vec::new(), true);
    }
    if n == 3 {
        return (vec![[0, 1, 2]], true);
    }
    let points = flatten(corners);
    let convex = is_strictly_convex(&points);
    if convex || n > MOST_CORNERS {
        return ((1..n - 1).map(|i| [0, i, i + 1]).collect(), convex);
    }
    (clip_ears(&points), true)
}

/// The polygon in its own plane, counter-clockwise.
fn flatten(corners: &[DVec3]) -> Vec<DVec2> {
    // Newell's normal; positions relative to the first corner keep it exact far from the origin.
    let o = corners[0];
    let mut normal = DVec3::ZERO;
    for (i, &a) in corners.iter().enumerate() {
        normal += (a - o).cross(corners[(i + 1) % corners.len()] - o);
    }
    let n = normal.normalize_or(DVec3::Z);
    let u = n.any_orthonormal_vector();
    let v = n.cross(u);
    corners.iter().map(|&p| DVec2::new((p - o).dot(u), (p - o).dot(v))).collect()
}

/// Sine of the turn at `b`, positive to the left; 0 where an edge has no length.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (d, e) = (b - a, c - b);
    let lengths = d.length() * e.length();
    if lengths > 0.0 { d.perp_dot(e) / lengths } else { 0.0 }
}

fn is_strictly_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let at = |i: usize| points[i % n];
    // Turning left everywhere is not enough: a pentagram does too, but goes round twice.
    let mut reversals = 0;
    for i in 0..n {
        if turn(at(i), at(i + 1), at(i + 2)) <= STRAIGHT {
            return false;
        }
        let (before, after) = (at(i + 1).x - at(i).x, at(i + 2).x - at(i + 1).x);
        reversals += usize::from((before < 0.0) != (after < 0.0));
    }
    reversals <= 2
}

fn clip_ears(points: &[DVec2]) -> Vec<[usize; 3]> {
    let mut ring: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    let mut start = 0;
    while ring.len() > 3 {
        let n = ring.len();
        let ear = |i: usize| [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
        // Strict ears first; then ears that other corners touch (holes joined by a bridge); then
        // anything, as a polygon that crosses itself may have none.
        let order = || (0..n).map(|k| (start + k) % n);
        let found = order()
            .find(|&i| is_ear(points, &ring, ear(i), true))
            .or_else(|| order().find(|&i| is_ear(points, &ring, ear(i), false)))
            .unwrap_or(start % n);
        triangles.push(ear(found));
        ring.remove(found);
        start = found;
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

fn is_ear(points: &[DVec2], ring: &[usize], ear: [usize; 3], strict: bool) -> bool {
    let [a, b, c] = ear.map(|i| points[i]);
    if turn(a, b, c) <= STRAIGHT || (c - a).length_squared() == 0.0 {
        return false;
    }
    ring.iter().filter(|i| !ear.contains(i)).all(|&i| {
        let p = points[i];
        if p == a || p == b || p == c {
            return true;
        }
        let turns = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
        let limit = if strict { -STRAIGHT } else { STRAIGHT };
        turns.iter().any(|&t| t < limit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[[f64; 2]]) -> Vec<DVec3> {
        // A tilted plane far from the origin.
        points.iter().map(|p| DVec3::new(100.0 + p[0], 7.0 + p[1] * 0.6, p[1] * 0.8)).collect()
    }

    fn area(corners: &[DVec3], t: [usize; 3]) -> DVec3 {
        let [a, b, c] = t.map(|i| corners[i]);
        0.5 * (b - a).cross(c - a)
    }

    /// All triangles wind alike, and their areas sum to the polygon's.
    fn check(points: &[[f64; 2]]) -> Vec<[usize; 3]> {
        let corners = polygon(points);
        let (triangles, tiled) = triangulate(&corners);
        assert!(tiled);
        assert_eq!(triangles.len(), corners.len() - 2);
        let doubled: f64 = (0..points.len())
            .map(|i| DVec2::from(points[i]).perp_dot(points[(i + 1) % points.len()].into()))
            .sum();
        let normal = DVec3::new(0.0, -0.8, 0.6) * doubled.signum();
        let areas = triangles.iter().map(|&t| area(&corners, t).dot(normal));
        assert!(areas.clone().all(|a| a > 1e-6), "a triangle is flat or turned");
        assert!((areas.sum::<f64>() - doubled.abs() / 2.0).abs() < 1e-9);
        triangles
    }

    #[test]
    fn convex_polygons_are_fanned() {
        let hexagon = [[2.0, 0.0], [1.0, 1.7], [-1.0, 1.7], [-2.0, 0.0], [-1.0, -1.7], [1.0, -1.7]];
        assert_eq!(check(&hexagon), [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
    }

    #[test]
    fn dents_and_straight_corners_are_clipped_without_flat_triangles() {
        check(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        check(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        check(&[[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0], [1.0, 0.0]]);
        check(&[
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ]);
    }

    #[test]
    fn a_hole_joined_by_a_bridge_stays_a_hole() {
        let ring = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ];
        check(&ring);
    }

    #[test]
    fn a_comb_of_many_teeth() {
        let teeth = 200;
        let mut points: Vec<[f64; 2]> =
            (0..=2 * teeth).map(|i| [f64::from(i), if i % 2 == 0 { 1.0 } else { 9.0 }]).collect();
        points.push([f64::from(2 * teeth), 0.0]);
        points.push([0.0, 0.0]);
        check(&points);
    }

    #[test]
    fn crossed_flat_and_huge_polygons_still_yield_all_triangles() {
        let bow = polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(triangulate(&bow).0.len(), 2);
        assert_eq!(triangulate(&[DVec3::ONE; 7]).0.len(), 5);
        let star: Vec<DVec3> = (0..5)
            .map(|i| DVec2::from_angle(f64::from(i * 2) * std::f64::consts::TAU / 5.0).extend(0.0))
            .collect();
        assert_eq!(triangulate(&star).0.len(), 3);
        let huge: Vec<DVec3> =
            (0..5000).map(|i| DVec3::new(f64::from(i), f64::from(i % 2), 0.0)).collect();
        let (triangles, tiled) = triangulate(&huge);
        assert_eq!((triangles.len(), tiled), (4998, false));
    }
}
