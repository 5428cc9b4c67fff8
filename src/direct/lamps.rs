//! Light of lamps: sources without extent, and the shadows of what is before them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::scene::{Axes, Lamp, Rgb, Scene};
use crate::simd::LANES;
use crate::visibility::{Bvh, Packet};

/// Points of a patch that lamps shine on: one packet of rays to each lamp.
const POINTS: usize = LANES;

/// Patches whose rays are traced at a time.
const BLOCK: usize = 64;

/// Where something stands on a patch, its points move towards its origin by this fraction of the
/// way, so that none lies exactly at the foot of what stands there, where lamps on either side
/// reach it.
const LEAN: f64 = 0.01;

/// A point that lamps shine on.
struct Receiver {
    position: DVec3,
    normal: DVec3,
    /// Its own triangle, by which it is not shadowed.
    own: Option<u32>,
}

/// Irradiance of each patch from lamps (W/m² or lx), with shadows; the mean over 16 points spread
/// evenly over what belongs to the patch.
///
/// ```text
/// H = I(ω) cos θ / r²        point and spot lamps
/// H = H_⊥ cos θ              directional ones
/// ```
///
/// The cone of a spot lamp falls off as `KHR_lights_punctual` recommends. `bvh` is that of the
/// scene's geometry.
#[must_use]
pub fn from_lamps(scene: &Scene, patches: &Patches, bvh: &Bvh) -> Vec<Rgb> {
    let lamps: Vec<(&Lamp, Axes)> = scene.lamps.iter().map(|l| (l, l.axes(scene.up))).collect();
    let mut direct = vec![Rgb::ZERO; patches.len()];
    direct.par_chunks_mut(BLOCK).enumerate().for_each(|(block, direct)| {
        let first = (block * BLOCK) as u32;
        let receivers: Vec<Vec<Receiver>> = (first..first + direct.len() as u32)
            .map(|i| receivers(scene, patches, bvh, PatchId(i)))
            .collect();
        let mut packets = vec![Packet::EMPTY; direct.len()];
        let mut arriving = vec![[Rgb::ZERO; POINTS]; direct.len()];
        let mut blocked = vec![0_u16; direct.len()];
        for (lamp, axes) in &lamps {
            for ((receivers, packet), arriving) in
                receivers.iter().zip(&mut packets).zip(&mut arriving)
            {
                (*packet, *arriving) = shine(lamp, axes, receivers, bvh);
            }
            bvh.blocked(&packets, &mut blocked);
            for ((direct, arriving), blocked) in direct.iter_mut().zip(&arriving).zip(&blocked) {
                let seen = |l: &usize| blocked >> l & 1 == 0;
                *direct += (0..POINTS).filter(seen).map(|l| arriving[l]).sum::<Rgb>();
            }
        }
    });
    direct
}

/// Adds the irradiance from all lamps (W/m² or lx), with shadows, at points of a unit normal each.
pub(crate) fn lamps_over(
    scene: &Scene,
    bvh: &Bvh,
    points: impl Iterator<Item = (DVec3, DVec3)>,
    found: &mut [Rgb],
) {
    if scene.lamps.is_empty() {
        return;
    }
    let receivers: Vec<Receiver> =
        points.map(|(position, normal)| Receiver { position, normal, own: None }).collect();
    let blocks = receivers.len().div_ceil(POINTS);
    let mut packets = vec![Packet::EMPTY; blocks];
    let mut arriving = vec![[Rgb::ZERO; POINTS]; blocks];
    let mut blocked = vec![0_u16; blocks];
    for lamp in &scene.lamps {
        let axes = lamp.axes(scene.up);
        for (b, block) in receivers.chunks(POINTS).enumerate() {
            (packets[b], arriving[b]) = shine(lamp, &axes, block, bvh);
            arriving[b] = arriving[b].map(|h| h * block.len() as f64);
        }
        bvh.blocked(&packets, &mut blocked);
        for (i, found) in found.iter_mut().enumerate() {
            let (b, l) = (i / POINTS, i % POINTS);
            if blocked[b] >> l & 1 == 0 {
                *found += arriving[b][l];
            }
        }
    }
}

