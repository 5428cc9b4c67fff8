//! Exchange areas `S_ij = A_i F_ij = A_j F_ji`: a matrix of form factors, made symmetric to the
//! last bit.

use rayon::prelude::*;

use super::error::HeatError;
use crate::matrix::Rows;
use crate::progress::Progress;
use crate::scene::disjoint_sets::DisjointSets;

/// Parts that a product is made in, each with sums of its own; their number is fixed, so that the
/// number of threads changes nothing.
const PARTS: usize = 16;

/// Bytes of a pair: its column and its exchange area.
const PAIR_BYTES: u64 = 12;

/// Bytes of a row, mostly of the draws that errors are found by, in each part of them.
const ROW_BYTES: u64 = 2400;

/// A model that loses more than this share of what its surfaces send out has an environment.
const OPEN: f64 = 1e-3;

/// Exchange areas between all pairs of rows, in m².
///
/// What rows lose numerically, and to backs that have no row, returns to where it came from: so
/// each row, and the environment's share, sum to its area, and what one side gains others lose.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// Areas, m².
    pub(super) areas: Vec<f64>,
    /// Where the entries of each row begin.
    starts: Vec<usize>,
    /// Columns beyond the row's own, ascending.
    columns: Vec<u32>,
    values: Vec<f64>,
    /// With itself.
    own: Vec<f64>,
    /// With the environment.
    pub(super) environment: Vec<f64>,
    /// Rows of each part of a product.
    parts: Vec<std::ops::Range<usize>>,
}

impl Exchange {
    /// Those of a matrix whose rows have these areas (m²). With an `environment`, what escapes goes
    /// to it; without, it must be next to nothing.
    ///
    /// # Errors
    /// If much escapes to no environment, the exchange areas do not fit in `memory` (bytes), or the
    /// caller cancelled.
    pub fn new(
        rows: &dyn Rows,
        areas: &[f64],
        environment: bool,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Self, HeatError> {
        let n = rows.len();
        let needed = PAIR_BYTES * (rows.entries() / 2) + ROW_BYTES * n as u64;
        if needed > memory {
            return Err(HeatError::Memory { what: "exchange areas", needed, allowed: memory });
        }
        let escaping: Vec<f64> = (0..n).map(|i| areas[i] * rows.rest(i)[0]).collect();
        let share = escaping.iter().sum::<f64>() / areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        if !environment && share > OPEN {
            return Err(HeatError::Open { share });
        }
        progress.stage("exchange areas", 2 * n as u64);
        let mut me = Self {
            areas: areas.to_vec(),
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
            own: vec![0.0; n],
            environment: if environment { escaping } else { vec![0.0; n] },
            parts: Vec::new(),
        };
        let (mut columns, mut factors) = (Vec::new(), Vec::new());
        for (i, area) in areas.iter().enumerate() {
            rows.row(i, &mut columns, &mut factors)?;
            let upper = columns.partition_point(|&j| j as usize <= i);
            me.columns.extend(&columns[upper..]);
            me.values.extend(factors[upper..].iter().map(|f| 0.5 * area * f));
            me.starts.push(me.columns.len());
            progress.advance(1)?;
        }
        // Column j of all rows above, as j ascends: each row is read once, from its start on.
        let mut next = me.starts.clone();
        let mut alone = Vec::new();
        for (j, area) in areas.iter().enumerate() {
            rows.row(j, &mut columns, &mut factors)?;
            for (&i, f) in columns.iter().zip(&factors).take_while(|e| (*e.0 as usize) < j) {
                let (at, end) = (&mut next[i as usize], me.starts[i as usize + 1]);
                while *at < end && (me.columns[*at] as usize) < j {
                    *at += 1;
                }
                let half = 0.5 * area * f;
                match *at < end && me.columns[*at] as usize == j {
                    true => me.values[*at] += half,
                    // Only one of both rows has an entry.
                    false => alone.push((i, j as u32, half)),
                }
            }
            progress.advance(1)?;
        }
        me.add(alone);
        let mut sums = me.environment.clone();
        for i in 0..n {
            for (j, s) in me.row(i) {
                sums[i] += s;
                sums[j] += s;
            }
        }
        me.own = areas.iter().zip(&sums).map(|(a, s)| a - s).collect();
        me.parts = me.divided();
        Ok(me)
    }

    /// Adds entries that are not there yet: row, column beyond it, exchange area.
    fn add(&mut self, mut entries: Vec<(u32, u32, f64)>) {
        if entries.is_empty() {
            return;
        }
        for i in 0..self.len() {
            entries.extend(self.row(i).map(|(j, s)| (i as u32, j as u32, s)));
        }
        entries.sort_unstable_by_key(|e| (e.0, e.1));
        self.starts =
            (0..=self.len()).map(|i| entries.partition_point(|e| (e.0 as usize) < i)).collect();
        self.columns = entries.iter().map(|e| e.1).collect();
        self.values = entries.iter().map(|e| e.2).collect();
    }

    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        PAIR_BYTES * self.columns.len() as u64 + ROW_BYTES * self.len() as u64
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Entries of a row with the rows after it, m².
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let values = self.values[range.clone()].iter().copied();
        self.columns[range].iter().map(|&j| j as usize).zip(values)
    }

