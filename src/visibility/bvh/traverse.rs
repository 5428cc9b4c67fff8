//! Packets through the hierarchy: one box or one triangle against 16 rays.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use glam::{DVec3, Vec3, dvec3};

use super::{
    Bvh, DEEPEST, Hits, INNER, LANES, Lanes, NOISE, NOTHING, Node, Packet, ROUNDING, SLAB, Triangle,
};
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
    let mut later = Later::EMPTY;
    for (packet, hits) in packets.iter().zip(hits) {
        *hits = Hits::NONE;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, false>(bvh, &mut later);
            } else {
                rays.trace::<false, false>(bvh, &mut later);
            }
            rays.write(hits);
        }
    }
}

#[inline(always)]
fn blocked_kernel(bvh: &Bvh, packets: &[Packet], blocked: &mut [u16]) {
    let mut later = Later::EMPTY;
    for (packet, blocked) in packets.iter().zip(blocked) {
        *blocked = 0;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, true>(bvh, &mut later);
            } else {
                rays.trace::<false, true>(bvh, &mut later);
            }
            for l in 0..LANES {
                *blocked |= u16::from(rays.item[l] != NOTHING) << l;
            }
        }
    }
}

/// At each level below the root at most one node waits; a power of two spares checks of indices.
const STACK: usize = DEEPEST.next_power_of_two();

/// Nodes still to be visited, and where rays enter them; reused from packet to packet.
#[repr(align(64))]
struct Later {
    from: [Lanes; STACK],
    node: [u32; STACK],
}

impl Later {
    const EMPTY: Self = Self { from: [[0.0; LANES]; STACK], node: [0; STACK] };
}

/// All bits set in the lanes that it holds for, none in the others.
type Mask = [u32; LANES];

impl Packet {
    /// The lanes that hold a ray.
    #[inline(always)]
    fn lanes(&self) -> Mask {
        let mut lanes = [0; LANES];
        for l in 0..LANES {
            lanes[l] = mask(self.far[l] > 0.0);
        }
        lanes
    }
}

#[inline(always)]
fn mask(condition: bool) -> u32 {
    u32::from(condition).wrapping_neg()
}

