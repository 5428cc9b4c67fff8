//! What lies between two groups of patches: nothing, something that hides everything, or something
//! that needs a closer look.
//!
//! A shaft is the convex hull of two boxes (Haines & Wallace 1991, "Shaft culling for efficient
//! ray-traced radiosity"); what is outside blocks nothing between them. For what is inside,
//! segments from corner to corner decide: on which side of an edge q₀q₁ a segment xy passes is the
//! sign of
//!
//! ```text
//! (q₀ - x) × (q₁ - x) · (y - x)
//! ```
//!
//! which is linear in x and in y (Plücker): it is enough to test the corners of two convex sets.

use glam::DVec3;

use super::blockers::Blocker;
use super::culling::Region;
use super::tree::Node;
use crate::visibility::Bvh;

/// What a polygon hides between two groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Occlusion {
    /// It blocks no segment.
    None,
    /// It may block some.
    Partial,
    /// It blocks all.
    Complete,
}

/// The planes about the convex hull of two boxes.
#[derive(Debug, Default)]
pub(super) struct Shaft {
    low: DVec3,
    high: DVec3,
    /// Outward normals and offsets.
    planes: Vec<(DVec3, f64)>,
}

impl Shaft {
    pub fn between(&mut self, a: &Node, b: &Node) {
        (self.low, self.high) = (a.low.min(b.low), a.high.max(b.high));
        self.planes.clear();
        for (x, y) in [(0, 1), (1, 2), (2, 0)] {
            for (sx, sy) in [(false, false), (false, true), (true, false), (true, true)] {
                let end = |n: &Node| {
                    let pick = |s: bool, k: usize| if s { n.high[k] } else { n.low[k] };
                    (pick(sx, x), pick(sy, y))
                };
                let ((ax, ay), (bx, by)) = (end(a), end(b));
                let out = |s: bool| if s { 1.0 } else { -1.0 };
                // One box reaches farther along x, the other along y.
                if ((ax - bx) * out(sx)) * ((ay - by) * out(sy)) < 0.0 {
                    let mut normal = DVec3::ZERO;
                    normal[x] = (ay - by).abs() * out(sx);
                    normal[y] = (ax - bx).abs() * out(sy);
                    self.planes.push((normal, normal[x] * ax + normal[y] * ay));
                }
            }
        }
    }

    /// Sets a region to the shaft, and to what lies in front of flat groups at its ends.
    pub fn set(&self, region: &mut Region, ends: [&Node; 2], bvh: &Bvh) {
        let fronts = ends.iter().filter_map(|n| n.plane.map(|(m, d)| (-m, -d)));
        let corners = ends.iter().flat_map(|n| n.corners());
        region.set(bvh, (self.low, self.high), self.planes.iter().copied().chain(fronts), corners);
    }

    /// Whether a polygon is certainly outside.
    fn misses(&self, corners: &[DVec3]) -> bool {
        (0..3).any(|k| {
            corners.iter().all(|c| c[k] > self.high[k])
                || corners.iter().all(|c| c[k] < self.low[k])
        }) || self.planes.iter().any(|&(n, d)| corners.iter().all(|&c| n.dot(c) > d))
    }
}

/// The least and the greatest of some numbers.
fn range(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
}

/// Whether one of two groups lies completely behind the plane of the other.
pub(super) fn face_away(a: &Node, b: &Node, coplanar: f64) -> bool {
    let behind = |a: &Node, b: &Node| {
        a.plane.is_some_and(|(n, d)| b.corners().iter().all(|c| n.dot(*c) - d <= coplanar))
    };
    behind(a, b) || behind(b, a)
}

/// How closely polygons are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// Only those that may hide all: what is smaller than both groups may block a part.
    Large,
    /// All, but small ones not from corner to corner.
    All,
    Closely,
}

/// What a polygon hides between two groups that the shaft is about, as far as such a look tells.
pub(super) fn occlusion(
    q: &Blocker,
    shaft: &Shaft,
    [a, b]: [&Node; 2],
    look: Look,
    coplanar: f64,
) -> Occlusion {
    // What is smaller than both groups cannot hide one from the other.
    let large = q.low.distance_squared(q.high) >= a.diagonal().min(b.diagonal());
    if !large && look == Look::Large {
        return Occlusion::Partial;
    }
    let (a_low, a_high) = range(a.corners().iter().map(|&c| q.height(c)));
    let (b_low, b_high) = range(b.corners().iter().map(|&c| q.height(c)));
    let same_side = a_low.min(b_low) >= -coplanar || a_high.max(b_high) <= coplanar;
    if same_side {
        return Occlusion::None;
    }
    let behind = |n: &Node| {
        n.plane.is_some_and(|(m, d)| q.corners.iter().all(|c| m.dot(*c) - d <= coplanar))
    };
    if behind(a) || behind(b) || shaft.misses(&q.corners) {
        return Occlusion::None;
    }
    if !large && look != Look::Closely {
        return Occlusion::Partial;
    }
    if a_low > coplanar && b_high < -coplanar {
        across(q, a, b, 1.0, coplanar)
    } else if a_high < -coplanar && b_low > coplanar {
        across(q, a, b, -1.0, coplanar)
    } else {
        Occlusion::Partial
    }
}

/// What a polygon hides whose plane separates two groups; `a` is in front of it if `side` is 1,
/// behind it if -1.
fn across(q: &Blocker, a: &Node, b: &Node, side: f64, coplanar: f64) -> Occlusion {
    let mut inside = true;
    for k in 0..q.corners.len() {
        let (q0, q1) = (q.corners[k], q.corners[(k + 1) % q.corners.len()]);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &x in a.corners() {
            let plane = (q0 - x).cross(q1 - x) * side;
            for &y in b.corners() {
                let product = plane.dot(y - x);
                (low, high) = (low.min(product), high.max(product));
            }
        }
        // As seen from the front, segments inside pass on the left: the product is negative.
        let noise = coplanar * coplanar * (q1 - q0).length();
        if low >= -noise {
            return Occlusion::None;
        }
        inside &= high < -noise;
    }
    if inside { Occlusion::Complete } else { Occlusion::Partial }
}
