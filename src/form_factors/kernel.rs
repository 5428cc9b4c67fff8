//! The form factor from a point to a polygon, in closed form.
//!
//! J.H. Lambert (1760), "Photometria": seen from a point with unit normal n, a polygon whose
//! corners lie at r_0, r_1, … has the form factor
//!
//! ```text
//! F = |Σ_k θ_k n·Γ_k| / 2π        Γ_k = r_k × r_{k+1} / |r_k × r_{k+1}|
//! ```
//!
//! where θ_k is the angle between r_k and r_{k+1}. Baum, Rushmeier & Winget (1989), "Improving
//! radiosity solutions through the use of analytically determined form-factors", brought it to
//! radiosity. What lies below the point's horizon is clipped away first (Sutherland & Hodgman
//! 1974, "Reentrant polygon clipping"): unclipped it would count as negative.

use std::f64::consts::TAU;

use glam::DVec3;

/// Form factor, 0..1, from `point` with unit `normal` to the part of a plane polygon above the
/// point's horizon, whichever side the polygon turns to it. Nothing is assumed to lie between.
#[must_use]
pub fn point_to_polygon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut contour = Contour { normal, first: None, last: DVec3::ZERO, sum: 0.0 };
    let Some(&end) = corners.last() else { return 0.0 };
    let mut from = end - point;
    let mut from_height = normal.dot(from);
    for &corner in corners {
        let to = corner - point;
        let to_height = normal.dot(to);
        if (from_height > 0.0) != (to_height > 0.0) {
            contour.add(from + (to - from) * (from_height / (from_height - to_height)));
        }
        if to_height > 0.0 {
            contour.add(to);
        }
        (from, from_height) = (to, to_height);
    }
    // Rounding alone can exceed 1, where the point lies in the polygon.
    (contour.closed() / TAU).abs().min(1.0)
}

/// The contour of what lies above the horizon, summed corner by corner.
struct Contour {
    normal: DVec3,
    first: Option<DVec3>,
    last: DVec3,
    sum: f64,
}

impl Contour {
    fn add(&mut self, r: DVec3) {
        if self.first.is_some() {
            self.sum += edge(self.normal, self.last, r);
        } else {
            self.first = Some(r);
        }
        self.last = r;
    }

    fn closed(&self) -> f64 {
        self.first.map_or(0.0, |first| self.sum + edge(self.normal, self.last, first))
    }
}

/// `θ n·Γ` of one edge; 0 where both ends are seen in the same direction.
fn edge(normal: DVec3, from: DVec3, to: DVec3) -> f64 {
    let (cross, cos) = (from.cross(to), from.dot(to));
    let square = cross.length_squared();
    if cos > 0.0 && square < SHORT * cos * cos {
        return normal.dot(cross) / cos * angle_by_tangent(square / (cos * cos));
    }
    let sin = square.sqrt();
    if sin > 0.0 { normal.dot(cross) / sin * sin.atan2(cos) } else { 0.0 }
}

/// Below this square of the tangent of its angle an edge is short.
const SHORT: f64 = 0.01;

