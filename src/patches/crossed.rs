//! Patches that contact lines pass through, and the owners of what lies beyond the lines.

use glam::{DVec2, DVec3};

use super::cell::index_in_grid;
use super::line::Line;
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
    /// For each cell that is mixed, in order, where its ways begin; then where the last end.
    pub(super) starts: Vec<u32>,
    /// The ways from each mixed cell, in the order in which they are tried.
    pub(super) ways: Vec<Way>,
    /// For each way the lines that may cross it.
    pub(super) crossing: Vec<u8>,
}

/// The ways from a cell of the table to one that may own its points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// 0 the patch itself, k for `others[k - 1]`.
    pub owner: u8,
    /// Where the lines end that may cross it.
    pub to: u32,
}

/// All crossed patches.
#[derive(Debug, Clone, Default)]
pub(super) struct CrossedPatches {
    /// What lines do to the patches of each side.
    pub(super) sides: Vec<Crossed>,
    /// For each patch its place in `patches`, [`NONE`] or [`WHOLE`]; empty if nothing is crossed.
    pub(super) index: Vec<u32>,
    pub(super) patches: Vec<CrossedPatch>,
}

/// What contact lines do to a side.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Crossed {
    /// A line passes through a patch.
    pub entered: bool,
    /// Points of a patch belong to others.
    pub parted: bool,
}

/// No line passes through.
pub(super) const NONE: u32 = u32::MAX;

/// A line passes through, but all points are the patch's own.
pub(super) const WHOLE: u32 = NONE - 1;

impl CrossedPatches {
    /// Whether points of any patch of a side belong to others.
    #[inline(always)]
    pub fn on_side(&self, side: usize) -> bool {
        self.sides[side].parted
    }

    /// Whether points of a patch belong to others.
    #[inline(always)]
    pub fn is_crossed(&self, id: PatchId) -> bool {
        self.index.get(id.index()).is_some_and(|&k| k < WHOLE)
    }

    /// Whether a line passes through a patch of a side.
    pub fn enters_side(&self, side: usize) -> bool {
        self.sides[side].entered
    }

    /// Whether a line passes through a patch.
    pub fn enters(&self, id: PatchId) -> bool {
        self.index.get(id.index()).is_some_and(|&k| k != NONE)
    }

    /// How a patch is crossed.
    #[cfg(feature = "gpu")]
    pub fn of(&self, id: PatchId) -> Option<&CrossedPatch> {
        let k = self.index.get(id.index()).filter(|&&k| k < WHOLE)?;
        Some(&self.patches[*k as usize])
    }

    /// The patch that a point in the cell of patch `id` belongs to; `local` are its barycentric
    /// coordinates within the cell, `uv` those on the source triangle.
    #[inline]
    pub fn owner(&self, id: PatchId, local: impl FnOnce() -> DVec3, uv: DVec2) -> PatchId {
        match self.index.get(id.index()) {
            None | Some(&(NONE | WHOLE)) => id,
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
        let cell = index_in_grid(TABLE_LEVEL, local) as usize;
        match self.table[cell] {
            0 => id,
            MIXED => self.first_seen(cell, uv).map_or(id, |k| self.others[k].0),
            k => self.others[k as usize - 1].0,
        }
    }

    /// Which of the others a point in a mixed cell belongs to.
    fn first_seen(&self, cell: usize, uv: DVec2) -> Option<usize> {
        let mixed = self.table[..cell].iter().filter(|&&code| code == MIXED).count();
        let [from, to] = [self.starts[mixed], self.starts[mixed + 1]].map(|k| k as usize);
        let mut lines = from.checked_sub(1).map_or(0, |k| self.ways[k].to as usize);
        for way in &self.ways[from..to] {
            let other = usize::from(way.owner).checked_sub(1);
            let target = other.map_or(self.centre, |k| self.others[k].1);
            let crossing = &self.crossing[lines..way.to as usize];
            lines = way.to as usize;
            if !crossing.iter().any(|&l| self.lines[usize::from(l)].separates(uv, target)) {
                return other;
            }
        }
        None
    }

    pub(super) fn sees(&self, a: DVec2, b: DVec2) -> bool {
        !self.lines.iter().any(|l| l.separates(a, b))
    }
}
