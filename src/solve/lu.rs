//! Dense linear systems by LU factors with partial pivoting, O(n³).
//!
//! ```text
//! P A = L U        L unit lower, U upper triangular, both in the place of A
//! ```
//!
//! A panel of columns is factorised, then the columns right of it are updated, `U₁₂ = L₁₁⁻¹ A₁₂`
//! and `A₂₂ - L₂₁ U₁₂`, and factorised in turn (Golub & Van Loan, "Matrix Computations", block LU
//! with partial pivoting). A panel is factorised likewise, by halves (Toledo 1997, "Locality of
//! reference in LU decomposition with partial pivoting"). So nearly all work is products of
//! matrices: these read L₂₁ packed in the order of a small kernel that stays in registers (Goto &
//! van de Geijn 2008, "Anatomy of high-performance matrix multiplication").
//!
//! Every number is the outcome of the same operations in the same order for any number of threads
//! and any set of instructions.

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};
use crate::simd::multiversion;

/// Columns that are factorised one by one.
const FEW: usize = 8;

/// Columns of a panel: the triangle of its L stays in the cache while others are updated by it.
const PANEL: usize = 64;

/// Rows and columns of the block that the kernel keeps in registers.
const ROWS: usize = 8;
const COLUMNS: usize = 6;

/// Columns that one task updates. Fixed, so that the number of threads changes nothing.
const TASK: usize = 8 * COLUMNS;

/// Factors of a square matrix.
pub(crate) struct Lu<'a> {
    /// L below the diagonal, U on and above it, column by column.
    factors: &'a mut [f64],
    /// The row that was exchanged with each row, in order.
    pivots: Vec<usize>,
}

impl<'a> Lu<'a> {
    /// Factorises a matrix of `n` columns in its own place. A singular one leaves factors that are
    /// not finite.
    pub fn new(
        matrix: &'a mut [f64],
        n: usize,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let mut pivots = vec![0; n];
        factorise(matrix, n, 0, &mut pivots, progress)?;
        Ok(Self { factors: matrix, pivots })
    }

    /// Solves `A x = b` in the place of `b`.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.pivots.len();
        for (i, &p) in self.pivots.iter().enumerate() {
            b.swap(i, p);
        }
        for j in 0..n {
            let column = &self.factors[j * n..(j + 1) * n];
            let x = b[j];
            subtract(&mut b[j + 1..], &column[j + 1..], x);
        }
        for j in (0..n).rev() {
            let column = &self.factors[j * n..(j + 1) * n];
            b[j] /= column[j];
            let x = b[j];
            subtract(&mut b[..j], &column[..j], x);
        }
    }
}

/// Factorises the columns of length `n` in `columns`, whose first pivot is that of row `first`.
/// Rows are exchanged in these columns alone; `pivots` says which, one a column.
fn factorise(
    columns: &mut [f64],
    n: usize,
    first: usize,
    pivots: &mut [usize],
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    let count = pivots.len();
    if count <= FEW {
        few(columns, n, first, pivots);
        return Ok(());
    }
    progress.advance(0)?;
    let wide = if count > PANEL { PANEL } else { (count / 2).next_multiple_of(FEW) };
    let (left, right) = columns.split_at_mut(wide * n);
    let (left_pivots, right_pivots) = pivots.split_at_mut(wide);
    factorise(left, n, first, left_pivots, progress)?;
    let packed = Packed::new(left, n, first, wide);
    right.par_chunks_mut(TASK * n).for_each(|columns| {
        for column in columns.chunks_exact_mut(n) {
            exchange(column, first, left_pivots);
            substitute(left, n, first, wide, column);
        }
        packed.subtract_from(columns, n, first);
    });
    factorise(right, n, first + wide, right_pivots, progress)?;
    left.par_chunks_mut(n).for_each(|column| exchange(column, first + wide, right_pivots));
    Ok(())
}

