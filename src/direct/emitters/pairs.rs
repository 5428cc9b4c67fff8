//! The visible share: pairs of points on receiver and emitters, and the segments between them.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::{Emitters, Receiver, ReceiverPoint};
use crate::scene::Rgb;
use crate::visibility::{LANES, Packet};

/// Pairs drawn at first: half of them from each of two independent sequences.
pub(super) const PAIRS: usize = LANES;

/// Most shadow rays a group of emitters and receiver.
pub const MOST_SHADOW: usize = 4096;

/// Room for one receiver's work; reused.
#[derive(Debug, Default)]
pub struct Room {
    pub(super) weights: Vec<f32>,
    /// Sums of each 16 weights of a group.
    pub(super) blocks: Vec<f32>,
    packets: Vec<Packet>,
    kernels: Vec<Rgb>,
    blocked: Vec<u16>,
}

/// Sums of kernels over pairs: those that see each other, and all.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    kept: Rgb,
    all: Rgb,
}

impl Seen {
    pub fn and(self, other: Self) -> Self {
        Self { kept: self.kept + other.kept, all: self.all + other.all }
    }

    pub fn share(&self) -> Rgb {
        (self.kept / self.all.max(Rgb::splat(f64::MIN_POSITIVE))).min(Rgb::ONE)
    }
}