    /// Rows that exchange with nothing: they lie on something, or take no part.
    pub(super) fn isolated(&self) -> Vec<bool> {
        let mut isolated: Vec<bool> = self.environment.iter().map(|s| *s <= 0.0).collect();
        for i in 0..self.len() {
            for (j, _) in self.row(i).filter(|e| e.1 > 0.0) {
                (isolated[i], isolated[j]) = (false, false);
            }
        }
        isolated
    }

    /// Sets of rows that exchange with each other, through others if need be.
    pub(super) fn sets(&self) -> DisjointSets {
        let mut sets = DisjointSets::new(self.len());
        for i in 0..self.len() {
            self.row(i).filter(|e| e.1 > 0.0).for_each(|(j, _)| sets.join(i as u32, j as u32));
        }
        sets
    }

    /// All of the symmetric matrix, row by row.
    pub(super) fn dense(&self) -> Vec<f64> {
        let n = self.len();
        let mut all = vec![0.0; n * n];
        for i in 0..n {
            all[i * n + i] = self.own[i];
            for (j, s) in self.row(i) {
                all[i * n + j] = s;
                all[j * n + i] = s;
            }
        }
        all
    }

    /// `S x`, without the environment.
    pub(super) fn times(&self, x: &[f64]) -> Vec<f64> {
        let sums = self.in_parts(|part| {
            let mut sum = vec![0.0; self.len()];
            for i in part {
                let range = self.starts[i]..self.starts[i + 1];
                let mut own = self.own[i] * x[i];
                for (&j, s) in self.columns[range.clone()].iter().zip(&self.values[range]) {
                    own += s * x[j as usize];
                    sum[j as usize] += s * x[i];
                }
                sum[i] += own;
            }
            sum
        });
        added(sums)
    }

    /// What `make` makes of each part of the rows, in order.
    pub(super) fn in_parts<T: Send>(
        &self,
        make: impl Fn(std::ops::Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        self.parts.par_iter().map(|part| make(part.clone())).collect()
    }

    /// Parts of about as many entries each.
    fn divided(&self) -> Vec<std::ops::Range<usize>> {
        let n = self.len();
        let work = |i: usize| self.starts[i] + i;
        let mut ends = vec![0];
        for k in 1..PARTS {
            let mut end = ends[k - 1];
            while work(end) * PARTS < work(n) * k {
                end += 1;
            }
            ends.push(end);
        }
        ends.push(n);
        ends.windows(2).map(|e| e[0]..e[1]).collect()
    }
}

/// The sum of vectors, in order.
pub(super) fn added(parts: Vec<Vec<f64>>) -> Vec<f64> {
    let mut parts = parts.into_iter();
    let mut sum = parts.next().unwrap_or_default();
    for part in parts {
        sum.par_iter_mut().with_min_len(4096).zip(part).for_each(|(s, p)| *s += p);
    }
    sum
}
