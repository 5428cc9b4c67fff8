//! Patches that something covers, wholly or partly.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::hemisphere::{DIRECTIONS, seen_from};
use super::{Bvh, NOTHING};
use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::progress::{Cancelled, Progress};
use crate::scene::{Geometry, Side, TriangleId};

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

/// Whether most of what a point of a surface sees are backs that do not reflect.
fn is_covered(geometry: &Geometry, bvh: &Bvh, p: SurfacePoint) -> bool {
    let absorbs = |item: u32| {
        item != NOTHING
            && item & 1 == 1
            && !geometry.exchanges(bvh.ids()[item as usize / 2], Side::Back)
    };
    let behind = seen_from(geometry, bvh, p).filter(|&item| absorbs(item)).count();
    behind as f64 > COVERED * DIRECTIONS as f64
}

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
        .filter(|&triangle| geometry.exchanges(triangle, Side::Front))
        .filter(|&triangle| {
            let p = SurfacePoint { triangle, side: Side::Front, uv: third };
            is_covered(geometry, &bvh, p)
        })
        .collect()
}

/// Moves the origins of patches that are covered at their centroid, but not everywhere, to a point
/// that is not. Only patches at a contact can be covered in part.
///
/// # Errors
/// If `progress` stops it.
pub fn uncover(
    geometry: &Geometry,
    patches: Patches,
    bvh: &Bvh,
    progress: &dyn Progress,
) -> Result<Patches, Cancelled> {
    // Only backs that do not reflect cover, and nothing of the model stands on a stage.
    let dark = |t: TriangleId| geometry.is_solid(t) && !geometry.exchanges(t, Side::Back);
    if !geometry.ids().any(|t| dark(t) && !geometry.is_whole(t)) {
        return Ok(patches);
    }
    let near: Vec<PatchId> = patches.ids().filter(|&i| patches.has_contact(i)).collect();
    let covered = |p: SurfacePoint| is_covered(geometry, bvh, p);
    let free = |i: PatchId| {
        progress.advance(0)?;
        if !covered(patches.center(i)) {
            return Ok(None);
        }
        let cell = patches.cell(i);
        let free = TRIED.iter().map(|&l| cell.point(l)).find(|&p| !covered(p));
        Ok(free.map(|p| (i, p)))
    };
    let free: Result<Vec<_>, Cancelled> = near.into_par_iter().map(free).collect();
    let origins: HashMap<PatchId, SurfacePoint> = free?.into_iter().flatten().collect();
    if origins.is_empty() { Ok(patches) } else { patches.with_origins(origins, progress) }
}
