//! What of a polygon is left where others lie in it.

use glam::DVec3;

use crate::scene::clip::clip;
use crate::scene::polygon::triangulate;

/// Parts smaller than this share of the polygon are rounding.
const SLIVER: f64 = 1e-9;

/// Corners this near to an edge, as a share of the polygon's size, lie on it.
const ON_EDGE: f64 = 1e-9;

/// Corners may be this far from the plane of the polygon that they lie in, as a share of the size
/// of theirs; so View3D has it.
const IN_PLANE: f64 = 1e-5;

/// This share of a polygon may lie beyond the edges of the one that it lies in.
const BEYOND: f64 = 1e-5;

/// Normals of polygons that face the same way agree as well as this.
const ALIKE: f64 = 0.999;

/// A polygon of three or four corners, as convex parts in its plane.
#[derive(Debug)]
pub struct Parts {
    /// Unit normal; zero without area.
    pub normal: DVec3,
    /// Mean of the corners.
    pub centre: DVec3,
    /// Largest distance of a corner from the centre.
    size: f64,
    area: f64,
    /// Counter-clockwise seen along the normal.
    pub convex: Vec<Vec<DVec3>>,
}

/// Why a polygon cannot be taken away from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misfit {
    /// It lies in another plane.
    Plane,
    /// It faces the other way.
    Facing,
    /// It is not within the outline.
    Outline,
}

impl Parts {
    pub fn new(corners: &[DVec3]) -> Self {
        let o = corners[0];
        let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
        let normal = pairs.map(|(a, b)| (a - o).cross(b - o)).sum::<DVec3>().normalize_or_zero();
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let size = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        let convex = match is_convex(corners, normal) {
            true => vec![corners.to_vec()],
            false => {
                let triangles = triangulate(corners).0.into_iter();
                triangles.map(|t| t.map(|i| corners[i]).to_vec()).collect()
            }
        };
        let area = convex.iter().map(|p| area(p, normal)).sum();
        Self { normal, centre, size, area, convex }
    }

    /// How far corners are from one plane, as a share of the polygon's size.
    pub fn bend(&self) -> f64 {
        let corners = self.convex.iter().flatten();
        let height = |c: &DVec3| self.normal.dot(c - self.centre).abs();
        corners.map(height).fold(0.0, f64::max) / self.size.max(f64::MIN_POSITIVE)
    }

    /// Whether `hole` can be taken away from these parts, which are a whole polygon yet.
    pub fn holds(&self, hole: &Self) -> Result<(), Misfit> {
        let far = |c: &DVec3| self.normal.dot(c - self.centre).abs() > IN_PLANE * hole.size;
        if hole.convex.iter().flatten().any(far) {
            return Err(Misfit::Plane);
        }
        if hole.normal.dot(self.normal) < ALIKE {
            return Err(Misfit::Facing);
        }
        let shared = self.convex.iter().flat_map(|a| {
            hole.convex.iter().map(|b| {
                let inside = (0..b.len()).fold(a.clone(), |left, k| self.side(&left, b, k, 1.0));
                area(&inside, self.normal)
            })
        });
        let within = shared.sum::<f64>() >= (1.0 - BEYOND) * hole.area;
        if within { Ok(()) } else { Err(Misfit::Outline) }
    }

    /// Takes a polygon away: of each part, what lies beyond each of its edges and within those
    /// before.
    pub fn subtract(&mut self, hole: &Self) {
        for b in &hole.convex {
            let mut left = Vec::new();
            for part in std::mem::take(&mut self.convex) {
                let mut rest = part;
                for k in 0..b.len() {
                    left.push(self.side(&rest, b, k, -1.0));
                    rest = self.side(&rest, b, k, 1.0);
                }
            }
            left.retain(|part| area(part, self.normal) > SLIVER * self.area);
            self.convex = left;
        }
    }