/// Lanes of `a` where the mask is set, else of `b`; without a branch, even if that saves loading.
#[inline(always)]
fn select(mask: u32, a: f32, b: f32) -> f32 {
    f32::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

/// A number for each lane. Loops over lanes stand alone, never in loops over axes, which compilers
/// would rather vectorise.
#[inline(always)]
fn each(number: impl Fn(usize) -> f32) -> Lanes {
    let mut lanes = [0.0; LANES];
    for l in 0..LANES {
        lanes[l] = number(l);
    }
    lanes
}

/// 1 if negative, else 0.
#[inline(always)]
fn sign(x: f32) -> u32 {
    x.to_bits() >> 31
}

/// Whether lanes differ in sign.
#[inline(always)]
fn differ(lanes: &Lanes) -> bool {
    let first = lanes[0].to_bits();
    let mut differ = 0;
    for l in 0..LANES {
        differ |= lanes[l].to_bits() ^ first;
    }
    differ >> 31 != 0
}

/// Inverse of the direction along an axis, in units of 1 over length along z.
#[inline(always)]
fn inverse(direction: &Lanes, inverse_length: &Lanes) -> Lanes {
    each(|l| {
        let d = direction[l] * inverse_length[l];
        1.0 / max(d.abs(), LEAST_SLOPE).copysign(d)
    })
}

/// Rays of a packet that run along the same axis in the same sense.
///
/// Distances are along that axis.
#[repr(C, align(64))]
struct Rays {
    /// Distance of the nearest hit, less its slab; -∞ where there is no ray.
    best: Lanes,
    /// Inverse of the direction, and the origin times it, in axes of space.
    inverse: [Lanes; 3],
    offset: [Lanes; 3],
    /// Slopes of x and y along z.
    slope: [Lanes; 2],
    /// Where rays meet the plane z = 0.
    foot: [Lanes; 2],
    /// z of the origin along the rays.
    start: Lanes,
    /// Length of the direction along z.
    length: Lanes,
    own: [u32; LANES],
    item: [u32; LANES],
    u: Lanes,
    v: Lanes,
    distance: Lanes,
    /// The axes of space that are x, y and z of the drawing; z is along the rays, and fronts are
    /// counter-clockwise in the drawing.
    axes: [usize; 3],
    /// The sense of z along the rays, 1 or -1.
    sense: f32,
    /// Index in [`Node::bounds`] of the plane through which rays enter and leave a box.
    enter: [usize; 3],
    leave: [usize; 3],
    /// Bit a is set if rays (the first of them) go backwards along axis a.
    backwards: u32,
    /// Whether rays differ in sense along some axis.
    mixed: bool,
}

impl Rays {
    /// Takes rays that can be drawn alike from those `left` of a packet; `None` if none is left.
    #[inline(always)]
    fn alike(packet: &Packet, left: &mut Mask) -> Option<Self> {
        if left.iter().fold(0, |any, l| any | l) == 0 {
            return None;
        }
        let first = left.iter().position(|&l| l != 0)?;
        let [dx, dy, dz] = &packet.direction;
        let d = [dx[first], dy[first], dz[first]];
        let z = if d[1].abs() > d[0].abs() { 1 } else { 0 };
        let z = if d[2].abs() > d[z].abs() { 2 } else { z };
        let sense = 1.0_f32.copysign(d[z]);
        let (x, y) =
            if sense > 0.0 { ((z + 2) % 3, (z + 1) % 3) } else { ((z + 1) % 3, (z + 2) % 3) };
        let [dx, dy, dz] = [&packet.direction[x], &packet.direction[y], &packet.direction[z]];
        let mut taken = [0; LANES];
        for l in 0..LANES {
            let along = sense * dz[l];
            let across = max(dx[l].abs(), dy[l].abs());
            taken[l] = left[l] & mask((across <= STEEPEST * along) & (along < f32::INFINITY));
        }
        left[first] = 0;
        for l in 0..LANES {
            left[l] &= !taken[l];
        }
        let mut rays = Self::blank([x, y, z], d, packet.own);
        // Lanes without a ray follow the first one.
        let follow = |lanes: &Lanes| {
            let other = lanes[first];
            each(|l| select(taken[l], lanes[l], other))
        };
        let ([ox, oy, oz], [dx, dy, dz]) = (&packet.origin, &packet.direction);
        let (origin, direction) =
            ([follow(ox), follow(oy), follow(oz)], [follow(dx), follow(dy), follow(dz)]);
        let (along, start) = (&direction[z], &origin[z]);
        let mut inverse_length = [0.0; LANES];
        for l in 0..LANES {
            let length = along[l].abs();
            rays.length[l] = length;
            inverse_length[l] = 1.0 / length;
            rays.start[l] = sense * start[l];
            rays.best[l] = select(taken[l], packet.far[l] * length, f32::NEG_INFINITY);
        }
        let [ox, oy, oz] = &origin;
        let [dx, dy, dz] = &direction;
        rays.mixed = differ(dx) | differ(dy) | differ(dz);
        rays.inverse = [
            inverse(dx, &inverse_length),
            inverse(dy, &inverse_length),
            inverse(dz, &inverse_length),
        ];
        let [ix, iy, iz] = &rays.inverse;
        rays.offset = [each(|l| ox[l] * ix[l]), each(|l| oy[l] * iy[l]), each(|l| oz[l] * iz[l])];
        let slope = |across: &Lanes| each(|l| across[l] * inverse_length[l] * sense);
        rays.slope = [slope(&direction[x]), slope(&direction[y])];
        let foot = |o: &Lanes, s: &Lanes| each(|l| o[l] - s[l] * start[l]);
        rays.foot = [foot(&origin[x], &rays.slope[0]), foot(&origin[y], &rays.slope[1])];
        Some(rays)
    }

    /// Rays still to be filled in, that have met nothing.
    #[inline(always)]
    fn blank(axes: [usize; 3], d: [f32; 3], own: [u32; LANES]) -> Self {
        const ZERO: Lanes = [0.0; LANES];
        Self {
            best: ZERO,
            inverse: [ZERO; 3],
            offset: [ZERO; 3],
            slope: [ZERO; 2],
            foot: [ZERO; 2],
            start: ZERO,
            length: ZERO,
            own,
            item: [NOTHING; LANES],
            u: ZERO,
            v: ZERO,
            distance: [f32::INFINITY; LANES],
            axes,
            sense: 1.0_f32.copysign(d[axes[2]]),
            enter: [0, 1, 2].map(|a| a + 3 * sign(d[a]) as usize),
            leave: [0, 1, 2].map(|a| a + 3 - 3 * sign(d[a]) as usize),
            backwards: sign(d[0]) | sign(d[1]) << 1 | sign(d[2]) << 2,
            mixed: false,
        }
    }

    /// Visits the boxes that rays enter before their best hit. Both children are tested at once:
    /// the second test then costs little, as it need not wait for the first to be decided.
    #[inline(always)]
    fn trace<const MIXED: bool, const ANY: bool>(&mut self, bvh: &Bvh, later: &mut Later) {
        let mut at = 0;
        let mut top = 0;
        loop {
            let node = &bvh.nodes[at as usize];
            if node.kind() >= INNER {
                let backwards = self.backwards >> (node.kind() & 3) & 1;
                let (near, far) = (node.first() + backwards, node.first() + 1 - backwards);
                let mut from = [0.0; LANES];
                let enters_near = self.enters::<MIXED>(&bvh.nodes[near as usize], &mut from);
                let put = top % STACK;
                let from = &mut later.from[put];
                let enters_far = self.enters::<MIXED>(&bvh.nodes[far as usize], from);
                if enters_near {
                    later.node[put] = far;
                    top += usize::from(enters_far);
                    at = near;
                    continue;
                }
                if enters_far {
                    at = far;
                    continue;
                }
            } else {
                let first = node.first() as usize;
                for triangle in &bvh.triangles[first..first + node.kind() as usize] {
                    self.test::<ANY>(bvh, triangle);
                }
                if ANY && self.best.iter().all(|&b| b == f32::NEG_INFINITY) {
                    return;
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if self.reaches(&later.from[top % STACK]) {
                    break;
                }
            }
            at = later.node[top % STACK];
        }
    }

    /// Whether any ray gets as far as `from` without a hit.
    #[inline(always)]
    fn reaches(&self, from: &Lanes) -> bool {
        let mut any = 0_u32;
        for l in 0..LANES {
            any |= u32::from(from[l] <= self.best[l]);
        }
        any != 0
    }

    /// Whether any ray enters the box before its best hit; and where, or NaN if it does not.
    #[inline(always)]
    fn enters<const MIXED: bool>(&self, node: &Node, entry: &mut Lanes) -> bool {
        let plane = |i: usize| node.0[i % 8];
        let [ex, ey, ez] = self.enter;
        let (ex, ey, ez) = (plane(ex), plane(ey), plane(ez));
        let [lx, ly, lz] = self.leave;
        let (lx, ly, lz) = (plane(lx), plane(ly), plane(lz));
        let ([ix, iy, iz], [ox, oy, oz]) = (&self.inverse, &self.offset);
        let mut any = 0_u32;
        for l in 0..LANES {
            let (x0, x1) = (ex * ix[l] - ox[l], lx * ix[l] - ox[l]);
            let (y0, y1) = (ey * iy[l] - oy[l], ly * iy[l] - oy[l]);
            let (z0, z1) = (ez * iz[l] - oz[l], lz * iz[l] - oz[l]);
            let (x0, x1) = if MIXED { (min(x0, x1), max(x0, x1)) } else { (x0, x1) };
            let (y0, y1) = if MIXED { (min(y0, y1), max(y0, y1)) } else { (y0, y1) };
            let (z0, z1) = if MIXED { (min(z0, z1), max(z0, z1)) } else { (z0, z1) };
            let from = max(max(x0, y0), max(z0, 0.0));
            let to = min(min(x1, y1), min(z1, self.best[l]));
            entry[l] = if from <= to { from } else { f32::NAN };
            any |= u32::from(from <= to);
        }
        any != 0
    }

    /// Meets a triangle.
    #[inline(always)]
    fn test<const ANY: bool>(&mut self, bvh: &Bvh, triangle: &Triangle) {
        let n = &triangle.numbers;
        let [x, y, z] = self.axes;
        // Never so: spares checking each index.
        if x > 2 || y > 2 || z > 2 {
            return;
        }
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
        let mut unclear = 0_u32;
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
            let clear = (near > 0.0) & (det.abs() > n[NOISE]);
            unclear |= u32::from(met & !clear);
            let met = met & clear;
            let item = 2 * triangle.solid + u32::from(det < 0.0);
            let best = if ANY { f32::NEG_INFINITY } else { near };
            self.best[l] = if met { best } else { self.best[l] };
            self.item[l] = if met { item } else { self.item[l] };
            if !ANY {
                self.u[l] = if met { b * inverse } else { self.u[l] };
                self.v[l] = if met { c * inverse } else { self.v[l] };
                self.distance[l] = if met { distance } else { self.distance[l] };
            }
        }
        if unclear != 0 {
            self.test_closely::<ANY>(bvh, triangle, [ea, eb, ec]);
        }
    }

    /// Meets a triangle that some rays begin on or see edge on, unless it continues the plane of
    /// their own.
    #[cold]
    #[inline(never)]
    fn test_closely<const ANY: bool>(&mut self, bvh: &Bvh, triangle: &Triangle, edges: [Lanes; 3]) {
        let n = &triangle.numbers;
        let z = self.axes[2];
        for l in 0..LANES {
            let [a, b, c] = [edges[0][l], edges[1][l], edges[2][l]];
            let det = (a + b) + c;
            let inside = min(min(a, b), c) >= 0.0 || max(max(a, b), c) <= 0.0;
            if !inside || det == 0.0 || self.own[l] == triangle.solid {
                continue;
            }
            let inverse = 1.0 / det;
            let along = ((a * n[z] + b * n[3 + z]) + c * n[6 + z]) * inverse;
            let distance = self.sense * along - self.start[l];
            let slab = n[SLAB] * inverse;
            let near = distance - slab;
            let until = if ANY { distance + slab.abs() } else { near };
            let clear = near > 0.0 && det.abs() > n[NOISE];
            let met = !clear && distance + slab > 0.0 && until < self.best[l];
            if met && !bvh.continues(triangle, self.own[l]) {
                self.best[l] = if ANY { f32::NEG_INFINITY } else { near };
                self.item[l] = 2 * triangle.solid + u32::from(det < 0.0);
                (self.u[l], self.v[l]) = (b * inverse, c * inverse);
                self.distance[l] = distance;
            }
        }
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

/// Normals with a smaller sine between them are those of one plane: single precision turns those of
/// small triangles by as much.
const PARALLEL: f64 = 1e-3;

impl Bvh {
    /// Whether a triangle is parallel to the solid triangle `own` and faces the same way.
    fn continues(&self, triangle: &Triangle, own: u32) -> bool {
        let place = self.place.get(own as usize).map_or(NOTHING, |&p| p);
        self.triangles.get(place as usize).is_some_and(|own| {
            let (m, n) = (own.normal(), triangle.normal());
            let along = m.dot(n);
            along > 0.0 && m.cross(n).length() <= PARALLEL * along
        })
    }
}

impl Triangle {
    /// Triangle number `solid` with these corners.
    pub(super) fn new(corners: [Vec3; 3], solid: u32) -> Self {
        let mut numbers = [0.0; 11];
        for (numbers, corner) in numbers.chunks_exact_mut(3).zip(corners) {
            numbers.copy_from_slice(&corner.to_array());
        }
        let mut triangle = Self { numbers, solid };
        let [a, b, c] = corners;
        let perimeter = (b - a).length() + (c - b).length() + (a - c).length();
        triangle.numbers[NOISE] = 16.0 * ROUNDING as f32 * perimeter;
        triangle.numbers[SLAB] = (ROUNDING * triangle.normal().length()) as f32;
        triangle
    }

    /// Normal, as long as twice the area.
    fn normal(&self) -> DVec3 {
        let [ax, ay, az, bx, by, bz, cx, cy, cz, ..] = self.numbers.map(f64::from);
        let (a, b, c) = (dvec3(ax, ay, az), dvec3(bx, by, bz), dvec3(cx, cy, cz));
        (b - a).cross(c - a)
    }
}
