//! Patches that something covers, wholly or partly.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{Bvh, Frame, Hits, NOTHING, Packet};
use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::scene::{Geometry, Side, TriangleId};
use crate::simd::LANES;

/// A patch that sends more than this fraction of its light to backs that do not reflect is covered.
pub const COVERED: f64 = 0.5;

/// Points tried on a patch whose centroid is covered, in barycentric coordinates: towards each
/// corner, then towards each edge.
const TRIED: [DVec3; 6] = [
    DVec3::new(0.7, 0.15, 0.15),
    DVec3::new(0.15, 0.7, 0.15),
    DVec3::new(0.15, 0.15, 0.7),
    DVec3::new(0.06, 0.47, 0.47),
    DVec3::new(0.47, 0.06, 0.47),
    DVec3::new(0.47, 0.47, 0.06),
];

/// Directions tried from a point.
const DIRECTIONS: usize = 4 * LANES;

/// Whether most of what a point of a surface sees are backs that do not reflect.
fn is_covered(geometry: &Geometry, bvh: &Bvh, p: SurfacePoint) -> bool {
    let frame = Frame::on_surface(p.position(geometry), geometry.normal(p.triangle, p.side));
    let [t, u, n] = frame.axes.map(|a| a.as_vec3());
    let (origin, own) = (bvh.local(frame.origin), bvh.solid(p.triangle));
    let mut packets = [Packet::EMPTY; DIRECTIONS / LANES];
    for k in 0..DIRECTIONS {
        // Even over the hemisphere: a spiral that turns by the golden angle.
        let z = (k as f32 + 0.5) / DIRECTIONS as f32;
        let (sin, cos) = (k as f32 * GOLDEN_ANGLE).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let direction = t * (r * cos) + u * (r * sin) + n * z;
        packets[k / LANES].set(k % LANES, origin, direction, f32::INFINITY, own);
    }
    let mut hits = [Hits::NONE; DIRECTIONS / LANES];
    bvh.closest(&packets, &mut hits);
    let absorbs = |item: u32| {
        item != NOTHING
            && item & 1 == 1
            && !geometry.exchanges(bvh.ids()[item as usize / 2], Side::Back)
    };
    let behind = hits.iter().flat_map(|h| h.item).filter(|&item| absorbs(item)).count();
    behind as f64 > COVERED * DIRECTIONS as f64
}

/// In radians.
const GOLDEN_ANGLE: f32 = 2.399_963_2;

/// Triangles that are covered at their centroid, of at most `most` spread over the model.
#[must_use]
pub fn covered_triangles(geometry: &Geometry, most: usize) -> Vec<TriangleId> {
    // Only backs that do not reflect cover.
    if !geometry.ids().any(|t| geometry.is_solid(t) && !geometry.exchanges(t, Side::Back)) {
        return Vec::new();
    }
    let bvh = Bvh::new(geometry);
    let step = bvh.ids().len().div_ceil(most).max(1);
    let third = DVec2::splat(1.0 / 3.0);
    bvh.ids()
        .par_iter()
        .step_by(step)
        .copied()
        .filter(|&triangle| {
            let p = SurfacePoint { triangle, side: Side::Front, uv: third };
            is_covered(geometry, &bvh, p)
        })
        .collect()
}

/// Moves the origins of patches that are covered at their centroid, but not everywhere, to a point
/// that is not. Only patches at a contact can be covered in part.
#[must_use]
pub fn uncover(geometry: &Geometry, patches: Patches, bvh: &Bvh) -> Patches {
    let near: Vec<PatchId> = patches.ids().filter(|&i| patches.has_contact(i)).collect();
    let covered = |p: SurfacePoint| is_covered(geometry, bvh, p);
    let origins: HashMap<PatchId, SurfacePoint> = near
        .into_par_iter()
        .filter(|&i| covered(patches.center(i)))
        .filter_map(|i| {
            let cell = patches.cell(i);
            let free = TRIED.iter().map(|&l| cell.point(l)).find(|&p| !covered(p));
            free.map(|p| (i, p))
        })
        .collect();
    if origins.is_empty() { patches } else { patches.with_origins(origins) }
}
