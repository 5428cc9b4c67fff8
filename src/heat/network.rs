//! The network of conductors, and its solution by conjugate gradients.
//!
//! What a side sends out follows from what arrives, `J = c + M h`, where `h = A H` in W. A side of
//! a node whose temperature is given only reflects, `M_ii = ρ_i / A_i`; one of a node that floats
//! also sends out again what the node's sides absorb:
//!
//! ```text
//! M_il = δ_il ρ_i / A_i + ε_i ε_l / a_k        a_k = Σ A_i ε_i over the sides of node k
//! ```
//!
//! So `M = L Lᵀ`, with a column of L for each side and one for each node that floats. In
//! `h = b + S M h` put `z = Lᵀ h`: `(I - Lᵀ S L) z = Lᵀ b` is symmetric and positive, with
//! eigenvalues of at most 2, whatever the emissivities. It is solved by conjugate gradients
//! (M.R. Hestenes & E. Stiefel 1952, "Methods of conjugate gradients for solving linear systems").

use super::error::HeatError;
use super::exchange::Exchange;
use crate::progress::Progress;

/// Iterations at most.
const MOST: u32 = 20_000;

/// A node that a side is not of.
const NONE: u32 = u32::MAX;

/// What sides send out for what arrives.
pub(super) struct Network<'a> {
    exchange: &'a Exchange,
    /// √(ρ_i / A_i) of each side.
    reflected: Vec<f64>,
    /// ε_i / √a_k of each side of a node that floats, else 0.
    absorbed: Vec<f64>,
    /// Number of the node of each side, among those that float.
    node: Vec<u32>,
    /// How many float.
    floating: usize,
}

impl<'a> Network<'a> {
    /// `emissivity` is that of each side; `floating` says of each node, which `node_of` names for
    /// each side, whether its temperature is to be found.
    pub fn new(
        exchange: &'a Exchange,
        emissivity: &[f64],
        node_of: &[u32],
        floating: &[bool],
    ) -> Self {
        let weights = weights(exchange, emissivity, node_of, floating.len());
        let mut number = vec![NONE; floating.len()];
        let mut count = 0;
        for (number, _) in number.iter_mut().zip(floating).filter(|f| *f.1) {
            *number = count;
            count += 1;
        }
        let inverse = |a: f64| if a > 0.0 { 1.0 / a } else { 0.0 };
        let sides = || exchange.areas.iter().zip(emissivity).zip(node_of);
        let reflected = sides().map(|((a, e), _)| ((1.0 - e) * inverse(*a)).sqrt()).collect();
        let node: Vec<u32> = node_of.iter().map(|&k| number[k as usize]).collect();
        let again = |((_, e), k): ((_, &f64), &u32)| match floating[*k as usize] {
            true => e * inverse(weights[*k as usize]).sqrt(),
            false => 0.0,
        };
        let absorbed = sides().map(again).collect();
        Self { exchange, reflected, absorbed, node, floating: count as usize }
    }

    /// One whose sides only reflect what they do not absorb.
    pub fn of_reflectors(exchange: &'a Exchange, absorptance: &[f64]) -> Self {
        let node_of = vec![0; exchange.len()];
        Self::new(exchange, absorptance, &node_of, &[false])
    }

    /// `M h`: what sides send out (W/m²) for what arrives (W).
    pub fn sent(&self, h: &[f64]) -> Vec<f64> {
        self.up(&self.down(h))
    }

    /// Solves `h = b + S M h` (W) to that residual relative to b; also the iterations.
    pub fn solve(
        &self,
        b: &[f64],
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<(Vec<f64>, u32), HeatError> {
        let right = self.down(b);
        let whole = dot(&right, &right);
        if !whole.is_finite() {
            return Err(HeatError::Stalled { iterations: 0, residual: f64::INFINITY });
        }
        let (mut z, mut r) = (vec![0.0; right.len()], right);
        let (mut p, mut square, mut iterations) = (r.clone(), whole, 0);
        while square > tolerance * tolerance * whole {
            if iterations == MOST {
                let residual = (square / whole).sqrt();
                return Err(HeatError::Stalled { iterations, residual });
            }
            progress.advance(0)?;
            let through = self.down(&self.exchange.times(&self.up(&p)));
            let image: Vec<f64> = p.iter().zip(&through).map(|(p, t)| p - t).collect();
            let curvature = dot(&p, &image);
            if curvature <= 0.0 {
                // Nothing is left but what exchanges with itself alone.
                break;
            }
            let step = square / curvature;
            for ((z, r), (p, image)) in z.iter_mut().zip(&mut r).zip(p.iter().zip(&image)) {
                *z += step * p;
                *r -= step * image;
            }
            let next = dot(&r, &r);
            for (p, r) in p.iter_mut().zip(&r) {
                *p = r + next / square * *p;
            }
            square = next;
            iterations += 1;
        }
        let again = self.exchange.times(&self.up(&z));
        Ok((b.iter().zip(again).map(|(b, a)| b + a).collect(), iterations))
    }

    /// `Lᵀ h`.
    fn down(&self, h: &[f64]) -> Vec<f64> {
        let n = h.len();
        let mut z: Vec<f64> = self.reflected.iter().zip(h).map(|(l, h)| l * h).collect();
        z.resize(n + self.floating, 0.0);
        for ((k, l), h) in self.node.iter().zip(&self.absorbed).zip(h).filter(|x| *x.0.0 != NONE) {
            z[n + *k as usize] += l * h;
        }
        z
    }

    /// `L z`.
    fn up(&self, z: &[f64]) -> Vec<f64> {
        let (sides, nodes) = z.split_at(self.reflected.len());
        let again = |k: u32, l: f64| if k == NONE { 0.0 } else { l * nodes[k as usize] };
        let own = self.reflected.iter().zip(sides).map(|(l, z)| l * z);
        own.zip(self.node.iter().zip(&self.absorbed)).map(|(x, (k, l))| x + again(*k, *l)).collect()
    }
}

/// `a_k = Σ A_i ε_i` of each node, m².
pub(super) fn weights(
    exchange: &Exchange,
    emissivity: &[f64],
    node_of: &[u32],
    nodes: usize,
) -> Vec<f64> {
    let mut weights = vec![0.0; nodes];
    for ((a, e), k) in exchange.areas.iter().zip(emissivity).zip(node_of) {
        weights[*k as usize] += a * e;
    }
    weights
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
