//! Which triangle a ray meets first, and whether it meets any: packets of rays through a hierarchy
//! of boxes.
//!
//! Rays go in packets of 16. Each packet is seen along one axis of space: lengths along that axis
//! are the unit of distance, and a shear turns each ray into the axis itself, so that a triangle
//! becomes a drawing in the plane and the ray a point of it (Woop, Benthin & Wald 2013, "Watertight
//! ray/triangle intersection"). A position is drawn alike for all triangles that share it, and an
//! edge function x₁y₂ - x₂y₁ without contraction never has the wrong sign, only perhaps the value
//! 0, which counts as inside. So no ray slips through between triangles that share an edge or a
//! vertex.
//!
//! # Rounding
//!
//! Coordinates are single precision, centred on the scene and in units of its radius, and no better
//! than [`ROUNDING`](super::ROUNDING) = δ. A triangle is therefore a slab that reaches δ to either
//! side of its plane. With θ the angle of incidence, it begins δ / cos θ before the plane:
//!
//! - A back is taken to be farther by δ / cos θ and a front nearer by as much, when it is asked
//!   which hit comes first. At the silhouette of a closed body a front and a back meet in an edge;
//!   so the front wins, and backs inside a body are never seen.
//! - A ray that starts within δ of a triangle's plane does not meet its back. It meets its front,
//!   as in the corner of a room, unless that lies in the plane of the ray's own triangle.
//! - A segment is not blocked by what its far end touches: a triangle whose plane is within δ of
//!   that end.
//!
//! Boxes are wider by twice δ on all sides, which is more than slopes and products of coordinates
//! within the scene can err by; so no box hides a hit (as Ize 2013, "Robust BVH ray traversal", by
//! other means).
//!
//! # Limits
//!
//! A ray that starts within 2δ of an edge of its own triangle may pass between that and its
//! neighbour: what it begins on, it does not meet. Rays that leave the back of a triangle as near
//! to an edge may meet a neighbour in the same plane that is wound the other way. Meshes whose
//! neighbours do not share vertices are as tight as their coordinates.

mod build;
mod hierarchy;
mod meet;
mod node;
mod packet;
mod rays;
mod traverse;
mod triangle;
#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::NOTHING;
use crate::scene::{Geometry, Side, TriangleId};

use hierarchy::Hierarchy;
pub use packet::{Hits, Lanes, Packet};
use triangle::Triangle;

/// A binary hierarchy of boxes about the solid triangles of a scene.
#[derive(Debug, Clone)]
pub struct Bvh {
    centre: DVec3,
    radius: f64,
    ids: Vec<TriangleId>,
    boxes: Hierarchy,
}

/// What a single ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// The source triangle.
    pub triangle: TriangleId,
    /// The side that the ray comes upon.
    pub side: Side,
    /// Barycentric coordinates of the corners b and c.
    pub uv: [f64; 2],
    /// Distance in metres.
    pub distance: f64,
}

impl Bvh {
    /// The hierarchy of all solid triangles, the same for any number of threads. Triangles that are
    /// not finite in single precision are not met.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        let (centre, radius) = geometry.bounds().map_or((DVec3::ZERO, 1.0), |(low, high)| {
            let radius = 0.5 * (high - low).length();
            (0.5 * (low + high), if radius > 0.0 { radius } else { 1.0 })
        });
        let ids: Vec<TriangleId> = geometry.ids().filter(|&t| geometry.is_solid(t)).collect();
        let local = |p: DVec3| ((p - centre) / radius).as_vec3();
        let corners = |i: usize| geometry.corners(ids[i]).map(local);
        let (nodes, order) = build::hierarchy(ids.len(), corners);
        let triangles: Vec<_> =
            order.par_iter().map(|&i| Triangle::new(corners(i as usize), i)).collect();
        let mut place = vec![NOTHING; ids.len()];
        for (at, &i) in order.iter().enumerate() {
            place[i as usize] = at as u32;
        }
        Self { centre, radius, ids, boxes: Hierarchy { nodes, triangles, place } }
    }

    /// The source triangle of each solid triangle, in the order of
    /// [`Occluders::ids`](super::Occluders::ids).
    #[must_use]
    pub fn ids(&self) -> &[TriangleId] {
        &self.ids
    }

    /// The index of a source triangle among the solid ones; `None` if it is not solid.
    #[must_use]
    pub fn solid(&self, id: TriangleId) -> Option<u32> {
        self.ids.binary_search(&id).ok().map(|i| i as u32)
    }

    /// A point (m) in the coordinates of packets.
    #[must_use]
    pub fn local(&self, point: DVec3) -> Vec3 {
        ((point - self.centre) / self.radius).as_vec3()
    }

    /// Length in metres of a unit of the coordinates of packets.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.radius
    }

    /// The point (m) that the coordinates of packets are centred on.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        self.centre
    }

    /// Bytes of memory that it takes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        size_of_val(&*self.ids) as u64 + self.boxes.bytes()
    }

    /// The first hit of each ray.
    ///
    /// As many packets are traced as there are `hits`.
    pub fn closest(&self, packets: &[Packet], hits: &mut [Hits]) {
        if self.boxes.nodes.is_empty() {
            hits.fill(Hits::NONE);
        } else {
            traverse::closest(&self.boxes, packets, hits);
        }
    }

    /// Which rays meet anything before their far ends: bit l for lane l.
    pub fn blocked(&self, packets: &[Packet], blocked: &mut [u16]) {
        if self.boxes.nodes.is_empty() {
            blocked.fill(0);
        } else {
            traverse::blocked(&self.boxes, packets, blocked);
        }
    }

    /// The point of a ray (m), at its origin or ahead of it, from where on it may meet something. A
    /// packet is exact only if it begins there: single precision knows nothing as small as a
    /// triangle where it counts from far away.
    #[must_use]
    pub fn approach(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        let length2 = direction.length_squared();
        if (origin - self.centre).length() <= 2.0 * self.radius || length2 <= 0.0 {
            return origin;
        }
        let closest = (self.centre - origin).dot(direction) / length2;
        origin + direction * (closest - 2.0 * self.radius / length2.sqrt()).max(0.0)
    }

    /// What a ray from `origin` (m) meets first, the triangle `own` left out. The direction may
    /// have any length but 0.
    #[must_use]
    pub fn see(&self, origin: DVec3, direction: DVec3, own: Option<TriangleId>) -> Option<Met> {
        let unit = direction.try_normalize()?;
        let near = self.approach(origin, unit);
        let mut packet = Packet::EMPTY;
        let own = own.and_then(|t| self.solid(t));
        packet.set(0, self.local(near), unit.as_vec3(), f32::INFINITY, own);
        let mut hits = [Hits::NONE];
        self.closest(&[packet], &mut hits);
        let [hits] = hits;
        let item = hits.item[0];
        (item != NOTHING).then(|| Met {
            triangle: self.ids[item as usize / 2],
            side: if item & 1 == 1 { Side::Back } else { Side::Front },
            uv: [hits.u[0].into(), hits.v[0].into()],
            distance: (near - origin).length() + f64::from(hits.distance[0]) * self.radius,
        })
    }

    /// Whether any triangle blocks the segment between two points (m); those that an end touches do
    /// not.
    #[must_use]
    pub fn blocks(&self, from: DVec3, to: DVec3) -> bool {
        let near = self.local(self.approach(from, to - from));
        let far = self.local(self.approach(to, from - to));
        let mut packet = Packet::EMPTY;
        packet.set(0, near, far - near, 1.0, None);
        let mut blocked = [0];
        self.blocked(&[packet], &mut blocked);
        blocked[0] != 0
    }
}
