//! Direct irradiance of receivers: unoccluded, times the visible fraction.

use std::f64::consts::PI;

use glam::DVec2;

use super::cut::Group;
use super::lanes::{add_far, weigh};
use super::pairs::{PAIRS, Seen, point_on};
use super::receiver::{Receiver, ReceiverPoint};
use super::set::Emitters;
use super::workspace::Workspace;
use crate::direct::{Analytic, DirectLight, MOST_SHADOW};
use crate::form_factors::kernel::point_to_polygon;
use crate::patches::{PatchId, Patches};
use crate::scene::{Rgb, luminance};
use crate::simd::LANES;

impl Emitters<'_> {
    /// Direct irradiance from the emitters that are analytic for a receiver, after a
    /// [`look`](Self::look).
    /// `sample` gives a point of it from one in the unit square.
    pub fn light(
        &self,
        receiver: &Receiver,
        sample: impl Fn(DVec2) -> ReceiverPoint,
        work: &mut Workspace,
    ) -> DirectLight {
        let mut total = DirectLight::default();
        self.each_group(receiver, work, |group, unoccluded, work| {
            let mut seen = [[Seen::default(); 2]];
            let most = self.worth(unoccluded);
            self.visible(receiver, group, &sample, work, (PAIRS, most), &mut seen);
            let [[a, b]] = seen;
            total.irradiance += unoccluded * a.and(b).fraction();
            for (half, seen) in total.halves.iter_mut().zip([a, b]) {
                *half += unoccluded * seen.fraction();
            }
        });
        total
    }

    /// The same as 2 `N` independent sequences of shadow rays give it, each pair of at most
    /// `shadow`: by all of them together, and by each alone.
    pub fn light_replicated<const N: usize>(
        &self,
        receiver: &Receiver,
        sample: impl Fn(DVec2) -> ReceiverPoint,
        shadow: usize,
        work: &mut Workspace,
    ) -> (Rgb, [[Rgb; 2]; N]) {
        let mut total = (Rgb::ZERO, [[Rgb::ZERO; 2]; N]);
        /// The first look takes one in this many shadow rays: what it misses is an unknown error.
        const LOOK: usize = 8;
        let look = (shadow / LOOK).clamp(PAIRS, MOST_SHADOW);
        self.each_group(receiver, work, |group, unoccluded, work| {
            let mut seen = [[Seen::default(); 2]; N];
            let more = shadow.min(MOST_SHADOW);
            self.visible(receiver, group, &sample, work, (look, more), &mut seen);
            let all = seen.iter().flatten().fold(Seen::default(), |all, s| all.and(*s));
            total.0 += unoccluded * all.fraction();
            for (one, seen) in total.1.iter_mut().flatten().zip(seen.iter().flatten()) {
                *one += unoccluded * seen.fraction();
            }
        });
        total
    }

    /// Calls `found` for each group that would light the receiver if nothing stood between, with
    /// the unoccluded irradiance.
    pub(super) fn each_group(
        &self,
        receiver: &Receiver,
        work: &mut Workspace,
        mut found: impl FnMut(&Group<'_>, Rgb, &mut Workspace),
    ) {
        if self.is_empty() || self.options.analytic == Analytic::None {
            return;
        }
        let cut = std::mem::take(&mut work.cut);
        work.weights.resize(cut.blocks.len(), [0.0; LANES]);
        work.sums.resize(cut.blocks.len(), 0.0);
        weigh(&cut.blocks, receiver, &mut work.weights, &mut work.sums);
        for (number, blocks) in &cut.groups {
            if work.sums[blocks.clone()].iter().all(|sum| *sum <= 0.0) {
                continue;
            }
            let group = Group { number: *number, blocks: blocks.clone(), cut: &cut };
            let unoccluded = self.unoccluded(receiver, &group, &work.weights);
            if unoccluded != Rgb::ZERO {
                found(&group, unoccluded, work);
            }
        }
        work.cut = cut;
    }

    /// Shadow rays for a group that would send so much: noise in bright places weighs most.
    fn worth(&self, unoccluded: Rgb) -> usize {
        let relative = luminance(unoccluded) / self.typical.max(f64::MIN_POSITIVE);
        let wanted = self.options.shadow as f64 * relative;
        (wanted as usize).clamp(PAIRS, MOST_SHADOW)
    }

    /// The same as [`light`](Self::light) for a patch.
    pub fn light_patch(
        &self,
        receiver: &Receiver,
        patches: &Patches,
        id: PatchId,
        work: &mut Workspace,
    ) -> DirectLight {
        let g = self.geometry;
        if patches.is_cluster(id) || patches.is_fragmented(id) {
            let sample = |u| {
                let p = patches.sample_own(id, u);
                (p.position(g), g.normal(p.triangle, p.side), self.bvh.solid(p.triangle))
            };
            return self.light(receiver, sample, work);
        }
        let cell = patches.cell(id);
        let corners = cell.corners(g);
        let (normal, own) = (g.normal(cell.triangle, cell.side), self.bvh.solid(cell.triangle));
        self.light(receiver, |u| (point_on(corners, u.x, u.y), normal, own), work)
    }

    /// Mean irradiance over the receiver from a group, as if nothing stood between.
    fn unoccluded(
        &self,
        receiver: &Receiver,
        Group { number, blocks, cut }: &Group<'_>,
        weights: &[[f32; LANES]],
    ) -> Rgb {
        /// Radii of a receiver beyond which its centre stands for all of it.
        const FAR: f64 = 24.0;
        let (centre, reach) = self.reaches[*number];
        let away = (centre - receiver.middle.0).length() - reach;
        let radius = f64::from(receiver.radius) * self.bvh.scale();
        let middle = [receiver.middle];
        let points = if away > FAR * radius { &middle } else { receiver.points() };
        let mut sum = Rgb::ZERO;
        for (at, normal) in points {
            let (mut far, mut some_near) = ([0.0; 3], false);
            let (local, up) = (self.bvh.local(*at), normal.as_vec3());
            let (entries, weights) = (&cut.blocks[blocks.clone()], &weights[blocks.clone()]);
            add_far(entries, weights, local, up, &mut far, &mut some_near);
            sum += Rgb::from_array(far.map(f64::from));
            if !some_near {
                continue;
            }
            // Only single sources are near.
            let lanes = (0..entries.len()).flat_map(|b| (0..LANES).map(move |l| (b, l)));
            for (b, l) in lanes.filter(|&(b, l)| weights[b][l] > 0.0) {
                let s = &self.sources[cut.sources[blocks.start + b][l].0 as usize];
                if entries[b].is_near(l, local) && s.normal.dot(*at - s.corners[0]) > 0.0 {
                    sum += s.radiance * (PI * point_to_polygon(*at, *normal, &s.corners));
                }
            }
        }
        sum / points.len() as f64
    }
}
