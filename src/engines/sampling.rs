//! Where rays begin and go: points of an area and directions, some sets of them at a time.
//!
//! Points come from a Sobol' sequence in four dimensions, scrambled as Owen (1995) does, which
//! fills them evenly: the error falls nearly as 1/N instead of 1/√N. Two of them are the direction;
//! N points, a power of two, have one in each of N equal cells of its unit square ((0,2)-sequences,
//! Niederreiter 1987). Cells are sorted along a curve of Morton's. A set makes the points its own
//! by exclusive or with random bits (a digital shift): of the area in all places, of the direction
//! only within its cell. So all sets have one ray in each cell, whichever it is, and packets of
//! rays from neighbouring sets through neighbouring cells go nearly alike.

use std::ops::{Mul, Range, Sub};

use glam::Vec3;

use crate::simd::{LANES, multiversion};
use crate::visibility::Packet;

/// Random bits by which a set of rays differs from the table.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mask {
    area: [u32; 2],
    direction: [u32; 2],
}

/// Points of one sequence, as packets need them.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// For each packet: bits of the direction's unit square, then of the area's.
    packets: Vec<[[u32; LANES]; 4]>,
    /// Sets that share a packet.
    sets: usize,
    /// Bits of the direction that are below the cell.
    within: [u32; 2],
}

impl Table {
    /// Of so many points for each set, rounded up to a power of two of at least [`LANES`]; `sets`,
    /// a power of two up to [`LANES`], share a packet.
    pub fn new(points: usize, seed: u32, sets: usize) -> Self {
        let count = points.max(LANES).next_power_of_two();
        let mut points: Vec<[u32; 4]> = (0..count as u32)
            .map(|i| sobol_burley::sample_4d(i, 0, seed).map(|x| (x * TWO_TO_32) as u32))
            .collect();
        points.sort_by_key(|p| morton(p[0], p[1]));
        let cells = LANES / sets;
        let lanes = |points: &[[u32; 4]]| {
            std::array::from_fn(|k| std::array::from_fn(|l| points[l % cells][k]))
        };
        let bits = count.ilog2();
        // The curve takes bits of both in turn, of the first one first.
        let below = |bits: u32| u32::MAX.checked_shr(bits).unwrap_or(0);
        Self {
            packets: points.chunks_exact(cells).map(lanes).collect(),
            sets,
            within: [below(bits.div_ceil(2)), below(bits / 2)],
        }
    }

    /// Points of each set.
    pub fn points(&self) -> usize {
        self.packets.len() * LANES / self.sets
    }

    /// The lanes of a set, one after the other.
    pub fn lanes(&self, set: usize) -> Range<usize> {
        let cells = LANES / self.sets;
        set * cells..(set + 1) * cells
    }

    /// Points of each packet.
    pub fn packets(&self) -> &[[[u32; LANES]; 4]] {
        &self.packets
    }

    /// The random bits of a set; other seeds give others.
    pub fn mask(&self, seed: u64) -> Mask {
        let mut random = Random::new(seed);
        let mut next = || (random.bits() >> 32) as u32;
        let (area, [a, b]) = ([next(), next()], [next(), next()]);
        Mask { area, direction: [a & self.within[0], b & self.within[1]] }
    }
}

/// 2³².
const TWO_TO_32: f32 = 4_294_967_296.0;

/// The place of a cell on Morton's curve.
fn morton(x: u32, y: u32) -> u64 {
    let spread = |x: u32| {
        let mut x = u64::from(x);
        for (shift, mask) in [
            (16, 0x0000_ffff_0000_ffff),
            (8, 0x00ff_00ff_00ff_00ff),
            (4, 0x0f0f_0f0f_0f0f_0f0f),
            (2, 0x3333_3333_3333_3333),
            (1, 0x5555_5555_5555_5555),
        ] {
            x = (x | x << shift) & mask;
        }
        x
    };
    spread(x) << 1 | spread(y)
}

