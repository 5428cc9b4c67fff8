//! Adds up the weights of a row patch by patch, in any order, and lists them in theirs.

use std::ops::AddAssign;

use crate::patches::PatchId;

/// Patches are marked as seen by groups of so many.
const GROUP: usize = 64;

/// Sums of weights; all zero between rows.
#[derive(Debug, Default)]
pub(crate) struct Tally<W> {
    sums: Vec<W>,
    /// Whether something of each [`GROUP`] has been seen.
    seen: Vec<bool>,
}

impl<W: Copy + Default + PartialEq + AddAssign> Tally<W> {
    /// Makes room for so many patches.
    pub fn resize(&mut self, patches: usize) {
        self.seen.resize(patches.div_ceil(GROUP), false);
        self.sums.resize(self.seen.len() * GROUP, W::default());
    }

    /// Adds to the sum of one patch.
    #[inline(always)]
    pub fn add(&mut self, patch: u32, weight: W) {
        self.sums[patch as usize] += weight;
        self.seen[patch as usize / GROUP] = true;
    }

    /// Takes the sum of one patch away.
    pub fn take(&mut self, patch: u32) -> W {
        std::mem::take(&mut self.sums[patch as usize])
    }

    /// Moves the sums that are not zero into `weights`, and their patches, ascending, into
    /// `columns`.
    pub fn write(&mut self, columns: &mut Vec<PatchId>, weights: &mut Vec<W>) {
        columns.clear();
        weights.clear();
        let groups = self.seen.iter_mut().zip(self.sums.as_chunks_mut::<GROUP>().0);
        for (first, (seen, sums)) in (0_u32..).step_by(GROUP).zip(groups) {
            if std::mem::take(seen) {
                compact(sums, first, weights, columns);
                sums.fill(W::default());
            }
        }
    }
}

/// Appends the numbers of `values` that are not zero to `kept`, and their places, counted from
/// `first`, to `places`.
fn compact<W: Copy + Default + PartialEq>(
    values: &[W; GROUP],
    first: u32,
    kept: &mut Vec<W>,
    places: &mut Vec<PatchId>,
) {
    let (mut v, mut p, mut count) = ([W::default(); GROUP], [PatchId(0); GROUP], 0);
    // Without a branch a number: which are zero cannot be foretold.
    for (place, &value) in (first..).zip(values) {
        v[count % GROUP] = value;
        p[count % GROUP] = PatchId(place);
        count += usize::from(value != W::default());
    }
    kept.extend_from_slice(&v[..count]);
    places.extend_from_slice(&p[..count]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_come_in_the_order_of_patches_and_leave_nothing_behind() {
        let mut tally = Tally::default();
        tally.resize(200);
        let (mut columns, mut weights) = (vec![PatchId(7)], vec![7]);
        for (patch, weight) in [(130, 2_u32), (0, 1), (130, 3), (63, 4), (64, 0)] {
            tally.add(patch, weight);
        }
        tally.write(&mut columns, &mut weights);
        assert_eq!((&columns[..], &weights[..]), (&[0, 63, 130].map(PatchId)[..], &[1, 4, 5][..]));
        tally.write(&mut columns, &mut weights);
        assert!(columns.is_empty() && weights.is_empty());
    }
}
