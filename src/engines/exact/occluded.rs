//! Which fraction of a triangle a convex polygon hides, seen from 16 points at once, in closed
//! form.
//!
//! From a point x, a corner q of the polygon appears on the triangle p₀p₁p₂ at the homogeneous
//! barycentric coordinates β of its direction: q - x = Σ β_k (p_k - x). What is hidden is the part
//! of the projected polygon where all β are positive. Its measure is a sum over the polygon's
//! edges: each adds what of the triangle lies between it and p₀, with the sign of its sense about
//! p₀. Where an edge coincides with one of the triangle, as is common, the sum does not depend on
//! the side that rounding puts it on.
//!
//! The kernel K is taken to be linear over a triangle that is small against its distance. Over
//! others, it is integrated around what is hidden, by Lambert's formula (1760).

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use glam::Vec3;

use super::convex;
use crate::simd::{LANES, multiversion};
use crate::visibility::Lanes;

/// Most corners of a blocker that two planes have clipped.
pub(super) const MOST_CORNERS: usize = convex::MOST_CORNERS + 2;

/// Where points look: a triangle, its unit normal, and the kernel towards its corners.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Target {
    /// Corners about a nearby origin.
    pub corners: [Vec3; 3],
    /// The points.
    pub from: [Lanes; 3],
    /// Whether the kernel is far from linear.
    pub closely: bool,
    /// Unit normal of the plane that the points lie in.
    near: Vec3,
    /// Kernel towards each corner, over the sum of them.
    kernel: [Lanes; 3],
    /// ∫ K dA over the target: the weight of the lane.
    pub weight: Lanes,
    /// Directions to the corners, crossed with the opposite edge, over the determinant.
    dual: [[Lanes; 3]; 3],
}

/// The corners of a polygon, projected on a target; reused.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct Projected([[Lanes; 3]; MOST_CORNERS]);

impl Projected {
    pub const EMPTY: Self = Self([[[0.0; LANES]; 3]; MOST_CORNERS]);
}

/// Fraction of a target that polygons hide, added up over them: those whose front faces the points,
/// and those whose back does.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Occluded {
    pub by_fronts: Lanes,
    pub by_backs: Lanes,
}

impl Occluded {
    pub const NOTHING: Self = Self { by_fronts: [0.0; LANES], by_backs: [0.0; LANES] };
}

impl Target {
    pub const EMPTY: Self = Self {
        corners: [Vec3::ZERO; 3],
        from: [[0.0; LANES]; 3],
        closely: false,
        near: Vec3::ZERO,
        kernel: [[0.0; LANES]; 3],
        weight: [0.0; LANES],
        dual: [[[0.0; LANES]; 3]; 3],
    };
}

multiversion! {
    /// Prepares a target whose `corners`, `from` and `closely` are set, seen from a plane with
    /// normal `near`; `far` is its own normal.
    pub(super) fn aim(target: &mut Target, near: Vec3, far: Vec3) = aim_kernel
}

#[inline(always)]
fn aim_kernel(target: &mut Target, near: Vec3, far: Vec3) {
    let [p0, p1, p2] = target.corners;
    let (e0, e1, e2) = (p2 - p1, p0 - p2, p1 - p0);
    target.near = near;
    let third = e0.cross(e1).length() / 6.0;
    let closely = target.closely;
    let Target { from: [fx, fy, fz], kernel: [k0, k1, k2], weight, dual: [m0, m1, m2], .. } =
        target;
    let ([m0x, m0y, m0z], [m1x, m1y, m1z], [m2x, m2y, m2z]) = (m0, m1, m2);
    for l in 0..LANES {
        let (x, y, z) = (fx[l], fy[l], fz[l]);
        let (ax, ay, az) = (p0.x - x, p0.y - y, p0.z - z);
        let (bx, by, bz) = (p1.x - x, p1.y - y, p1.z - z);
        let (cx, cy, cz) = (p2.x - x, p2.y - y, p2.z - z);
        // p_{k+1} × (p_{k+2} - p_{k+1}) is the cross of both without their common length.
        let (ux, uy, uz) = (by * e0.z - bz * e0.y, bz * e0.x - bx * e0.z, bx * e0.y - by * e0.x);
        let (vx, vy, vz) = (cy * e1.z - cz * e1.y, cz * e1.x - cx * e1.z, cx * e1.y - cy * e1.x);
        let (wx, wy, wz) = (ay * e2.z - az * e2.y, az * e2.x - ax * e2.z, ax * e2.y - ay * e2.x);
        let inverse = 1.0 / (ux * ax + uy * ay + uz * az);
        (m0x[l], m0y[l], m0z[l]) = (ux * inverse, uy * inverse, uz * inverse);
        (m1x[l], m1y[l], m1z[l]) = (vx * inverse, vy * inverse, vz * inverse);
        (m2x[l], m2y[l], m2z[l]) = (wx * inverse, wy * inverse, wz * inverse);
        let height = -(far.x * ax + far.y * ay + far.z * az);
        let (ra, rb, rc) =
            (ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz);
        let (ha, hb, hc) = (
            near.x * ax + near.y * ay + near.z * az,
            near.x * bx + near.y * by + near.z * bz,
            near.x * cx + near.y * cy + near.z * cz,
        );
        let ka = if ha * height > 0.0 { ha * height / (ra * ra) } else { 0.0 };
        let kb = if hb * height > 0.0 { hb * height / (rb * rb) } else { 0.0 };
        let kc = if hc * height > 0.0 { hc * height / (rc * rc) } else { 0.0 };
        let sum = ka + kb + kc;
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        weight[l] = sum * third;
        (k0[l], k1[l], k2[l]) = (ka * scale, kb * scale, kc * scale);
    }
    if closely {
        for l in 0..LANES {
            let x = Vec3::new(fx[l], fy[l], fz[l]);
            let [a, b, c] = [p0 - x, p1 - x, p2 - x];
            let around = edge(a, b, near) + edge(b, c, near) + edge(c, a, near);
            weight[l] = if around < 0.0 { -0.5 * around } else { 0.0 };
        }
    }
}

