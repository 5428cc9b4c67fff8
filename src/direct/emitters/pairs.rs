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
    /// Takes in a pair, whether it sees each other or not.
    pub fn add(&mut self, kernel: Rgb, is_seen: bool) {
        self.all += kernel;
        if is_seen {
            self.kept += kernel;
        }
    }

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
    pub(super) fn draw(
        &self,
        seed: u64,
        group: &Group<'_>,
        (round, count): (u64, usize),
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        work: &mut Workspace,
    ) {
        work.packets.clear();
        work.packets.resize(count / LANES, Packet::EMPTY);
        work.kernels.clear();
        work.kernels.resize(count, Rgb::ZERO);
        let each = count / 2;
        let sum = group.sum(&work.sums);
        for half in 0..2 {
            let seed = seed << 8 ^ (group.number as u64) << 2 ^ round << 1 ^ half as u64;
            let [s0, s1, s2, s3, s4] = Random::new(seed).numbers();
            let mut place = (group.blocks.start, 0.0);
            for (i, pair) in self.pairs[half][..each].iter().enumerate() {
                // One in each of `each` equal intervals of the sum, in order.
                let target = (i as f64 + s0) / each as f64 * sum;
                let pair = wrapped(pair, [s1, s2, s3, s4]);
                let Some(pair) = self.pair(group, work, (target, &mut place), pair, sample) else {
                    continue;
                };
                let lane = 2 * i + half;
                let start = self.bvh.local(pair.from);
                let way = self.bvh.local(pair.to) - start;
                work.packets[lane / LANES].set(lane % LANES, start, way, 1.0, pair.own);
                work.kernels[lane] = pair.kernel;
            }
        }
        work.blocked.clear();
        work.blocked.resize(count / LANES, 0);
        self.bvh.blocked(&work.packets, &mut work.blocked);
    }

    /// A pair of points: the emitter's at `target` of the group's [`sum`](Group::sum), for which
    /// the search begins at a `place` before it; `at` are both's coordinates in unit squares.
    /// `None` if they do not face each other.
    pub(super) fn pair(
        &self,
        Group { blocks, cut, .. }: &Group<'_>,
        work: &Workspace,
        (target, place): (f64, &mut (usize, f64)),
        at: [f64; 4],
        sample: &impl Fn(DVec2) -> ReceiverPoint,
    ) -> Option<Pair> {
        let (block, below) = place;
        while *block + 1 < blocks.end && *below + f64::from(work.sums[*block]) <= target {
            *below += f64::from(work.sums[*block]);
            *block += 1;
        }
        let (mut k, mut rest) = (0, target - *below);
        while k + 1 < LANES && f64::from(work.weights[*block][k]) <= rest {
            rest -= f64::from(work.weights[*block][k]);
            k += 1;
        }
        let weight = f64::from(work.weights[*block][k]);
        if weight <= 0.0 {
            return None;
        }
        let (from, normal, own) = sample(DVec2::new(at[0], at[1]));
        let (first, end) = cut.sources[*block][k];
        let s = &self.sources[if end - first == 1 {
            first as usize
        } else {
            // What is left of the target is the place within the entry.
            self.tree.at_fraction((first, end), (rest / weight).clamp(0.0, 1.0))
        }];
        let to = point_on(s.corners, at[2], at[3]);
        let kernel = kernel(s, from, normal, to);
        let area = f64::from(cut.blocks[*block].area[k]);
        let kernel = (kernel > 0.0).then(|| s.radiance * (area * kernel / weight))?;
        Some(Pair { from, to, own, kernel })
    }
}

/// A point of a receiver and one of an emitter that face each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub from: DVec3,
    pub to: DVec3,
    /// The solid triangle that the receiver's lies on.
    pub own: Option<u32>,
    /// What the emitter sends, times the kernel.
    pub kernel: Rgb,
}

/// A point of a sequence, shifted within the unit cube.
pub(super) fn wrapped(point: &[f32; 4], by: [f64; 4]) -> [f64; 4] {
    let x: [f64; 4] = std::array::from_fn(|k| f64::from(point[k]) + by[k]);
    x.map(|x| if x < 1.0 { x } else { x - 1.0 })
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
