//! Patches that contact lines pass through, and whom their other parts belong to.

use glam::{DVec2, DVec3};

use super::cell::index_in_grid;
use super::contact::{ContactLines, Line};
use super::{PatchId, Patches, Split};

/// Splits of a cut patch into the cells of its table.
const TABLE_LEVEL: u8 = 3;

/// The cell of the table is crossed by a line: the point itself decides.
const MIXED: u8 = u8::MAX;

/// Centres within so many strips are near enough to stand for a part of a cut patch.
const NEAR: f64 = 2.5;

/// What a cut patch's points belong to.
#[derive(Debug, Clone)]
pub(crate) struct CutPatch {
    pub(crate) centre: DVec2,
    lines: Vec<Line>,
    /// Neighbours that parts belong to, with their centres.
    pub(crate) others: Vec<(PatchId, DVec2)>,
    /// For each cell: 0 the patch itself, k for `others[k - 1]`, or [`MIXED`].
    table: [u8; 1 << (2 * TABLE_LEVEL)],
}

/// All cut patches.
#[derive(Debug, Clone, Default)]
pub(super) struct Cuts {
    /// Whether a side has any.
    sides: Vec<bool>,
    /// For each patch of such sides its place in `cut`, or `NONE`; empty if nothing is cut.
    index: Vec<u32>,
    cut: Vec<CutPatch>,
}

const NONE: u32 = u32::MAX;

impl Cuts {
    pub fn find(patches: &Patches, lines: &ContactLines) -> Self {
        let mut me = Self { sides: vec![false; patches.splits().len()], ..Self::default() };
        for (side, split) in patches.splits().iter().enumerate() {
            let lines = lines.of(side);
            let Split::Uniform { first, level } = *split else { continue };
            if lines.is_empty() {
                continue;
            }
            for id in (first..first + (1 << (2 * u32::from(level)))).map(PatchId) {
                let Some(cut) = cut_patch(patches, id, first, level, lines) else { continue };
                if me.index.is_empty() {
                    me.index = vec![NONE; patches.len()];
                }
                me.sides[side] = true;
                me.index[id.index()] = me.cut.len() as u32;
                me.cut.push(cut);
            }
        }
        me
    }

    /// Whether any patch of a side is cut.
    #[inline(always)]
    pub fn on_side(&self, side: usize) -> bool {
        self.sides[side]
    }

    /// Whether a line passes through a patch.
    #[inline(always)]
    pub fn is_cut(&self, id: PatchId) -> bool {
        self.index.get(id.index()).is_some_and(|&k| k != NONE)
    }

    /// How a patch is cut.
    #[cfg(feature = "gpu")]
    pub fn of(&self, id: PatchId) -> Option<&CutPatch> {
        let k = self.index.get(id.index()).filter(|&&k| k != NONE)?;
        Some(&self.cut[*k as usize])
    }

    /// The patch that a point in the cell of patch `id` belongs to; `local` are its barycentric
    /// coordinates within the cell, `uv` those on the source triangle.
    #[inline]
    pub fn owner(&self, id: PatchId, local: impl FnOnce() -> DVec3, uv: DVec2) -> PatchId {
        match self.index.get(id.index()) {
            None | Some(&NONE) => id,
            Some(&k) => self.cut[k as usize].owner(id, local(), uv),
        }
    }
}

#[cfg(feature = "gpu")]
impl CutPatch {
    /// Both ends of each line that parts the patch, in the coordinates `uv` of its source triangle.
    pub(crate) fn lines(&self) -> impl ExactSizeIterator<Item = [DVec2; 2]> + '_ {
        self.lines.iter().map(|l| [l.from, l.to])
    }

    /// For each cell of the table the owner of all of it, patch `id` being the one that is cut; `None`
    /// where the point itself decides.
    pub(crate) fn table(&self, id: PatchId) -> impl Iterator<Item = Option<PatchId>> + '_ {
        self.table.iter().map(move |&code| match code {
            0 => Some(id),
            MIXED => None,
            k => Some(self.others[usize::from(k) - 1].0),
        })
    }
}

