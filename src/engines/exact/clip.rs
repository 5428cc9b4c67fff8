//! Blockers clipped to the space between the two polygons of a pair.

use glam::DVec3;

use super::blockers::{Blocker, BlockerId, BodyId};
use super::model::Model;
use super::occluded::MOST_CORNERS;
use super::pair::Pair;
use super::polygon::Polygon;
use crate::scene::clip::clip as clip_polygon;

/// The part of a blocker that lies in front of both polygons.
#[derive(Debug, Clone)]
pub(super) struct ClippedBlocker {
    corners: [DVec3; MOST_CORNERS],
    len: usize,
    pub normal: DVec3,
    /// Blockers of one group never overlap.
    pub group: u32,
    /// Whether it blocks only what enters by its front.
    pub one_sided: bool,
    /// How much it has been found to hide.
    pub hides: f64,
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

/// The part of a blocker that lies between the polygons; `None` if it cannot hide anything.
pub(super) fn clip(
    pair: &Pair<'_>,
    id: BlockerId,
    model: &Model<'_>,
    buffers: &mut ClipBuffers,
) -> Option<ClippedBlocker> {
    let (q, touching) = (model.blockers.polygon(id), model.touching);
    let [a, b] = pair.polygons.each_ref().map(|p| heights(p, q));
    let entered = |body: &BodyId| !pair.pieces[0].inside.contains(body);
    let body = q.body.filter(entered);
    if a.0.min(b.0) >= -touching
        || a.1.max(b.1) <= touching
        || body.is_some() && (a.1 <= touching || b.0 >= -touching)
    {
        return None;
    }
    let ClipBuffers([first, second]) = buffers;
    before(&q.corners, &pair.polygons[0], touching, first);
    before(first, &pair.polygons[1], touching, second);
    if second.len() < 3 || second.len() > MOST_CORNERS {
        return None;
    }
    let mut corners = [DVec3::ZERO; MOST_CORNERS];
    corners[..second.len()].copy_from_slice(second);
    Some(ClippedBlocker {
        corners,
        len: second.len(),
        normal: q.normal,
        group: body.map_or(model.blockers.bodies.len() as u32 + id.0, |body| body.0),
        one_sided: body.is_some(),
        hides: 0.0,
    })
}

/// The least and the greatest height of a polygon's corners over a blocker.
fn heights(p: &Polygon, over: &Blocker) -> (f64, f64) {
    let heights = p.corners().iter().map(|&c| over.height(c));
    heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
}

/// The part of a polygon more than `touching` in front of another's plane, or all of it if none of
/// it lies behind.
fn before(corners: &[DVec3], of: &Polygon, touching: f64, part: &mut Vec<DVec3>) {
    part.clear();
    let height = |v: DVec3| of.normal.dot(v - of.corners()[0]);
    if corners.iter().all(|&c| height(c) <= touching) {
        return;
    }
    clip_polygon(corners, height, |v| part.push(v));
}