impl Emitters<'_> {
    /// Adds up pairs of points on the receiver and on a group of emitters, for each half of each set of
    /// pairs that is asked for. All sets decide together whether they need more than the first `look`.
    pub(super) fn visible(
        &self,
        receiver: &Receiver,
        number: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
        look: usize,
        seen: &mut [[Seen; 2]],
    ) {
        let (mut drawn, mut blocked) = (0, 0);
        let more = self.options.shadow.min(MOST_SHADOW).next_multiple_of(PAIRS);
        // The first pairs tell whether more are worth their while.
        for (round, count) in [(0, look.next_multiple_of(PAIRS)), (1, more)] {
            for (k, halves) in seen.iter_mut().enumerate() {
                let seed = receiver.seed ^ (k as u64) << 48;
                self.draw(seed, (number, round), count, sample, room);
                let kernels = room.kernels.iter().enumerate();
                for (lane, kernel) in kernels.filter(|k| *k.1 != Rgb::ZERO) {
                    let half = &mut halves[lane % 2];
                    half.all += *kernel;
                    drawn += 1;
                    if room.blocked[lane / LANES] >> (lane % LANES) & 1 == 0 {
                        half.kept += *kernel;
                    } else {
                        blocked += 1;
                    }
                }
            }
            if round == 0 && (blocked == 0 || blocked == drawn) {
                // What is hidden in part is seldom hidden in the middle alone.
                let (outer, hidden) = self.between_corners(number, sample, room);
                if blocked == 0 && hidden == 0 || blocked > 0 && hidden == outer {
                    break;
                }
            }
        }
    }

    /// How many segments there are between four outer points of the receiver and of a group that face
    /// each other, and how many of them are blocked.
    fn between_corners(
        &self,
        number: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) -> (u32, u32) {
        /// Corners of the unit square, drawn in a little.
        const OUTER: [DVec2; 4] = [
            DVec2::new(0.03, 0.03),
            DVec2::new(0.97, 0.03),
            DVec2::new(0.03, 0.97),
            DVec2::new(0.97, 0.97),
        ];
        /// Corners of four triangles spread over a group: for two halves of a rectangle, all of its.
        const CORNERS: [usize; 4] = [0, 1, 1, 2];
        /// Share of the way from a corner to the middle of its triangle.
        const INSET: f64 = 0.05;
        let group = self.groups[number].clone();
        let mut packet = Packet::EMPTY;
        let mut aimed = 0_u32;
        for (i, u) in OUTER.into_iter().enumerate() {
            let (from, normal, own) = sample(u);
            for (j, corner) in CORNERS.into_iter().enumerate() {
                let k = group.start + (2 * j + 1) * group.len() / 8;
                let corners = self.sources[k].corners;
                let to = corners[corner].lerp(corners.iter().sum::<DVec3>() / 3.0, INSET);
                if room.weights[k] > 0.0 && self.kernel(k, from, normal, to) > 0.0 {
                    let start = self.bvh.local(from);
                    packet.set(4 * i + j, start, self.bvh.local(to) - start, 1.0, own);
                    aimed |= 1 << (4 * i + j);
                }
            }
        }
        let mut hidden = [0];
        self.bvh.blocked(&[packet], &mut hidden);
        (aimed.count_ones(), (u32::from(hidden[0]) & aimed).count_ones())
    }

    /// Draws `count` pairs and traces the segments between them; even lanes are of the first half.
    fn draw(
        &self,
        seed: u64,
        (number, round): (usize, u64),
        count: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) {
        let group = self.groups[number].clone();
        room.packets.clear();
        room.packets.resize(count / LANES, Packet::EMPTY);
        room.kernels.clear();
        room.kernels.resize(count, Rgb::ZERO);
        let each = count / 2;
        let sum: f64 = room.blocks.iter().map(|b| f64::from(*b)).sum();
        for half in 0..2 {
            let seed = seed << 8 ^ (number as u64) << 2 ^ round << 1 ^ half as u64;
            let [s0, s1, s2, s3, s4] = shifts(seed);
            let (mut block, mut below) = (0, 0.0);
            for (i, pair) in self.pairs[half][..each].iter().enumerate() {
                // One in each of so many equal parts of the sum, in order.
                let target = (i as f64 + s0) / each as f64 * sum;
                while block + 1 < room.blocks.len()
                    && below + f64::from(room.blocks[block]) <= target
                {
                    below += f64::from(room.blocks[block]);
                    block += 1;
                }
                let mut k = group.start + block * LANES;
                let end = group.end.min(k + LANES);
                let mut rest = target - below;
                while k + 1 < end && f64::from(room.weights[k]) <= rest {
                    rest -= f64::from(room.weights[k]);
                    k += 1;
                }
                let weight = f64::from(room.weights[k]);
                let wrapped = |p: f32, s: f64| {
                    let x = f64::from(p) + s;
                    if x < 1.0 { x } else { x - 1.0 }
                };
                let (from, normal, own) =
                    sample(DVec2::new(wrapped(pair[0], s1), wrapped(pair[1], s2)));
                let to = self.on_source(k, wrapped(pair[2], s3), wrapped(pair[3], s4));
                let kernel = self.kernel(k, from, normal, to);
                if kernel <= 0.0 || weight <= 0.0 {
                    continue;
                }
                let lane = 2 * i + half;
                let start = self.bvh.local(from);
                let way = self.bvh.local(to) - start;
                room.packets[lane / LANES].set(lane % LANES, start, way, 1.0, own);
                room.kernels[lane] = self.sources[k].radiance * (kernel / weight);
            }
        }
        room.blocked.clear();
        room.blocked.resize(count / LANES, 0);
        self.bvh.blocked(&room.packets, &mut room.blocked);
    }

    /// A point of a source, uniform in area.
    fn on_source(&self, k: usize, u: f64, v: f64) -> DVec3 {
        on_triangle(self.sources[k].corners, u, v)
    }

    /// Area of a source times the kernel between two points.
    fn kernel(&self, k: usize, from: DVec3, normal: DVec3, to: DVec3) -> f64 {
        let s = &self.sources[k];
        let way = to - from;
        let r2 = way.length_squared();
        let (here, there) = (normal.dot(way), -s.normal.dot(way));
        if here > 0.0 && there > 0.0 && r2 > 0.0 {
            s.area * here * there / (PI * r2 * r2)
        } else {
            0.0
        }
    }
}

/// A point of a triangle, uniform in area (Heitz 2019, "A low-distortion map between triangle and
/// square").
pub(super) fn on_triangle([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    let (p, q) = if v > u { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
    a + (b - a) * p + (c - a) * q
}

/// Five numbers in 0..1 that look random.
fn shifts(seed: u64) -> [f64; 5] {
    // SplitMix64 (Steele, Lea & Flood 2014).
    let mut state = seed.wrapping_mul(0xd134_2543_de82_ef95);
    std::array::from_fn(|_| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    })
}
