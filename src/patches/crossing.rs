//! Finds the patches that contact lines pass through, and the owners of what lies beyond.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cell::Cell;
use super::contact::ContactLines;
use super::crossed::{CrossedPatch, CrossedPatches, MIXED, NONE, TABLE_LEVEL, WHOLE, Way};
use super::line::Line;
use super::mesh::Patches;
use super::point::PatchId;
use super::split::Split;
use crate::progress::{Cancelled, Progress};

/// Patches whose centres lie within this many strips may own what lies beyond a line.
const NEAR: f64 = 2.5;

/// Of the lines about a patch so many are kept, the nearest; what lies behind the last of them owns
/// nothing here.
const MOST_LINES: usize = 128;

/// The patches that contact lines pass through, and the owners of what lies beyond.
pub(super) fn find_crossed(
    patches: &Patches,
    contacts: &ContactLines,
    progress: &dyn Progress,
) -> Result<CrossedPatches, Cancelled> {
    let mut me = CrossedPatches::default();
    me.sides.resize_with(patches.splits().len(), Default::default);
    let touched: Vec<(usize, PatchId, [u32; 2])> = (0..)
        .zip(patches.splits())
        .filter(|(side, _)| contacts.any_on(*side))
        .filter_map(|(side, split)| match *split {
            Split::Uniform { first, level } => Some((side, [first, u32::from(level)])),
            Split::None | Split::Adaptive { .. } => None,
        })
        .flat_map(|(side, grid @ [first, level])| {
            (first..first + (1 << (2 * level))).map(move |id| (side, PatchId(id), grid))
        })
        .collect();
    let crossed: Result<Vec<Option<CrossedPatch>>, Cancelled> = touched
        .par_iter()
        .map(|&(side, id, grid)| {
            progress.advance(0)?;
            Ok(crossed_patch(patches, id, grid, side, contacts))
        })
        .collect();
    for ((side, id, _), crossed) in touched.into_iter().zip(crossed?) {
        let Some(crossed) = crossed else { continue };
        if me.index.is_empty() {
            me.index = vec![NONE; patches.len()];
        }
        me.sides[side].entered = true;
        me.index[id.index()] = WHOLE;
        if !crossed.others.is_empty() {
            me.sides[side].parted = true;
            me.index[id.index()] = me.patches.len() as u32;
            me.patches.push(crossed);
        }
    }
    Ok(me)
}

impl CrossedPatch {
    /// What the table says of a point: 0 if it sees the centre, or else the nearest of `candidates`
    /// that it sees, which joins the others.
    fn code_at(&mut self, at: DVec2, candidates: &[(PatchId, DVec2)]) -> u8 {
        if self.sees(at, self.centre) {
            return 0;
        }
        let (mut seen, mut nearest) = (None, f64::INFINITY);
        for other in candidates {
            let distance = other.1.distance_squared(at);
            if distance < nearest && self.sees(at, other.1) {
                (seen, nearest) = (Some(*other), distance);
            }
        }
        let Some(other) = seen else { return 0 };
        let k = self.others.iter().position(|o| o.0 == other.0).unwrap_or_else(|| {
            self.others.push(other);
            self.others.len() - 1
        });
        (k + 1).min(usize::from(MIXED - 1)) as u8
    }

    /// Lists the lines that may cross ways from mixed cells of the table, as far as those ways are
    /// tried.
    fn list_ways(&mut self, corners: [DVec2; 3], outlines: &[[DVec2; 3]]) {
        let numbers = 0..self.lines.len() as u8;
        let targets = std::iter::once(self.centre).chain(self.others.iter().map(|o| o.1));
        let ways: Vec<(DVec2, Vec<u8>)> = targets
            .map(|to| {
                let may = |&k: &u8| self.lines[usize::from(k)].may_part(corners, to);
                (to, numbers.clone().filter(may).collect())
            })
            .collect();
        self.starts.push(0);
        for (outline, _) in outlines.iter().zip(self.table).filter(|c| c.1 == MIXED) {
            for (owner, (to, lines)) in ways.iter().enumerate().take(usize::from(MIXED)) {
                let before = self.crossing.len();
                let may = |&&k: &&u8| self.lines[usize::from(k)].may_part(*outline, *to);
                self.crossing.extend(lines.iter().filter(may));
                self.ways.push(Way { owner: owner as u8, to: self.crossing.len() as u32 });
                if self.crossing.len() == before {
                    break;
                }
            }
            self.starts.push(self.ways.len() as u32);
        }
    }
}