/// Exchanges rows of a column from `first` on as `pivots` say.
fn exchange(column: &mut [f64], first: usize, pivots: &[usize]) {
    for (k, &p) in pivots.iter().enumerate() {
        column.swap(first + k, p);
    }
}

/// Factorises a few columns, one after the other.
fn few(columns: &mut [f64], n: usize, first: usize, pivots: &mut [usize]) {
    for k in 0..pivots.len() {
        let row = first + k;
        let column = &columns[k * n..(k + 1) * n];
        let larger = |a: usize, b: usize| if column[b].abs() > column[a].abs() { b } else { a };
        let pivot = (row + 1..n).fold(row, larger);
        pivots[k] = pivot;
        for column in columns.chunks_exact_mut(n) {
            column.swap(row, pivot);
        }
        let (done, rest) = columns.split_at_mut((k + 1) * n);
        let column = &mut done[k * n..];
        let inverse = 1.0 / column[row];
        column[row + 1..].iter_mut().for_each(|x| *x *= inverse);
        for other in rest.chunks_exact_mut(n) {
            let x = other[row];
            subtract(&mut other[row + 1..], &column[row + 1..], x);
        }
    }
}

/// `L₁₁⁻¹` of a column, in its rows from `first` on.
fn substitute(left: &[f64], n: usize, first: usize, count: usize, column: &mut [f64]) {
    for k in 0..count {
        let rows = first + k + 1..first + count;
        let x = column[first + k];
        subtract(&mut column[rows.clone()], &left[k * n..][rows], x);
    }
}

multiversion! {
    /// `to - column x`.
    fn subtract(to: &mut [f64], column: &[f64], x: f64) = subtract_kernel
}

#[inline(always)]
fn subtract_kernel(to: &mut [f64], column: &[f64], x: f64) {
    for (to, c) in to.iter_mut().zip(column) {
        *to -= c * x;
    }
}

/// L₂₁ in the order in which the kernel reads it: [`ROWS`] rows at a time, of these column by
/// column.
struct Packed {
    /// Rows are filled up with zeros to a multiple of [`ROWS`].
    numbers: Vec<[f64; ROWS]>,
    /// Columns of L₂₁.
    terms: usize,
}

impl Packed {
    /// Of the columns `left`, below row `first + terms`.
    fn new(left: &[f64], n: usize, first: usize, terms: usize) -> Self {
        let below = first + terms;
        let mut numbers = vec![[0.0; ROWS]; (n - below).div_ceil(ROWS) * terms];
        numbers.par_chunks_mut(terms).enumerate().for_each(|(block, numbers)| {
            let top = below + block * ROWS;
            let height = ROWS.min(n - top);
            for (numbers, column) in numbers.iter_mut().zip(left.chunks_exact(n)) {
                numbers[..height].copy_from_slice(&column[top..top + height]);
            }
        });
        Self { numbers, terms }
    }

    /// `A₂₂ - L₂₁ U₁₂` in some columns, whose U₁₂ begins in row `first`.
    fn subtract_from(&self, columns: &mut [f64], n: usize, first: usize) {
        let below = first + self.terms;
        let groups = columns.len().div_ceil(COLUMNS * n);
        let mut upper = vec![[0.0; COLUMNS]; groups * self.terms];
        for (c, column) in columns.chunks_exact(n).enumerate() {
            let upper = &mut upper[c / COLUMNS * self.terms..];
            for (upper, x) in upper.iter_mut().zip(&column[first..below]) {
                upper[c % COLUMNS] = *x;
            }
        }
        for (block, lower) in self.numbers.chunks_exact(self.terms).enumerate() {
            update(columns, n, below + block * ROWS, lower, &upper);
        }
    }
}

