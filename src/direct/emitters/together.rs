//! Direct irradiance of many points that lie together, as pictures need it.
//!
//! Where an emitter is seen as a whole, or not at all, from all of them, a few shadow rays from
//! each tell so: together they are many. Only where that is not so has each point its own visible
//! fraction, by more rays where its first ones or those of its neighbours disagree.

use glam::{DVec2, DVec3};

use super::pairs::{PAIRS, Pair, Seen, wrapped};
use super::receiver::{Receiver, ReceiverPoint};
use super::set::Emitters;
use super::workspace::Workspace;
use crate::direct::MOST_SHADOW;
use crate::engines::sampling::Random;
use crate::scene::{Rgb, luminance};
use crate::simd::LANES;
use crate::visibility::Packet;

/// Pairs of each point that tell whether all points see a group alike, and of all together, at
/// least.
const FEW: [usize; 2] = [4, 64];

/// Pairs of points that lie farther out than this share of the farthest: half-shadows that begin
/// among the points begin there.
const MORE: usize = 32;
const OUTER: f64 = 0.8;

/// What a point may receive of a group of emitters.
#[derive(Debug, Clone, Copy)]
struct Share {
    point: u32,
    group: u32,
    unoccluded: Rgb,
    seen: Seen,
    /// How many of its pairs face each other, and how many of those are blocked.
    drawn: u32,
    blocked: u32,
}

impl Share {
    fn disagrees(&self) -> bool {
        self.blocked > 0 && self.blocked < self.drawn
    }

    /// Variance of a visible fraction, as if pairs were random.
    fn variance(&self, fraction: f64) -> f64 {
        fraction * (1.0 - fraction) / f64::from(self.drawn.max(1))
    }

    /// What arrives if this fraction is visible, and the variance of its luminance.
    fn light(&self, fraction: Rgb, variance: f64) -> (Rgb, f64) {
        /// Pairs are spread evenly: their variance is this share of that of random ones, about.
        const EVEN: f64 = 0.25;
        let all = luminance(self.unoccluded);
        (self.unoccluded * fraction, all * all * EVEN * variance)
    }

    fn own_light(&self) -> (Rgb, f64) {
        let fraction = self.seen.fraction();
        self.light(fraction, self.variance(luminance(fraction).min(1.0)))
    }

    fn add(&mut self, kernel: Rgb, is_seen: bool) {
        self.seen.add(kernel, is_seen);
        self.drawn += 1;
        self.blocked += u32::from(!is_seen);
    }
}