/// A random sequence: SplitMix64 (Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    /// Neighbouring seeds give sequences that have nothing in common.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.0;
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// The next numbers, uniform in 0..1.
    pub fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| (self.bits() >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// Where the rays of each lane begin.
#[derive(Debug, Clone)]
pub(crate) struct Starts {
    /// A corner of a triangle and two edges from it; without extent it is a point.
    triangle: [[[f32; LANES]; 3]; 3],
    /// Rays go into the hemisphere about the third.
    axes: [[[f32; LANES]; 3]; 3],
    own: [u32; LANES],
    /// Positive where there are rays.
    far: [f32; LANES],
    area: [[u32; LANES]; 2],
    direction: [[u32; LANES]; 2],
}

impl Starts {
    /// No rays.
    pub const NONE: Self = Self {
        triangle: [[[0.0; LANES]; 3]; 3],
        axes: [[[0.0; LANES]; 3]; 3],
        own: [0; LANES],
        far: [0.0; LANES],
        area: [[0; LANES]; 2],
        direction: [[0; LANES]; 2],
    };

    /// Rays from all over the triangle of a corner and two edges, on the solid triangle `own`.
    pub fn set(&mut self, lane: usize, triangle: [Vec3; 3], axes: [Vec3; 3], own: u32) {
        for k in 0..3 {
            for axis in 0..3 {
                self.triangle[k][axis][lane] = triangle[k][axis];
                self.axes[k][axis][lane] = axes[k][axis];
            }
        }
        self.own[lane] = own;
        self.far[lane] = f32::INFINITY;
    }

    /// Which rays they are.
    pub fn set_mask(&mut self, lane: usize, mask: Mask) {
        for k in 0..2 {
            self.area[k][lane] = mask.area[k];
            self.direction[k][lane] = mask.direction[k];
        }
    }

    /// Where on its area, in the unit square, the ray of a lane begins; and where it goes, about
    /// the third axis.
    pub fn point(&self, points: &[[u32; LANES]; 4], l: usize) -> ([f32; 2], Vec3) {
        let [x, y, p, q] = points.map(|bits| bits[l]);
        let place = [unit(p ^ self.area[0][l]), unit(q ^ self.area[1][l])];
        let towards = cosine(unit(x ^ self.direction[0][l]), unit(y ^ self.direction[1][l]));
        (place, Vec3::from_array(towards))
    }
}

multiversion! {
    pub(crate) fn aim(points: &[[[u32; LANES]; 4]], starts: &Starts, packets: &mut [Packet])
        = aim_kernel
}

/// Fills in packets.
#[inline(always)]
fn aim_kernel(points: &[[[u32; LANES]; 4]], starts: &Starts, packets: &mut [Packet]) {
    let [corner, b, c] = &starts.triangle;
    let [t, u, n] = &starts.axes;
    for (points, packet) in points.iter().zip(packets) {
        let (mut p, mut q) = ([0.0; LANES], [0.0; LANES]);
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            (p[l], q[l]) = on_triangle(
                unit(points[2][l] ^ starts.area[0][l]),
                unit(points[3][l] ^ starts.area[1][l]),
            );
        }
        for l in 0..LANES {
            [x[l], y[l], z[l]] = cosine(
                unit(points[0][l] ^ starts.direction[0][l]),
                unit(points[1][l] ^ starts.direction[1][l]),
            );
        }
        for axis in 0..3 {
            let (from, to) = (&mut packet.origin[axis], &mut packet.direction[axis]);
            for l in 0..LANES {
                from[l] = corner[axis][l] + b[axis][l] * p[l] + c[axis][l] * q[l];
                to[l] = t[axis][l] * x[l] + u[axis][l] * y[l] + n[axis][l] * z[l];
            }
        }
        packet.far = starts.far;
        packet.own = starts.own;
    }
}