    /// What of a convex part lies within edge `k` of another (`sign` 1), or beyond it (-1).
    fn side(&self, part: &[DVec3], b: &[DVec3], k: usize, sign: f64) -> Vec<DVec3> {
        let (from, to) = (b[k], b[(k + 1) % b.len()]);
        let inwards = self.normal.cross(to - from).normalize_or_zero() * sign;
        let height = |p: DVec3| {
            let h = inwards.dot(p - from);
            if h.abs() <= ON_EDGE * self.size { 0.0 } else { h }
        };
        let mut found = Vec::new();
        clip(part, height, |p| found.push(p));
        found
    }
}

fn is_convex(corners: &[DVec3], normal: DVec3) -> bool {
    let n = corners.len();
    (0..n).all(|i| {
        let [a, b, c] = [i, i + 1, i + 2].map(|k| corners[k % n]);
        (b - a).cross(c - b).dot(normal) > 0.0
    })
}

fn area(corners: &[DVec3], normal: DVec3) -> f64 {
    let Some(&o) = corners.first() else { return 0.0 };
    let fans = corners.windows(2).map(|w| (w[0] - o).cross(w[1] - o).dot(normal));
    0.5 * fans.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> Parts {
        // In a tilted plane far from the origin.
        let at = |x: f64, y: f64| DVec3::new(100.0 + x, 7.0 + 0.6 * y, 0.8 * y);
        Parts::new(&[at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)])
    }

    fn left(parts: &Parts) -> f64 {
        parts.convex.iter().map(|p| area(p, parts.normal)).sum()
    }

    #[test]
    fn a_window_leaves_a_frame_of_few_parts() {
        let mut wall = rectangle([0.0, 0.0], [4.0, 3.0]);
        let window = rectangle([1.0, 1.0], [2.0, 2.0]);
        assert_eq!(wall.holds(&window), Ok(()));
        wall.subtract(&window);
        assert_eq!(wall.convex.len(), 4);
        assert!((left(&wall) - 11.0).abs() < 1e-12);
        // A door at the edge of the wall leaves three more parts at most.
        wall.subtract(&rectangle([3.0, 0.0], [4.0, 2.0]));
        assert!((left(&wall) - 9.0).abs() < 1e-9 && wall.convex.len() <= 7, "{wall:?}");
        wall.subtract(&rectangle([0.0, 0.0], [4.0, 3.0]));
        assert!(wall.convex.is_empty());
    }

    #[test]
    fn dents_are_kept() {
        let arrow = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        let corners = arrow.map(|[x, y]| DVec3::new(x, y, 0.0));
        let mut parts = Parts::new(&corners);
        assert!((parts.area - 4.0).abs() < 1e-12 && parts.convex.len() == 2);
        let hole =
            Parts::new(&[[0.2, 0.2], [0.6, 0.2], [0.2, 0.6]].map(|[x, y]| DVec3::new(x, y, 0.0)));
        assert_eq!(parts.holds(&hole), Ok(()));
        parts.subtract(&hole);
        assert!((left(&parts) - 3.92).abs() < 1e-12);
        let beyond =
            Parts::new(&[[1.0, 0.5], [2.0, 1.5], [1.0, 1.5]].map(|[x, y]| DVec3::new(x, y, 0.0)));
        assert_eq!(parts.holds(&beyond), Err(Misfit::Outline));
    }

    #[test]
    fn what_does_not_fit_is_told_apart() {
        let wall = rectangle([0.0, 0.0], [4.0, 3.0]);
        assert_eq!(wall.holds(&rectangle([3.0, 1.0], [5.0, 2.0])), Err(Misfit::Outline));
        assert_eq!(wall.holds(&rectangle([2.0, 1.0], [1.0, 2.0])), Err(Misfit::Facing));
        let raised = [[1.0, 1.0, 0.1], [2.0, 1.0, 0.1], [1.0, 2.0, 0.1]];
        let raised =
            Parts::new(&raised.map(|[x, y, z]| DVec3::new(100.0 + x, 7.0 + 0.6 * y, 0.8 * y + z)));
        assert_eq!(wall.holds(&raised), Err(Misfit::Plane));
    }
}
