//! Scales of a symmetric matrix that give its rows the sums they should have.
//!
//! Wanted are `d > 0` with `d_i Σ_j S_ij d_j = a_i`. With `d = e^x` that is where the convex
//! function
//!
//! ```text
//! φ(x) = ½ Σ_ij S_ij e^(x_i + x_j) - Σ_i a_i x_i
//! ```
//!
//! is least: its gradient is `r - a` with the sums r of `M = D S D`, its Hessian `diag(r) + M`.
//! Newton's method takes few steps where alternate scaling (Sinkhorn) takes thousands, between two
//! close plates for one; each solves its linear system by conjugate gradients, as Knight & Ruiz
//! (2013), "A fast algorithm for matrix balancing", do.

use rayon::prelude::*;

use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};

/// Sums are right to this share of themselves.
pub const TOLERANCE: f64 = 1e-9;

/// Steps by which the error has to halve: beyond them no scales exist, or none worth having.
const PATIENCE: usize = 8;

/// Scales change at most by a factor e a step.
const LONGEST: f64 = 1.0;

/// Scales that go beyond this factor have lost their way.
const FURTHEST: f64 = 1e3;

/// Conjugate gradients of one step: enough for the worst enclosures seen, and an end for the rest.
const INNER: usize = 300;

/// Rows whose sums are furthest off are named, so many.
const NAMED: usize = 64;

/// Scales, and how they were found.
#[derive(Debug, Clone)]
pub struct Scales {
    /// One a row; 1 for rows that are not taken.
    pub scales: Vec<f64>,
    /// Newton steps taken.
    pub steps: usize,
    /// Largest relative error of a sum.
    pub residual: f64,
}

/// Why there are no scales.
#[derive(Debug, Clone, PartialEq)]
pub enum ScalingError {
    /// The sums stay wrong: the worst rows, each with its sum as a share of what it should be.
    Stalled(Vec<(usize, f64)>),
    /// The caller cancelled.
    Cancelled(Cancelled),
}

/// Finds the scales of the `taken` rows of a symmetric matrix (columns and entries a row) that give
/// them the `sums`.
pub fn scale(
    rows: &[(&[PatchId], &[f32])],
    sums: &[f64],
    taken: &[bool],
    progress: &dyn Progress,
) -> Result<Scales, ScalingError> {
    let system = Rows { rows, sums, taken };
    let mut now = system.at(vec![1.0; rows.len()]);
    let mut best = (now.residual, 0);
    for steps in 0.. {
        if now.residual <= TOLERANCE {
            return Ok(Scales { scales: now.d, steps, residual: now.residual });
        }
        if now.residual < 0.5 * best.0 {
            best = (now.residual, steps);
        }
        if steps - best.1 >= PATIENCE {
            break;
        }
        progress.advance(1).map_err(ScalingError::Cancelled)?;
        let change = system.newton(&now);
        let mut length = 1.0;
        now = loop {
            let moved = |(d, y): (&f64, &f64)| d * (length * y).clamp(-LONGEST, LONGEST).exp();
            let new = system.at(now.d.iter().zip(&change).map(moved).collect());
            if new.residual < now.residual || new.phi < now.phi || length < 1e-3 {
                break new;
            }
            length *= 0.5;
        };
        if now.d.iter().any(|d| !(1.0 / FURTHEST..FURTHEST).contains(d)) {
            break;
        }
    }
    let share = |i: usize| (i, now.r[i] / sums[i]);
    let mut worst: Vec<(usize, f64)> = (0..rows.len()).filter(|&i| taken[i]).map(share).collect();
    worst.sort_by(|a, b| (b.1 - 1.0).abs().total_cmp(&(a.1 - 1.0).abs()));
    worst.truncate(NAMED);
    let far = |w: &(usize, f64)| (w.1 - 1.0).abs() > TOLERANCE;
    worst.retain(far);
    Err(ScalingError::Stalled(worst))
}

struct Rows<'a> {
    rows: &'a [(&'a [PatchId], &'a [f32])],
    sums: &'a [f64],
    taken: &'a [bool],
}

/// Scales and what they yield.
struct State {
    d: Vec<f64>,
    /// Sums of the scaled rows.
    r: Vec<f64>,
    phi: f64,
    residual: f64,
}

impl Rows<'_> {
    /// `S x`.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let dot = |(columns, entries): &(&[PatchId], &[f32])| {
            columns.iter().zip(*entries).map(|(&j, &s)| f64::from(s) * x[j.index()]).sum()
        };
        self.rows.par_iter().map(dot).collect()
    }

    fn at(&self, d: Vec<f64>) -> State {
        let r: Vec<f64> = self.times(&d).iter().zip(&d).map(|(s, d)| s * d).collect();
        let (mut phi, mut residual) = (0.0, 0.0_f64);
        for i in (0..d.len()).filter(|&i| self.taken[i]) {
            phi += 0.5 * r[i] - self.sums[i] * d[i].ln();
            residual = residual.max((r[i] / self.sums[i] - 1.0).abs());
        }
        State { d, r, phi, residual }
    }

    /// The change of `ln d` that Newton's method takes: `(diag(r) + M) y = a - r`, by conjugate
    /// gradients preconditioned with `diag(r)`.
    fn newton(&self, now: &State) -> Vec<f64> {
        let n = now.d.len();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let divided = |g: &[f64]| -> Vec<f64> {
            g.iter().zip(&now.r).map(|(g, r)| if *r > 0.0 { g / r } else { 0.0 }).collect()
        };
        let mut rest: Vec<f64> =
            (0..n).map(|i| if self.taken[i] { self.sums[i] - now.r[i] } else { 0.0 }).collect();
        let mut z = divided(&rest);
        let mut direction = z.clone();
        let mut y = vec![0.0; n];
        let mut rho = dot(&rest, &z);
        // A step that is right to its own size makes the next one as good as Newton's.
        let goal = rho * now.residual.min(0.1).powi(2);
        for _ in 0..INNER {
            let scaled: Vec<f64> = direction.iter().zip(&now.d).map(|(v, d)| v * d).collect();
            let mut image = self.times(&scaled);
            for (i, image) in image.iter_mut().enumerate() {
                *image = now.d[i] * *image + now.r[i] * direction[i];
            }
            let curvature = dot(&direction, &image);
            // In a bipartite pattern some directions change nothing.
            if curvature.is_nan() || curvature <= 1e-14 * dot(&direction, &direction) {
                break;
            }
            let step = rho / curvature;
            for i in 0..n {
                y[i] += step * direction[i];
                rest[i] -= step * image[i];
            }
            z = divided(&rest);
            let new = dot(&rest, &z);
            if new <= goal {
                break;
            }
            let turn = new / rho;
            rho = new;
            for (v, z) in direction.iter_mut().zip(&z) {
                *v = z + turn * *v;
            }
        }
        y
    }
}