/// A number of 0..1 with 24 bits.
#[inline(always)]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Barycentric coordinates of two corners, uniform over the triangle (Heitz 2019, "A low-distortion
/// map between triangle and square"), in either precision.
#[inline(always)]
pub(crate) fn on_triangle<T>(u: T, v: T) -> (T, T)
where
    T: Copy + PartialOrd + From<f32> + Mul<Output = T> + Sub<Output = T>,
{
    let half = T::from(0.5);
    if v > u { (half * u, v - half * u) } else { (u - half * v, half * v) }
}

/// A direction about the third axis, with a density proportional to the cosine (Malley's method: a
/// uniform disk lifted to the hemisphere).
#[inline(always)]
pub(crate) fn cosine(u: f32, v: f32) -> [f32; 3] {
    let sin = u.sqrt();
    let (c, s) = turn(v);
    [sin * c, sin * s, (1.0 - u).sqrt()]
}

/// Cosine and sine of a turn, for v of 0..1 an angle of -π..π: their series to the eleventh and
/// twelfth power, within 10⁻⁷.
#[inline(always)]
fn turn(v: f32) -> (f32, f32) {
    let t = v - 0.5;
    let a = t.abs();
    let beyond = a > 0.25;
    let x = std::f32::consts::TAU * if beyond { 0.5 - a } else { a };
    let x2 = x * x;
    let s = -2.505_210_8e-8_f32;
    let s = s * x2 + 2.755_731_9e-6;
    let s = s * x2 - 1.984_127e-4;
    let s = s * x2 + 8.333_333e-3;
    let s = s * x2 - 1.666_666_7e-1;
    let s = (s * x2 + 1.0) * x;
    let c = 2.087_675_7e-9_f32;
    let c = c * x2 - 2.755_732e-7;
    let c = c * x2 + 2.480_158_7e-5;
    let c = c * x2 - 1.388_888_9e-3;
    let c = c * x2 + 4.166_666_7e-2;
    let c = c * x2 - 0.5;
    let c = c * x2 + 1.0;
    (if beyond { -c } else { c }, s.copysign(t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_of_directions_has_one_point_whatever_the_mask() {
        for (points, sets) in [(16_usize, 16), (32, 4), (512, 16), (1024, 1)] {
            let table = Table::new(points, 7, sets);
            assert_eq!((table.points(), table.packets().len()), (points, points * sets / LANES));
            let bits = 64 - points.ilog2();
            for seed in 0..4 {
                let mask = table.mask(seed);
                for set in 0..sets {
                    let all = table.packets().iter();
                    let cells = all.flat_map(|p| table.lanes(set).map(|l| [p[0][l], p[1][l]]));
                    for (cell, [x, y]) in cells.enumerate() {
                        let (x, y) = (x ^ mask.direction[0], y ^ mask.direction[1]);
                        assert_eq!(morton(x, y) >> bits, cell as u64, "{points} points");
                    }
                }
            }
        }
    }

    #[test]
    fn masks_move_points_within_the_whole_of_a_cell() {
        // The mean over many sets of one cell's points is the cell's middle.
        let table = Table::new(16, 0, 16);
        let (mut sum, count) = ([0.0_f64; 2], 4000);
        for seed in 0..count {
            let mask = table.mask(seed);
            for (k, sum) in sum.iter_mut().enumerate() {
                let bits = table.packets()[5][k][0] ^ mask.direction[k];
                *sum += f64::from(bits) / f64::from(u32::MAX);
            }
        }
        // Cell 5 of 4 × 4 on Morton's curve: bits 0101, so x = 00, y = 11.
        let mean = sum.map(|s| s / count as f64);
        assert!((mean[0] - 0.125).abs() < 0.01 && (mean[1] - 0.875).abs() < 0.01, "{mean:?}");
    }

    #[test]
    fn turns_are_cosine_and_sine() {
        for i in 0..=1000 {
            let v = i as f32 / 1001.0;
            let (c, s) = turn(v);
            let angle = std::f64::consts::TAU * (f64::from(v) - 0.5);
            assert!((f64::from(c) - angle.cos()).abs() < 3e-7, "{v}");
            assert!((f64::from(s) - angle.sin()).abs() < 3e-7, "{v}");
        }
    }
}
