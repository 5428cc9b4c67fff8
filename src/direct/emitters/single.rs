//! One shadow ray an emitter group, for places of which there are many.

use glam::DVec3;

use super::pairs::{kernel, point_on};
use super::receiver::Receiver;
use super::set::Emitters;
use super::workspace::Workspace;
use crate::engines::sampling::Random;
use crate::scene::Rgb;
use crate::simd::LANES;

impl Emitters<'_> {
    /// Calls `found` for each group of emitters that would light a point (the
    /// [`look`](Self::look) before was at it too): its unoccluded irradiance, W/m² or lx, and a
    /// point of it, drawn in proportion to what arrives. The irradiance counts if the segment to
    /// that point is free; so it does on average.
    pub(crate) fn one_each(
        &self,
        receiver: &Receiver,
        random: &mut Random,
        work: &mut Workspace,
        mut found: impl FnMut(Rgb, DVec3),
    ) {
        /// Emitters may lie partly below the horizon: so many points of them are tried.
        const TRIES: usize = 4;
        let (from, normal) = receiver.middle;
        self.each_group(receiver, work, |group, unoccluded, work| {
            let sum: f32 = work.sums[group.blocks.clone()].iter().sum();
            for _ in 0..TRIES {
                let [x, u, v] = random.numbers();
                let mut rest = (x * f64::from(sum)) as f32;
                let mut block = group.blocks.start;
                while block + 1 < group.blocks.end && work.sums[block] <= rest {
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
                    continue;
                }
                let (first, end) = group.cut.sources[block][k];
                let s = &self.sources[if end - first == 1 {
                    first as usize
                } else {
                    self.tree.at_fraction((first, end), f64::from(rest / weight).clamp(0.0, 1.0))
                }];
                let to = point_on(s.corners, u, v);
                if kernel(s, from, normal, to) > 0.0 {
                    found(unoccluded, to);
                    break;
                }
            }
        });
    }
}
