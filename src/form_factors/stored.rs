//! The matrix of form factors, kept row by row.

mod edit;

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use super::rows::{Row, RowSink, SinkError, Weights, factor_to};
use super::tally::Tally;
use crate::patches::PatchId;
use crate::scene::Rgb;

/// What a row holds beside its entries.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RowAccount {
    /// Share that escapes.
    pub environment: f64,
    /// Share that ends on backs which do not reflect.
    pub back: f64,
    /// Share lost numerically.
    pub lost: f64,
}

/// Rows of form factors in memory. A patch that nobody asked for has no row; its entries are zero.
#[derive(Debug, Clone)]
pub struct FormFactors {
    blocks: Vec<Arc<Block>>,
    /// Block and row within it of each patch.
    place: Vec<Option<(u32, u32)>>,
    accounts: Vec<RowAccount>,
    entries: u64,
    bytes: u64,
    limit: u64,
    part: Part,
}

/// Rows one after another, not yet kept.
#[derive(Debug, Default)]
pub(crate) struct Band {
    pub ids: Vec<PatchId>,
    /// Where each row begins, and where the last ends.
    pub starts: Vec<usize>,
    pub columns: Vec<u32>,
    pub weights: Vec<f32>,
    pub accounts: Vec<RowAccount>,
}

/// Which entries of sampled rows are seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    All,
    FirstHalf,
    SecondHalf,
}

#[derive(Debug, Clone)]
struct Block {
    /// Where each row begins, and where the last ends.
    starts: Vec<usize>,
    /// Where the second half of each row begins; empty if rows are not sampled.
    halves: Vec<usize>,
    columns: Vec<u32>,
    weights: Weights,
}

/// One stored row.
#[derive(Debug, Clone, Copy)]
pub struct StoredRow<'a> {
    /// The patches seen, as in a [`Row`].
    pub columns: &'a [u32],
    weights: &'a Weights,
    start: usize,
}

impl StoredRow<'_> {
    /// The row with the columns that are parts of one patch added up: `patch_of` each column, or
    /// `u32::MAX` to leave it out. Fixed-point sums are exact.
    pub fn merged(&self, patch_of: &[u32], merger: &mut Merger) -> (Vec<u32>, Weights) {
        let mut merged = (Vec::new(), Weights::default());
        let end = self.start + self.columns.len();
        merger.merge(self.columns, self.weights, self.start..end, patch_of, &mut merged);
        merged
    }

    /// Patches and form factors in turn.
    pub fn entries(&self) -> impl Iterator<Item = (PatchId, f64)> + '_ {
        self.columns
            .iter()
            .enumerate()
            .map(|(k, &j)| (PatchId(j), self.weights.get(self.start + k)))
    }
}

/// Room to add up the entries of a row that belong to one patch.
#[derive(Debug, Default)]
pub struct Merger {
    fixed: Tally<u32>,
    each: Tally<f64>,
}

impl Merger {
    /// Room for so many patches.
    #[must_use]
    pub fn new(patches: usize) -> Self {
        let mut me = Self::default();
        me.fixed.resize(patches);
        me.each.resize(patches);
        me
    }

    /// Adds up the entries of `columns` by `patch_of`, their weights being those `at` a range.
    fn merge(
        &mut self,
        columns: &[u32],
        weights: &Weights,
        at: Range<usize>,
        patch_of: &[u32],
        (merged, sums): &mut (Vec<u32>, Weights),
    ) {
        let patches = columns.iter().map(|&j| patch_of[j as usize]);
        match weights {
            Weights::Fixed(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| self.fixed.add(patch, w));
                let mut fixed = match std::mem::take(sums) {
                    Weights::Fixed(sums) => sums,
                    _ => Vec::new(),
                };
                self.fixed.write(merged, &mut fixed);
                *sums = Weights::Fixed(fixed);
            }
            Weights::Each(w) => {
                let entries = patches.zip(&w[at]).filter(|e| e.0 != u32::MAX);
                entries.for_each(|(patch, &w)| self.each.add(patch, f64::from(w)));
                let mut each = Vec::new();
                self.each.write(merged, &mut each);
                *sums = Weights::Each(each.into_iter().map(|w| w as f32).collect());
            }
            Weights::Equal { rays, .. } => {
                let entries = patches.filter(|&patch| patch != u32::MAX);
                entries.for_each(|patch| self.fixed.add(patch, 1));
                let (mut hits, share) = (Vec::new(), 1.0 / *rays as f32);
                self.fixed.write(merged, &mut hits);
                *sums = Weights::Each(hits.into_iter().map(|hits| hits as f32 * share).collect());
            }
        }
    }
}

