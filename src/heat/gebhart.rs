//! Gebhart factors: where what each side emits is absorbed in the end.
//!
//! ```text
//! B = F (I - ρ F)⁻¹ ε        GR_ij = A_i ε_i B_ij = GR_ji
//! ```
//!
//! (B. Gebhart 1961, "Surface temperature calculations in radiant surroundings of arbitrary
//! complexity - for gray, diffuse radiation", Int. J. Heat Mass Transfer 3, 341-346). The radiative
//! conductors GR between two sides are symmetric: `Q_ij = GR_ij σ (T_i⁴ - T_j⁴)`.

use std::io;

use rayon::prelude::*;

use super::error::HeatError;
use super::exchange::Exchange;
use crate::matrix::{Precision, Reflected, Rows, SurfaceRow};
use crate::progress::Progress;
use crate::scene::Geometry;

/// Shares that differences of sums leave by rounding.
const ROUNDING: f64 = 1e-12;

/// Whether each row only exchanges with rows none of which absorbs.
fn white(exchange: &Exchange, emissivity: &[f64]) -> Vec<bool> {
    let mut sets = exchange.sets();
    let mut white = vec![true; exchange.len()];
    for (i, (e, out)) in emissivity.iter().zip(&exchange.environment).enumerate() {
        white[sets.find(i as u32) as usize] &= *e <= 0.0 && *out <= 0.0;
    }
    (0..exchange.len()).map(|i| white[sets.find(i as u32) as usize]).collect()
}

/// Where what each side emits is absorbed, and the conductors between sides.
#[derive(Debug, Clone)]
pub struct Gebhart {
    /// `ε_i A_i` of each side, m².
    weights: Vec<f64>,
    /// GR_ij, row by row, m².
    conductors: Vec<f64>,
    /// GR between each side and the environment, m².
    environment: Vec<f64>,
    surfaces: Vec<SurfaceRow>,
}

/// Finds the Gebhart factors of sides of these emissivities (0..1); `surfaces` are what rows stand
/// for.
///
/// # Errors
/// If they do not fit in `memory` (bytes), or the caller cancelled.
pub fn gebhart(
    exchange: &Exchange,
    emissivity: &[f64],
    surfaces: Vec<SurfaceRow>,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Gebhart, HeatError> {
    // Without rows there is nothing to part.
    let n = exchange.len().max(1);
    let needed = 2 * 8 * (n as u64).pow(2);
    if needed > memory {
        return Err(HeatError::Memory { what: "Gebhart factors", needed, allowed: memory });
    }
    progress.stage("Gebhart factors", 0);
    let weights: Vec<f64> = exchange.areas.iter().zip(emissivity).map(|(a, e)| a * e).collect();
    let mut conductors = exchange.dense();
    let areas = || exchange.areas.iter().map(|a| a.max(f64::MIN_POSITIVE));
    for (row, area) in conductors.chunks_exact_mut(n).zip(areas()) {
        row.iter_mut().for_each(|s| *s /= area);
    }
    // What nothing of absorbs sends light to and fro for ever, and nothing to others.
    let white = white(exchange, emissivity);
    conductors.chunks_exact_mut(n).zip(&white).filter(|r| *r.1).for_each(|(row, _)| row.fill(0.0));
    let mut factors = conductors.clone();
    let reflected = Reflected::new(&mut factors, emissivity, progress)?;
    conductors.par_chunks_mut(n).zip(&weights).try_for_each(|(row, weight)| {
        reflected.row(row);
        row.iter_mut().zip(emissivity).for_each(|(z, e)| *z *= weight * e);
        progress.advance(0)
    })?;
    if conductors.iter().any(|c| !c.is_finite()) {
        return Err(HeatError::Singular);
    }
    let open = exchange.environment.iter().any(|s| *s > 0.0);
    let rest = |(row, weight): (&[f64], &f64)| {
        let rest = weight - row.iter().sum::<f64>();
        if open && rest > ROUNDING * weight { rest } else { 0.0 }
    };
    let environment = conductors.chunks_exact(n).zip(&weights).map(rest).collect();
    Ok(Gebhart { weights, conductors, environment, surfaces })
}

impl Gebhart {
    /// The conductors between nodes, each of which has some rows, in m². `row` hears of each node
    /// in order, with its conductors to those after it, and with that to the environment; zeros
    /// are left out.
    ///
    /// # Errors
    /// Those of `row`.
    pub fn between_nodes<E>(
        &self,
        node_of: &[u32],
        mut row: impl FnMut(usize, &[(usize, f64)], Option<f64>) -> Result<(), E>,
    ) -> Result<(), E> {
        let (n, nodes) = (self.weights.len(), node_of.iter().max().map_or(0, |k| *k as usize + 1));
        let mut rows = vec![Vec::new(); nodes];
        node_of.iter().enumerate().for_each(|(i, k)| rows[*k as usize].push(i));
        for (k, own) in rows.iter().enumerate() {
            let mut sum = vec![0.0; nodes];
            for &i in own {
                for (other, conductor) in node_of.iter().zip(&self.conductors[i * n..]) {
                    sum[*other as usize] += conductor;
                }
            }
            let others: Vec<(usize, f64)> =
                (k + 1..nodes).map(|l| (l, sum[l])).filter(|c| c.1 > 0.0).collect();
            let out: f64 = own.iter().map(|&i| self.environment[i]).sum();
            row(k, &others, (out > 0.0).then_some(out))?;
        }
        Ok(())
    }

    /// What the sides are.
    #[must_use]
    pub fn sides(&self) -> &[SurfaceRow] {
        &self.surfaces
    }
}

/// The matrix B: row i says where what side i emits is absorbed.
impl Rows for Gebhart {
    fn len(&self) -> usize {
        self.weights.len()
    }

    fn entries(&self) -> u64 {
        self.conductors.iter().filter(|c| **c > 0.0).count() as u64
    }

    fn precision(&self) -> Precision {
        Precision::Double
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        let row = &self.conductors[i * self.len()..][..self.len()];
        columns.clear();
        values.clear();
        for (j, gr) in (0_u32..).zip(row).filter(|e| *e.1 > 0.0) {
            columns.push(j);
            values.push(gr / self.weights[i]);
        }
        Ok(())
    }

    fn label(&self, i: usize) -> String {
        let row = &self.surfaces[i];
        if row.triangle.is_some() { i.to_string() } else { row.name.clone() }
    }

    fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
        self.surfaces.clone()
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        let emits = self.weights[i] > 0.0;
        [if emits { self.environment[i] / self.weights[i] } else { 0.0 }, 0.0]
    }
}
