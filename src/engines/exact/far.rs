//! The exchange of one patch with many far ones, 16 at a time.
//!
//! ```text
//! S = A_i A_j / π · h g · Σ_kl h_k g_l r_kl⁻⁴ / Σ_kl h_k g_l
//! ```
//!
//! over the three points of a rule of degree 2 on each triangle (Hammer & Stroud 1956): h_k is the
//! height of a point of one over the plane of the other, g_l the other way round. h and g are their
//! means over the triangles, of what is above the plane alone: known in closed form, so that only
//! r⁻⁴ is left to the rule where a triangle straddles the other's plane.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use std::f32::consts::FRAC_1_PI;

use glam::DVec3;

use super::places::Place;
use super::triangles::{Triangles, pad, stand_in};
use crate::simd::{LANES, multiversion};
use crate::visibility::Lanes;

/// Patches nearer than this many sums of radii are left to more points: beyond, the rule errs by
/// less than some 3e-4 of S. That is for an error of 1e-3; it falls as the fourth power.
const FAR: f64 = 4.0;
const POWER: f64 = 0.25;

/// Heights below this are noise of single precision, in units of the scene's radius.
const NOISE: f32 = 1e-6;

/// The least height of a point of the rule, as a fraction of its corner's height.
const TIP: f32 = 1e-3;

/// Marks pairs that need another method.
pub(super) const CLOSELY: f32 = f32::NEG_INFINITY;

/// Patches in the order of the tree, in units of the scene's radius about its centre.
#[derive(Debug, Default)]
pub(super) struct FarPatches {
    /// Each patch, or the triangle that stands for its pieces.
    triangles: Triangles,
    /// Infinite where nothing can stand for a patch.
    radius: Vec<f32>,
    area: Vec<f32>,
    /// 1 where the triangle stands for several pieces, which reach beyond it, else 0.
    several: Vec<f32>,
    /// The rule is good enough from this many sums of radii on.
    far: f32,
}

impl FarPatches {
    /// No patches yet; factors may err by `error`.
    pub fn new(error: f64) -> Self {
        let far = (FAR * (1e-3 / error).max(1.0).powf(POWER)) as f32;
        Self { far, ..Self::default() }
    }

    /// Adds a patch of this area that consists of triangles with these corners and normals.
    pub fn push(&mut self, triangles: &[([DVec3; 3], DVec3)], area: f64) {
        let stand_in = stand_in(triangles, f64::from(NOISE));
        let (corners, normal) = stand_in.unwrap_or(([DVec3::ZERO; 3], DVec3::ZERO));
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        let reach = triangles.iter().flat_map(|t| &t.0).map(|c| c.distance(centre));
        let radius = reach.fold(0.0, f64::max);
        self.triangles.push(corners, normal);
        self.radius.push(if stand_in.is_some() { radius as f32 } else { f32::INFINITY });
        self.several.push(if triangles.len() > 1 { 1.0 } else { 0.0 });
        self.area.push(area as f32);
    }

    /// Adds padding for kernels that read beyond the last.
    pub fn pad(&mut self) {
        self.triangles.pad();
        [&mut self.radius, &mut self.area, &mut self.several].into_iter().for_each(pad);
    }
}

multiversion! {
    /// S of the patch at `row` with those from `from` on, in units of the scene's radius squared;
    /// -S where one straddles the other's plane, and the rule is less good; [`CLOSELY`] where that
    /// takes another method.
    pub(super) fn exchange_with(patches: &FarPatches, row: Place, from: Place, out: &mut [Lanes])
        = exchange_kernel
}

#[inline(always)]
fn lanes(v: &[f32], at: usize) -> &Lanes {
    const NONE: &Lanes = &[0.0; LANES];
    v.get(at..).and_then(|v| v.first_chunk()).unwrap_or(NONE)
}