impl Block {
    /// The same rows with the columns that are parts of one patch added up, in the same memory if
    /// weights keep their form.
    fn merged(mut self, patch_of: &[u32], merger: &mut Merger) -> Self {
        let mut row = (Vec::new(), Weights::default());
        let (mut end, mut others) = (0, Weights::default());
        for r in 0..self.starts.len() - 1 {
            let at = self.starts[r]..self.starts[r + 1];
            let columns = &self.columns[at.clone()];
            merger.merge(columns, &self.weights, at, patch_of, &mut row);
            // A row is never longer than what it is made of.
            self.starts[r] = end;
            self.columns[end..end + row.0.len()].copy_from_slice(&row.0);
            match (&mut self.weights, &row.1) {
                (Weights::Fixed(all), Weights::Fixed(w)) => {
                    all[end..end + w.len()].copy_from_slice(w);
                }
                (Weights::Each(all), Weights::Each(w)) => {
                    all[end..end + w.len()].copy_from_slice(w);
                }
                (_, w) => others.append(w),
            }
            end += row.0.len();
        }
        if let Some(last) = self.starts.last_mut() {
            *last = end;
        }
        self.columns.truncate(end);
        self.halves.clear();
        match &mut self.weights {
            Weights::Fixed(w) => w.truncate(end),
            Weights::Each(w) => w.truncate(end),
            Weights::Equal { .. } => self.weights = others,
        }
        self
    }
}

/// Bytes of one stored entry: column and weight.
#[must_use]
pub fn entry_bytes(weights: &Weights) -> u64 {
    4 + weights.bytes()
}

impl FormFactors {
    /// Room for the rows of `patches` patches in at most `limit` bytes.
    #[must_use]
    pub fn new(patches: usize, limit: u64) -> Self {
        Self {
            blocks: Vec::new(),
            place: vec![None; patches],
            accounts: vec![RowAccount::default(); patches],
            entries: 0,
            bytes: 0,
            limit,
            part: Part::All,
        }
    }

    /// Keeps rows without copying them.
    pub(crate) fn keep(&mut self, band: Band) -> Result<(), SinkError> {
        let entries = band.columns.len() as u64;
        let weights = Weights::Each(band.weights);
        self.entries += entries;
        self.bytes += entries * entry_bytes(&weights);
        if self.bytes > self.limit {
            return Err(SinkError::Memory { limit_mib: self.limit >> 20 });
        }
        for ((row, &id), account) in (0..).zip(&band.ids).zip(band.accounts) {
            self.place[id.index()] = Some((self.blocks.len() as u32, row));
            self.accounts[id.index()] = account;
        }
        let (starts, columns) = (band.starts, band.columns);
        self.blocks.push(Arc::new(Block { starts, halves: Vec::new(), columns, weights }));
        Ok(())
    }

    /// Number of patches, with and without a row.
    #[must_use]
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Whether there is no patch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// Number of entries stored.
    #[must_use]
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// Bytes that they take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The matrices that the two halves of sampled rows make on their own, as independent of each
    /// other as if made from other rays; `None` if rows are not sampled. They share memory with
    /// this one, and their accounts are those of all rays. For products alone
    /// ([`gather`](Self::gather)).
    #[must_use]
    pub fn halves(&self) -> Option<[Self; 2]> {
        let sampled = self.blocks.iter().all(|b| !b.halves.is_empty()) && !self.blocks.is_empty();
        let half = |part| Self { part, ..self.clone() };
        sampled.then(|| [half(Part::FirstHalf), half(Part::SecondHalf)])
    }

    /// The rows of a mesh of `patches` that coarsens the one that these are of: columns that are
    /// parts of one patch are added up, `patch_of` each, and the row of a patch is that of
    /// `row_of(patch)`, a part of it. Takes the memory of the old rows.
    #[must_use]
    pub fn merged(
        self,
        patches: usize,
        patch_of: &[u32],
        row_of: impl Fn(PatchId) -> PatchId,
    ) -> Self {
        let rows: Vec<PatchId> = (0..patches as u32).map(|i| row_of(PatchId(i))).collect();
        let place = rows.iter().map(|r| self.place[r.index()]).collect();
        let accounts = rows.iter().map(|r| self.accounts[r.index()]).collect();
        let blocks: Vec<Arc<Block>> = self
            .blocks
            .into_par_iter()
            .map_init(
                || Merger::new(patches),
                |merger, block| Arc::new(Arc::unwrap_or_clone(block).merged(patch_of, merger)),
            )
            .collect();
        let entries = blocks.iter().map(|b| b.columns.len() as u64).sum();
        let bytes = blocks.iter().map(|b| b.columns.len() as u64 * entry_bytes(&b.weights)).sum();
        Self { blocks, place, accounts, entries, bytes, limit: self.limit, part: Part::All }
    }

