//! The visible fraction: pairs of points on receiver and emitters, and the segments between them.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::cut::Group;
use super::receiver::{Receiver, ReceiverPoint};
use super::set::Emitters;
use super::sources::Source;
use super::workspace::Workspace;
use crate::engines::sampling::{Random, on_triangle};
use crate::scene::Rgb;
use crate::simd::LANES;
use crate::visibility::Packet;

/// Pairs drawn at first: half of them from each of two independent sequences.
pub(super) const PAIRS: usize = LANES;

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

    /// The fraction of the unoccluded light that arrives, a channel each.
    pub fn fraction(&self) -> Rgb {
        (self.kept / self.all.max(Rgb::splat(f64::MIN_POSITIVE))).min(Rgb::ONE)
    }
}

impl Emitters<'_> {
    /// Adds up pairs of points on the receiver and on a group of emitters, for each half of each
    /// set of pairs that is asked for. All sets decide together whether they need `more` than the
    /// first `look`.
    pub(super) fn visible(
        &self,
        receiver: &Receiver,
        group: &Group<'_>,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        work: &mut Workspace,
        (look, more): (usize, usize),
        seen: &mut [[Seen; 2]],
    ) {
        let (mut drawn, mut blocked) = (0, 0);
        let more = more.next_multiple_of(PAIRS);
        // The first pairs tell whether more are needed.
        for (round, count) in [(0, look.next_multiple_of(PAIRS)), (1, more)] {
            for (k, halves) in seen.iter_mut().enumerate() {
                let seed = receiver.seed ^ (k as u64) << 48;
                self.draw(seed, group, (round, count), sample, work);
                let kernels = work.kernels.iter().enumerate();
                for (lane, kernel) in kernels.filter(|k| *k.1 != Rgb::ZERO) {
                    let half = &mut halves[lane % 2];
                    half.all += *kernel;
                    drawn += 1;
                    if work.blocked[lane / LANES] >> (lane % LANES) & 1 == 0 {
                        half.kept += *kernel;
                    } else {
                        blocked += 1;
                    }
                }
            }
            if round == 0 && (blocked == 0 || blocked == drawn) {
                // What is partly hidden is seldom hidden in the middle alone.
                let (outer, hidden) = self.between_corners(receiver, group.number, sample);
                if blocked == 0 && hidden == 0 || blocked > 0 && hidden == outer {
                    break;
                }
            }
        }
    }

    /// How many segments there are between four outer points of the receiver and of a group that
    /// face each other, and how many of them are blocked.
    fn between_corners(
        &self,
        receiver: &Receiver,
        number: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
    ) -> (u32, u32) {
        /// Corners of the unit square, drawn in a little.
        const OUTER: [DVec2; 4] = [
            DVec2::new(0.03, 0.03),
            DVec2::new(0.97, 0.03),
            DVec2::new(0.03, 0.97),
            DVec2::new(0.97, 0.97),
        ];
        /// Corners of four triangles spread over a group: for two halves of a rectangle, all of
        /// its.
        const CORNERS: [usize; 4] = [0, 1, 1, 2];
        /// Fraction of the way from a corner to the middle of its triangle.
        const INSET: f64 = 0.05;
        let group = self.groups[number].clone();
        let mut packet = Packet::EMPTY;
        let mut aimed = 0_u32;
        for (i, u) in OUTER.into_iter().enumerate() {
            let (from, normal, own) = sample(u);
            for (j, corner) in CORNERS.into_iter().enumerate() {
                let k = group.start + (2 * j + 1) * group.len() / 8;
                let s = &self.sources[k];
                let to = s.corners[corner].lerp(s.corners.iter().sum::<DVec3>() / 3.0, INSET);
                if kernel(s, from, normal, to) > 0.0 && self.source_is_analytic(receiver, k) {
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
        Group { number, blocks, cut }: &Group<'_>,
        (round, count): (u64, usize),
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        work: &mut Workspace,
    ) {
        work.packets.clear();
        work.packets.resize(count / LANES, Packet::EMPTY);
        work.kernels.clear();
        work.kernels.resize(count, Rgb::ZERO);
        let each = count / 2;
        let sum: f64 = work.sums[blocks.clone()].iter().map(|b| f64::from(*b)).sum();
        for half in 0..2 {
            let seed = seed << 8 ^ (*number as u64) << 2 ^ round << 1 ^ half as u64;
            let [s0, s1, s2, s3, s4] = Random::new(seed).numbers();
            let (mut block, mut below) = (blocks.start, 0.0);
            for (i, pair) in self.pairs[half][..each].iter().enumerate() {
                // One in each of `each` equal intervals of the sum, in order.
                let target = (i as f64 + s0) / each as f64 * sum;
                while block + 1 < blocks.end && below + f64::from(work.sums[block]) <= target {
                    below += f64::from(work.sums[block]);
                    block += 1;
                }
                let (mut k, mut rest) = (0, target - below);
                while k + 1 < LANES && f64::from(work.weights[block][k]) <= rest {
                    rest -= f64::from(work.weights[block][k]);
                    k += 1;
                }
                let weight = f64::from(work.weights[block][k]);
                if weight <= 0.0 {
                    continue;
                }
                let wrapped = |p: f32, s: f64| {
                    let x = f64::from(p) + s;
                    if x < 1.0 { x } else { x - 1.0 }
                };
                let (from, normal, own) =
                    sample(DVec2::new(wrapped(pair[0], s1), wrapped(pair[1], s2)));
                let (first, end) = cut.sources[block][k];
                let s = &self.sources[if end - first == 1 {
                    first as usize
                } else {
                    // What is left of the target is the place within the entry.
                    self.tree.at_fraction((first, end), (rest / weight).clamp(0.0, 1.0))
                }];
                let to = point_on(s.corners, wrapped(pair[2], s3), wrapped(pair[3], s4));
                let kernel = kernel(s, from, normal, to);
                if kernel <= 0.0 {
                    continue;
                }
                let lane = 2 * i + half;
                let start = self.bvh.local(from);
                let way = self.bvh.local(to) - start;
                work.packets[lane / LANES].set(lane % LANES, start, way, 1.0, own);
                let area = f64::from(cut.blocks[block].area[k]);
                work.kernels[lane] = s.radiance * (area * kernel / weight);
            }
        }
        work.blocked.clear();
        work.blocked.resize(count / LANES, 0);
        self.bvh.blocked(&work.packets, &mut work.blocked);
    }
}

/// The kernel cos θ cos θ' / (π r²) between two points.
pub(super) fn kernel(s: &Source, from: DVec3, normal: DVec3, to: DVec3) -> f64 {
    let way = to - from;
    let r2 = way.length_squared();
    let (here, there) = (normal.dot(way), -s.normal.dot(way));
    if here > 0.0 && there > 0.0 && r2 > 0.0 { here * there / (PI * r2 * r2) } else { 0.0 }
}

/// A point of a triangle, uniform in area.
pub(super) fn point_on([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    let (p, q) = on_triangle(u, v);
    a + (b - a) * p + (c - a) * q
}
