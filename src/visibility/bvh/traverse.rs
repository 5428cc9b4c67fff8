//! Packets through the hierarchy: one box or one triangle against 16 rays.

use std::array;

use super::{Bvh, DEEPEST, Hits, INNER, LANES, Lanes, NOTHING, Node, Packet, ROUNDING, SLAB, Triangle};
use crate::visibility::simd::multiversion;

/// Rays are drawn along the same axis if no other coordinate of their directions is larger than its
/// own by more than this factor: the shear then costs two bits of precision at most.
const STEEPEST: f32 = 4.0;

/// Smallest slope: less moves a ray by less than rounding on its way through the scene, and is
/// never divided by.
const LEAST_SLOPE: f32 = 1e-9;

multiversion! {
    pub(super) fn closest(bvh: &Bvh, packets: &[Packet], hits: &mut [Hits]) = closest_kernel
}

multiversion! {
    pub(super) fn blocked(bvh: &Bvh, packets: &[Packet], blocked: &mut [u16]) = blocked_kernel
}

#[inline(always)]
fn closest_kernel(bvh: &Bvh, packets: &[Packet], hits: &mut [Hits]) {
    for (packet, hits) in packets.iter().zip(hits) {
        *hits = Hits::NONE;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, false>(bvh);
            } else {
                rays.trace::<false, false>(bvh);
            }
            rays.write(hits);
        }
    }
}

#[inline(always)]
fn blocked_kernel(bvh: &Bvh, packets: &[Packet], blocked: &mut [u16]) {
    for (packet, blocked) in packets.iter().zip(blocked) {
        *blocked = 0;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, true>(bvh);
            } else {
                rays.trace::<false, true>(bvh);
            }
            for l in 0..LANES {
                *blocked |= u16::from(rays.item[l] != NOTHING) << l;
            }
        }
    }
}

impl Packet {
    /// The lanes that hold a ray.
    #[inline(always)]
    fn lanes(&self) -> [bool; LANES] {
        array::from_fn(|l| self.far[l] > 0.0)
    }
}

/// Rays of a packet that run along the same axis in the same sense.
///
/// Distances are along that axis.
struct Rays {
    /// The axes of space that are x, y and z of the drawing; z is along the rays, and fronts are
    /// counter-clockwise in the drawing.
    axes: [usize; 3],
    /// The sense of z along the rays, 1 or -1.
    sense: f32,
    /// Slopes of x and y along z.
    slope: [Lanes; 2],
    /// Where rays meet the plane z = 0.
    foot: [Lanes; 2],
    /// z of the origin along the rays.
    start: Lanes,
    /// Inverse of the direction, and the origin times it, in axes of space.
    inverse: [Lanes; 3],
    offset: [Lanes; 3],
    /// Index in [`Node::bounds`] of the plane through which rays enter and leave a box.
    enter: [usize; 3],
    leave: [usize; 3],
    /// Whether rays differ in sense along some axis.
    mixed: bool,
    /// Length of the direction along z.
    length: Lanes,
    own: [u32; LANES],
    /// Distance of the nearest hit, less its slab; -∞ where there is no ray.
    best: Lanes,
    item: [u32; LANES],
    u: Lanes,
    v: Lanes,
    distance: Lanes,
}