    /// Number of rows stored.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.place.iter().flatten().count()
    }

    /// Whether a patch has a row.
    #[must_use]
    pub fn has_row(&self, id: PatchId) -> bool {
        self.place[id.index()].is_some()
    }

    /// What a patch's row holds beside its entries; all zero without a row.
    #[must_use]
    pub fn account(&self, id: PatchId) -> RowAccount {
        self.accounts[id.index()]
    }

    /// A patch's row.
    #[must_use]
    pub fn row(&self, id: PatchId) -> Option<StoredRow<'_>> {
        let (block, row) = self.place[id.index()]?;
        let block = &self.blocks[block as usize];
        let (from, to) = (block.starts[row as usize], block.starts[row as usize + 1]);
        Some(StoredRow { columns: &block.columns[from..to], weights: &block.weights, start: from })
    }

    /// The form factor from patch `i` to patch `j`.
    #[must_use]
    pub fn factor(&self, i: PatchId, j: PatchId) -> f64 {
        self.row(i)
            .map_or(0.0, |r| factor_to(r.columns, j, |k| r.weights.get(r.start + k), r.weights))
    }

    /// `Σ_j F_ij x_j`; zero without a row.
    #[must_use]
    pub fn gather(&self, id: PatchId, x: &[Rgb]) -> Rgb {
        self.gather_by(id, |j| x[j])
    }

    /// `Σ_j F_ij x(j)`; zero without a row.
    #[inline]
    pub fn gather_by(&self, id: PatchId, x: impl Fn(usize) -> Rgb) -> Rgb {
        let Some(row) = self.row(id) else { return Rgb::ZERO };
        let (from, to) = (row.start, row.start + row.columns.len());
        match row.weights {
            Weights::Fixed(w) => {
                let mut sum = Rgb::ZERO;
                for (&j, &w) in row.columns.iter().zip(&w[from..to]) {
                    sum += x(j as usize) * f64::from(w);
                }
                sum / f64::from(super::rows::ONE)
            }
            Weights::Each(w) => row
                .columns
                .iter()
                .zip(&w[from..to])
                .map(|(&j, &w)| x(j as usize) * f64::from(w))
                .sum(),
            Weights::Equal { .. } => {
                let Some((hits, rays)) = self.hits(id) else { return Rgb::ZERO };
                let mut sum = Rgb::ZERO;
                for &j in hits {
                    sum += x(j as usize);
                }
                sum / rays
            }
        }
    }

    /// The same for values held as [`values`](Self::values) chose.
    #[inline]
    pub fn gather_values(&self, id: PatchId, values: &Values) -> Rgb {
        match values {
            Values::Double(x) => self.gather(id, x),
            Values::Single(x) => match self.hits(id) {
                Some((hits, rays)) => sum(hits, x) / rays,
                None => self.gather_by(id, |j| x[j].truncate().as_dvec3()),
            },
        }
    }

    /// What the rays of a sampled row hit, and how many rays there are.
    fn hits(&self, id: PatchId) -> Option<(&[u32], f64)> {
        let row = self.row(id)?;
        let Weights::Equal { rays, .. } = row.weights else { return None };
        Some(match self.part {
            Part::All => (row.columns, f64::from(*rays)),
            Part::FirstHalf => (&row.columns[..self.half(id)], 0.5 * f64::from(*rays)),
            Part::SecondHalf => (&row.columns[self.half(id)..], 0.5 * f64::from(*rays)),
        })
    }

    /// A value of each patch, held for products with these rows that need not be better than
    /// `tolerance`, a share of the whole.
    #[must_use]
    pub fn values(&self, tolerance: f64, value: impl Fn(usize) -> Rgb) -> Values {
        /// Products of single precision are better than this.
        const SINGLE: f64 = 1e-6;
        let sampled = |b: &Arc<Block>| matches!(b.weights, Weights::Equal { .. });
        if tolerance >= SINGLE && self.blocks.iter().any(sampled) {
            Values::Single((0..self.len()).map(|i| single(value(i))).collect())
        } else {
            Values::Double((0..self.len()).map(value).collect())
        }
    }

    /// Number of entries of the first half of a sampled row.
    fn half(&self, id: PatchId) -> usize {
        self.place[id.index()].map_or(0, |(block, row)| {
            let block = &self.blocks[block as usize];
            block.halves[row as usize] - block.starts[row as usize]
        })
    }

    /// Sum of a row's entries, without its account.
    #[must_use]
    pub fn row_sum(&self, id: PatchId) -> f64 {
        self.row(id).map_or(0.0, |r| r.entries().map(|e| e.1).sum())
    }
}

