//! Rays of a packet, made ready to be traced.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use super::packet::{Hits, Lanes, Packet};
use crate::simd::LANES;
use crate::visibility::NOTHING;

/// Rays are drawn along the same axis if no other coordinate of their directions is larger than its
/// own by more than this factor: the shear then costs two bits of precision at most.
const STEEPEST: f32 = 4.0;

/// Smallest slope: less moves a ray by less than rounding on its way through the scene, and is
/// never divided by.
const LEAST_SLOPE: f32 = 1e-9;

/// All bits set in the lanes that it holds for, none in the others.
pub(super) type Mask = [u32; LANES];

/// Rays of a packet that run along the same axis in the same sense.
///
/// Distances are along that axis.
#[repr(C, align(64))]
pub(super) struct Rays {
    /// Distance of the nearest hit, less its slab; -∞ where there is no ray.
    pub best: Lanes,
    /// Inverse of the direction, and the origin times it, in axes of space.
    pub inverse: [Lanes; 3],
    pub offset: [Lanes; 3],
    /// Slopes of x and y along z.
    pub slope: [Lanes; 2],
    /// Where rays meet the plane z = 0.
    pub foot: [Lanes; 2],
    /// z of the origin along the rays.
    pub start: Lanes,
    /// Length of the direction along z.
    pub length: Lanes,
    pub own: [u32; LANES],
    pub item: [u32; LANES],
    pub u: Lanes,
    pub v: Lanes,
    pub distance: Lanes,
    /// The axes of space that are x, y and z of the drawing; z is along the rays, and fronts are
    /// counter-clockwise in the drawing.
    pub axes: [usize; 3],
    /// The sense of z along the rays, 1 or -1.
    pub sense: f32,
    /// Index in a [`Node`](super::Node) of the plane through which rays enter and leave a box.
    pub enter: [usize; 3],
    pub leave: [usize; 3],
    /// Bit a is set if rays (the first of them) go backwards along axis a.
    pub backwards: u32,
    /// Whether rays differ in sense along some axis.
    pub mixed: bool,
}

impl Rays {
    /// Takes rays that can be drawn alike from those `left` of a packet; `None` if none is left.
    #[inline(always)]
    pub fn alike(packet: &Packet, left: &mut Mask) -> Option<Self> {
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

    /// Hands over what the rays met.
    #[inline(always)]
    pub fn write(&self, hits: &mut Hits) {
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

impl Packet {
    /// The lanes that hold a ray.
    #[inline(always)]
    pub(super) fn lanes(&self) -> Mask {
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

/// One instruction, unlike [`f32::min`], which minds what is not a number.
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// One instruction, as [`min`].
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