multiversion! {
    /// Subtracts the product of [`ROWS`] rows of L₂₁ and of `upper` from rows `top` on of columns
    /// of length `n`. `upper` has [`COLUMNS`] columns of U₁₂ at a time, each group as long as
    /// `lower`.
    fn update(
        columns: &mut [f64],
        n: usize,
        top: usize,
        lower: &[[f64; ROWS]],
        upper: &[[f64; COLUMNS]],
    ) = update_kernel
}

#[inline(always)]
fn update_kernel(
    columns: &mut [f64],
    n: usize,
    top: usize,
    lower: &[[f64; ROWS]],
    upper: &[[f64; COLUMNS]],
) {
    for (columns, upper) in columns.chunks_mut(COLUMNS * n).zip(upper.chunks_exact(lower.len())) {
        let mut sums = [[0.0; ROWS]; COLUMNS];
        for (l, u) in lower.iter().zip(upper) {
            for c in 0..COLUMNS {
                for r in 0..ROWS {
                    sums[c][r] += l[r] * u[c];
                }
            }
        }
        for (column, sums) in columns.chunks_exact_mut(n).zip(&sums) {
            for (to, sum) in column[top..].iter_mut().zip(sums) {
                *to -= sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    /// A matrix of numbers from -1 to 1, column by column.
    fn random(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut number = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        (0..n * n).map(|_| number()).collect()
    }

    fn times(a: &[f64], x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let mut b = vec![0.0; n];
        for (column, x) in a.chunks_exact(n).zip(x) {
            b.iter_mut().zip(column).for_each(|(b, c)| *b += c * x);
        }
        b
    }

    fn solved(a: &[f64], b: &[f64]) -> Vec<f64> {
        let (mut factors, mut x) = (a.to_vec(), b.to_vec());
        Lu::new(&mut factors, b.len(), &Silent).unwrap().solve(&mut x);
        x
    }

    #[test]
    fn systems_of_every_size_are_solved() {
        for n in [1, 2, 7, 8, 9, 31, 64, 65, 127, 150, 200, 333] {
            let a = random(n, n as u64);
            let x: Vec<f64> = (0..n).map(|i| 1.0 + (i % 7) as f64).collect();
            let b = times(&a, &x);
            let back = times(&a, &solved(&a, &b));
            let residual = back.iter().zip(&b).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
            assert!(residual < 1e-11 * n as f64, "{n}: {residual:e}");
        }
    }

    #[test]
    fn rows_are_exchanged_where_a_pivot_is_missing() {
        // A permutation: every pivot is zero but for the exchange.
        let n = 100;
        let mut a = vec![0.0; n * n];
        for j in 0..n {
            a[j * n + (j * 37 + 11) % n] = 1.0;
        }
        let x: Vec<f64> = (0..n).map(|i| i as f64).collect();
        assert_eq!(solved(&a, &times(&a, &x)), x);
        // Without exchange a tiny pivot would drown the rest.
        let found = solved(&[1e-20, 1.0, 1.0, 1.0], &[1.0, 2.0]);
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_singular_matrix_has_no_finite_solution() {
        let n = 90;
        let mut a = random(n, 3);
        a.copy_within(5 * n..6 * n, 70 * n);
        let x = solved(&a, &vec![1.0; n]);
        assert!(x.iter().any(|x| !x.is_finite() || x.abs() > 1e9));
        assert!(solved(&[0.0; 9], &[1.0; 3]).iter().any(|x| !x.is_finite()));
    }

    #[test]
    fn threads_and_instructions_change_no_bit() {
        let n = 210;
        let (a, b) = (random(n, 9), random(n, 10)[..n].to_vec());
        let expected = solved(&a, &b);
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| solved(&a, &b)), expected);
        }
        #[cfg(target_arch = "x86_64")]
        for version in [crate::simd::Version::Portable, crate::simd::Version::Avx2] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(1)
                .start_handler(move |_| crate::simd::WIDEST.set(version))
                .build()
                .unwrap();
            assert_eq!(pool.install(|| solved(&a, &b)), expected, "{version:?}");
        }
    }
}