impl RowSink for FormFactors {
    fn take(&mut self, ids: &[PatchId], rows: &[Row]) -> Result<(), SinkError> {
        let entries: usize = rows.iter().map(|r| r.columns.len()).sum();
        self.entries += entries as u64;
        self.bytes +=
            rows.iter().map(|r| r.columns.len() as u64 * entry_bytes(&r.weights)).sum::<u64>();
        if self.bytes > self.limit {
            return Err(SinkError::Memory { limit_mib: self.limit >> 20 });
        }
        let (mut starts, mut halves) = (vec![0], Vec::new());
        let mut columns = Vec::new();
        columns.try_reserve_exact(entries)?;
        let mut weights = match rows.first().map(|r| &r.weights) {
            Some(Weights::Each(_)) => Weights::Each(Vec::new()),
            _ => Weights::default(),
        };
        weights.try_reserve_exact(entries)?;
        for (row, (&id, r)) in ids.iter().zip(rows).enumerate() {
            columns.extend_from_slice(&r.columns);
            weights.append(&r.weights);
            if matches!(r.weights, Weights::Equal { .. }) {
                halves.push(starts[row] + r.half);
            }
            starts.push(columns.len());
            self.place[id.index()] = Some((self.blocks.len() as u32, row as u32));
            self.accounts[id.index()] =
                RowAccount { environment: r.environment, back: r.back, lost: r.lost };
        }
        self.blocks.push(Arc::new(Block { starts, halves, columns, weights }));
        Ok(())
    }
}

/// A value a patch, as products gather it. Products with sampled rows wait for memory alone: single
/// precision halves the wait, and the noise of such rows is far larger than its rounding.
#[derive(Debug, Clone)]
pub enum Values {
    /// Each as it is.
    Double(Vec<Rgb>),
    /// Rounded; the fourth component is zero.
    Single(Vec<Vec4>),
}

impl Values {
    /// Sets the value of patch `i`.
    #[inline]
    pub fn set(&mut self, i: usize, value: Rgb) {
        match self {
            Self::Double(x) => x[i] = value,
            Self::Single(x) => x[i] = single(value),
        }
    }
}

fn single(value: Rgb) -> Vec4 {
    value.as_vec3().extend(0.0)
}

/// The sum of what was hit, in double precision; four sums take turns.
fn sum(hits: &[u32], x: &[Vec4]) -> Rgb {
    let mut sums = [[DVec2::ZERO; 2]; 4];
    let (fours, rest) = hits.as_chunks::<4>();
    let mut add = |k: usize, j: u32| {
        let v = x[j as usize];
        sums[k][0] += v.xy().as_dvec2();
        sums[k][1] += v.zw().as_dvec2();
    };
    for four in fours {
        (0..4).for_each(|k| add(k, four[k]));
    }
    rest.iter().for_each(|&j| add(0, j));
    let [xy, zw] = [0, 1].map(|h| (sums[0][h] + sums[1][h]) + (sums[2][h] + sums[3][h]));
    Rgb::new(xy.x, xy.y, zw.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::ONE;

    fn row(columns: &[u32], weights: Weights) -> Row {
        Row { columns: columns.to_vec(), weights, lost: 0.25, ..Row::default() }
    }

    fn check(f: &FormFactors) {
        let x = [Rgb::splat(1.0), Rgb::new(2.0, 4.0, 8.0), Rgb::splat(8.0)];
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
        assert_eq!((f.len(), f.rows(), f.entries()), (3, 2, 3));
        near(f.factor(PatchId(0), PatchId(1)), 0.5);
        near(f.factor(PatchId(0), PatchId(2)), 0.25);
        near(f.factor(PatchId(2), PatchId(0)), 0.75);
        assert_eq!(f.factor(PatchId(1), PatchId(0)), 0.0);
        near(f.gather(PatchId(0), &x).y, 0.5 * 4.0 + 0.25 * 8.0);
        near(f.gather(PatchId(2), &x).x, 0.75);
        near(f.row_sum(PatchId(0)), 0.75);
        assert_eq!(f.account(PatchId(2)).lost, 0.25);
    }

    #[test]
    fn rows_of_either_form_are_kept_and_gathered() {
        let fixed = |w: &[u32]| Weights::Fixed(w.to_vec());
        let quarter = ONE / 4 + 1;
        let a = [fixed(&[2 * quarter, quarter]), fixed(&[3 * quarter])];
        let b = [Weights::Each(vec![0.5, 0.25]), Weights::Each(vec![0.75])];
        let mixed = [[a[0].clone(), b[1].clone()], [b[0].clone(), a[1].clone()]];
        for [first, second] in [a, b].into_iter().chain(mixed) {
            assert!((first.sum() - 0.75).abs() < 1e-7 && first.len() == 2 && !first.is_empty());
            let mut f = FormFactors::new(3, 1 << 10);
            let rows = [row(&[1, 2], first), row(&[0], second)];
            f.take(&[PatchId(0), PatchId(2)], &rows).unwrap();
            check(&f);
        }
    }
}
