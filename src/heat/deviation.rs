//! How far errors of the form factors carry: to first order, by draws of what they may be.
//!
//! Each exchange area is off by `± e S_ij`, where e is the relative error that the matrix states,
//! independently of others. What one pair has too much either side has too little elsewhere: with
//! the environment where the side sees it, else with itself. So
//!
//! ```text
//! δh = δS J + S δJ        δJ = M δh + δc
//! ```
//!
//! is the same network, driven by `δS J`.

use rayon::prelude::*;

use super::emissive_power;
use super::error::HeatError;
use super::exchange::{Exchange, added};
use super::network::Network;
use super::state::{Condition, HeatInput, SideHeat, over};
use super::sunlight::Sunlit;
use crate::engines::sampling::Random;
use crate::progress::Progress;

/// Draws; what they tell is known to a fifth.
const DRAWS: usize = 16;

/// Relative residual of their equations.
const TOLERANCE: f64 = 1e-3;

/// Half the width of a 95 % interval over its standard deviation.
const WIDTH: f64 = 1.96;

/// Half-widths of 95 % intervals: of temperature (K), and of net flux (W/m²) or heat (W).
pub(super) struct Deviations {
    pub sides: Vec<[f64; 2]>,
    pub surfaces: Vec<[f64; 2]>,
}

/// A solution, which has errors.
pub(super) struct Solution<'a> {
    pub network: &'a Network<'a>,
    /// `a_k` of each node, m².
    pub weights: &'a [f64],
    /// Whether each node floats and has one side alone, so that its net flux is known.
    pub alone: &'a [bool],
    pub sides: &'a [SideHeat],
    pub sunlit: Option<&'a Sunlit>,
}

/// The errors of a solution.
pub(super) fn deviations(
    input: &HeatInput<'_>,
    solution: &Solution<'_>,
    progress: &dyn Progress,
) -> Result<Deviations, HeatError> {
    let HeatInput { exchange, emissivity, node_of, conditions, surface_of, .. } = *input;
    let Solution { network, weights, sunlit, alone, .. } = *solution;
    let n = exchange.len();
    let mut sides = vec![[0.0; 2]; n];
    let mut surfaces = vec![[0.0; 2]; input.surfaces];
    let done = |sides, surfaces| Ok(Deviations { sides, surfaces });
    if input.error == 0.0 {
        return done(sides, surfaces);
    }
    let mut area = vec![0.0; input.surfaces];
    surface_of.iter().zip(&exchange.areas).for_each(|(s, a)| area[*s as usize] += a);
    let sent: Vec<f64> = solution.sides.iter().map(|s| s.radiosity).collect();
    let around = input.environment.map_or(0.0, emissive_power);
    let driven = driven(exchange, input.error, &sent, around);
    // Kelvin a W/m² more: T⁴ is in proportion to what is emitted.
    let slope = |side: &SideHeat| match side.temperature {
        Some(t) if t > 0.0 => 0.25 * t / emissive_power(t),
        _ => 0.0,
    };
    let slopes: Vec<f64> = solution.sides.iter().map(slope).collect();
    let sun = match (sunlit, input.sunlight) {
        (Some(lit), Some(sun)) => {
            let share = lit.irradiance.iter().zip(sun.absorptance);
            let reflected: Vec<f64> = share.map(|(h, a)| h * (1.0 - a)).collect();
            let driven = self::driven(exchange, input.error, &reflected, sun.diffuse);
            Some((driven, sun.absorptance, Network::of_reflectors(exchange, sun.absorptance)))
        }
        _ => None,
    };
    for (d, driven) in driven.iter().enumerate() {
        // Sunlight absorbed, W.
        let sunlight: Option<Vec<f64>> = match &sun {
            Some((of_sunlight, absorptance, network)) => {
                let (arriving, _) = network.solve(&of_sunlight[d], TOLERANCE, progress)?;
                Some(arriving.iter().zip(*absorptance).map(|(h, a)| h * a).collect())
            }
            None => None,
        };
        let mut first = driven.clone();
        let mut supply = vec![0.0; conditions.len()];
        if let Some(sunlight) = &sunlight {
            node_of.iter().zip(sunlight).for_each(|(k, s)| supply[*k as usize] += s);
            let own: Vec<f64> = (0..n)
                .map(|i| match conditions[node_of[i] as usize] {
                    Condition::Temperature(_) => 0.0,
                    Condition::Heat(_) => {
                        let k = node_of[i] as usize;
                        emissivity[i] * over(supply[k], weights[k])
                    }
                })
                .collect();
            first.iter_mut().zip(exchange.times(&own)).for_each(|(f, o)| *f += o);
        }
        let (arriving, _) = network.solve(&first, TOLERANCE, progress)?;
        let mut absorbed = supply;
        for ((k, e), h) in node_of.iter().zip(emissivity).zip(&arriving) {
            absorbed[*k as usize] += e * h;
        }
        let mut sums = vec![[0.0; 2]; input.surfaces];
        for i in 0..n {
            let (k, a) = (node_of[i] as usize, exchange.areas[i]);
            let (power, slope) = match conditions[k] {
                Condition::Temperature(_) => (0.0, 0.0),
                Condition::Heat(_) => (over(absorbed[k], weights[k]), slopes[i]),
            };
            let sun = sunlight.as_ref().map_or(0.0, |s| over(s[i], a));
            let flux = emissivity[i] * (power - over(arriving[i], a)) - sun;
            let off = [power * slope, if alone[k] { 0.0 } else { flux }];
            let sum = &mut sums[surface_of[i] as usize];
            for q in 0..2 {
                sides[i][q] += off[q] * off[q];
                sum[q] += a * off[q];
            }
        }
        for ((surface, sum), area) in surfaces.iter_mut().zip(sums).zip(&area) {
            let mean = over(sum[0], *area);
            surface[0] += mean * mean;
            surface[1] += sum[1] * sum[1];
        }
    }
    let width = |square: f64| WIDTH * (square / DRAWS as f64).sqrt();
    for pair in sides.iter_mut().chain(&mut surfaces) {
        *pair = pair.map(width);
    }
    done(sides, surfaces)
}

/// `δS J` of each draw, W.
fn driven(exchange: &Exchange, error: f64, sent: &[f64], around: f64) -> Vec<Vec<f64>> {
    let n = exchange.len();
    let sees = |i: usize| exchange.environment[i] > 0.0;
    let against = |i: usize| if sees(i) { around } else { sent[i] };
    let parts = exchange.in_parts(|part| {
        let mut sums = vec![0.0; DRAWS * n];
        for i in part {
            for (j, s) in exchange.row(i) {
                let signs = signs(i, j);
                let to_i = error * s * (sent[j] - against(i));
                let to_j = error * s * (sent[i] - against(j));
                for d in 0..DRAWS {
                    let sign = if signs >> d & 1 == 0 { 1.0 } else { -1.0 };
                    sums[d * n + i] += sign * to_i;
                    sums[d * n + j] += sign * to_j;
                }
            }
        }
        sums
    });
    added(parts).par_chunks(n.max(1)).map(<[f64]>::to_vec).collect()
}

/// Random bits that belong to a pair.
pub(super) fn signs(i: usize, j: usize) -> u64 {
    Random::new((i as u64) << 32 | j as u64).bits()
}
