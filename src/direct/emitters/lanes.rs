//! Emitters at once, in vectors: how much each may send, and what arrives from those that are far.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use glam::Vec3;

use super::receiver::Receiver;
use super::sources::{Source, Unit, sphere};
use crate::scene::{Rgb, luminance};
use crate::simd::{LANES, multiversion};
use crate::visibility::Bvh;

/// A receiver nearer than this many times its own size to an emitter leaves it to the rays.
pub(super) const NEAREST: f32 = 2.0;

/// A triangle whose distance is below this many times the root of its area counts as near.
pub(super) const NEAR: f32 = 10.0;

/// What a first look at an emitter needs, in coordinates of the hierarchy.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub centre: Vec3,
    pub normal: Vec3,
    /// Of the farthest corner from the centre.
    pub radius: f32,
    pub area: f32,
    pub radiance: Vec3,
    pub luminance: f32,
    /// What decides whether it is analytic: centre, normal (zero if it is not flat), radius and
    /// area of the patch that it belongs to, if that is a cluster, else its own.
    pub unit: (Vec3, Vec3, f32, f32),
}

impl Entry {
    pub fn of(bvh: &Bvh, s: &Source, unit: &Unit) -> Self {
        let ((centre, radius), scale) = (sphere(&s.corners), bvh.scale());
        Self {
            centre: bvh.local(centre),
            normal: s.normal.as_vec3(),
            radius: (radius / scale) as f32,
            area: (s.area / (scale * scale)) as f32,
            radiance: s.radiance.as_vec3(),
            luminance: brightness(s.radiance),
            unit: (
                bvh.local(unit.centre),
                unit.normal.as_vec3(),
                (unit.radius / scale) as f32,
                (unit.area / (scale * scale)) as f32,
            ),
        }
    }
}

/// Luminance, but not nothing where there is a colour.
pub(super) fn brightness(radiance: Rgb) -> f32 {
    luminance(radiance).max(radiance.max_element() * 1e-3) as f32
}

/// [`LANES`] emitters as vectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    centre: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    radiance: [[f32; LANES]; 3],
    pub area: [f32; LANES],
    radius: [f32; LANES],
    luminance: [f32; LANES],
    unit_centre: [[f32; LANES]; 3],
    unit_normal: [[f32; LANES]; 3],
    unit_radius: [f32; LANES],
    unit_area: [f32; LANES],
    /// Not 0 where it is analytic, whatever its unit.
    analytic: [u32; LANES],
}

