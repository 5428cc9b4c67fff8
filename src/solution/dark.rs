//! Which patches stay in the dark under the sky of a stage, as the insides of closed bodies do:
//! they need no rows, which are half of all in a model of two-sided triangles.
//!
//! A few rays from each patch and some bounces among them make a rough solution. To ask whether any
//! light at all comes to a patch would not do: rays pass where faces cross each other, and one in
//! millions passes between two faces.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::patches::{PatchId, Patches, Split, side_index};
use crate::progress::{Cancelled, Progress};
use crate::scene::{Rgb, Scene, Side};
use crate::visibility::{Bvh, DIRECTIONS, NOTHING, seen_from, share_of};

/// Fewer patches than this look in too few directions together.
const FEW: usize = 4_000;

/// What the rays of more patches than this end on takes too much memory.
const MANY: usize = 400_000;

/// Patches that receive less than this share of what is usual stay in the dark. Where no light
/// comes, rounding at silhouettes lets in about a tenth of that.
const DARK: f64 = 1e-3;

/// Bounces after which no light comes farther.
const BOUNCES: usize = 64;

/// A ray ends in the sky.
const SKY: u32 = u32::MAX;

/// A ray ends on what exchanges no light.
const BLACK: u32 = SKY - 1;

/// What a rough solution is found from.
pub(super) struct Rough<'a> {
    pub scene: &'a Scene,
    pub patches: &'a Patches,
    pub rho: &'a [Rgb],
    pub emission: &'a [Rgb],
    /// Irradiance from lamps.
    pub lamps: &'a [Rgb],
}

impl Rough<'_> {
    /// All patches on sides that light comes to; `None` where that is not to be told so.
    pub fn lit(
        &self,
        bvh: &Bvh,
        progress: &dyn Progress,
    ) -> Result<Option<Vec<PatchId>>, Cancelled> {
        let n = self.patches.len();
        // Without a stage the light is the user's own, and a dim room under a bright sky counts.
        let staged = self.scene.geometry.whole_from.is_some();
        if !staged || self.scene.sky.max_element() <= 0.0 || !(FEW..=MANY).contains(&n) {
            return Ok(None);
        }
        let ends: Result<Vec<_>, Cancelled> = (0..n as u32)
            .into_par_iter()
            .map(|i| {
                progress.advance(0)?;
                Ok(self.ends(PatchId(i), bvh))
            })
            .collect();
        let (ends, first) = (ends?, self.first_of_sides());
        let sky = PI * self.scene.sky.max_element();
        let own = |values: &[Rgb], i: usize| values[i].max_element();
        let mut h = vec![0.0; n];
        let mut lit = Vec::new();
        for _ in 0..BOUNCES {
            progress.advance(0)?;
            let glow =
                self.mean_of_sides(&first, |i| own(self.emission, i) + own(self.rho, i) * h[i]);
            let received = |(i, ends): (usize, &[u32; DIRECTIONS])| {
                let from = |(k, &end): (usize, &u32)| match end {
                    SKY => share_of(k) * sky,
                    BLACK => 0.0,
                    side => share_of(k) * glow[side as usize],
                };
                own(self.lamps, i) + ends.iter().enumerate().map(from).sum::<f64>()
            };
            h = ends.par_iter().enumerate().map(received).collect();
            // A mean that a few patches close to a lamp do not rule.
            let usual = (h.iter().map(|h: &f64| h.sqrt()).sum::<f64>() / n as f64).powi(2);
            let lit_side = self.mean_of_sides(&first, |i| own(self.emission, i) + h[i]);
            let is_lit = |id: &PatchId| lit_side[first[id.index()] as usize] > DARK * usual;
            let now: Vec<PatchId> = self.patches.ids().filter(is_lit).collect();
            if now == lit {
                break;
            }
            lit = now;
        }
        Ok(Some(lit))
    }

    /// What rays from a patch end on: the first patch of a side, [`SKY`] or [`BLACK`].
    fn ends(&self, id: PatchId, bvh: &Bvh) -> [u32; DIRECTIONS] {
        let mut ends = [SKY; DIRECTIONS];
        let seen = seen_from(&self.scene.geometry, bvh, self.patches.origin(id));
        for (end, item) in ends.iter_mut().zip(seen).filter(|(_, item)| *item != NOTHING) {
            let side = if item & 1 == 0 { Side::Front } else { Side::Back };
            let split = self.patches.splits()[side_index(bvh.ids()[item as usize / 2], side)];
            *end = match split {
                Split::None => BLACK,
                Split::Uniform { first, .. } | Split::Adaptive { first, .. } => first,
            };
        }
        ends
    }

    /// For each patch the first one of its side.
    fn first_of_sides(&self) -> Vec<u32> {
        let mut firsts: Vec<u32> = (0..self.patches.len() as u32).collect();
        for split in self.patches.splits() {
            let (first, count) = match *split {
                Split::None => continue,
                Split::Uniform { first, level } => (first, 1 << (2 * u32::from(level))),
                Split::Adaptive { first, count, .. } => (first, count),
            };
            firsts[first as usize..(first + count) as usize].fill(first);
        }
        firsts
    }

    /// The mean of a value over the patches of each side, at the first of them.
    fn mean_of_sides(&self, first: &[u32], value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![(0.0, 0_u32); first.len()];
        for (i, &first) in first.iter().enumerate() {
            let (sum, count) = &mut sums[first as usize];
            (*sum, *count) = (*sum + value(i), *count + 1);
        }
        sums.into_iter().map(|(sum, count)| sum / f64::from(count.max(1))).collect()
    }
}
