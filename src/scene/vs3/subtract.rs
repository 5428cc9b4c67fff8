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
        let centre = mean(corners);
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
        let shared = self
            .convex
            .iter()
            .flat_map(|a| hole.convex.iter().map(|b| area(&self.within(a, b), self.normal)));
        let within = shared.sum::<f64>() >= (1.0 - BEYOND) * hole.area;
        if within { Ok(()) } else { Err(Misfit::Outline) }
    }

    /// Takes polygons away that lie in this one. A part that one of them takes up in part is cut
    /// in two along one of its edges, until each part is either free or taken up: the edge that
    /// cuts through the fewest of the others and lies along the most. `check` hears how many
    /// parts there are.
    ///
    /// # Errors
    /// Those of `check`.
    pub fn subtract<E>(
        &mut self,
        holes: &[&Self],
        check: impl Fn(usize) -> Result<(), E>,
    ) -> Result<(), E> {
        let holes: Vec<Hole<'_>> =
            holes.iter().flat_map(|hole| &hole.convex).map(|b| Hole::new(b)).collect();
        let all: Vec<usize> = (0..holes.len()).collect();
        let mut cells: Vec<_> = self.convex.drain(..).map(|part| (part, all.clone())).collect();
        let mut left = Vec::new();
        let sliver = SLIVER * self.area;
        while let Some((cell, mut near)) = cells.pop() {
            check(left.len() + cells.len())?;
            let whole = area(&cell, self.normal);
            if whole <= sliver {
                continue;
            }
            let bounds = bounds(&cell);
            let mut taken = false;
            near.retain(|&i| {
                let inside = match holes[i].meets(bounds, IN_PLANE * self.size) {
                    true => area(&self.within(&cell, holes[i].corners), self.normal),
                    false => 0.0,
                };
                taken |= inside >= whole - sliver;
                inside > sliver
            });
            match self.best_cut(&cell, &holes, &near) {
                _ if taken => {}
                Some((b, k)) => {
                    for sign in [-1.0, 1.0] {
                        cells.push((self.side(&cell, b, k, sign), near.clone()));
                    }
                }
                None => left.push(cell),
            }
        }
        self.convex = left;
        Ok(())
    }

    /// Of the hole that is nearest to the middle of a part, so that the others are shared out, the
    /// edge that divides the part and cuts through the fewest holes. `None` if there is none.
    fn best_cut<'a>(
        &self,
        cell: &[DVec3],
        holes: &[Hole<'a>],
        near: &[usize],
    ) -> Option<(&'a [DVec3], usize)> {
        let middle = mean(cell);
        let distance = |i: usize| holes[i].centre.distance_squared(middle);
        let b = near.iter().copied().min_by(|&i, &j| distance(i).total_cmp(&distance(j)))?;
        let b = holes[b].corners;
        // What no hole takes up is spread over the sides beyond its edges.
        let least = SLIVER * self.area / b.len() as f64;
        let divides = |&k: &usize| {
            let beyond = area(&self.side(cell, b, k, -1.0), self.normal);
            beyond > least && beyond < area(cell, self.normal) - least
        };
        // How many holes it cuts through, then how many it does not lie along.
        let cost = |&k: &usize| {
            let (mut through, mut apart) = (0, 0);
            for &i in near {
                let heights = holes[i].corners.iter().map(|&p| self.height(p, b, k));
                through += usize::from(
                    heights.clone().any(|h| h < 0.0) && heights.clone().any(|h| h > 0.0),
                );
                apart += usize::from(heights.filter(|h| *h == 0.0).count() < 2);
            }
            (through, apart)
        };
        (0..b.len()).filter(divides).min_by_key(cost).map(|k| (b, k))
    }

    /// What of a convex part lies within another.
    fn within(&self, part: &[DVec3], b: &[DVec3]) -> Vec<DVec3> {
        (0..b.len()).fold(part.to_vec(), |left, k| self.side(&left, b, k, 1.0))
    }

    /// How far within edge `k` of a convex part a point lies; 0 on it.
    fn height(&self, p: DVec3, b: &[DVec3], k: usize) -> f64 {
        let (from, to) = (b[k], b[(k + 1) % b.len()]);
        let h = self.normal.cross(to - from).normalize_or_zero().dot(p - from);
        if h.abs() <= ON_EDGE * self.size { 0.0 } else { h }
    }

    /// What of a convex part lies within edge `k` of another (`sign` 1), or beyond it (-1).
    fn side(&self, part: &[DVec3], b: &[DVec3], k: usize, sign: f64) -> Vec<DVec3> {
        let mut found = Vec::new();
        clip(part, |p| sign * self.height(p, b, k), |p| found.push(p));
        found
    }
}

