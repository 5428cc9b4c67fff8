//! How points are measured.

use crate::direct::MOST_SHADOW;
use crate::simd::LANES;

/// How points are measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherOptions {
    /// Rays a point, 256 to [`MOST_RAYS`], rounded up to a power of two. Default 4,096.
    pub samples: usize,
    /// Shadow rays from a point to a group of emitters that it sees in part, an eighth of them
    /// to one that is seen as a whole or not at all; 128 to 32,768. Default 4,096.
    pub shadow: usize,
    /// Hits nearer than this many radii of the patch that a ray meets are gathered once more, some
    /// of those up to twice as far. Default 4.
    pub near: f64,
    /// Whether many points of few rays are wanted: then patches that nothing stands on or leans
    /// over, and whose light is smooth, are not gathered once more. Default: no.
    pub of_pictures: bool,
    /// Half-width of 95 % intervals that is aimed at, as a share of irradiance: more rays go where
    /// it is not reached. Default: none.
    pub error: Option<f64>,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { samples: 4096, shadow: 4096, near: 4.0, of_pictures: false, error: None, seed: 0 }
    }
}

impl GatherOptions {
    /// The noise of pictures that they ask for.
    pub(super) fn noise(&self) -> f64 {
        /// Of an interval's half-width this is left to noise: the rest is for shadows and for the
        /// solution.
        const SHARE: f64 = 0.35;
        /// Larger errors than this allow for more noise than there is unless one is asked for, and
        /// so many times more at most.
        const ROUGH: f64 = 0.1;
        const ROUGHEST: f64 = 4.0;
        let Some(error) = self.error else { return NOISE };
        (SHARE * error).min(NOISE * (error / ROUGH).clamp(1.0, ROUGHEST))
    }

    /// Shadow rays, of each pair of sets, that they ask for.
    pub(super) fn shadow(&self) -> usize {
        let shadow = self.shadow.div_ceil(SETS / 2);
        let more = if self.of_pictures { (NOISE / self.noise()).powi(2) } else { 1.0 };
        ((shadow as f64 * more) as usize).min(MOST_SHADOW)
    }

    /// For pictures: many points, each of a few rays, which share what they find; 16 shadow rays
    /// from each to each group of emitters, 128 more where they differ.
    #[must_use]
    pub fn of_pictures(seed: u32) -> Self {
        let shadow = SHADOW * SETS / 2;
        Self { samples: FEWEST_RAYS, shadow, near: 1.0, of_pictures: true, error: None, seed }
    }
}

/// Shadow rays from a point of a picture to a group of emitters that it sees in part.
const SHADOW: usize = 128;

/// Noise of reflected light in pictures, a standard error as a share of all light, unless an error
/// is asked for.
pub(crate) const NOISE: f64 = 0.015;

/// Most rays a point.
pub const MOST_RAYS: usize = 1 << 20;

/// Fewest rays a point: sixteen of each set.
pub const FEWEST_RAYS: usize = SETS * 16;

/// Independent sets of rays: a lane each of packets.
pub(super) const SETS: usize = LANES;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_rough_error_takes_fewer_rays_than_none() {
        let of = |error| GatherOptions { error, ..GatherOptions::of_pictures(0) };
        let usual = of(None);
        for (error, noise) in [(0.01, 0.0035), (0.05, NOISE), (0.1, NOISE), (0.2, 2.0 * NOISE)] {
            assert!((of(Some(error)).noise() - noise).abs() < 1e-12, "{error}");
        }
        assert_eq!(of(Some(3.0)).noise(), 4.0 * NOISE);
        assert!(of(Some(0.4)).shadow() < usual.shadow());
        assert!(of(Some(0.01)).shadow() > usual.shadow());
    }
}