#[inline(always)]
fn exchange_kernel(patches: &FarPatches, row: Place, from: Place, out: &mut [Lanes]) {
    let (row, from) = (row.index(), from.index());
    let number = |v: &[f32]| v.get(row).map_or(0.0, |&x| x);
    let Triangles { corners: c, normal, centre } = &patches.triangles;
    let (ax, ay, az) = (number(&c[0]), number(&c[1]), number(&c[2]));
    let (bx, by, bz) = (number(&c[3]), number(&c[4]), number(&c[5]));
    let (cx, cy, cz) = (number(&c[6]), number(&c[7]), number(&c[8]));
    let [nx, ny, nz] = [0, 1, 2].map(|k| number(&normal[k]));
    let [mx, my, mz] = [0, 1, 2].map(|k| number(&centre[k]));
    let radius = number(&patches.radius);
    let own_several = number(&patches.several);
    let area = number(&patches.area) * FRAC_1_PI;
    // The rule's points lie half-way from the centre to the corners.
    let points = [
        [0.5 * (mx + ax), 0.5 * (my + ay), 0.5 * (mz + az)],
        [0.5 * (mx + bx), 0.5 * (my + by), 0.5 * (mz + bz)],
        [0.5 * (mx + cx), 0.5 * (my + cy), 0.5 * (mz + cz)],
    ];
    for (block, out) in out.iter_mut().enumerate() {
        let at = from + block * LANES;
        let [px, py, pz] = [0, 1, 2].map(|k| lanes(&c[k], at));
        let [qx, qy, qz] = [3, 4, 5].map(|k| lanes(&c[k], at));
        let [rx, ry, rz] = [6, 7, 8].map(|k| lanes(&c[k], at));
        let [ux, uy, uz] = [0, 1, 2].map(|k| lanes(&normal[k], at));
        let [ox, oy, oz] = [0, 1, 2].map(|k| lanes(&centre[k], at));
        let (radii, areas) = (lanes(&patches.radius, at), lanes(&patches.area, at));
        let several = lanes(&patches.several, at);
        for l in 0..LANES {
            // Heights of their corners over this plane, and of these over theirs.
            let h0 = nx * (px[l] - mx) + ny * (py[l] - my) + nz * (pz[l] - mz);
            let h1 = nx * (qx[l] - mx) + ny * (qy[l] - my) + nz * (qz[l] - mz);
            let h2 = nx * (rx[l] - mx) + ny * (ry[l] - my) + nz * (rz[l] - mz);
            let g0 = ux[l] * (ax - ox[l]) + uy[l] * (ay - oy[l]) + uz[l] * (az - oz[l]);
            let g1 = ux[l] * (bx - ox[l]) + uy[l] * (by - oy[l]) + uz[l] * (bz - oz[l]);
            let g2 = ux[l] * (cx - ox[l]) + uy[l] * (cy - oy[l]) + uz[l] * (cz - oz[l]);
            let (h_low, h_high) = (min(min(h0, h1), h2), max(max(h0, h1), h2));
            let (g_low, g_high) = (min(min(g0, g1), g2), max(max(g0, g1), g2));
            let (dx, dy, dz) = (ox[l] - mx, oy[l] - my, oz[l] - mz);
            let reach = patches.far * (radius + radii[l]);
            let far = dx * dx + dy * dy + dz * dz > reach * reach;
            let whole = (h_low >= -NOISE) & (g_low >= -NOISE);
            let height = above(h0, h1, h2) * above(g0, g1, g2);
            let (h0, h1, h2) = weights(h0, h1, h2, whole);
            let (g0, g1, g2) = weights(g0, g1, g2, whole);
            let (sx, sy, sz) =
                (0.5 * (ox[l] + px[l]), 0.5 * (oy[l] + py[l]), 0.5 * (oz[l] + pz[l]));
            let (tx, ty, tz) =
                (0.5 * (ox[l] + qx[l]), 0.5 * (oy[l] + qy[l]), 0.5 * (oz[l] + qz[l]));
            let (vx, vy, vz) =
                (0.5 * (ox[l] + rx[l]), 0.5 * (oy[l] + ry[l]), 0.5 * (oz[l] + rz[l]));
            let [p, q, r] = points;
            let s0 = h0 * kernel(p, sx, sy, sz)
                + h1 * kernel(p, tx, ty, tz)
                + h2 * kernel(p, vx, vy, vz);
            let s1 = h0 * kernel(q, sx, sy, sz)
                + h1 * kernel(q, tx, ty, tz)
                + h2 * kernel(q, vx, vy, vz);
            let s2 = h0 * kernel(r, sx, sy, sz)
                + h1 * kernel(r, tx, ty, tz)
                + h2 * kernel(r, vx, vy, vz);
            let all = ((h0 + h1) + h2) * ((g0 + g1) + g2);
            let s = area * areas[l] * height * ((g0 * s0 + g1 * s1) + g2 * s2) / all;
            let odd = (radius == f32::INFINITY) | (radii[l] == f32::INFINITY);
            let s = if whole { s } else { -s };
            // Near the horizon only double precision tells whether a corner is above.
            let clear = far & (h_high > 32.0 * NOISE) & (g_high > 32.0 * NOISE);
            let maybe = (h_high > -NOISE) & (g_high > -NOISE);
            let s = if clear { s } else { CLOSELY };
            let s = if maybe { s } else { 0.0 };
            let odd = odd | (((own_several + several[l]) > 0.0) & !far);
            out[l] = if odd { CLOSELY } else { s };
        }
    }
}

/// The mean of the positive part of a height over a triangle, from the heights of its corners.
#[inline(always)]
fn above(a: f32, b: f32, c: f32) -> f32 {
    let (low, high) = (min(min(a, b), c), max(max(a, b), c));
    let mid = max(min(a, b), min(max(a, b), c));
    let mean = ((a + b) + c) / 3.0;
    let below = low * low * low / (3.0 * (low - high) * (low - mid));
    let tip = high * high * high / (3.0 * (high - low) * (high - mid));
    let cut = if mid > 0.0 { mean - below } else { tip };
    let cut = if low >= 0.0 { mean } else { cut };
    if high > 0.0 { cut } else { 0.0 }
}

/// Heights of the rule's three points, or what stands for them where only a corner is above.
#[inline(always)]
fn weights(a: f32, b: f32, c: f32, whole: bool) -> (f32, f32, f32) {
    let third = ((a + b) + c) / 3.0;
    let (p, q, r) = (0.5 * (a + third), 0.5 * (b + third), 0.5 * (c + third));
    if whole { (p, q, r) } else { (tip(p, a), tip(q, b), tip(r, c)) }
}

#[inline(always)]
fn tip(point: f32, corner: f32) -> f32 {
    max(point, 0.0) + TIP * max(corner, 0.0)
}

/// r⁻⁴ between two points.
#[inline(always)]
fn kernel([px, py, pz]: [f32; 3], x: f32, y: f32, z: f32) -> f32 {
    let (dx, dy, dz) = (x - px, y - py, z - pz);
    let r2 = dx * dx + dy * dy + dz * dz;
    1.0 / (r2 * r2)
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
