//! Triangles as arrays of coordinates, for kernels that take 16 at a time.

use glam::DVec3;

use crate::simd::LANES;

/// Triangles in units of the scene's radius about its centre.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    /// Coordinate `3 k + axis` of the corners.
    pub corners: [Vec<f32>; 9],
    pub normal: [Vec<f32>; 3],
    pub centre: [Vec<f32>; 3],
}

impl Triangles {
    pub fn push(&mut self, corners: [DVec3; 3], normal: DVec3) {
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        for axis in 0..3 {
            for (k, corner) in corners.iter().enumerate() {
                self.corners[3 * k + axis].push(corner[axis] as f32);
            }
            self.normal[axis].push(normal[axis] as f32);
            self.centre[axis].push(centre[axis] as f32);
        }
    }

    /// Adds padding for kernels that read beyond the last.
    pub fn pad(&mut self) {
        self.corners.iter_mut().chain(&mut self.normal).chain(&mut self.centre).for_each(pad);
    }
}

/// Adds padding for lanes beyond the last number.
pub(super) fn pad(numbers: &mut Vec<f32>) {
    numbers.resize(numbers.len().next_multiple_of(LANES) + LANES, 0.0);
}

/// A triangle with the centroid and the second moments of plane triangles: a rule of degree 2 on it
/// is one on them. `None` if they do not lie in one plane, nearer to it than `coplanar`.
pub(super) fn stand_in(
    triangles: &[([DVec3; 3], DVec3)],
    coplanar: f64,
) -> Option<([DVec3; 3], DVec3)> {
    let &(first, normal) = triangles.first()?;
    if triangles.len() == 1 {
        return Some((first, normal));
    }
    let flat = |c: &[DVec3; 3]| c.iter().all(|p| normal.dot(*p - first[0]).abs() <= coplanar);
    if !triangles.iter().all(|(c, n)| n.dot(normal) > 1.0 - 1e-9 && flat(c)) {
        return None;
    }
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let middle = |c: &[DVec3; 3]| c.iter().sum::<DVec3>() / 3.0;
    let total: f64 = triangles.iter().map(|(c, _)| area(c)).sum();
    if total <= 0.0 {
        return None;
    }
    let centre = triangles.iter().map(|(c, _)| middle(c) * area(c)).sum::<DVec3>() / total;
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for (corners, _) in triangles {
        let weight = area(corners) / total;
        let mut add = |d: DVec3, weight: f64| {
            let (x, y) = (u.dot(d), v.dot(d));
            (uu, uv, vv) = (uu + weight * x * x, uv + weight * x * y, vv + weight * y * y);
        };
        let middle = middle(corners);
        corners.iter().for_each(|&p| add(p - middle, weight / 12.0));
        add(middle - centre, weight);
    }
    // A regular triangle of radius √8 has unit moments; Cholesky's factor of those wanted maps it.
    let a = uu.sqrt();
    let b = uv / a;
    let c = (vv - b * b).max(0.0).sqrt();
    let corner = |x: f64, y: f64| centre + 8.0_f64.sqrt() * (u * (a * x) + v * (b * x + c * y));
    let half = 0.75_f64.sqrt();
    let corners = [corner(1.0, 0.0), corner(-0.5, half), corner(-0.5, -half)];
    corners.iter().all(|p| p.is_finite()).then_some((corners, normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn a_triangle_cut_up_stands_for_itself_in_all_second_moments() {
        let whole = [dvec3(1.0, 0.0, 2.0), dvec3(3.0, 0.5, 2.0), dvec3(1.5, 4.0, 2.0)];
        let [a, b, c] = whole;
        let p = a * 0.5 + b * 0.2 + c * 0.3;
        let parts = [[a, b, p], [b, c, p], [c, a, p]].map(|t| (t, DVec3::Z));
        let (stand, normal) = stand_in(&parts, 1e-9).unwrap();
        assert_eq!(normal, DVec3::Z);
        assert!((stand[1] - stand[0]).cross(stand[2] - stand[0]).dot(normal) > 0.0);
        // Of a plane region area, centroid and moments determine what a rule of degree 2 finds.
        let rule = |t: [DVec3; 3], f: &dyn Fn(DVec3) -> f64| {
            let m = t.iter().sum::<DVec3>() / 3.0;
            t.iter().map(|&v| f(0.5 * (v + m))).sum::<f64>() / 3.0
        };
        let functions: [&dyn Fn(DVec3) -> f64; 5] =
            [&|p| p.x, &|p| p.y, &|p| p.x * p.x, &|p| p.x * p.y, &|p| p.y * p.y];
        for f in functions {
            assert!((rule(stand, f) - rule(whole, f)).abs() < 1e-12);
        }
        let bent = [parts[0], ([b, c, p + DVec3::Z], DVec3::Z)];
        assert!(stand_in(&bent, 1e-9).is_none());
    }
}