/// The points of a patch, at most [`POINTS`]: those of an even set that belong to it, or else its
/// origin.
fn receivers(scene: &Scene, patches: &Patches, bvh: &Bvh, id: PatchId) -> Vec<Receiver> {
    let origin = patches.origin(id);
    let receiver = |p: SurfacePoint| Receiver {
        position: p.position(&scene.geometry),
        normal: scene.geometry.normal(p.triangle, p.side),
        own: bvh.solid(p.triangle),
    };
    let points = (0..POINTS).map(|k| patches.sample(id, even(k)));
    if !patches.has_contact(id) {
        return points.map(receiver).collect();
    }
    // No cluster has contacts: all points are on the triangle of the origin.
    let own: Vec<Receiver> = points
        .filter(|&p| patches.at(p) == Some(id))
        .map(|p| receiver(SurfacePoint { uv: p.uv.lerp(origin.uv, LEAN), ..p }))
        .collect();
    if own.is_empty() { vec![receiver(origin)] } else { own }
}

/// Point `k` of a set in the unit square with one point in each strip of 1/16 and in each square of
/// 1/4 (Hammersley's, in base 2).
fn even(k: usize) -> DVec2 {
    let reversed = (k as u8).reverse_bits() >> (8 - POINTS.ilog2());
    (DVec2::new(k as f64, f64::from(reversed)) + 0.5) / POINTS as f64
}

/// The rays from the points of a patch to a lamp, and what each would bring if nothing were in its
/// way: its contribution to the patch's mean irradiance.
fn shine(lamp: &Lamp, axes: &Axes, receivers: &[Receiver], bvh: &Bvh) -> (Packet, [Rgb; POINTS]) {
    let (mut packet, mut arriving) = (Packet::EMPTY, [Rgb::ZERO; POINTS]);
    for (l, r) in receivers.iter().enumerate() {
        let (irradiance, way) = unshadowed(lamp, axes, r.position, r.normal);
        if irradiance == Rgb::ZERO {
            continue;
        }
        arriving[l] = irradiance / receivers.len() as f64;
        let from = bvh.local(r.position);
        match lamp {
            Lamp::Directional { .. } => packet.set(l, from, way.as_vec3(), f32::INFINITY, r.own),
            Lamp::Point { .. } | Lamp::Spot { .. } => {
                let to = bvh.local(bvh.approach(r.position + way, -way));
                packet.set(l, from, to - from, 1.0, r.own);
            }
        }
    }
    (packet, arriving)
}

/// Irradiance that a lamp alone would give, and the way to it (m); to a directional lamp a unit
/// vector.
fn unshadowed(lamp: &Lamp, axes: &Axes, point: DVec3, normal: DVec3) -> (Rgb, DVec3) {
    let (way, intensity) = match lamp {
        Lamp::Directional { direction, irradiance, .. } => (-*direction, *irradiance),
        Lamp::Point { position, intensity, .. } | Lamp::Spot { position, intensity, .. } => {
            (*position - point, *intensity)
        }
    };
    let distance2 = way.length_squared();
    let cos = normal.dot(way) / distance2.sqrt();
    // The cosine to a lamp at the point itself is no number.
    if cos <= 0.0 || cos.is_nan() {
        return (Rgb::ZERO, way);
    }
    let direction = -way / distance2.sqrt();
    let share = match (lamp, lamp.photometry()) {
        (_, Some(photometry)) => photometry.towards(axes, direction),
        (Lamp::Spot { direction: axis, inner, outer, .. }, None) => {
            let edge = outer.cos();
            let t = (direction.dot(*axis) - edge) / (inner.cos() - edge).max(1e-9);
            t.clamp(0.0, 1.0).powi(2)
        }
        (Lamp::Point { .. } | Lamp::Directional { .. }, None) => 1.0,
    };
    let spread = if matches!(lamp, Lamp::Directional { .. }) { 1.0 } else { distance2 };
    (intensity * (share * cos / spread), way)
}

#[cfg(test)]
mod tests;