/// What an edge adds to Lambert's sum: its angle as seen from the origin, times the height of the
/// unit normal of the triangle that it makes with it.
#[inline(always)]
fn edge(u: Vec3, v: Vec3, normal: Vec3) -> f32 {
    let cross = u.cross(v);
    let sine = cross.length();
    let height = cross.dot(normal);
    if sine > 0.0 { angle(sine, u.dot(v)) * height / sine } else { 0.0 }
}

/// The angle 0..π with a sine (not negative) and cosine, up to a common factor, to 2e-7.
///
/// The polynomial is that of Moshier's Cephes library (1989).
#[inline(always)]
fn angle(sine: f32, cosine: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let c = cosine.abs();
    let (low, high) = if sine < c { (sine, c) } else { (c, sine) };
    let beyond = low > 0.414_213_56 * high;
    let t = if beyond { (low - high) / (low + high) } else { low / high };
    let z = t * t;
    let p = ((0.080_537_446 * z - 0.138_776_86) * z + 0.199_777_11) * z - 0.333_329_5;
    let t = p * z * t + t + if beyond { FRAC_PI_4 } else { 0.0 };
    let t = if sine < c { t } else { FRAC_PI_2 - t };
    if cosine < 0.0 { PI - t } else { t }
}

multiversion! {
    /// Adds the fraction of a target that a polygon hides. Its corners, about the target's origin,
    /// run counter-clockwise about `normal`.
    pub(super) fn occlude(
        target: &Target,
        polygon: &[Vec3],
        normal: Vec3,
        projected: &mut Projected,
        occluded: &mut Occluded,
    ) = occlude_kernel
}

#[inline(always)]
fn occlude_kernel(
    target: &Target,
    polygon: &[Vec3],
    normal: Vec3,
    Projected(projected): &mut Projected,
    occluded: &mut Occluded,
) {
    let count = polygon.len().min(MOST_CORNERS);
    let Some(&origin) = polygon.first() else { return };
    let [fx, fy, fz] = &target.from;
    let [[ux, uy, uz], [vx, vy, vz], [wx, wy, wz]] = &target.dual;
    for (q, [d0, d1, d2]) in polygon.iter().zip(&mut *projected) {
        for l in 0..LANES {
            let (x, y, z) = (q.x - fx[l], q.y - fy[l], q.z - fz[l]);
            d0[l] = ux[l] * x + uy[l] * y + uz[l] * z;
            d1[l] = vx[l] * x + vy[l] * y + vz[l] * z;
            d2[l] = wx[l] * x + wy[l] * y + wz[l] * z;
        }
    }
    // 1 where the polygon is projected counter-clockwise, -1 where clockwise.
    let mut turn = [0.0_f32; LANES];
    for l in 0..LANES {
        let height = normal.x * (fx[l] - origin.x)
            + normal.y * (fy[l] - origin.y)
            + normal.z * (fz[l] - origin.z);
        turn[l] = if height > 0.0 { 1.0 } else { -1.0 };
    }
    let mut sum = [0.0_f32; LANES];
    for k in 0..count {
        let corners = [&projected[k], &projected[if k + 1 < count { k + 1 } else { 0 }]];
        match target.closely {
            true => add_closely(target, corners, &mut sum),
            false => add(target, corners, &mut sum),
        }
    }
    for l in 0..LANES {
        let all = turn[l] * sum[l];
        // What is not a number counts as nothing.
        let all = if all > 0.0 { all } else { 0.0 };
        let all = if all < 1.0 { all } else { 1.0 };
        occluded.by_fronts[l] += if turn[l] > 0.0 { all } else { 0.0 };
        occluded.by_backs[l] += if turn[l] > 0.0 { 0.0 } else { all };
    }
}

