//! All emitting sides at once, in vectors: how much each may send, and what arrives from those that
//! are far.

use std::ops::Range;

use glam::Vec3;

use super::Receiver;
use super::sources::{Source, Unit, sphere};
use crate::scene::luminance;
use crate::visibility::{Bvh, LANES, multiversion};

/// A receiver nearer than this many times its own size to an emitter leaves it to the rays.
const NEAREST: f32 = 4.0;

/// A triangle whose distance is below this many times the root of its area counts as near.
const NEAR: f32 = 10.0;

/// What a first look at all sources needs, in coordinates of the hierarchy.
#[derive(Debug, Clone, Default)]
pub(super) struct Lanes {
    pub centre: [Vec<f32>; 3],
    pub normal: [Vec<f32>; 3],
    pub radiance: [Vec<f32>; 3],
    pub area: Vec<f32>,
    /// Of the farthest corner from the centre.
    pub radius: Vec<f32>,
    pub luminance: Vec<f32>,
    /// What sets a source apart: of the patch that it belongs to, if that is a cluster, else its own.
    pub units: Units,
}

/// Centre, normal (zero if it is not flat), radius and area of emitters that are set apart as one.
#[derive(Debug, Clone, Default)]
pub(super) struct Units {
    pub centre: [Vec<f32>; 3],
    pub normal: [Vec<f32>; 3],
    pub radius: Vec<f32>,
    pub area: Vec<f32>,
}

impl Lanes {
    pub fn push(&mut self, bvh: &Bvh, s: &Source, unit: &Unit) {
        let (centre, radius) = sphere(&s.corners);
        let (centre, at, scale) = (bvh.local(centre), bvh.local(unit.centre), bvh.scale());
        for axis in 0..3 {
            self.centre[axis].push(centre[axis]);
            self.normal[axis].push(s.normal[axis] as f32);
            self.units.centre[axis].push(at[axis]);
            self.units.normal[axis].push(unit.normal[axis] as f32);
            self.radiance[axis].push(s.radiance[axis] as f32);
        }
        self.area.push((s.area / (scale * scale)) as f32);
        self.radius.push((radius / scale) as f32);
        self.units.radius.push((unit.radius / scale) as f32);
        self.units.area.push((unit.area / (scale * scale)) as f32);
        self.luminance.push(luminance(s.radiance).max(s.radiance.max_element() * 1e-3) as f32);
    }

