//! What of a convex polygon lies on one side of a line or a plane.
//!
//! I.E. Sutherland & G.W. Hodgman 1974, "Reentrant polygon clipping".

use std::ops::{Add, Mul, Sub};

/// A point of the plane or of space.
pub(crate) trait Point:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

impl<P> Point for P where P: Copy + Add<Output = P> + Sub<Output = P> + Mul<f64, Output = P> {}

/// Where an edge passes through height zero, given both its ends with their heights; `None` unless
/// one lies above and the other below.
#[inline]
pub(crate) fn crossing<P: Point>((from, h): (P, f64), (to, g): (P, f64)) -> Option<P> {
    (h * g < 0.0).then(|| from + (to - from) * (h / (h - g)))
}

/// Hands over the corners, in order, of what of a convex polygon is not below height zero. Of a
/// polygon that only touches it from below, that is a corner or an edge.
#[inline]
pub(crate) fn clip<P: Point>(corners: &[P], height: impl Fn(P) -> f64, mut corner: impl FnMut(P)) {
    let Some(&last) = corners.last() else { return };
    let mut from = (last, height(last));
    for &p in corners {
        let to = (p, height(p));
        crossing(from, to).into_iter().for_each(&mut corner);
        if to.1 >= 0.0 {
            corner(p);
        }
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3, dvec2, dvec3};

    use super::*;

    const SQUARE: [DVec2; 4] =
        [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(2.0, 2.0), DVec2::new(0.0, 2.0)];

    fn clipped<P: Point>(corners: &[P], height: impl Fn(P) -> f64) -> Vec<P> {
        let mut found = Vec::new();
        clip(corners, height, |p| found.push(p));
        found
    }

    #[test]
    fn what_is_above_keeps_its_order() {
        assert_eq!(clipped(&SQUARE, |p| p.x + 1.0), SQUARE);
        let right = clipped(&SQUARE, |p| p.x - 0.5);
        assert_eq!(right, [dvec2(0.5, 0.0), SQUARE[1], SQUARE[2], dvec2(0.5, 2.0)]);
        let left = clipped(&SQUARE, |p| 0.5 - p.x);
        assert_eq!(left, [SQUARE[0], dvec2(0.5, 0.0), dvec2(0.5, 2.0), SQUARE[3]]);
        assert!(clipped(&SQUARE, |p| p.x - 3.0).is_empty());
        assert!(clipped(&[], |p: DVec2| p.x).is_empty());
    }

    #[test]
    fn corners_at_height_zero_stand_once() {
        let half = clipped(&SQUARE, |p| p.x - p.y);
        assert_eq!(half, [SQUARE[0], SQUARE[1], SQUARE[2]]);
        assert_eq!(clipped(&SQUARE, |p| -p.x), [SQUARE[0], SQUARE[3]], "an edge touches");
        assert_eq!(clipped(&SQUARE, |p| -p.x - p.y), [SQUARE[0]], "a corner touches");
    }

    #[test]
    fn both_sides_make_up_a_polygon_in_space() {
        let triangle = [dvec3(0.0, 0.0, -1.0), dvec3(3.0, 0.0, 2.0), dvec3(0.0, 3.0, 5.0)];
        let area = |p: &[DVec3]| -> f64 {
            (2..p.len()).map(|k| (p[k - 1] - p[0]).cross(p[k] - p[0]).length()).sum()
        };
        for at in [-0.5, 0.0, 1.75, 4.0] {
            let above = clipped(&triangle, |p| p.z - at);
            let below = clipped(&triangle, |p| at - p.z);
            assert!((area(&above) + area(&below) - area(&triangle)).abs() < 1e-12, "{at}");
            assert!(above.iter().all(|p| p.z >= at - 1e-15));
        }
    }
}