impl CutPatch {
    fn owner(&self, id: PatchId, local: DVec3, uv: DVec2) -> PatchId {
        match self.table[index_in_grid(TABLE_LEVEL, local) as usize] {
            0 => id,
            MIXED if self.sees(uv, self.centre) => id,
            MIXED => self.others.iter().find(|o| self.sees(uv, o.1)).map_or(id, |o| o.0),
            k => self.others[k as usize - 1].0,
        }
    }

    /// What the table says of a point: 0 if it sees the centre, or else the nearest of `candidates`
    /// that it sees, which joins the others.
    fn code_at(&mut self, at: DVec2, candidates: &[(PatchId, DVec2)]) -> u8 {
        if self.sees(at, self.centre) {
            return 0;
        }
        let seen = candidates
            .iter()
            .filter(|o| self.sees(at, o.1))
            .min_by(|a, b| a.1.distance_squared(at).total_cmp(&b.1.distance_squared(at)));
        let Some(&other) = seen else { return 0 };
        let k = self.others.iter().position(|o| o.0 == other.0).unwrap_or_else(|| {
            self.others.push(other);
            self.others.len() - 1
        });
        (k + 1).min(usize::from(MIXED - 1)) as u8
    }

    fn sees(&self, a: DVec2, b: DVec2) -> bool {
        !self.lines.iter().any(|l| l.parts(a, b))
    }
}

/// `None` if no line passes through the patch.
fn cut_patch(
    patches: &Patches,
    id: PatchId,
    first: u32,
    level: u8,
    lines: &[Line],
) -> Option<CutPatch> {
    let cell = patches.cell(id);
    let strip = 1.0 / f64::from(cell.strips());
    let centre = patches.origin(id).uv;
    let corners = cell.barycentric().map(|l| DVec2::new(l.y, l.z));
    let middle = patches.center(id).uv;
    let near = |reach: f64| move |l: &&Line| l.near(middle, reach * strip);
    if !lines.iter().filter(near(1.0)).any(|l| l.enters(corners)) {
        return None;
    }
    // A way to a neighbour's centre may cross lines beyond the patch itself.
    let lines: Vec<Line> = lines.iter().filter(near(NEAR + 1.0)).copied().collect();
    let mut me = CutPatch { centre, lines, others: Vec::new(), table: [0; 64] };
    let mut candidates = neighbours(patches, id, first, level);
    candidates.retain(|o| (o.1 - centre).abs().max_element() <= NEAR * strip);
    candidates.sort_by(|a, b| {
        a.1.distance_squared(centre).total_cmp(&b.1.distance_squared(centre)).then(a.0.cmp(&b.0))
    });
    for (k, part) in super::Cell::grid(cell.triangle, cell.side, TABLE_LEVEL).enumerate() {
        let [a, b, c] = part.barycentric();
        let on_source = |local: DVec3| cell.point(local).uv;
        let at = on_source((a + b + c) / 3.0);
        let outline = [on_source(a), on_source(b), on_source(c)];
        me.table[k] = if me.lines.iter().any(|l| l.enters(outline)) {
            // A line has a corner on each of its sides, however thin the part is that it cuts off.
            for corner in outline {
                me.code_at(corner, &candidates);
            }
            MIXED
        } else {
            me.code_at(at, &candidates)
        };
    }
    Some(me)
}

/// The patches of the same side within a few strips, with their centres.
fn neighbours(patches: &Patches, id: PatchId, first: u32, level: u8) -> Vec<(PatchId, DVec2)> {
    let [i, j, _] = patches.cell(id).strip();
    let n = 1_u32 << level;
    let around = |i: u32| i.saturating_sub(3)..(i + 4).min(n);
    let mut found = Vec::new();
    for i in around(i) {
        for j in around(j).filter(|j| i + j < n) {
            let upright = first + i * (2 * n - i) + 2 * j;
            let both = [upright, upright + 1];
            for k in both.into_iter().take(if i + j + 1 < n { 2 } else { 1 }).map(PatchId) {
                if k != id {
                    found.push((k, patches.origin(k).uv));
                }
            }
        }
    }
    found
}
