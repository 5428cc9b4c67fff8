//! A look from a point of a surface, in few directions.

use super::{Bvh, Frame, Hits, Packet};
use crate::patches::SurfacePoint;
use crate::scene::Geometry;
use crate::simd::LANES;

/// Directions of a look.
pub(crate) const DIRECTIONS: usize = 4 * LANES;

/// In radians.
const GOLDEN_ANGLE: f32 = 2.399_963_2;

/// Share of a direction of a look in what a point receives: as its cosine is of all.
pub(crate) fn share_of(direction: usize) -> f64 {
    (2 * direction + 1) as f64 / (DIRECTIONS * DIRECTIONS) as f64
}

/// What is seen from a point of a surface in directions even over the hemisphere: an item, or
/// [`NOTHING`](super::NOTHING), for each.
pub(crate) fn seen_from(
    geometry: &Geometry,
    bvh: &Bvh,
    p: SurfacePoint,
) -> impl Iterator<Item = u32> {
    let frame = Frame::on_surface(p.position(geometry), geometry.normal(p.triangle, p.side));
    let [t, u, n] = frame.axes.map(|a| a.as_vec3());
    let (origin, own) = (bvh.local(frame.origin), bvh.solid(p.triangle));
    let mut packets = [Packet::EMPTY; DIRECTIONS / LANES];
    for k in 0..DIRECTIONS {
        // A spiral that turns by the golden angle.
        let z = (k as f32 + 0.5) / DIRECTIONS as f32;
        let (sin, cos) = (k as f32 * GOLDEN_ANGLE).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let direction = t * (r * cos) + u * (r * sin) + n * z;
        packets[k / LANES].set(k % LANES, origin, direction, f32::INFINITY, own);
    }
    let mut hits = [Hits::NONE; DIRECTIONS / LANES];
    bvh.closest(&packets, &mut hits);
    hits.into_iter().flat_map(|h| h.item)
}
