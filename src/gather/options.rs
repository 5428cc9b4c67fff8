//! How points are measured.

use crate::simd::LANES;

/// How points are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GatherOptions {
    /// Rays a point, 256 to [`MOST_RAYS`], rounded up to a power of two. Default 4,096.
    pub samples: usize,
    /// Shadow rays from a point to a group of emitters that it sees in part, an eighth of them
    /// to one that is seen as a whole or not at all; 128 to 32,768. Default 4,096.
    pub shadow: usize,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { samples: 4096, shadow: 4096, seed: 0 }
    }
}

impl GatherOptions {
    /// For pictures: many points, each of a few rays, which share what they find; 16 shadow rays
    /// from each to each group of emitters, 128 more where they differ.
    #[must_use]
    pub fn of_pictures(seed: u32) -> Self {
        Self { samples: FEWEST_RAYS, shadow: 128 * SETS / 2, seed }
    }
}

/// Most rays a point.
pub const MOST_RAYS: usize = 1 << 20;

/// Fewest rays a point: sixteen of each set.
pub const FEWEST_RAYS: usize = SETS * 16;

/// Independent sets of rays: a lane each of packets.
pub(super) const SETS: usize = LANES;
