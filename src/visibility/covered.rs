//! Patches that lie under something, wholly or in part.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{Occluders, Surroundings, share};
use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::scene::{Geometry, Side, TriangleId};

/// A patch that sends more than this share of its light to backs that do not reflect is covered.
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
fn is_covered(geometry: &Geometry, occluders: &Occluders, p: SurfacePoint) -> bool {
    let normal = geometry.normal(p.triangle, p.side);
    let seen = Surroundings::of(occluders, p.position(geometry), normal, Some(p.triangle));
    share(seen.above(), |g| {
        g.hit.is_some_and(|(t, side, _)| side == Side::Back && !geometry.exchanges(t, side))
    }) > COVERED
}

/// Triangles that are covered at their centroid, of at most `most` spread over the model.
#[must_use]
pub fn covered_triangles(geometry: &Geometry, most: usize) -> Vec<TriangleId> {
    // Only backs that do not reflect cover.
    if !geometry.ids().any(|t| geometry.is_solid(t) && !geometry.exchanges(t, Side::Back)) {
        return Vec::new();
    }
    let occluders = Occluders::new(geometry);
    let step = occluders.len().div_ceil(most).max(1);
    let third = DVec2::splat(1.0 / 3.0);
    occluders
        .ids()
        .par_iter()
        .step_by(step)
        .copied()
        .filter(|&triangle| {
            let p = SurfacePoint { triangle, side: Side::Front, uv: third };
            is_covered(geometry, &occluders, p)
        })
        .collect()
}

/// Moves the origins of patches that are covered at their centroid, but not everywhere, to a point
/// that is not. Only patches at a contact can be covered in part.
#[must_use]
pub fn uncover(geometry: &Geometry, patches: Patches) -> Patches {
    let occluders = Occluders::new(geometry);
    let near: Vec<PatchId> = patches.ids().filter(|&i| patches.has_contact(i)).collect();
    let covered = |p: SurfacePoint| is_covered(geometry, &occluders, p);
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
