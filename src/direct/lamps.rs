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

/// Part of its distance to a lamp that a piece of a patch may be long; larger ones are quartered.
const NEAR: f64 = 0.5;

/// Quarters of quarters of a patch at most.
const DEEPEST: u32 = 6;

/// Irradiance of each patch from lamps (W/m² or lx), with shadows; the mean over 16 points spread
/// evenly over what belongs to the patch, or over as many of each piece of it where a lamp is near.
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
    lamps_on(scene, patches, bvh, &patches.ids().collect::<Vec<_>>())
}

/// The same on some of the patches, each of which gets what it would get among all.
pub(crate) fn lamps_on(scene: &Scene, patches: &Patches, bvh: &Bvh, ids: &[PatchId]) -> Vec<Rgb> {
    let lamps: Vec<(&Lamp, Axes)> = scene.lamps.iter().map(|l| (l, l.axes(scene.up))).collect();
    let mut direct = vec![Rgb::ZERO; ids.len()];
    direct.par_chunks_mut(BLOCK).zip(ids.par_chunks(BLOCK)).for_each(|(direct, ids)| {
        let receivers: Vec<Vec<Receiver>> =
            ids.iter().map(|&i| receivers(scene, patches, bvh, i)).collect();
        let mut packets = vec![Packet::EMPTY; direct.len()];
        let mut arriving = vec![[Rgb::ZERO; POINTS]; direct.len()];
        let mut blocked = vec![0_u16; direct.len()];
        let lengths: Vec<f64> = receivers.iter().map(|r| length(r)).collect();
        for (lamp, axes) in &lamps {
            for (k, receivers) in receivers.iter().enumerate() {
                if is_near(lamp, receivers, lengths[k]) {
                    direct[k] += near_mean((scene, patches, bvh), ids[k], lamp, axes);
                    (packets[k], arriving[k]) = (Packet::EMPTY, [Rgb::ZERO; POINTS]);
                } else {
                    (packets[k], arriving[k]) = shine(lamp, axes, receivers, bvh);
                }
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

/// How far the points of a patch are apart at most, or about so.
fn length(receivers: &[Receiver]) -> f64 {
    let middle = receivers.iter().map(|r| r.position).sum::<DVec3>() / receivers.len() as f64;
    2.0 * receivers.iter().map(|r| r.position.distance(middle)).fold(0.0, f64::max)
}

/// Whether a lamp is so near that 16 points do not stand for all of a patch.
fn is_near(lamp: &Lamp, receivers: &[Receiver], length: f64) -> bool {
    let Some(lamp) = lamp.position() else { return false };
    receivers.iter().any(|r| length > NEAR * (r.position.distance(lamp) - 0.25 * length))
}

/// Mean irradiance of a patch from a lamp that is near: pieces of the unit square of its
/// coordinates are quartered until they are small for their distance.
fn near_mean(
    (scene, patches, bvh): (&Scene, &Patches, &Bvh),
    id: PatchId,
    lamp: &Lamp,
    axes: &Axes,
) -> Rgb {
    let Some(position) = lamp.position() else { return Rgb::ZERO };
    let (mut sum, mut area) = (Rgb::ZERO, 0.0);
    let mut pieces = vec![(DVec2::ZERO, 0)];
    while let Some((corner, depth)) = pieces.pop() {
        let size = 0.5_f64.powi(depth as i32);
        let place = |u: DVec2| patches.sample(id, corner + u * size).position(&scene.geometry);
        let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(place);
        let across = |p: &DVec3| corners.iter().map(|q| q.distance(*p)).fold(0.0, f64::max);
        let length = corners.iter().map(across).fold(0.0, f64::max);
        let middle = place(DVec2::splat(0.5));
        let distance = corners.iter().chain([&middle]).map(|p| p.distance(position));
        let distance = distance.fold(f64::INFINITY, f64::min);
        if depth < DEEPEST && length > NEAR * distance {
            let quarters = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];
            pieces.extend(quarters.map(|q| (corner + q * (0.5 * size), depth + 1)));
            continue;
        }
        let receivers = within(scene, patches, bvh, id, |u| corner + u * size);
        if receivers.is_empty() {
            continue;
        }
        let own = size * size * receivers.len() as f64 / POINTS as f64;
        sum += reaching(lamp, axes, &receivers, bvh) * own;
        area += own;
    }
    // A patch that is smaller than what points tell of is its origin.
    match area > 0.0 {
        true => sum / area,
        false => reaching(lamp, axes, &receivers(scene, patches, bvh, id), bvh),
    }
}

/// Mean irradiance of points from a lamp, with shadows.
fn reaching(lamp: &Lamp, axes: &Axes, receivers: &[Receiver], bvh: &Bvh) -> Rgb {
    let (packet, arriving) = shine(lamp, axes, receivers, bvh);
    let mut blocked = [0];
    bvh.blocked(&[packet], &mut blocked);
    (0..POINTS).filter(|l| blocked[0] >> l & 1 == 0).map(|l| arriving[l]).sum()
}

/// The points of a patch, at most [`POINTS`]: those of an even set that belong to it, or else its
/// origin.
fn receivers(scene: &Scene, patches: &Patches, bvh: &Bvh, id: PatchId) -> Vec<Receiver> {
    let own = within(scene, patches, bvh, id, |u| u);
    if own.is_empty() { vec![receiver(scene, bvh, patches.origin(id))] } else { own }
}

/// Those of an even set of points of a patch that belong to it; `place` says where in the unit
/// square of its coordinates they are.
fn within(
    scene: &Scene,
    patches: &Patches,
    bvh: &Bvh,
    id: PatchId,
    place: impl Fn(DVec2) -> DVec2,
) -> Vec<Receiver> {
    let points = (0..POINTS).map(|k| patches.sample(id, place(even(k))));
    if !patches.has_contact(id) {
        return points.map(|p| receiver(scene, bvh, p)).collect();
    }
    // No cluster has contacts: all points are on the triangle of the origin.
    let origin = patches.origin(id);
    points
        .filter(|&p| patches.at(p) == Some(id))
        .map(|p| SurfacePoint { uv: p.uv.lerp(origin.uv, LEAN), ..p })
        .map(|p| receiver(scene, bvh, p))
        .collect()
}

fn receiver(scene: &Scene, bvh: &Bvh, p: SurfacePoint) -> Receiver {
    Receiver {
        position: p.position(&scene.geometry),
        normal: scene.geometry.normal(p.triangle, p.side),
        own: bvh.solid(p.triangle),
    }
}

/// Point `k` of a set in the unit square with one point in each strip of 1/16 and in each square of
/// 1/4: Hammersley's, its second coordinate scrambled as by Owen so that the centroid of the set in
/// a triangle is the triangle's, within a thousandth of its edges (of Hammersley's, a fortieth).
fn even(k: usize) -> DVec2 {
    const SCRAMBLED: [u8; POINTS] = [5, 11, 3, 14, 7, 9, 0, 13, 4, 10, 2, 15, 6, 8, 1, 12];
    (DVec2::new(k as f64, f64::from(SCRAMBLED[k])) + 0.5) / POINTS as f64
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