/// A convex part of a polygon that is taken away.
struct Hole<'a> {
    corners: &'a [DVec3],
    centre: DVec3,
    bounds: [DVec3; 2],
}

impl<'a> Hole<'a> {
    fn new(corners: &'a [DVec3]) -> Self {
        Self { corners, centre: mean(corners), bounds: bounds(corners) }
    }

    /// Whether the boxes round it and round a part come nearer to each other than `margin`.
    fn meets(&self, [low, high]: [DVec3; 2], margin: f64) -> bool {
        let [l, h] = self.bounds;
        (l - margin).cmple(high).all() && (h + margin).cmpge(low).all()
    }
}

fn mean(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / corners.len() as f64
}

/// Least and largest coordinates.
fn bounds(corners: &[DVec3]) -> [DVec3; 2] {
    let all =
        |of: fn(DVec3, DVec3) -> DVec3| corners.iter().copied().reduce(of).unwrap_or_default();
    [all(DVec3::min), all(DVec3::max)]
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

    fn take(parts: &mut Parts, holes: &[Parts]) {
        let holes: Vec<&Parts> = holes.iter().collect();
        parts.subtract(&holes, |_| Ok::<(), ()>(())).unwrap();
    }

    #[test]
    fn a_window_leaves_a_frame_of_few_parts() {
        let mut wall = rectangle([0.0, 0.0], [4.0, 3.0]);
        let window = rectangle([1.0, 1.0], [2.0, 2.0]);
        assert_eq!(wall.holds(&window), Ok(()));
        take(&mut wall, &[window]);
        assert_eq!(wall.convex.len(), 4);
        assert!((left(&wall) - 11.0).abs() < 1e-12);
        // A door at the edge of the wall leaves three more parts at most.
        take(&mut wall, &[rectangle([3.0, 0.0], [4.0, 2.0])]);
        assert!((left(&wall) - 9.0).abs() < 1e-9 && wall.convex.len() <= 7, "{wall:?}");
        take(&mut wall, &[rectangle([0.0, 0.0], [4.0, 3.0])]);
        assert!(wall.convex.is_empty());
    }

    #[test]
    fn many_windows_leave_few_parts() {
        for n in [10, 20] {
            // Each row is shifted by half a window, or by some of it.
            for shift in [0.0, 0.5, 0.29] {
                let window = |i: usize| {
                    let (row, column) = (i / n, (i % n) as f64);
                    let at = [1.2 * column + (shift * row as f64).fract(), 1.3 * row as f64];
                    rectangle([at[0] + 0.1, at[1] + 0.1], [at[0] + 1.1, at[1] + 1.1])
                };
                let (width, height) = (1.2 * n as f64 + 1.0, 1.3 * n as f64);
                let mut wall = rectangle([0.0, 0.0], [width, height]);
                let windows: Vec<Parts> = (0..n * n).map(window).collect();
                assert!(windows.iter().all(|w| wall.holds(w) == Ok(())));
                take(&mut wall, &windows);
                let rest = width * height - (n * n) as f64;
                assert!((left(&wall) - rest).abs() < 1e-6 * rest, "{}", left(&wall) - rest);
                let most = (n + 1) * (n + 1) + n;
                assert!(wall.convex.len() <= most, "{n} {shift}: {}", wall.convex.len());
            }
        }
    }

    #[test]
    fn windows_may_overlap_and_their_number_is_checked() {
        let mut wall = rectangle([0.0, 0.0], [4.0, 3.0]);
        let [a, b] = [[1.0, 1.0], [1.5, 1.5]].map(|[x, y]| rectangle([x, y], [x + 1.0, y + 1.0]));
        wall.subtract(&[&a, &b, &b], |_| Ok::<(), ()>(())).unwrap();
        assert!((left(&wall) - (12.0 - 1.75)).abs() < 1e-9);
        let mut wall = rectangle([0.0, 0.0], [4.0, 3.0]);
        assert_eq!(wall.subtract(&[&a], |n| if n > 2 { Err(n) } else { Ok(()) }), Err(3));
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
        take(&mut parts, &[hole]);
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
