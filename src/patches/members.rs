//! The source triangles of patches that are clusters.

use crate::scene::TriangleId;

/// The members of clusters.
#[derive(Debug, Clone, Default)]
pub(super) struct Members {
    /// First member of each patch, and their number; empty if no patch is a cluster.
    pub starts: Vec<u32>,
    /// Source triangles, ascending within a patch.
    pub triangles: Vec<TriangleId>,
    /// Share of the patch's area up to and including each member, 0..1.
    pub shares: Vec<f64>,
}

impl Members {
    /// The range of a patch's members; empty unless it is a cluster.
    pub fn of(&self, patch: usize) -> std::ops::Range<usize> {
        match self.starts.get(patch..patch + 2) {
            Some(&[from, to]) => from as usize..to as usize,
            _ => 0..0,
        }
    }

    /// The member at a share of the area, and the share of it, 0..1, that lies before.
    pub fn at_share(&self, patch: usize, share: f64) -> Option<(TriangleId, f64)> {
        let range = self.of(patch);
        let shares = &self.shares[range.clone()];
        let k = shares.partition_point(|&s| s <= share).min(shares.len().checked_sub(1)?);
        let from = if k == 0 { 0.0 } else { shares[k - 1] };
        let within = ((share - from) / (shares[k] - from)).clamp(0.0, 1.0);
        Some((self.triangles[range.start + k], within))
    }
}