    /// Whether a source is so near to a point that its centre cannot stand for it.
    pub fn is_near(&self, k: usize, at: Vec3) -> bool {
        let d = Vec3::new(self.centre[0][k], self.centre[1][k], self.centre[2][k]) - at;
        d.length_squared() < NEAR * NEAR * self.area[k]
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
    pub(super) fn weigh(lanes: &Lanes, receiver: &Receiver, all: bool, weights: &mut [f32]) = weigh_kernel
}

/// About what each source may send to a receiver at most: zero only for those that send nothing or
/// are not set apart.
#[inline(always)]
fn weigh_kernel(lanes: &Lanes, r: &Receiver, all: bool, weights: &mut [f32]) {
    let n = weights.len();
    let [x, y, z] = lanes.centre.each_ref().map(|v| &v[..n]);
    let [nx, ny, nz] = lanes.normal.each_ref().map(|v| &v[..n]);
    let (area, radius, bright) = (&lanes.area[..n], &lanes.radius[..n], &lanes.luminance[..n]);
    let units = &lanes.units;
    let [ux, uy, uz] = units.centre.each_ref().map(|v| &v[..n]);
    let [mx, my, mz] = units.normal.each_ref().map(|v| &v[..n]);
    let (unit_radius, unit_area) = (&units.radius[..n], &units.area[..n]);
    for k in 0..n {
        let (dx, dy, dz) = (x[k] - r.centre.x, y[k] - r.centre.y, z[k] - r.centre.z);
        let reach = r.radius + radius[k];
        let d2 = dx * dx + dy * dy + dz * dz + reach * reach;
        let here = r.normal.x * dx + r.normal.y * dy + r.normal.z * dz + reach + r.bend * d2.sqrt();
        let there = reach - (nx[k] * dx + ny[k] * dy + nz[k] * dz);
        let most = bright[k] * area[k] * (here.max(0.0) * there.max(0.0)) / (d2 * d2);
        let (centre, normal) = ([ux[k], uy[k], uz[k]], [mx[k], my[k], mz[k]]);
        let apart = all | suitable(r, centre, normal, unit_radius[k], unit_area[k]);
        weights[k] = if apart { most } else { 0.0 };
    }
}

multiversion! {
    pub(super) fn add_blocks(weights: &[f32], blocks: &mut Vec<f32>) = add_blocks_kernel
}

/// Sums of each 16 weights.
#[inline(always)]
fn add_blocks_kernel(weights: &[f32], blocks: &mut Vec<f32>) {
    blocks.clear();
    let (whole, rest) = weights.as_chunks::<LANES>();
    blocks.extend(whole.iter().map(|block| {
        let mut four = [0.0; 4];
        for (k, w) in block.iter().enumerate() {
            four[k % 4] += w;
        }
        (four[0] + four[1]) + (four[2] + four[3])
    }));
    if !rest.is_empty() {
        blocks.push(rest.iter().sum());
    }
}

multiversion! {
    pub(super) fn add_far(
        lanes: &Lanes,
        group: Range<usize>,
        weights: &[f32],
        at: Vec3,
        normal: Vec3,
        sum: &mut [f32; 3],
        some_near: &mut bool,
    ) = add_far_kernel
}

/// Irradiance at a point from the sources of a group that are far from it, by their centres, and
/// whether some are near.
#[inline(always)]
fn add_far_kernel(
    lanes: &Lanes,
    group: Range<usize>,
    weights: &[f32],
    at: Vec3,
    normal: Vec3,
    sum: &mut [f32; 3],
    some_near: &mut bool,
) {
    let n = group.len();
    let [x, y, z] = lanes.centre.each_ref().map(|v| &v[group.clone()][..n]);
    let [nx, ny, nz] = lanes.normal.each_ref().map(|v| &v[group.clone()][..n]);
    let [red, green, blue] = lanes.radiance.each_ref().map(|v| &v[group.clone()][..n]);
    let (area, weights) = (&lanes.area[group.clone()][..n], &weights[group][..n]);
    let (mut sums, mut near) = ([[0.0_f32; LANES]; 3], [0_u32; LANES]);
    let whole = n / LANES * LANES;
    for block in (0..whole).step_by(LANES) {
        for l in 0..LANES {
            let k = block + l;
            let d = [x[k] - at.x, y[k] - at.y, z[k] - at.z];
            let (factor, is_near) =
                far_factor(d, [nx[k], ny[k], nz[k]], normal, area[k], weights[k]);
            near[l] |= is_near;
            sums[0][l] += factor * red[k];
            sums[1][l] += factor * green[k];
            sums[2][l] += factor * blue[k];
        }
    }
    for k in whole..n {
        let d = [x[k] - at.x, y[k] - at.y, z[k] - at.z];
        let (factor, is_near) = far_factor(d, [nx[k], ny[k], nz[k]], normal, area[k], weights[k]);
        near[0] |= is_near;
        sums[0][0] += factor * red[k];
        sums[1][0] += factor * green[k];
        sums[2][0] += factor * blue[k];
    }
    for (sum, lanes) in sum.iter_mut().zip(sums) {
        *sum = lanes.iter().sum();
    }
    *some_near = near.iter().any(|n| *n != 0);
}

/// π times the form factor from a point to a source by its centre, 0 if it is not set apart or near;
/// and 1 if it is near.
#[inline(always)]
fn far_factor(d: [f32; 3], source: [f32; 3], normal: Vec3, area: f32, weight: f32) -> (f32, u32) {
    let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    let here = (normal.x * d[0] + normal.y * d[1] + normal.z * d[2]).max(0.0);
    let there = (-(source[0] * d[0] + source[1] * d[1] + source[2] * d[2])).max(0.0);
    let (counts, far) = (weight > 0.0, d2 >= NEAR * NEAR * area);
    let factor = area * here * there / (d2 * d2);
    (if counts & far { factor } else { 0.0 }, u32::from(counts & !far))
}
