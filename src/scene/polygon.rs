//! Triangles of a polygon: a fan if it is convex, ears otherwise.
//!
//! Meisters 1975, "Polygons Have Ears". A simple polygon of n corners always yields n - 2
//! triangles; so does a crossed or flat one, some of whose triangles are then degenerate or
//! overlap.

use glam::{DVec2, DVec3};

use super::ears::{STRAIGHT, clip_ears, turn};

/// Corner indices of the `n - 2` triangles of a polygon, wound as the polygon is, and whether
/// they tile it (they may not if it is large and has no ears for long).
pub fn triangulate(corners: &[DVec3]) -> (Vec<[usize; 3]>, bool) {
    let n = corners.len();
    if n < 3 {
        return (Vec::new(), true);
    }
    if n == 3 {
        return (vec![[0, 1, 2]], true);
    }
    let points = flatten(corners);
    if is_strictly_convex(&points) {
        return ((1..n - 1).map(|i| [0, i, i + 1]).collect(), true);
    }
    clip_ears(&points)
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
        let expected = doubled.abs() / 2.0;
        assert!((areas.sum::<f64>() - expected).abs() < 1e-9 * expected.max(1.0));
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
    }

    #[test]
    fn many_corners_take_little_time() {
        // A star of as many points, and a tangle without ears.
        let star = |n: usize| -> Vec<[f64; 2]> {
            let at = |i: usize| {
                let angle = i as f64 * std::f64::consts::TAU / n as f64;
                (DVec2::from_angle(angle) * [1e3, 2e3][i % 2]).to_array()
            };
            (0..n).map(at).collect()
        };
        check(&star(20_000));
        let start = std::time::Instant::now();
        assert!(triangulate(&polygon(&star(100_000))).1);
        // All cells of the box of every point would be several seconds.
        assert!(start.elapsed().as_secs_f64() < 2.0, "{} s", start.elapsed().as_secs_f64());
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8)
        };
        let tangle: Vec<DVec3> = (0..20_000).map(|_| DVec3::new(random(), random(), 0.0)).collect();
        let start = std::time::Instant::now();
        let (triangles, tiled) = triangulate(&tangle);
        assert_eq!((triangles.len(), tiled), (19_998, false));
        // Quadratic time would be minutes.
        assert!(start.elapsed().as_secs() < 10);
    }
}
