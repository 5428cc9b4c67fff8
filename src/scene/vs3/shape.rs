//! Whether the corners of a surface make a surface.

use glam::DVec3;

use super::parse::Polygon;
use crate::scene::ears::STRAIGHT;
use crate::scene::geometry::position_key;
use crate::scene::source::{ImportError, Place, Source};

/// Areas below this share of the square of the size are rounding.
const NO_AREA: f64 = 1e-12;

/// Coordinates are this exact, as a share of their own size: a few units in the last place.
const EXACT: f64 = 4.0 * f64::EPSILON;

/// Refuses surfaces whose corners coincide, whose edges cross, or that have no area.
pub fn check(source: &Source<'_>, number: usize, polygon: &Polygon) -> Result<(), ImportError> {
    let corners = &polygon.corners;
    let wrong = |problem: String, remedy: &str| {
        Err(source.malformed(Place::Line(polygon.line), problem, remedy))
    };
    let keys: Vec<_> = corners.iter().map(|&c| position_key(c)).collect();
    let n = keys.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    if let Some((i, j)) = pairs.into_iter().find(|&(i, j)| keys[i] == keys[j]) {
        let problem =
            format!("corners {} and {} of surface {number} are at one place", i + 1, j + 1);
        return wrong(problem, "name vertices that lie apart; 0 is the fourth of a triangle");
    }
    if crosses_itself(corners) {
        let problem = format!("the edges of surface {number} cross each other");
        return wrong(problem, "name its vertices in their order round it");
    }
    if !has_area(corners) {
        let problem = format!("surface {number} has no area: its corners are on one line");
        return wrong(problem, "leave it out, or name vertices that are not on one line");
    }
    Ok(())
}

/// Whether two edges of a quadrilateral cross or run along each other. Of one that goes round its
/// area once no corner turns the other way, or one does.
fn crosses_itself(corners: &[DVec3]) -> bool {
    let &[a, b, c, d] = corners else { return false };
    let normals = [[d, a, b], [a, b, c], [b, c, d], [c, d, a]]
        .map(|[before, at, after]| (at - before).cross(after - at));
    // The area of a crossed one may be zero, but not that of all its triangles.
    let longest = normals.into_iter().fold(DVec3::ZERO, |n, m| match m.length() > n.length() {
        true => m,
        false => n,
    });
    let sum: DVec3 = normals.into_iter().sum();
    let flat = sum.length() <= STRAIGHT * longest.length();
    let normal = if flat { longest } else { sum }.normalize_or_zero();
    let edges = [a - d, b - a, c - b, d - c];
    let (mut left, mut right) = (0, 0);
    for k in 0..4 {
        let (before, after) = (edges[k], edges[(k + 1) % 4]);
        let lengths = before.length() * after.length();
        let turn = normals[k].dot(normal);
        if turn.abs() > STRAIGHT * lengths {
            *(if turn > 0.0 { &mut left } else { &mut right }) += 1;
        } else if before.dot(after) < 0.0 && normal != DVec3::ZERO {
            return true;
        }
    }
    left == 2 && right == 2
}

fn has_area(corners: &[DVec3]) -> bool {
    let o = corners[0];
    let doubled = corners.windows(2).map(|w| (w[0] - o).cross(w[1] - o)).sum::<DVec3>().length();
    let size = corners.iter().map(|c| c.distance(o)).fold(0.0, f64::max);
    let far = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
    doubled > (NO_AREA * size).max(EXACT * far) * size
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a tilted plane far from the origin.
    fn plane(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|[x, y]| DVec3::new(100.0 + x, 7.0 + 0.6 * y, 0.8 * y)).collect()
    }

    #[test]
    fn edges_that_cross_or_run_back_are_told_from_dents() {
        for (points, expected) in [
            ([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]], false),
            // A dent, a straight corner, a corner almost straight.
            ([[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]], false),
            ([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]], false),
            ([[0.0, 0.0], [1.0, 1e-7], [2.0, 0.0], [0.0, 1.0]], false),
            // Bow-ties, of no area and of some.
            ([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]], true),
            ([[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.0]], true),
            ([[0.0, 0.0], [2.0, 0.0], [-0.5, 1.0], [1.0, 3.0]], true),
            ([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]], true),
        ] {
            for k in 0..4 {
                let mut points = points;
                points.rotate_left(k);
                assert_eq!(crosses_itself(&plane(&points)), expected, "{points:?}");
                points.reverse();
                assert_eq!(crosses_itself(&plane(&points)), expected, "{points:?}");
            }
        }
    }

    #[test]
    fn needles_have_an_area_and_lines_have_none() {
        assert!(has_area(&plane(&[[0.0, 0.0], [1.0, 0.0], [0.5, 1e-9]])));
        assert!(!has_area(&plane(&[[0.0, 0.0], [0.3, 0.1], [0.9, 0.3]])));
        assert!(!has_area(&plane(&[[0.0, 0.0], [0.1, 0.0], [0.7, 0.0], [0.9, 0.0]])));
        let far = [[4000.1, 0.0], [4000.2, 0.1], [4000.3, 0.2]];
        assert!(!has_area(&far.map(|[x, y]| DVec3::new(x, y, 0.0))));
        let near = [[1e-6, 0.0], [2e-6, 0.0], [1e-6, 1e-6]];
        assert!(has_area(&near.map(|[x, y]| DVec3::new(x, y, 0.0))));
    }
}
