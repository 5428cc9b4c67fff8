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

/// Most rays a point.
pub const MOST_RAYS: usize = 1 << 20;

/// Fewest rays a point: sixteen of each set.
pub const FEWEST_RAYS: usize = SETS * 16;

/// Independent sets of rays: a lane each of packets.
pub(super) const SETS: usize = LANES;
