//! One shadow ray, for places of which there are many.

use std::f64::consts::PI;

use glam::DVec3;

use super::lanes::weigh;
use super::pairs::{kernel, point_on};
use super::receiver::Receiver;
use super::set::Emitters;
use super::workspace::Workspace;
use crate::engines::sampling::Random;
use crate::scene::Rgb;
use crate::simd::LANES;

impl Emitters<'_> {
    /// A point of the emitters that are analytic for a point (the [`look`](Self::look) before was
    /// at it too), drawn in proportion to what about arrives from each, and the irradiance
    /// (W/m² or lx) that it stands for: on average, where the segment to it is free, that of all.
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
        let to = point_on(s.corners, u, v);
        let (from, normal) = receiver.middle;
        let kernel = kernel(s, from, normal, to);
        let area = f64::from(cut.blocks[block].area[k]) * self.bvh.scale().powi(2);
        let light = s.radiance * (PI * kernel * area * f64::from(sum / weight));
        (kernel > 0.0).then_some((light, to))
    }
}