/// `None` if no line passes through the patch.
fn crossed_patch(
    patches: &Patches,
    id: PatchId,
    [first, level]: [u32; 2],
    side: usize,
    contacts: &ContactLines,
) -> Option<CrossedPatch> {
    let cell = patches.cell(id);
    let strip = 1.0 / f64::from(cell.strips());
    let centre = patches.origin(id).uv;
    let corners @ [a, b, c] = cell.barycentric().map(|l| DVec2::new(l.y, l.z));
    let within = [a.min(b).min(c), a.max(b).max(c)];
    if !contacts.any(side, within, |l| l.enters(corners)) {
        return None;
    }
    let mut me = CrossedPatch {
        centre,
        lines: Vec::new(),
        others: Vec::new(),
        table: [0; 64],
        starts: Vec::new(),
        ways: Vec::new(),
        crossing: Vec::new(),
    };
    // A side of one patch has no neighbours that might own parts of it.
    if level == 0 {
        return Some(me);
    }
    // A way to a neighbour's centre may cross lines beyond the patch itself.
    let middle = patches.center(id).uv;
    let about = (NEAR + 1.0) * strip;
    me.lines = contacts.all(side, [middle - about, middle + about], |l| l.near(middle, about));
    let known = keep_nearest(&mut me.lines, middle);
    let mut candidates = neighbours(patches, id, first, level);
    candidates.retain(|o| {
        (o.1 - centre).abs().max_element() <= NEAR * strip && o.1.distance(middle) < known
    });
    candidates.sort_by(|a, b| {
        a.1.distance_squared(centre).total_cmp(&b.1.distance_squared(centre)).then(a.0.cmp(&b.0))
    });
    let inside: Vec<Line> = me.lines.iter().filter(|l| l.enters(corners)).copied().collect();
    let on_source = |local: DVec3| cell.point(local).uv;
    let small = Cell::grid(cell.triangle, cell.side, TABLE_LEVEL).map(|small| small.barycentric());
    let small: Vec<[DVec2; 3]> = small.map(|corners| corners.map(on_source)).collect();
    for (k, outline) in small.iter().enumerate() {
        me.table[k] = if inside.iter().any(|l| l.enters(*outline)) {
            // A line has a corner on each of its sides, however thin a sliver it cuts off.
            for corner in *outline {
                me.code_at(corner, &candidates);
            }
            MIXED
        } else {
            me.code_at((outline[0] + outline[1] + outline[2]) / 3.0, &candidates)
        };
    }
    if !me.others.is_empty() {
        me.list_ways(corners, &small);
    }
    Some(me)
}

/// Keeps the lines nearest to `middle`; within the distance returned none is missing.
fn keep_nearest(lines: &mut Vec<Line>, middle: DVec2) -> f64 {
    if lines.len() <= MOST_LINES {
        return f64::INFINITY;
    }
    let mut by_distance: Vec<(f64, Line)> =
        lines.iter().map(|l| (l.distance(middle), *l)).collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    lines.clear();
    lines.extend(by_distance[..MOST_LINES].iter().map(|l| l.1));
    by_distance[MOST_LINES].0
}

/// The patches of the same side within a few strips, with their centres.
fn neighbours(patches: &Patches, id: PatchId, first: u32, level: u32) -> Vec<(PatchId, DVec2)> {
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
