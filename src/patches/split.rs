//! How often sides of source triangles are split, and how large patches become by it.

use thiserror::Error;

use crate::progress::Cancelled;
use crate::scene::{Geometry, Side, TriangleId};

/// Why a scene cannot be split as asked.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PatchesError {
    /// The largest area is zero, negative or not a number.
    #[error("the patch size must be a positive area in m²")]
    BadArea,
    /// More patches than ids, or a single triangle split too finely.
    #[error("the patch size is too small for this scene: {count} patches (at most {MAX_PATCHES})")]
    TooMany {
        /// How many patches it would take (at least).
        count: u64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// More patches than this are refused: ids must leave room for marks in an item buffer.
pub const MAX_PATCHES: u64 = 1 << 30;

/// A side of a source triangle is split at most this often (grid coordinates fit 16 bits).
pub const MAX_LEVEL: u8 = 14;

/// What one side of a source triangle is cut into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// It has no patch: a back that does not reflect, or a triangle that takes no part.
    None,
    /// A uniform grid of `4^level` patches that begins at `first`; all members of a cluster have
    /// the same `first` and level 0.
    Uniform {
        /// Id of the first patch.
        first: u32,
        /// Number of splits.
        level: u8,
    },
    /// Cells of several levels with consecutive ids.
    Adaptive {
        /// Id of the first patch.
        first: u32,
        /// Number of patches.
        count: u32,
        /// Number of splits of the finest grid that they are made of.
        level: u8,
    },
}

impl Split {
    /// Number of splits of the finest patches; `None` without patches.
    #[must_use]
    pub fn level(self) -> Option<u8> {
        match self {
            Self::None => None,
            Self::Uniform { level, .. } | Self::Adaptive { level, .. } => Some(level),
        }
    }
}

/// Number of 1-to-4 splits after which `area` is at most `max_area`.
#[must_use]
pub(crate) fn level_for(area: f64, max_area: f64) -> u8 {
    let mut level = 0;
    let mut a = area;
    while a > max_area && level < 60 {
        a *= 0.25;
        level += 1;
    }
    level
}

/// Area of each side that exchanges light and may be split or joined, m².
pub(super) fn exchanging_areas(geometry: &Geometry) -> impl Iterator<Item = f64> + '_ {
    let free = |&t: &TriangleId| geometry.is_solid(t) && !geometry.is_whole(t);
    geometry.ids().filter(free).flat_map(move |t| {
        let area = geometry.area(t);
        Side::BOTH.into_iter().filter(move |&s| geometry.exchanges(t, s)).map(move |_| area)
    })
}

/// How often the sides of each triangle are split until no area exceeds `max_area` (m²), and how
/// many patches that makes.
pub(super) fn uniform_levels(
    geometry: &Geometry,
    max_area: f64,
) -> Result<(Vec<u8>, u64), PatchesError> {
    if max_area.is_nan() || max_area <= 0.0 {
        return Err(PatchesError::BadArea);
    }
    let mut count = 0_u64;
    let mut levels = Vec::with_capacity(geometry.len());
    for t in geometry.ids() {
        let split = geometry.is_solid(t) && !geometry.is_whole(t);
        let level = if split { level_for(geometry.area(t), max_area) } else { 0 };
        let sides = Side::BOTH.iter().filter(|&&s| geometry.exchanges(t, s)).count() as u64;
        count = count.saturating_add(sides << (2 * u32::from(level.min(28))));
        if level > MAX_LEVEL || count > MAX_PATCHES {
            return Err(PatchesError::TooMany { count });
        }
        levels.push(level);
    }
    Ok((levels, count))
}
