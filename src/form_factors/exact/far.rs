//! The exchange of one patch with many far ones, 16 at a time.
//!
//! ```text
//! S = A_i A_j / (9 π) Σ_kl cos θ_k cos θ_l / r_kl²
//! ```
//!
//! over the three points of a rule of degree 2 on each triangle (Hammer & Stroud 1956).

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use std::f32::consts::FRAC_1_PI;

use glam::DVec3;

use super::model::Model;
use crate::visibility::{LANES, Lanes, multiversion};

/// Patches nearer than this many sums of radii are left to more points: beyond, the rule errs by
/// less than some 3e-4 of S.
const FAR: f32 = 4.0;

/// Heights below this are noise of single precision, in units of the scene's radius.
const NOISE: f32 = 1e-6;

/// Marks what is to be looked at on its own.
pub(super) const CLOSELY: f32 = -1.0;

/// Patches in the order of the tree, in units of the scene's radius about its centre.
#[derive(Debug, Default)]
pub(super) struct Columns {
    /// Coordinate `3 k + axis` of the corners.
    corners: [Vec<f32>; 9],
    normal: [Vec<f32>; 3],
    centre: [Vec<f32>; 3],
    /// Infinite where a patch is no triangle.
    radius: Vec<f32>,
    area: Vec<f32>,
}

impl Columns {
    pub fn new(model: &Model<'_>) -> Self {
        let mut me = Self::default();
        let scale = model.bvh.scale();
        for at in 0..model.len() {
            let first = model.pieces(at).first().map(|p| p.polygon);
            let corners = first.map_or([DVec3::ZERO; 3], |p| [0, 1, 2].map(|k| p.corners()[k]));
            let local = corners.map(|c| (c - model.bvh.center()) / scale);
            let centre = local.iter().sum::<DVec3>() / 3.0;
            let radius = local.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
            let normal = first.map_or(DVec3::ZERO, |p| p.normal);
            for axis in 0..3 {
                for k in 0..3 {
                    me.corners[3 * k + axis].push(local[k][axis] as f32);
                }
                me.normal[axis].push(normal[axis] as f32);
                me.centre[axis].push(centre[axis] as f32);
            }
            let simple = model.simple(at).is_some();
            me.radius.push(if simple { radius as f32 } else { f32::INFINITY });
            me.area.push((model.areas[at] / (scale * scale)) as f32);
        }
        let pad = |v: &mut Vec<f32>| v.resize(model.len().next_multiple_of(LANES) + LANES, 0.0);
        me.corners.iter_mut().chain(&mut me.normal).chain(&mut me.centre).for_each(pad);
        pad(&mut me.radius);
        pad(&mut me.area);
        me
    }
}

multiversion! {
    /// S of patch `row` with those from place `from` on, in units of the scene's radius squared;
    /// [`CLOSELY`] where that takes another method.
    pub(super) fn exchange_with(columns: &Columns, row: usize, from: usize, out: &mut [Lanes])
        = exchange_kernel
}

#[inline(always)]
fn lanes(v: &[f32], at: usize) -> &Lanes {
    const NONE: &Lanes = &[0.0; LANES];
    v.get(at..).and_then(|v| v.first_chunk()).unwrap_or(NONE)
}

#[inline(always)]
fn exchange_kernel(columns: &Columns, row: usize, from: usize, out: &mut [Lanes]) {
    let number = |v: &[f32]| v.get(row).map_or(0.0, |&x| x);
    let c = &columns.corners;
    let (ax, ay, az) = (number(&c[0]), number(&c[1]), number(&c[2]));
    let (bx, by, bz) = (number(&c[3]), number(&c[4]), number(&c[5]));
    let (cx, cy, cz) = (number(&c[6]), number(&c[7]), number(&c[8]));
    let [nx, ny, nz] = [0, 1, 2].map(|k| number(&columns.normal[k]));
    let [mx, my, mz] = [0, 1, 2].map(|k| number(&columns.centre[k]));
    let radius = number(&columns.radius);
    let area = number(&columns.area) * FRAC_1_PI / 9.0;
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
        let [ux, uy, uz] = [0, 1, 2].map(|k| lanes(&columns.normal[k], at));
        let [ox, oy, oz] = [0, 1, 2].map(|k| lanes(&columns.centre[k], at));
        let (radii, areas) = (lanes(&columns.radius, at), lanes(&columns.area, at));
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
            let reach = FAR * (radius + radii[l]);
            let far = dx * dx + dy * dy + dz * dz > reach * reach;
            let (h_mean, g_mean) = ((h0 + h1) + h2, (g0 + g1) + g2);
            let (h0, h1, h2) = (h0 + h_mean / 3.0, h1 + h_mean / 3.0, h2 + h_mean / 3.0);
            let (g0, g1, g2) = (g0 + g_mean / 3.0, g1 + g_mean / 3.0, g2 + g_mean / 3.0);
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
            // Twice each height has been added up.
            let s = 0.25 * area * areas[l] * ((g0 * s0 + g1 * s1) + g2 * s2);
            let odd = (radius == f32::INFINITY) | (radii[l] == f32::INFINITY);
            let whole = (h_low >= -NOISE) & (g_low >= -NOISE);
            // Near the horizon double precision tells whether there is anything.
            let clear = far & whole & (h_high > 32.0 * NOISE) & (g_high > 32.0 * NOISE);
            let maybe = (h_high > -NOISE) & (g_high > -NOISE);
            let s = if clear { s } else { CLOSELY };
            let s = if maybe { s } else { 0.0 };
            out[l] = if odd { CLOSELY } else { s };
        }
    }
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
