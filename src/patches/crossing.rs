//! Finds the patches that contact lines pass through, and the owners of what lies beyond.

use glam::{DVec2, DVec3};

use super::cell::Cell;
use super::contact::{ContactLines, Line};
use super::crossed::{CrossedPatch, CrossedPatches, MIXED, NONE, TABLE_LEVEL};
use super::mesh::Patches;
use super::point::PatchId;
use super::split::Split;

/// Patches whose centres lie within this many strips may own what lies beyond a line.
const NEAR: f64 = 2.5;

/// The patches that contact lines pass through, and the owners of what lies beyond.
pub(super) fn find_crossed(patches: &Patches, lines: &ContactLines) -> CrossedPatches {
    let mut me =
        CrossedPatches { sides: vec![false; patches.splits().len()], ..CrossedPatches::default() };
    for (side, split) in patches.splits().iter().enumerate() {
        let lines = lines.of(side);
        let Split::Uniform { first, level } = *split else { continue };
        if lines.is_empty() {
            continue;
        }
        for id in (first..first + (1 << (2 * u32::from(level)))).map(PatchId) {
            let Some(crossed) = crossed_patch(patches, id, first, level, lines) else { continue };
            if me.index.is_empty() {
                me.index = vec![NONE; patches.len()];
            }
            me.sides[side] = true;
            me.index[id.index()] = me.patches.len() as u32;
            me.patches.push(crossed);
        }
    }
    me
}

impl CrossedPatch {
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
}

/// `None` if no line passes through the patch.
fn crossed_patch(
    patches: &Patches,
    id: PatchId,
    first: u32,
    level: u8,
    lines: &[Line],
) -> Option<CrossedPatch> {
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
    let mut me = CrossedPatch { centre, lines, others: Vec::new(), table: [0; 64] };
    let mut candidates = neighbours(patches, id, first, level);
    candidates.retain(|o| (o.1 - centre).abs().max_element() <= NEAR * strip);
    candidates.sort_by(|a, b| {
        a.1.distance_squared(centre).total_cmp(&b.1.distance_squared(centre)).then(a.0.cmp(&b.0))
    });
    for (k, small) in Cell::grid(cell.triangle, cell.side, TABLE_LEVEL).enumerate() {
        let [a, b, c] = small.barycentric();
        let on_source = |local: DVec3| cell.point(local).uv;
        let at = on_source((a + b + c) / 3.0);
        let outline = [on_source(a), on_source(b), on_source(c)];
        me.table[k] = if me.lines.iter().any(|l| l.enters(outline)) {
            // A line has a corner on each of its sides, however thin a sliver it cuts off.
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
