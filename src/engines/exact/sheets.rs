//! Sheets: connected blockers of a pair that turn the same side to its points. Seen from a point,
//! the polygons of a small sheet do not overlap, so what they hide adds up.

use super::blockers::Blockers;
use super::clip::ClippedBlocker;
use super::polygon::Polygon;
use crate::scene::disjoint_sets::DisjointSets;

/// A sheet of fewer polygons cannot wind about an axis and overlap itself.
pub(super) const MAY_WIND: usize = 6;

/// Sorts blockers by surface and sheet, as seen from points of a polygon; those whose plane it
/// straddles are sheets of their own.
pub(super) fn sort_into_sheets(
    blockers: &mut [ClippedBlocker],
    from: &Polygon,
    all: &Blockers,
    touching: f64,
) {
    blockers.sort_unstable_by_key(|c| c.id);
    let side = |c: &ClippedBlocker| {
        let heights = || from.corners().iter().map(|&p| c.normal.dot(p - c.corners()[0]));
        if heights().all(|h| h >= -touching) {
            1
        } else if heights().all(|h| h <= touching) {
            -1
        } else {
            0
        }
    };
    let sides: Vec<i32> = blockers.iter().map(side).collect();
    let mut sets = DisjointSets::new(blockers.len());
    for (k, blocker) in blockers.iter().enumerate().filter(|(k, _)| sides[*k] != 0) {
        for next in all.neighbours(blocker.id) {
            if let Ok(other) = blockers.binary_search_by_key(next, |c| c.id)
                && sides[other] == sides[k]
            {
                sets.join(k as u32, other as u32);
            }
        }
    }
    for (k, blocker) in (0..).zip(&mut *blockers) {
        blocker.sheet = sets.find(k);
    }
    blockers.sort_unstable_by_key(|c| (c.surface, c.sheet, c.id));
}