/// `θ / tan θ` for a short edge, given the square of the tangent, to the last bit or two.
fn angle_by_tangent(square: f64) -> f64 {
    let terms = [1.0, 1.0 / 3.0, 0.2, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0];
    terms.iter().rev().fold(0.0, |sum, term| term - square * sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engines::delta::{parallel_rectangle, perpendicular_rectangle};
    use glam::dvec3;

    const UP: DVec3 = DVec3::Z;

    fn from_origin(corners: &[DVec3]) -> f64 {
        point_to_polygon(DVec3::ZERO, UP, corners)
    }

    /// The rectangle of the given x and y at height z.
    fn level(x: [f64; 2], y: [f64; 2], z: f64) -> [DVec3; 4] {
        [dvec3(x[0], y[0], z), dvec3(x[1], y[0], z), dvec3(x[1], y[1], z), dvec3(x[0], y[1], z)]
    }

    /// The rectangle of the given y and z at x = 1.
    fn upright(y: [f64; 2], z: [f64; 2]) -> [DVec3; 4] {
        [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| dvec3(1.0, y[i], z[j]))
    }

    #[test]
    fn known_point_factors() {
        let parallel = from_origin(&level([0.0, 1.0], [0.0, 1.0], 1.0));
        assert!((parallel - 0.138_531_606).abs() < 1e-9, "{parallel}");
        let perpendicular = from_origin(&upright([0.0, 1.0], [0.0, 1.0]));
        assert!((perpendicular - 0.055_734_197).abs() < 1e-9, "{perpendicular}");
    }

    #[test]
    fn short_edges_are_as_exact_as_long_ones() {
        for k in 1..200 {
            let angle = f64::from(k) * 1e-3;
            let (from, to) = (DVec3::X * 3.0, dvec3(angle.cos(), angle.sin(), 0.0) * 0.2);
            let found = edge(dvec3(0.6, 0.0, 0.8), from, to);
            assert!((found - 0.8 * angle).abs() < 4e-16 * angle.max(0.1), "{angle}: {found}");
        }
        assert_eq!(edge(DVec3::Z, DVec3::X, DVec3::X), 0.0);
    }

    #[test]
    fn agrees_with_delta_form_factors_everywhere() {
        for (x, y) in [(0.1, 0.2), (1.0, 3.0), (7.0, 0.01), (40.0, 50.0)] {
            for scale in [1e-3, 1.0, 1e3] {
                let mut top = level([0.0, x], [0.0, y], 1.0).map(|v| v * scale);
                let expected = parallel_rectangle(x, y);
                assert!((from_origin(&top) - expected).abs() < 1e-14, "{x} {y} {scale}");
                top.reverse();
                assert!((from_origin(&top) - expected).abs() < 1e-14, "either winding");
                let side = upright([0.0, x], [0.0, y]).map(|v| v * scale);
                let expected = perpendicular_rectangle(x, y);
                assert!((from_origin(&side) - expected).abs() < 1e-14, "{x} {y} {scale}");
            }
        }
    }

    #[test]
    fn what_lies_below_the_horizon_does_not_count() {
        let whole = from_origin(&upright([-0.5, 2.0], [-3.0, 1.5]));
        let above = from_origin(&upright([-0.5, 2.0], [0.0, 1.5]));
        assert!((whole - above).abs() < 1e-14, "{whole} {above}");
        assert_eq!(from_origin(&upright([-0.5, 2.0], [-3.0, -0.1])), 0.0);
        assert_eq!(from_origin(&level([-1.0, 1.0], [-1.0, 1.0], -1.0)), 0.0);
        // A triangle with one corner above, and with two.
        let one = [dvec3(1.0, 0.0, -1.0), dvec3(1.0, 2.0, -1.0), dvec3(1.0, 1.0, 1.0)];
        let tip = [dvec3(1.0, 0.5, 0.0), dvec3(1.0, 1.5, 0.0), dvec3(1.0, 1.0, 1.0)];
        assert!((from_origin(&one) - from_origin(&tip)).abs() < 1e-14);
        let two = one.map(|v| dvec3(v.x, v.y, -v.z));
        let trunk = [
            dvec3(1.0, 0.0, 1.0),
            dvec3(1.0, 2.0, 1.0),
            dvec3(1.0, 1.5, 0.0),
            dvec3(1.0, 0.5, 0.0),
        ];
        assert!((from_origin(&two) - from_origin(&trunk)).abs() < 1e-14);
    }

    #[test]
    fn parts_add_up_and_nothing_exceeds_one() {
        let wide = 1e8;
        let all = from_origin(&level([-wide, wide], [-wide, wide], 1.0));
        assert!(all <= 1.0 && all > 1.0 - 1e-7, "{all}");
        let near = from_origin(&level([-1.0, 1.0], [-1.0, 1.0], 1e-12));
        assert!(near <= 1.0 && near > 1.0 - 1e-9, "{near}");
        let tilted = [dvec3(-3.0, -1.0, -2.0), dvec3(4.0, -2.0, 3.0), dvec3(1.0, 5.0, 2.0)];
        let middle = (tilted[0] + tilted[1] + tilted[2]) / 3.0;
        let parts: f64 =
            (0..3).map(|k| from_origin(&[tilted[k], tilted[(k + 1) % 3], middle])).sum();
        assert!((from_origin(&tilted) - parts).abs() < 1e-14);
    }

    #[test]
    fn degenerate_polygons_give_zero() {
        assert_eq!(from_origin(&[]), 0.0);
        assert_eq!(from_origin(&[dvec3(1.0, 2.0, 3.0)]), 0.0);
        assert_eq!(from_origin(&[dvec3(1.0, 2.0, 3.0); 3]), 0.0);
        let line = [dvec3(1.0, 0.0, 1.0), dvec3(2.0, 0.0, 1.0), dvec3(3.0, 0.0, 1.0)];
        assert!(from_origin(&line) < 1e-15);
        // Seen edge-on, and with the point in a corner.
        assert!(
            from_origin(&[dvec3(1.0, 0.0, 0.0), dvec3(2.0, 0.0, 2.0), dvec3(3.0, 0.0, 1.0)])
                < 1e-15
        );
        let corner = from_origin(&[DVec3::ZERO, dvec3(1.0, 0.0, 1.0), dvec3(1.0, 1.0, 1.0)]);
        assert!((0.0..=1.0).contains(&corner));
    }
}