/// Adds what of the target lies between p₀ and an edge of a polygon, given in homogeneous
/// barycentric coordinates, twice over and with the kernel thrice.
#[inline(always)]
fn add(target: &Target, [a, b]: [&[Lanes; 3]; 2], sum: &mut Lanes) {
    let ([a0, a1, a2], [b0, b1, b2], [k0, k1, k2]) = (a, b, &target.kernel);
    for l in 0..LANES {
        let (a, b) = ([a0[l], a1[l], a2[l]], [b0[l], b1[l], b2[l]]);
        // The part of the edge within the wedge at p₀.
        let (from, to) = clip(a[1], b[1], 0.0, 1.0);
        let (from, to) = clip(a[2], b[2], from, to);
        // Where it passes out of the triangle.
        let (a_in, b_in) = (a[0] >= 0.0, b[0] >= 0.0);
        let zero = a[0] / (a[0] - b[0]);
        let zero = if zero > from { zero } else { from };
        let zero = if zero < to { zero } else { to };
        let (k1l, k2l) = (k1[l] - k0[l], k2[l] - k0[l]);
        let (s, t) = (if a_in { from } else { zero }, if b_in { to } else { zero });
        let (p, q) = (between(&a, &b, s), between(&a, &b, t));
        let (sp, sq) = (1.0 / (p[0] + p[1] + p[2]), 1.0 / (q[0] + q[1] + q[2]));
        let (pu, pv, qu, qv) = (p[1] * sp, p[2] * sp, q[1] * sq, q[2] * sq);
        let kernel = 3.0 * k0[l] + k1l * (pu + qu) + k2l * (pv + qv);
        let part = (pu * qv - pv * qu) * kernel;
        let within = if (a_in | b_in) & (s < t) { part } else { 0.0 };
        let (s, t) = (if a_in { zero } else { from }, if b_in { zero } else { to });
        let (p, q) = (between(&a, &b, s), between(&a, &b, t));
        let (pv, qv) = (p[2] / (p[1] + p[2]), q[2] / (q[1] + q[2]));
        let kernel = 3.0 * k0[l] + k1l * (2.0 - pv - qv) + k2l * (pv + qv);
        let part = (qv - pv) * kernel;
        let beyond = if !(a_in & b_in) & (s < t) { part } else { 0.0 };
        sum[l] += if from < to { within + beyond } else { 0.0 };
    }
}

/// The same where the kernel is far from linear: the sum around what lies between, over that around
/// the target.
#[inline(always)]
fn add_closely(target: &Target, [a, b]: [&[Lanes; 3]; 2], sum: &mut Lanes) {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    let [p0, p1, p2] = target.corners;
    let [fx, fy, fz] = &target.from;
    for l in 0..LANES {
        let (a, b) = ([a0[l], a1[l], a2[l]], [b0[l], b1[l], b2[l]]);
        let (from, to) = clip(a[1], b[1], 0.0, 1.0);
        let (from, to) = clip(a[2], b[2], from, to);
        let zero = a[0] / (a[0] - b[0]);
        let zero = if zero > from { zero } else { from };
        let zero = if zero < to { zero } else { to };
        let x = Vec3::new(fx[l], fy[l], fz[l]);
        let [r0, r1, r2] = [p0 - x, p1 - x, p2 - x];
        // What lies beyond the target runs along its edge instead.
        let at = |t: f32| {
            let p = between(&a, &b, t);
            r0 * if p[0] > 0.0 { p[0] } else { 0.0 } + r1 * p[1] + r2 * p[2]
        };
        let (p, z, q) = (at(from), at(zero), at(to));
        let n = target.near;
        let around = edge(r0, p, n) + edge(p, z, n) + edge(z, q, n) + edge(q, r0, n);
        sum[l] += if from < to { -0.5 * around / target.weight[l] } else { 0.0 };
    }
}

/// A point of an edge from `a` to `b`.
#[inline(always)]
fn between(a: &[f32; 3], b: &[f32; 3], t: f32) -> [f32; 3] {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t]
}

