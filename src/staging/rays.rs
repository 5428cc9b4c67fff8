//! Bundles of rays through a model.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::{Side, TriangleId};
use crate::simd::LANES;
use crate::visibility::{Bvh, Hits, NOTHING, Packet};

/// What a ray meets first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub triangle: TriangleId,
    pub side: Side,
    /// Metres.
    pub distance: f64,
}

/// What each ray (origin in metres, unit direction) meets first.
pub(super) fn cast(bvh: &Bvh, rays: &[(DVec3, DVec3)]) -> Vec<Option<Hit>> {
    rays.par_chunks(LANES)
        .flat_map_iter(|rays| {
            let mut packet = Packet::EMPTY;
            let mut skipped = [0.0; LANES];
            for (l, &(origin, direction)) in rays.iter().enumerate() {
                let near = bvh.approach(origin, direction);
                skipped[l] = (near - origin).length();
                packet.set(l, bvh.local(near), direction.as_vec3(), f32::INFINITY, None);
            }
            let mut hits = [Hits::NONE];
            bvh.closest(&[packet], &mut hits);
            let [hits] = hits;
            (0..rays.len()).map(move |l| {
                let item = hits.item[l];
                (item != NOTHING).then(|| Hit {
                    triangle: bvh.ids()[item as usize / 2],
                    side: if item & 1 == 1 { Side::Back } else { Side::Front },
                    distance: skipped[l] + f64::from(hits.distance[l]) * bvh.scale(),
                })
            })
        })
        .collect()
}

/// `count` unit vectors, even over the sphere: a spiral that turns by the golden angle.
pub(super) fn sphere(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5_f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (sin, cos) = (k as f64 * golden).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    })
}

/// Two horizontal unit vectors: to the right of who comes from the front, and to the front. Models
/// whose up is y look towards +z, those whose up is z towards -y.
pub(super) fn bearings(up: DVec3) -> (DVec3, DVec3) {
    let ahead = if up.y.abs() > 0.5 { DVec3::Z } else { DVec3::NEG_Y };
    let front = ahead.reject_from(up).normalize_or(up.any_orthonormal_vector());
    (up.cross(front), front)
}

/// `count` horizontal unit vectors, the first towards the front, and on to the right.
pub(super) fn horizon(up: DVec3, count: usize) -> impl Iterator<Item = DVec3> {
    let (right, front) = bearings(up);
    (0..count).map(move |k| {
        let (sin, cos) = (k as f64 / count as f64 * TAU).sin_cos();
        front * cos + right * sin
    })
}
