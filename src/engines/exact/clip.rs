//! Blockers clipped to the space between the two polygons of a pair.

use glam::DVec3;

use super::blockers::{Blocker, BlockerId};
use super::culling::Region;
use super::model::Model;
use super::occluded::MOST_CORNERS;
use super::pair::Pair;
use super::polygon::Polygon;
use crate::scene::clip::clip as clip_polygon;
use crate::visibility::Bvh;

/// What of a blocker lies lower than this over the planes of a pair, as a fraction of the pair's
/// extent, is cut off: single precision does not tell a direction along the horizon from its
/// opposite. It is as much as blockers touch within, if that is more.
const HORIZON: f64 = 2e-6;

/// What rises no higher than this over the plane of a polygon may lie in it, in units of the
/// distance at which blockers touch: rounding tilts the plane of a narrow one.
const TILTED: f64 = 20.0;

/// The part of a blocker that lies in front of both polygons.
#[derive(Debug, Clone)]
pub(super) struct ClippedBlocker {
    corners: [DVec3; MOST_CORNERS],
    len: usize,
    pub id: BlockerId,
    pub normal: DVec3,
    /// The connected surface that it belongs to, and whether that is closed here.
    pub surface: u32,
    pub closed: bool,
    /// Connected blockers of one surface that turn the same side to the points.
    pub sheet: u32,
    /// How much it has been found to hide.
    pub hides: f64,
    /// The points that it hides anything from, one bit each.
    pub seen: u16,
}

impl ClippedBlocker {
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }

    /// Distance of a point from the nearest corner or middle of an edge.
    pub fn distance(&self, p: DVec3) -> f64 {
        let corners = self.corners();
        let edges = (0..self.len).map(|k| 0.5 * (corners[k] + corners[(k + 1) % self.len]));
        let points = corners.iter().copied().chain(edges);
        points.map(|c| c.distance_squared(p)).fold(f64::INFINITY, f64::min).sqrt()
    }
}

/// A polygon clipped by one plane, and by both; reused.
#[derive(Debug, Default)]
pub(super) struct ClipBuffers([Vec<DVec3>; 2]);

/// The planes about the convex hull of two polygons in front of each other, each through an edge
/// of one and a corner of the other: outward normals and offsets.
#[derive(Debug, Default)]
pub(super) struct Hull {
    planes: Vec<(DVec3, f64)>,
    low: DVec3,
    high: DVec3,
    /// Half of the diagonal of the box about it.
    extent: f64,
}

impl Hull {
    /// The hull of two polygons; `noise` is a distance that is none.
    pub fn about(&mut self, [a, b]: &[Polygon; 2], noise: f64) {
        self.planes.clear();
        let corners = || a.corners().iter().chain(b.corners());
        self.low = corners().fold(DVec3::INFINITY, |l, &c| l.min(c));
        self.high = corners().fold(DVec3::NEG_INFINITY, |h, &c| h.max(c));
        self.extent = 0.5 * self.low.distance(self.high);
        // What lies behind either polygon is between them no more.
        for p in [a, b] {
            self.planes.push((-p.normal, -p.normal.dot(p.corners()[0])));
        }
        for (p, q) in [(a, b), (b, a)] {
            let own = p.corners();
            for (k, &from) in own.iter().enumerate() {
                let edge = own[(k + 1) % own.len()] - from;
                let outward = edge.cross(p.normal);
                // The corner that is seen lowest from the edge, towards its outside.
                let cotangent = |c: &DVec3| {
                    let (out, up) = (outward.dot(*c - from), p.normal.dot(*c - from));
                    out / (up.max(0.0) * edge.length()).max(f64::MIN_POSITIVE)
                };
                let outermost =
                    q.corners().iter().max_by(|x, y| cotangent(x).total_cmp(&cotangent(y)));
                let Some(&outermost) = outermost else { continue };
                let normal = (outermost - from).cross(edge).normalize_or_zero();
                let normal = if normal.dot(outward) < 0.0 { -normal } else { normal };
                // Where polygons touch, the plane may be anything.
                let offset = normal.dot(from);
                if normal != DVec3::ZERO && corners().all(|&c| normal.dot(c) <= offset + noise) {
                    self.planes.push((normal, offset));
                }
            }
        }
    }

    /// Sets a region to the hull of the polygons of a pair.
    pub fn set(&self, region: &mut Region, pair: &Pair<'_>, bvh: &Bvh) {
        let ends = pair.polygons.iter().flat_map(Polygon::corners);
        region.set(bvh, (self.low, self.high), self.planes.iter().copied(), ends);
    }

    /// Whether points lie outside, nowhere closer than `margin` to the inside.
    fn misses(&self, points: &[DVec3], margin: f64) -> bool {
        self.planes.iter().any(|&(n, d)| points.iter().all(|&p| n.dot(p) - d >= -margin))
    }
}

/// The part of a blocker that lies between the polygons; `None` if it cannot hide anything.
pub(super) fn clip(
    pair: &Pair<'_>,
    id: BlockerId,
    hull: &Hull,
    model: &Model<'_>,
    buffers: &mut ClipBuffers,
) -> Option<ClippedBlocker> {
    let (q, touching) = (model.blockers.polygon(id), model.touching);
    let [a, b] = pair.polygons.each_ref().map(|p| heights(p, q));
    if a.0.min(b.0) >= -touching || a.1.max(b.1) <= touching {
        return None;
    }
    if pair.polygons.iter().any(|p| is_flush(q, p, touching)) {
        return None;
    }
    let ClipBuffers([first, second]) = buffers;
    let horizon = touching.max(HORIZON * hull.extent);
    before(&q.corners, &pair.polygons[0], horizon, first);
    before(first, &pair.polygons[1], horizon, second);
    if second.len() < 3 || second.len() > MOST_CORNERS || hull.misses(second, touching) {
        return None;
    }
    let mut corners = [DVec3::ZERO; MOST_CORNERS];
    corners[..second.len()].copy_from_slice(second);
    Some(ClippedBlocker {
        corners,
        len: second.len(),
        id,
        normal: q.normal,
        surface: q.surface,
        closed: q.closed || !q.rim,
        sheet: 0,
        hides: 0.0,
        seen: 0,
    })
}

/// The least and the greatest height of a polygon's corners over a blocker.
fn heights(p: &Polygon, over: &Blocker) -> (f64, f64) {
    let heights = p.corners().iter().map(|&c| over.height(c));
    heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
}

/// Whether a blocker lies in a polygon's plane, as well as that is known where corners are known
/// within `touching`.
fn is_flush(q: &Blocker, p: &Polygon, touching: f64) -> bool {
    let height = |c: &DVec3| p.normal.dot(*c - p.corners()[0]);
    if q.corners.iter().any(|c| height(c) > TILTED * touching) {
        return false;
    }
    let edges = p.corners().iter().zip(p.corners().iter().cycle().skip(1));
    let longest = edges.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    let width = p.area() / longest;
    q.corners.iter().all(|c| height(c) <= touching * (1.0 + p.distance(*c) / width))
}

/// The part of a polygon more than `margin` in front of another's plane.
fn before(corners: &[DVec3], of: &Polygon, margin: f64, part: &mut Vec<DVec3>) {
    part.clear();
    clip_polygon(corners, |v| of.normal.dot(v - of.corners()[0]) - margin, |v| part.push(v));
}
