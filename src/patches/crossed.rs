//! Patches that contact lines pass through, and the owners of what lies beyond the lines.

use glam::{DVec2, DVec3};

use super::cell::index_in_grid;
use super::contact::Line;
use super::point::PatchId;

/// Splits of a crossed patch into the cells of its table.
pub(super) const TABLE_LEVEL: u8 = 3;

/// The cell of the table is crossed by a line: the point itself decides.
pub(super) const MIXED: u8 = u8::MAX;

/// The owner of each point of a crossed patch's cell.
#[derive(Debug, Clone)]
pub(crate) struct CrossedPatch {
    pub(crate) centre: DVec2,
    pub(super) lines: Vec<Line>,
    /// Neighbours that own what lies beyond the lines, with their centres.
    pub(crate) others: Vec<(PatchId, DVec2)>,
    /// For each cell: 0 the patch itself, k for `others[k - 1]`, or [`MIXED`].
    pub(super) table: [u8; 1 << (2 * TABLE_LEVEL)],
}

/// All crossed patches.
#[derive(Debug, Clone, Default)]
pub(super) struct CrossedPatches {
    /// Whether a side has any.
    pub(super) sides: Vec<bool>,
    /// For each patch of such sides its place in `patches`, or `NONE`; empty if nothing is crossed.
    pub(super) index: Vec<u32>,
    pub(super) patches: Vec<CrossedPatch>,
}

pub(super) const NONE: u32 = u32::MAX;

impl CrossedPatches {
    /// Whether any patch of a side is crossed.
    #[inline(always)]
    pub fn on_side(&self, side: usize) -> bool {
        self.sides[side]
    }

    /// Whether a line passes through a patch.
    #[inline(always)]
    pub fn is_crossed(&self, id: PatchId) -> bool {
        self.index.get(id.index()).is_some_and(|&k| k != NONE)
    }

    /// How a patch is crossed.
    #[cfg(feature = "gpu")]
    pub fn of(&self, id: PatchId) -> Option<&CrossedPatch> {
        let k = self.index.get(id.index()).filter(|&&k| k != NONE)?;
        Some(&self.patches[*k as usize])
    }

    /// The patch that a point in the cell of patch `id` belongs to; `local` are its barycentric
    /// coordinates within the cell, `uv` those on the source triangle.
    #[inline]
    pub fn owner(&self, id: PatchId, local: impl FnOnce() -> DVec3, uv: DVec2) -> PatchId {
        match self.index.get(id.index()) {
            None | Some(&NONE) => id,
            Some(&k) => self.patches[k as usize].owner(id, local(), uv),
        }
    }
}

#[cfg(feature = "gpu")]
impl CrossedPatch {
    /// Both ends of each line that divides the patch, in the coordinates `uv` of its source
    /// triangle.
    pub(crate) fn lines(&self) -> impl ExactSizeIterator<Item = [DVec2; 2]> + '_ {
        self.lines.iter().map(|l| [l.from, l.to])
    }

    /// For each cell of the table the owner of all of it, patch `id` being the crossed one; `None`
    /// where the point itself decides.
    pub(crate) fn table(&self, id: PatchId) -> impl Iterator<Item = Option<PatchId>> + '_ {
        self.table.iter().map(move |&code| match code {
            0 => Some(id),
            MIXED => None,
            k => Some(self.others[usize::from(k) - 1].0),
        })
    }
}

impl CrossedPatch {
    fn owner(&self, id: PatchId, local: DVec3, uv: DVec2) -> PatchId {
        match self.table[index_in_grid(TABLE_LEVEL, local) as usize] {
            0 => id,
            MIXED if self.sees(uv, self.centre) => id,
            MIXED => self.others.iter().find(|o| self.sees(uv, o.1)).map_or(id, |o| o.0),
            k => self.others[k as usize - 1].0,
        }
    }

    pub(super) fn sees(&self, a: DVec2, b: DVec2) -> bool {
        !self.lines.iter().any(|l| l.separates(a, b))
    }
}
