//! Plane convex polygons, and what two of them see of each other by their planes alone.

use glam::DVec3;

use crate::scene::clip::clip;

/// A plane convex polygon with a front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    /// Unit length; corners run counter-clockwise about it.
    pub normal: DVec3,
    corners: [DVec3; MOST_CORNERS],
    len: usize,
}

/// Most corners of a triangle that two planes have cut.
const MOST_CORNERS: usize = 5;

impl Polygon {
    pub fn triangle([a, b, c]: [DVec3; 3], normal: DVec3) -> Self {
        Self { normal, corners: [a, b, c, a, a], len: 3 }
    }

    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }

    /// The triangles of a fan about the first corner.
    pub fn fan(&self) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
        (2..self.len).map(|k| [self.corners[0], self.corners[k - 1], self.corners[k]])
    }

    pub fn area(&self) -> f64 {
        self.fan().map(area).sum()
    }

    /// The part more than `coplanar` in front of the plane through `point`; `None` if there is
    /// none.
    pub fn before(&self, point: DVec3, normal: DVec3, coplanar: f64) -> Option<Self> {
        let height = |v: DVec3| {
            let h = normal.dot(v - point);
            if h.abs() <= coplanar { 0.0 } else { h }
        };
        if self.corners().iter().all(|&v| height(v) <= 0.0) {
            return None;
        }
        let mut part = Self { len: 0, ..*self };
        clip(self.corners(), height, |v| {
            if let Some(corner) = part.corners.get_mut(part.len) {
                *corner = v;
                part.len += 1;
            }
        });
        (part.len > 2).then_some(part)
    }

    /// Mean of the corners.
    pub fn centre(&self) -> DVec3 {
        self.corners().iter().sum::<DVec3>() / self.len as f64
    }

    pub fn radius(&self, centre: DVec3) -> f64 {
        self.corners().iter().map(|v| v.distance_squared(centre)).fold(0.0, f64::max).sqrt()
    }

    /// Distance of a point.
    pub fn distance(&self, p: DVec3) -> f64 {
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

/// Length of the longest edge of a triangle.
pub(super) fn longest_edge([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// The parts of two polygons in front of each other; `None` if they do not face each other. Heights
/// up to `coplanar` count as none.
pub(super) fn facing(a: &Polygon, b: &Polygon, coplanar: f64) -> Option<(Polygon, Polygon)> {
    let b_seen = b.before(a.corners[0], a.normal, coplanar)?;
    let a_seen = a.before(b.corners[0], b.normal, coplanar)?;
    Some((a_seen, b_seen))
}
