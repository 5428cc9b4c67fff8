//! Buffers that finding direct light needs.

use super::cut::Cut;
use crate::scene::Rgb;
use crate::simd::LANES;
use crate::visibility::Packet;

/// Buffers for the work on one receiver, reused for the next.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) cut: Cut,
    /// About what each entry of the cut may send at most.
    pub(super) weights: Vec<[f32; LANES]>,
    /// Sum of the weights of each block.
    pub(super) sums: Vec<f32>,
    pub(super) packets: Vec<Packet>,
    /// Kernels of pairs, times what the emitter sends.
    pub(super) kernels: Vec<Rgb>,
    /// A bit for each lane of each packet.
    pub(super) blocked: Vec<u16>,
}
