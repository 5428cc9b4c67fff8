//! What a bake may be asked for.

use crate::units::DEFAULT_MEMORY;

/// Texels of an atlas, about, unless a size is given.
pub(super) const USUAL_TEXELS: f64 = 262_144.0;

/// What a bake may be asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BakeOptions {
    /// Width of a texel on surfaces, m. Default: one that gives about 260,000 texels in all.
    pub texel: Option<f64>,
    /// Bytes that the atlas may take, while it is lit and written. Default: 4 GiB.
    pub memory: u64,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { texel: None, memory: DEFAULT_MEMORY }
    }
}