/// The part of an interval where a linear function that is `a` at 0 and `b` at 1 is not negative.
#[inline(always)]
fn clip(a: f32, b: f32, from: f32, to: f32) -> (f32, f32) {
    let zero = a / (a - b);
    let enters = if a < 0.0 { zero } else { 0.0 };
    let leaves = if b < 0.0 { zero } else { 1.0 };
    let enters = if (a < 0.0) & (b < 0.0) { 2.0 } else { enters };
    (if enters > from { enters } else { from }, if leaves < to { leaves } else { to })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn target(corners: [Vec3; 3], from: Vec3) -> Target {
        let mut target = Target { corners, ..Target::EMPTY };
        for l in 0..LANES {
            let shift = 0.01 * l as f32;
            target.from[0][l] = from.x + shift;
            target.from[1][l] = from.y - 0.5 * shift;
            target.from[2][l] = from.z;
        }
        target
    }

    fn far(t: &Target) -> Vec3 {
        let [a, b, c] = t.corners;
        (b - a).cross(c - a).normalize()
    }

    /// By counting points of the triangle, weighted by the kernel or by its linear course.
    fn counted(t: &Target, l: usize, polygon: &[Vec3], normal: Vec3) -> f32 {
        let x = vec3(t.from[0][l], t.from[1][l], t.from[2][l]);
        let (mut hit, mut all, n) = (0.0, 0.0, 300);
        for i in 0..n {
            for j in 0..n - i {
                let (u, v) = ((i as f32 + 0.33) / n as f32, (j as f32 + 0.33) / n as f32);
                let w = 1.0 - u - v;
                let p = t.corners[0] * w + t.corners[1] * u + t.corners[2] * v;
                let r = p - x;
                let kernel = match t.closely {
                    true => t.near.dot(r) * -far(t).dot(r) / r.length_squared().powi(2),
                    false => t.kernel[0][l] * w + t.kernel[1][l] * u + t.kernel[2][l] * v,
                };
                all += kernel;
                let (h0, h1) = (normal.dot(x - polygon[0]), normal.dot(p - polygon[0]));
                if h0 * h1 >= 0.0 {
                    continue;
                }
                let at = x + (p - x) * (h0 / (h0 - h1));
                let inside = (0..polygon.len()).all(|k| {
                    let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                    normal.cross(b - a).dot(at - a) >= 0.0
                });
                hit += if inside { kernel } else { 0.0 };
            }
        }
        hit / all
    }

    #[test]
    fn occludes_what_rays_find_occluded() {
        let corners = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.1, 0.0), vec3(0.2, 0.9, 0.0)];
        let from = vec3(0.3, 0.4, 3.0);
        for (closely, from) in [(false, from), (true, from), (true, vec3(0.3, 0.4, 0.6))] {
            let mut t = target(corners, from);
            t.closely = closely;
            let toward = far(&t);
            aim(&mut t, vec3(0.3, 0.0, -1.0).normalize(), toward);
            let shapes = [
                vec![
                    vec3(0.0, 0.0, 1.0),
                    vec3(0.5, 0.0, 1.0),
                    vec3(0.5, 0.5, 1.2),
                    vec3(0.0, 0.5, 1.2),
                ],
                vec![
                    vec3(-9.0, -9.0, 1.0),
                    vec3(0.4, -9.0, 1.0),
                    vec3(0.4, 9.0, 1.0),
                    vec3(-9.0, 9.0, 1.0),
                ],
                vec![vec3(0.2, 0.2, 0.5), vec3(0.4, 0.2, 0.5), vec3(0.3, 0.4, 0.7)],
                vec![vec3(-9.0, -9.0, 2.0), vec3(9.0, -9.0, 2.0), vec3(0.0, 19.0, 2.0)],
                vec![vec3(3.0, 3.0, 1.0), vec3(4.0, 3.0, 1.0), vec3(3.0, 4.0, 1.0)],
                // Reaches above the points.
                vec![
                    vec3(0.25, -1.0, 0.2),
                    vec3(0.25, 0.3, 0.2),
                    vec3(0.1, 0.3, 9.0),
                    vec3(0.1, -1.0, 9.0),
                ],
                // Stands on the triangle.
                vec![
                    vec3(0.2, 0.2, 0.0),
                    vec3(0.5, 0.3, 0.0),
                    vec3(0.5, 0.3, 1.0),
                    vec3(0.2, 0.2, 1.0),
                ],
            ];
            let mut projected = Projected::EMPTY;
            for (n, mut shape) in shapes.into_iter().enumerate() {
                for _ in 0..2 {
                    let normal = (shape[1] - shape[0]).cross(shape[2] - shape[0]).normalize();
                    let mut occluded = Occluded::NOTHING;
                    occlude(&t, &shape, normal, &mut projected, &mut occluded);
                    for l in [0, 7, 15] {
                        let expected = counted(&t, l, &shape, normal);
                        let (front, back) = (occluded.by_fronts[l], occluded.by_backs[l]);
                        assert!((front + back - expected).abs() < 0.01, "{n}: {front} {back}");
                        let x = vec3(t.from[0][l], t.from[1][l], t.from[2][l]);
                        let behind = normal.dot(x - shape[0]) <= 0.0;
                        assert!(if behind { front == 0.0 } else { back == 0.0 });
                    }
                    shape.reverse();
                }
            }
        }
    }
}