impl Emitters<'_> {
    /// Adds to `found` the direct irradiance of each of some receivers that lie together, and the
    /// variance of its luminance, after a [`look`](Self::look) at them. `sample` gives a point of
    /// one, by its number and a point of the unit square; points nearer than `near` (m) to each
    /// other are neighbours.
    pub(crate) fn light_together(
        &self,
        receivers: &[Receiver],
        sample: impl Fn(usize, DVec2) -> ReceiverPoint,
        near: impl Fn(usize) -> f64,
        work: &mut Workspace,
        found: &mut [(Rgb, f64)],
    ) {
        let mut add = |share: &Share, (light, variance): (Rgb, f64)| {
            let (sum, of_it) = &mut found[share.point as usize];
            *sum += light;
            *of_it += variance;
        };
        let mut shares = self.shares(receivers, &sample, work);
        shares.sort_by_key(|s| s.group);
        let mut open: Vec<Share> = Vec::new();
        for group in shares.chunk_by(|a, b| a.group == b.group) {
            let sum = |of: fn(&Share) -> u32| group.iter().map(of).sum::<u32>();
            let (drawn, blocked) = (sum(|s| s.drawn), sum(|s| s.blocked));
            if blocked == 0 {
                for share in group {
                    add(share, (share.unoccluded, 0.0));
                }
            } else if blocked < drawn {
                open.extend(group);
            }
        }
        if open.is_empty() {
            return;
        }
        self.draw_more(receivers, &mut open, (0, PAIRS), &sample, work);
        open.sort_by_key(|s| (s.group, s.point));
        let at = |s: &Share| receivers[s.point as usize].middle.0;
        let mut more: Vec<Share> = Vec::new();
        for group in open.chunk_by(|a, b| a.group == b.group) {
            let doubtful: Vec<DVec3> = group.iter().filter(|s| s.disagrees()).map(at).collect();
            for share in group {
                let reach = near(share.point as usize).powi(2);
                if doubtful.iter().any(|d| d.distance_squared(at(share)) <= reach) {
                    more.push(*share);
                } else {
                    add(share, share.own_light());
                }
            }
        }
        let count = self.options.shadow.min(MOST_SHADOW).next_multiple_of(PAIRS);
        self.draw_more(receivers, &mut more, (1, count), &sample, work);
        more.sort_by_key(|s| (s.group, s.point));
        for group in more.chunk_by(|a, b| a.group == b.group) {
            for (share, light) in group.iter().zip(smoothed(group, at, &near)) {
                add(share, light);
            }
        }
    }

    /// What each receiver may get from each group, and what [`FEW`] pairs tell.
    fn shares(
        &self,
        receivers: &[Receiver],
        sample: &impl Fn(usize, DVec2) -> ReceiverPoint,
        work: &mut Workspace,
    ) -> Vec<Share> {
        let mut shares: Vec<Share> = Vec::new();
        let mut segments: Vec<(u32, Pair)> = Vec::new();
        let Some(lead) = receivers.first() else { return shares };
        let few = FEW[0].max(FEW[1].div_ceil(receivers.len()));
        let centre = receivers.iter().map(|r| r.middle.0).sum::<DVec3>() / receivers.len() as f64;
        let away = |r: &Receiver| r.middle.0.distance_squared(centre);
        let farthest = receivers.iter().map(away).fold(0.0, f64::max);
        // One sequence for all: it is spread over what each receiver sees and over all of them.
        let by = Random::new(lead.seed ^ 0x7067).numbers::<5>();
        let mut first = 0;
        for (point, receiver) in receivers.iter().enumerate() {
            let here = |u: DVec2| sample(point, u);
            let is_outer = away(receiver) > OUTER * OUTER * farthest;
            let few = if is_outer { few.max(MORE) } else { few };
            self.each_group(receiver, work, |group, unoccluded, work| {
                let sum = group.sum(&work.sums);
                let number = shares.len() as u32;
                shares.push(Share {
                    point: point as u32,
                    group: group.number as u32,
                    unoccluded,
                    seen: Seen::default(),
                    drawn: 0,
                    blocked: 0,
                });
                for k in 0..few {
                    let i = first + k;
                    let pairs = &self.pairs[0];
                    let at = wrapped(&pairs[i % pairs.len()], [by[0], by[1], by[2], by[3]]);
                    // A sequence of its own that is spread evenly, whatever comes before.
                    let target = (i as f64 * GOLDEN + by[4]).fract() * sum;
                    let mut place = (group.blocks.start, 0.0);
                    let pair = self.pair(group, work, (target, &mut place), at, &here);
                    segments.extend(pair.map(|pair| (number, pair)));
                }
            });
            first += few;
        }
        // Those that go to one group go together.
        segments.sort_by_key(|s| shares[s.0 as usize].group);
        work.packets.clear();
        work.packets.resize(segments.len().div_ceil(LANES), Packet::EMPTY);
        for (i, (_, pair)) in segments.iter().enumerate() {
            let start = self.bvh.local(pair.from);
            let way = self.bvh.local(pair.to) - start;
            work.packets[i / LANES].set(i % LANES, start, way, 1.0, pair.own);
        }
        work.blocked.clear();
        work.blocked.resize(work.packets.len(), 0);
        self.bvh.blocked(&work.packets, &mut work.blocked);
        for (i, (number, pair)) in segments.iter().enumerate() {
            let is_seen = work.blocked[i / LANES] >> (i % LANES) & 1 == 0;
            shares[*number as usize].add(pair.kernel, is_seen);
        }
        shares
    }

    /// Draws more pairs for some shares.
    fn draw_more(
        &self,
        receivers: &[Receiver],
        shares: &mut [Share],
        round: (u64, usize),
        sample: &impl Fn(usize, DVec2) -> ReceiverPoint,
        work: &mut Workspace,
    ) {
        shares.sort_by_key(|s| (s.point, s.group));
        for own in shares.chunk_by_mut(|a, b| a.point == b.point) {
            let point = own[0].point as usize;
            let receiver = &receivers[point];
            let here = |u: DVec2| sample(point, u);
            self.each_group(receiver, work, |group, _, work| {
                let share = own.iter_mut().find(|s| s.group as usize == group.number);
                let Some(share) = share else { return };
                self.draw(receiver.seed, group, round, &here, work);
                for (lane, kernel) in work.kernels.iter().enumerate() {
                    if *kernel != Rgb::ZERO {
                        let is_seen = work.blocked[lane / LANES] >> (lane % LANES) & 1 == 0;
                        share.add(*kernel, is_seen);
                    }
                }
            });
        }
    }
}

/// What arrives at points from a group that each sees in part, and the variance of its luminance.
/// Where neighbours on both sides of a point see as much as it does, but for noise, all are taken
/// together: in pairs that lie opposite each other, so that wide half-shadows keep their slope, and
/// narrow ones their edge.
fn smoothed(
    group: &[Share],
    at: impl Fn(&Share) -> DVec3,
    near: impl Fn(usize) -> f64,
) -> Vec<(Rgb, f64)> {
    /// Fractions that differ by so many standard errors are of different light.
    const ALIKE: f64 = 3.0;
    /// How well two lie opposite each other, as a share of the distance to neighbours.
    const OPPOSITE: f64 = 0.12;
    let seen: Vec<(DVec3, Rgb, f64)> = group
        .iter()
        .map(|s| {
            let fraction = s.seen.fraction();
            let f = luminance(fraction).clamp(0.0, 1.0);
            // None of so many may be one of more.
            let least = 1.0 / f64::from(s.drawn + 2);
            (at(s), fraction, s.variance(f.clamp(least, 1.0 - least)))
        })
        .collect();
    let of = |(i, share): (usize, &Share)| {
        let (here, own, variance) = seen[i];
        let reach = near(share.point as usize);
        let alike = |other: &&(DVec3, Rgb, f64)| {
            let off = luminance(other.1 - own).abs();
            let far = other.0.distance_squared(here);
            far > 0.0 && far < reach * reach && off * off < ALIKE * ALIKE * (variance + other.2)
        };
        let around: Vec<&(DVec3, Rgb, f64)> = seen.iter().filter(alike).collect();
        let (mut sum, mut count) = (own, 1.0);
        for (k, a) in around.iter().enumerate() {
            for b in &around[k + 1..] {
                if (a.0 + b.0 - here * 2.0).length() < 2.0 * OPPOSITE * reach {
                    sum += a.1 + b.1;
                    count += 2.0;
                }
            }
        }
        share.light(sum / count, variance / count)
    };
    group.iter().enumerate().map(of).collect()
}

/// The golden ratio, less 1.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
