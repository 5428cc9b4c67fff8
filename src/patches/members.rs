//! The source triangles of patches that are clusters.

use super::point::PatchId;
use crate::scene::TriangleId;

/// The members of clusters.
#[derive(Debug, Clone, Default)]
pub(super) struct Members {
    /// First member of each patch, and their number; empty if no patch is a cluster.
    pub starts: Vec<u32>,
    /// Source triangles, ascending within a patch.
    pub triangles: Vec<TriangleId>,
    /// Fraction of the patch's area up to and including each member, 0..1.
    pub cumulative: Vec<f64>,
}

impl Members {
    /// The range of a patch's members; empty unless it is a cluster.
    pub fn of(&self, patch: PatchId) -> std::ops::Range<usize> {
        match self.starts.get(patch.index()..patch.index() + 2) {
            Some(&[from, to]) => from as usize..to as usize,
            _ => 0..0,
        }
    }

    /// The member at a fraction of the patch's area, and the fraction of the member's own area
    /// before that place; both 0..1. `None` unless the patch is a cluster.
    pub fn at_fraction(&self, patch: PatchId, fraction: f64) -> Option<(TriangleId, f64)> {
        let range = self.of(patch);
        let sums = &self.cumulative[range.clone()];
        let k = sums.partition_point(|&s| s <= fraction).min(sums.len().checked_sub(1)?);
        let from = if k == 0 { 0.0 } else { sums[k - 1] };
        let within = ((fraction - from) / (sums[k] - from)).clamp(0.0, 1.0);
        Some((self.triangles[range.start + k], within))
    }
}
