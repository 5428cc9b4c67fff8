//! Products of rows with a value a patch: what a patch gathers.

use std::sync::Arc;

use glam::{DVec2, Vec4, Vec4Swizzles};

use super::block::RowBlock;
use super::rows::{ONE, Weights};
use super::stored::{FormFactors, Half};
use crate::patches::PatchId;
use crate::scene::Rgb;

impl FormFactors {
    /// The matrices that the two halves of sampled rows make on their own, as independent of each
    /// other as if made from other rays; `None` if rows are not sampled. They share memory with
    /// this one, and their accounts are those of all rays. For products alone
    /// ([`gather`](Self::gather)).
    #[must_use]
    pub fn halves(&self) -> Option<[Self; 2]> {
        let sampled = self.blocks.iter().all(|b| !b.halves.is_empty()) && !self.blocks.is_empty();
        let with = |half| Self { half, ..self.clone() };
        sampled.then(|| [with(Half::First), with(Half::Second)])
    }

    /// `Σ_j F_ij x_j`; zero without a row.
    #[must_use]
    pub fn gather(&self, id: PatchId, x: &[Rgb]) -> Rgb {
        self.gather_by(id, |j| x[j.index()])
    }

    /// `Σ_j F_ij x(j)`; zero without a row.
    #[inline]
    pub fn gather_by(&self, id: PatchId, x: impl Fn(PatchId) -> Rgb) -> Rgb {
        let Some(row) = self.row(id) else { return Rgb::ZERO };
        match row.weights {
            Weights::Fixed(w) => {
                let mut sum = Rgb::ZERO;
                for (&j, &w) in row.columns.iter().zip(&w[row.range()]) {
                    sum += x(j) * f64::from(w);
                }
                sum / f64::from(ONE)
            }
            Weights::Each(w) => {
                row.columns.iter().zip(&w[row.range()]).map(|(&j, &w)| x(j) * f64::from(w)).sum()
            }
            Weights::Equal { .. } => {
                let Some((hits, rays)) = self.hits(id) else { return Rgb::ZERO };
                let mut sum = Rgb::ZERO;
                for &j in hits {
                    sum += x(j);
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
                None => self.gather_by(id, |j| x[j.index()].truncate().as_dvec3()),
            },
        }
    }

    /// What the rays of a sampled row hit, and how many rays there are.
    fn hits(&self, id: PatchId) -> Option<(&[PatchId], f64)> {
        let row = self.row(id)?;
        let Weights::Equal { rays, .. } = row.weights else { return None };
        Some(match self.half {
            Half::Both => (row.columns, f64::from(*rays)),
            Half::First => (&row.columns[..self.first_half(id)], 0.5 * f64::from(*rays)),
            Half::Second => (&row.columns[self.first_half(id)..], 0.5 * f64::from(*rays)),
        })
    }

    /// A value of each patch, held for products with these rows that need not be better than
    /// `tolerance`, a share of the whole.
    #[must_use]
    pub fn values(&self, tolerance: f64, value: impl Fn(usize) -> Rgb) -> Values {
        /// Products of single precision are better than this.
        const SINGLE: f64 = 1e-6;
        let sampled = |b: &Arc<RowBlock>| matches!(b.weights, Weights::Equal { .. });
        if tolerance >= SINGLE && self.blocks.iter().any(sampled) {
            Values::Single((0..self.len()).map(|i| single(value(i))).collect())
        } else {
            Values::Double((0..self.len()).map(value).collect())
        }
    }

    /// How many entries the first half of a row has, if it is sampled.
    pub(crate) fn half_of_row(&self, id: PatchId) -> Option<usize> {
        let row = self.row(id)?;
        matches!(row.weights, Weights::Equal { .. }).then(|| self.first_half(id))
    }

    /// Number of entries of the first half of a sampled row.
    fn first_half(&self, id: PatchId) -> usize {
        self.place[id.index()].map_or(0, |(block, row)| {
            let block = &self.blocks[block as usize];
            block.halves[row as usize] - block.starts[row as usize]
        })
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
fn sum(hits: &[PatchId], x: &[Vec4]) -> Rgb {
    let mut sums = [[DVec2::ZERO; 2]; 4];
    let (fours, rest) = hits.as_chunks::<4>();
    let mut add = |k: usize, j: PatchId| {
        let v = x[j.index()];
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