impl Rays {
    /// Takes rays that can be drawn alike from those `left` of a packet; `None` if none is left.
    #[inline(always)]
    fn alike(packet: &Packet, left: &mut [bool; LANES]) -> Option<Self> {
        let first = left.iter().position(|&l| l)?;
        let d = packet.direction.map(|d| d[first]);
        let mut z = 0;
        for axis in 1..3 {
            if d[axis].abs() > d[z].abs() {
                z = axis;
            }
        }
        let sense = 1.0_f32.copysign(d[z]);
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if sense > 0.0 {
            (x, y) = (y, x);
        }
        let [dx, dy, dz] = [x, y, z].map(|a| &packet.direction[a]);
        let taken: [bool; LANES] = array::from_fn(|l| {
            let along = sense * dz[l];
            let steep = dx[l].abs().max(dy[l].abs()) <= STEEPEST * along;
            left[l] & (along > 0.0) & (along < f32::INFINITY) & steep
        });
        for l in 0..LANES {
            left[l] &= !taken[l];
        }
        left[first] = false;
        // Lanes without a ray follow the first one.
        let of = |lanes: &Lanes| -> Lanes {
            let other = lanes[first];
            array::from_fn(|l| if taken[l] { lanes[l] } else { other })
        };
        let origin = packet.origin.each_ref().map(of);
        let direction = packet.direction.each_ref().map(of);
        let length: Lanes = array::from_fn(|l| direction[z][l].abs());
        let inverse_length: Lanes = array::from_fn(|l| 1.0 / length[l]);
        let mut mixed = false;
        let mut inverse = [[0.0; LANES]; 3];
        let mut offset = [[0.0; LANES]; 3];
        let (mut enter, mut leave) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            let negative = direction[axis][first].is_sign_negative();
            enter[axis] = axis + if negative { 3 } else { 0 };
            leave[axis] = axis + if negative { 0 } else { 3 };
            for l in 0..LANES {
                let d = direction[axis][l] * inverse_length[l];
                mixed |= d.is_sign_negative() != negative;
                inverse[axis][l] = 1.0 / d.abs().max(LEAST_SLOPE).copysign(d);
                offset[axis][l] = origin[axis][l] * inverse[axis][l];
            }
        }
        let slope = [x, y].map(|a| {
            array::from_fn(|l| direction[a][l] * inverse_length[l] * sense)
        });
        let foot = array::from_fn(|i| {
            let a = [x, y][i];
            array::from_fn(|l| origin[a][l] - slope[i][l] * origin[z][l])
        });
        Some(Self {
            axes: [x, y, z],
            sense,
            slope,
            foot,
            start: array::from_fn(|l| sense * origin[z][l]),
            inverse,
            offset,
            enter,
            leave,
            mixed,
            length,
            own: packet.own,
            best: array::from_fn(|l| {
                if taken[l] { packet.far[l] * length[l] } else { f32::NEG_INFINITY }
            }),
            item: [NOTHING; LANES],
            u: [0.0; LANES],
            v: [0.0; LANES],
            distance: [f32::INFINITY; LANES],
        })
    }

    /// Visits the boxes that rays enter before their best hit.
    #[inline(always)]
    fn trace<const MIXED: bool, const ANY: bool>(&mut self, bvh: &Bvh) {
        let mut stack = [0_u32; DEEPEST.next_power_of_two()];
        let mut top = 0;
        let mut at = 0;
        let far_first = array::from_fn::<_, 3, _>(|axis| u32::from(self.enter[axis] > 2));
        loop {
            let node = &bvh.nodes[at as usize];
            if self.enters::<MIXED>(node) {
                if node.kind >= INNER {
                    let far_first = far_first[(node.kind & 3) as usize];
                    stack[top % DEEPEST.next_power_of_two()] = node.first + 1 - far_first;
                    top += 1;
                    at = node.first + far_first;
                    continue;
                }
                let first = node.first as usize;
                for triangle in &bvh.triangles[first..first + node.kind as usize] {
                    self.test::<ANY>(bvh, triangle);
                }
                if ANY && self.best.iter().all(|&b| b == f32::NEG_INFINITY) {
                    return;
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            at = stack[top % DEEPEST.next_power_of_two()];
        }
    }

    /// Whether any ray enters the box before its best hit.
    #[inline(always)]
    fn enters<const MIXED: bool>(&self, node: &Node) -> bool {
        let [ex, ey, ez] = self.enter.map(|i| node.bounds[i]);
        let [lx, ly, lz] = self.leave.map(|i| node.bounds[i]);
        let ([ix, iy, iz], [ox, oy, oz]) = (&self.inverse, &self.offset);
        let mut any = 0_u32;
        for l in 0..LANES {
            let (x0, x1) = (ex * ix[l] - ox[l], lx * ix[l] - ox[l]);
            let (y0, y1) = (ey * iy[l] - oy[l], ly * iy[l] - oy[l]);
            let (z0, z1) = (ez * iz[l] - oz[l], lz * iz[l] - oz[l]);
            let (x0, x1) = if MIXED { (min(x0, x1), max(x0, x1)) } else { (x0, x1) };
            let (y0, y1) = if MIXED { (min(y0, y1), max(y0, y1)) } else { (y0, y1) };
            let from = max(max(x0, y0), max(z0, 0.0));
            let to = min(min(x1, y1), min(z1, self.best[l]));
            any |= u32::from(from <= to);
        }
        any != 0
    }

    /// Meets a triangle.
    #[inline(always)]
    fn test<const ANY: bool>(&mut self, bvh: &Bvh, triangle: &Triangle) {
        let n = &triangle.numbers;
        let [x, y, z] = self.axes;
        let ([sx, sy], [fx, fy]) = (&self.slope, &self.foot);
        let (az, bz, cz) = (n[z], n[3 + z], n[6 + z]);
        let (mut ea, mut eb, mut ec) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut any = 0_u32;
        for l in 0..LANES {
            let ax = n[x] - (sx[l] * az + fx[l]);
            let ay = n[y] - (sy[l] * az + fy[l]);
            let bx = n[3 + x] - (sx[l] * bz + fx[l]);
            let by = n[3 + y] - (sy[l] * bz + fy[l]);
            let cx = n[6 + x] - (sx[l] * cz + fx[l]);
            let cy = n[6 + y] - (sy[l] * cz + fy[l]);
            let a = bx * cy - cx * by;
            let b = cx * ay - ax * cy;
            let c = ax * by - bx * ay;
            ea[l] = a;
            eb[l] = b;
            ec[l] = c;
            let (least, most) = (min(min(a, b), c), max(max(a, b), c));
            any |= u32::from((least >= 0.0) | (most <= 0.0));
        }
        if any == 0 {
            return;
        }
        let mut close = 0_u32;
        for l in 0..LANES {
            let (a, b, c) = (ea[l], eb[l], ec[l]);
            let (least, most) = (min(min(a, b), c), max(max(a, b), c));
            let inside = (least >= 0.0) | (most <= 0.0);
            let det = (a + b) + c;
            let inverse = 1.0 / det;
            let distance = self.sense * (((a * az + b * bz) + c * cz) * inverse) - self.start[l];
            // Fronts have positive edge functions.
            let slab = n[SLAB] * inverse;
            let near = distance - slab;
            let until = if ANY { distance + slab.abs() } else { near };
            let met = inside
                & (det != 0.0)
                & (distance + slab > 0.0)
                & (until < self.best[l])
                & (self.own[l] != triangle.solid);
            close |= u32::from(met & (near <= 0.0));
            let item = 2 * triangle.solid + u32::from(det < 0.0);
            self.best[l] = if met { if ANY { f32::NEG_INFINITY } else { near } } else { self.best[l] };
            self.item[l] = if met { item } else { self.item[l] };
            if !ANY {
                self.u[l] = if met { b * inverse } else { self.u[l] };
                self.v[l] = if met { c * inverse } else { self.v[l] };
                self.distance[l] = if met { distance } else { self.distance[l] };
            }
        }
        let _ = (close, bvh);
    }

    /// Hands over what the rays met.
    #[inline(always)]
    fn write(&self, hits: &mut Hits) {
        for l in 0..LANES {
            let met = self.item[l] != NOTHING;
            hits.item[l] = if met { self.item[l] } else { hits.item[l] };
            hits.u[l] = if met { self.u[l] } else { hits.u[l] };
            hits.v[l] = if met { self.v[l] } else { hits.v[l] };
            let distance = max(self.distance[l], 0.0) / self.length[l];
            hits.distance[l] = if met { distance } else { hits.distance[l] };
        }
    }
}

/// One instruction, unlike [`f32::min`], which minds what is not a number.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// One instruction, as [`min`].
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Triangle {
    /// Triangle number `solid` with these corners.
    pub(super) fn new(corners: [glam::Vec3; 3], solid: u32) -> Self {
        let mut numbers = [0.0; 11];
        for (numbers, corner) in numbers.chunks_exact_mut(3).zip(corners) {
            numbers.copy_from_slice(&corner.to_array());
        }
        let [a, b, c] = corners.map(|v| v.as_dvec3());
        numbers[SLAB] = (ROUNDING * (b - a).cross(c - a).length()) as f32;
        Self { numbers, solid }
    }
}