impl Block {
    /// Nothing, far away.
    pub const EMPTY: Self = Self {
        centre: [[1e6; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        radiance: [[0.0; LANES]; 3],
        area: [0.0; LANES],
        radius: [0.0; LANES],
        luminance: [0.0; LANES],
        unit_centre: [[1e6; LANES]; 3],
        unit_normal: [[0.0; LANES]; 3],
        unit_radius: [0.0; LANES],
        unit_area: [0.0; LANES],
        analytic: [0; LANES],
    };

    pub fn set(&mut self, l: usize, e: &Entry, analytic: bool) {
        let (unit_centre, unit_normal, unit_radius, unit_area) = e.unit;
        for axis in 0..3 {
            self.centre[axis][l] = e.centre[axis];
            self.normal[axis][l] = e.normal[axis];
            self.radiance[axis][l] = e.radiance[axis];
            self.unit_centre[axis][l] = unit_centre[axis];
            self.unit_normal[axis][l] = unit_normal[axis];
        }
        (self.area[l], self.radius[l], self.luminance[l]) = (e.area, e.radius, e.luminance);
        (self.unit_radius[l], self.unit_area[l]) = (unit_radius, unit_area);
        self.analytic[l] = u32::from(analytic);
    }

    /// Whether an emitter is so near to a point that its centre cannot stand for it.
    pub fn is_near(&self, l: usize, at: Vec3) -> bool {
        let [x, y, z] = self.centre.map(|c| c[l]);
        (Vec3::new(x, y, z) - at).length_squared() < NEAR * NEAR * self.area[l]
    }
}

/// Whether an emitter is neither too near nor too large for a receiver.
#[inline(always)]
pub(super) fn suitable(
    r: &Receiver,
    centre: [f32; 3],
    normal: [f32; 3],
    radius: f32,
    area: f32,
) -> bool {
    let d = [centre[0] - r.centre.x, centre[1] - r.centre.y, centre[2] - r.centre.z];
    let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    // The emitter is no nearer than its plane, nor than a ball about it.
    let height = (normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]).abs();
    let clear = r.radius + NEAREST * r.size;
    let beyond = radius + clear;
    ((height > clear) | (d2 > beyond * beyond)) & (area < r.largest * std::f32::consts::PI * d2)
}

multiversion! {
    pub(super) fn weigh(
        blocks: &[Block],
        receiver: &Receiver,
        weights: &mut [[f32; LANES]],
        sums: &mut [f32],
    ) = weigh_kernel
}

/// About what each emitter may send to a receiver at most, zero only for those that send nothing or
/// are not analytic; and the sum of each block.
#[inline(always)]
fn weigh_kernel(blocks: &[Block], r: &Receiver, weights: &mut [[f32; LANES]], sums: &mut [f32]) {
    for ((b, weights), sum) in blocks.iter().zip(weights).zip(sums) {
        for l in 0..LANES {
            let d = difference(&b.centre, l, r.centre);
            let reach = r.radius + b.radius[l];
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + reach * reach;
            let here = r.normal.x * d[0] + r.normal.y * d[1] + r.normal.z * d[2] + reach;
            let here = here + r.bend * d2.sqrt();
            let [nx, ny, nz] = [b.normal[0][l], b.normal[1][l], b.normal[2][l]];
            let there = reach - (nx * d[0] + ny * d[1] + nz * d[2]);
            let most = b.luminance[l] * b.area[l] * (here.max(0.0) * there.max(0.0)) / (d2 * d2);
            let is_suitable = suitable(
                r,
                [b.unit_centre[0][l], b.unit_centre[1][l], b.unit_centre[2][l]],
                [b.unit_normal[0][l], b.unit_normal[1][l], b.unit_normal[2][l]],
                b.unit_radius[l],
                b.unit_area[l],
            );
            weights[l] = if (b.analytic[l] != 0) | is_suitable { most } else { 0.0 };
        }
        *sum = weights.iter().sum();
    }
}

multiversion! {
    pub(super) fn add_far(
        blocks: &[Block],
        weights: &[[f32; LANES]],
        at: Vec3,
        normal: Vec3,
        sum: &mut [f32; 3],
        some_near: &mut bool,
    ) = add_far_kernel
}

/// Irradiance at a point from the emitters of a group that are far from it, by their centres, and
/// whether some are near.
#[inline(always)]
fn add_far_kernel(
    blocks: &[Block],
    weights: &[[f32; LANES]],
    at: Vec3,
    normal: Vec3,
    sum: &mut [f32; 3],
    some_near: &mut bool,
) {
    let (mut sums, mut near) = ([[0.0_f32; LANES]; 3], [0_u32; LANES]);
    for (b, weights) in blocks.iter().zip(weights) {
        for l in 0..LANES {
            let d = difference(&b.centre, l, at);
            let [nx, ny, nz] = [b.normal[0][l], b.normal[1][l], b.normal[2][l]];
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let here = (normal.x * d[0] + normal.y * d[1] + normal.z * d[2]).max(0.0);
            let there = (-(nx * d[0] + ny * d[1] + nz * d[2])).max(0.0);
            let (counts, far) = (weights[l] > 0.0, d2 >= NEAR * NEAR * b.area[l]);
            near[l] |= u32::from(counts & !far);
            let factor = b.area[l] * here * there / (d2 * d2);
            let factor = if counts & far { factor } else { 0.0 };
            sums[0][l] += factor * b.radiance[0][l];
            sums[1][l] += factor * b.radiance[1][l];
            sums[2][l] += factor * b.radiance[2][l];
        }
    }
    for (sum, lanes) in sum.iter_mut().zip(sums) {
        *sum = lanes.iter().sum();
    }
    *some_near = near.iter().any(|n| *n != 0);
}

/// From a point to one of a block's.
#[inline(always)]
fn difference(to: &[[f32; LANES]; 3], l: usize, from: Vec3) -> [f32; 3] {
    [to[0][l] - from.x, to[1][l] - from.y, to[2][l] - from.z]
}
