//! One shadow ray, for places of which there are many.

use std::f64::consts::PI;

use glam::DVec3;

use super::lanes::weigh;
use super::pairs::{kernel, point_on};
use super::receiver::Receiver;
use super::set::Emitters;
use super::workspace::Workspace;
use crate::engines::sampling::Random;
use crate::form_factors::kernel::point_to_polygon;
use crate::scene::Rgb;
use crate::simd::LANES;

impl Emitters<'_> {
    /// A point of the emitters that are analytic for a point (the [`look`](Self::look) before was
    /// at it too), drawn in proportion to what about arrives from each, and the irradiance
    /// (W/m² or lx) that it stands for: on average, where the segment to it is free, that of all.
    /// Of an emitter near by that is hidden in part, points count by area and not by what they
    /// send.
    pub(crate) fn one(
        &self,
        receiver: &Receiver,
        random: &mut Random,
        work: &mut Workspace,
    ) -> Option<(Rgb, DVec3)> {
        let cut = &work.cut;
        let blocks = cut.blocks.len();
        if blocks == 0 {
            return None;
        }
        work.weights.resize(blocks, [0.0; LANES]);
        work.sums.resize(blocks, 0.0);
        weigh(&cut.blocks, receiver, &mut work.weights, &mut work.sums);
        let sum: f32 = work.sums.iter().sum();
        let [x, u, v] = random.numbers();
        let mut rest = (x * f64::from(sum)) as f32;
        let mut block = 0;
        while block + 1 < blocks && work.sums[block] <= rest {
            rest -= work.sums[block];
            block += 1;
        }
        let mut k = 0;
        while k + 1 < LANES && work.weights[block][k] <= rest {
            rest -= work.weights[block][k];
            k += 1;
        }
        let weight = work.weights[block][k];
        if weight <= 0.0 {
            return None;
        }
        let (first, end) = cut.sources[block][k];
        let s = &self.sources[if end - first == 1 {
            first as usize
        } else {
            self.tree.at_fraction((first, end), f64::from(rest / weight).clamp(0.0, 1.0))
        }];
        let (from, normal) = receiver.middle;
        let chosen = f64::from(sum / weight);
        if end - first == 1 && cut.blocks[block].is_near(k, receiver.centre) {
            // A point of it may be next to the receiver: its light is exact, and only whether it
            // is seen is drawn.
            let faces = s.normal.dot(from - s.corners[0]) > 0.0;
            let light = s.radiance * (PI * point_to_polygon(from, normal, &s.corners) * chosen);
            let mut tried = [[u, v], random.numbers(), random.numbers()]
                .map(|[u, v]| point_on(s.corners, u, v))
                .into_iter();
            let to = tried.find(|to| kernel(s, from, normal, *to) > 0.0);
            return to.filter(|_| faces).map(|to| (light, to));
        }
        let to = point_on(s.corners, u, v);
        let kernel = kernel(s, from, normal, to);
        let area = f64::from(cut.blocks[block].area[k]) * self.bvh.scale().powi(2);
        let light = s.radiance * (PI * kernel * area * chosen);
        (kernel > 0.0).then_some((light, to))
    }
}
