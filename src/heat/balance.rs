//! The heat balance: temperatures and net fluxes of all nodes, and what the whole adds up to.

use super::deviation::{Deviations, Solution, deviations};
use super::error::HeatError;
use super::network::{Network, weights};
use super::state::{Condition, HeatBalance, HeatInput, SideHeat, SurfaceHeat, over};
use super::sunlight::Sunlit;
use super::{emissive_power, temperature};
use crate::progress::Progress;

/// Relative residual that equations are solved to.
pub(super) const TOLERANCE: f64 = 1e-13;

/// Finds temperatures and net fluxes.
///
/// # Errors
/// If a number is out of range, no temperature settles, or the caller cancelled.
pub fn balance(input: &HeatInput<'_>, progress: &dyn Progress) -> Result<HeatBalance, HeatError> {
    let HeatInput { exchange, emissivity, node_of, conditions, .. } = *input;
    check(input)?;
    progress.stage("heat balance", 0);
    let sunlit = input.sunlight.map(|s| s.solve(exchange, TOLERANCE, progress)).transpose()?;
    let (supply, left_out) = supply(input, sunlit.as_ref());
    let settled = settled(input, &supply)?;
    let floating: Vec<bool> = conditions.iter().map(|c| matches!(c, Condition::Heat(_))).collect();
    let network = Network::new(exchange, emissivity, node_of, &floating);
    let weight = weights(exchange, emissivity, node_of, conditions.len());
    // All powers count from the lowest: so equal temperatures exchange nothing at all.
    let given = conditions.iter().filter_map(power_of).chain(input.environment.map(emissive_power));
    let lowest = given.fold(f64::INFINITY, f64::min);
    let lowest = if lowest.is_finite() { lowest } else { 0.0 };
    let around = input.environment.map_or(0.0, emissive_power) - lowest;
    let own: Vec<f64> = emissivity
        .iter()
        .zip(node_of)
        .map(|(e, &k)| match power_of(&conditions[k as usize]) {
            Some(power) => e * (power - lowest),
            None => e * over(supply[k as usize], weight[k as usize]),
        })
        .collect();
    let arriving = |sent: &[f64]| -> Vec<f64> {
        let between = exchange.times(sent);
        between.iter().zip(&exchange.environment).map(|(b, s)| b + s * around).collect()
    };
    let (found, iterations) = network.solve(&arriving(&own), TOLERANCE, progress)?;
    let sent: Vec<f64> = network.sent(&found).iter().zip(&own).map(|(m, c)| m + c).collect();
    let arriving = arriving(&sent);
    let mut absorbed = vec![0.0; conditions.len()];
    for ((e, &k), h) in emissivity.iter().zip(node_of).zip(&arriving) {
        absorbed[k as usize] += e * h;
    }
    let power = |k: usize| match power_of(&conditions[k]) {
        Some(power) => power - lowest,
        None => over(supply[k] + absorbed[k], weight[k]),
    };
    let most = (0..conditions.len()).map(power).fold(lowest, f64::max);
    // Rounding may leave a little less than nothing.
    let frozen = |k: &u32| settled[*k as usize] && power(*k as usize) + lowest < -1e-9 * most;
    if node_of.iter().any(frozen) {
        let taken = |i: &usize| supply[node_of[*i] as usize];
        let row = (0..exchange.len()).min_by(|i, j| taken(i).total_cmp(&taken(j))).unwrap_or(0);
        return Err(HeatError::BelowZero { row, supplied: taken(&row) });
    }
    // A node of one side hands on what it is supplied with, to the last digit.
    let alone = alone(node_of, &floating);
    let sides: Vec<SideHeat> = (0..exchange.len())
        .map(|i| {
            let k = node_of[i] as usize;
            let irradiance = over(arriving[i], exchange.areas[i]);
            SideHeat {
                temperature: settled[k].then(|| temperature(power(k) + lowest)),
                radiosity: sent[i] + lowest,
                irradiance: irradiance + lowest,
                flux: match alone[k] {
                    true => over(supply[k], exchange.areas[i]),
                    false => emissivity[i] * (power(k) - irradiance),
                },
                sunlight: sunlit.as_ref().map_or(0.0, |s| s.absorbed[i]),
                ..SideHeat::default()
            }
        })
        .collect();
    let leaving = exchange.environment.iter().zip(&sent).map(|(s, j)| s * (j - around)).sum();
    let solution = Solution {
        network: &network,
        weights: &weight,
        alone: &alone,
        sides: &sides,
        sunlit: sunlit.as_ref(),
    };
    let errors = deviations(input, &solution, progress)?;
    let found = summed(input, sides, leaving, sunlit.as_ref(), &errors);
    Ok(HeatBalance { left_out, iterations, ..found })
}

/// Whether each node floats and has one side alone.
fn alone(node_of: &[u32], floating: &[bool]) -> Vec<bool> {
    let mut count = vec![0; floating.len()];
    node_of.iter().for_each(|k| count[*k as usize] += 1);
    floating.iter().zip(count).map(|(floats, count)| *floats && count == 1).collect()
}

/// What a node emits whose temperature is given, W/m².
fn power_of(condition: &Condition) -> Option<f64> {
    match condition {
        Condition::Temperature(t) => Some(emissive_power(*t)),
        Condition::Heat(_) => None,
    }
}

fn check(input: &HeatInput<'_>) -> Result<(), HeatError> {
    let share = |e: &f64| (0.0..=1.0).contains(e);
    if let Some(row) = input.emissivity.iter().position(|e| !share(e)) {
        let value = input.emissivity[row];
        return Err(HeatError::Share { what: "an emissivity of", row, value });
    }
    let given = input.conditions.iter().filter_map(|c| match c {
        Condition::Temperature(t) => Some(*t),
        Condition::Heat(_) => None,
    });
    let is_temperature = |t: &f64| t.is_finite() && *t >= 0.0;
    if let Some(t) = given.chain(input.environment).find(|t| !is_temperature(t)) {
        return Err(HeatError::Temperature(t));
    }
    let heat = |c: &Condition| matches!(c, Condition::Heat(q) if !q.is_finite());
    match input.conditions.iter().find(|c| heat(c)) {
        Some(Condition::Heat(q) | Condition::Temperature(q)) => Err(HeatError::Flux(*q)),
        None => Ok(()),
    }
}

/// Heat that the infrared has to carry away from each node that floats, W; and what of it is left
/// out, since no side of the node exchanges with anything, with the number of these sides.
fn supply(input: &HeatInput<'_>, sunlit: Option<&Sunlit>) -> (Vec<f64>, (f64, usize)) {
    let heat = |c: &Condition| if let Condition::Heat(q) = c { *q } else { 0.0 };
    let mut supply: Vec<f64> = input.conditions.iter().map(heat).collect();
    let mut exchanges = vec![false; supply.len()];
    let isolated = input.exchange.isolated();
    for (k, isolated) in input.node_of.iter().zip(&isolated) {
        exchanges[*k as usize] |= !isolated;
    }
    let lost = |k: &u32| !exchanges[*k as usize] && supply[*k as usize] != 0.0;
    let rows = input.node_of.iter().filter(|k| lost(k)).count();
    let nodes = supply.iter_mut().zip(&exchanges).filter(|s| !s.1);
    let left_out = nodes.map(|(supply, _)| std::mem::take(supply)).sum();
    if let Some(sunlit) = sunlit {
        let rows = input.node_of.iter().zip(&sunlit.absorbed).zip(&input.exchange.areas);
        rows.for_each(|((k, s), a)| supply[*k as usize] += s * a);
    }
    (supply, (left_out, rows))
}

/// Whether each node has a temperature: one that is given, or that it takes because it exchanges,
/// through others if need be, with something of a given one.
fn settled(input: &HeatInput<'_>, supply: &[f64]) -> Result<Vec<bool>, HeatError> {
    let HeatInput { exchange, emissivity, node_of, conditions, .. } = *input;
    let n = exchange.len();
    let mut sets = exchange.sets();
    // A row of each node through which it takes and gives heat.
    let mut first = vec![None; conditions.len()];
    for i in 0..n {
        if emissivity[i] > 0.0 {
            let first = *first[node_of[i] as usize].get_or_insert(i);
            sets.join(i as u32, first as u32);
        }
    }
    let (mut anchored, mut heat) = (vec![false; n], vec![[0.0; 2]; n]);
    for i in 0..n {
        let set = sets.find(i as u32) as usize;
        let fixed = power_of(&conditions[node_of[i] as usize]).is_some() && emissivity[i] > 0.0;
        let out = input.environment.is_some() && exchange.environment[i] > 0.0;
        anchored[set] |= fixed || out;
    }
    let mut row = vec![None; conditions.len()];
    node_of.iter().enumerate().for_each(|(i, k)| row[*k as usize] = Some(i));
    for (k, first) in first.iter().enumerate().filter(|k| supply[k.0] != 0.0) {
        match (first, row[k]) {
            (Some(i), _) => {
                let heat = &mut heat[sets.find(*i as u32) as usize];
                *heat = [heat[0] + supply[k], heat[1] + supply[k].abs()];
            }
            (None, Some(_)) if power_of(&conditions[k]).is_none() => {
                return Err(HeatError::White { node: k });
            }
            _ => {}
        }
    }
    // What is taken may be all that is given, but for rounding.
    let uneven = |i: &usize| !anchored[*i] && heat[*i][0].abs() > 1e-12 * heat[*i][1];
    if let Some(row) = (0..n).find(uneven) {
        return Err(HeatError::Unbounded { row, supplied: heat[row][0] });
    }
    let mut reached = |i: usize| anchored[sets.find(i as u32) as usize];
    let known = conditions.iter().zip(&first);
    Ok(known.map(|(c, first)| power_of(c).is_some() || first.is_some_and(&mut reached)).collect())
}

/// Sums over surfaces and over all.
fn summed(
    input: &HeatInput<'_>,
    mut sides: Vec<SideHeat>,
    to_environment: f64,
    sunlit: Option<&Sunlit>,
    deviations: &Deviations,
) -> HeatBalance {
    let areas = &input.exchange.areas;
    for (side, error) in sides.iter_mut().zip(&deviations.sides) {
        let known = side.temperature.is_some();
        [side.temperature_error, side.flux_error] = [if known { error[0] } else { 0.0 }, error[1]];
    }
    let mut surfaces = vec![SurfaceHeat::default(); input.surfaces];
    let mut sums = vec![[0.0; 2]; input.surfaces];
    let mut gross = vec![0.0; input.surfaces];
    for ((side, &a), &s) in sides.iter().zip(areas).zip(input.surface_of) {
        let (surface, sums) = (&mut surfaces[s as usize], &mut sums[s as usize]);
        surface.area += a;
        surface.net += a * side.net();
        surface.sunlight += a * side.sunlight;
        gross[s as usize] += a * (side.flux.abs() + side.sunlight);
        if let Some(t) = side.temperature {
            *sums = [sums[0] + a * t, sums[1] + a];
            let [_, low, high] = surface.temperature.unwrap_or([0.0, t, t]);
            surface.temperature = Some([0.0, low.min(t), high.max(t)]);
        }
    }
    for (surface, gross) in surfaces.iter_mut().zip(gross) {
        // What sides give and take cancels but for rounding.
        if surface.net.abs() < 1e-14 * gross {
            surface.net = 0.0;
        }
    }
    for ((surface, [sum, area]), error) in surfaces.iter_mut().zip(sums).zip(&deviations.surfaces) {
        if let Some([mean, low, high]) = &mut surface.temperature {
            *mean = if area > 0.0 { (sum / area).clamp(*low, *high) } else { *low };
        }
        [surface.temperature_error, surface.net_error] = *error;
    }
    let mut nodes = vec![0.0; input.conditions.len()];
    for ((side, a), &k) in sides.iter().zip(areas).zip(input.node_of) {
        nodes[k as usize] += a * side.net();
    }
    let positive = |sign: f64| nodes.iter().map(|q| (sign * q).max(0.0)).sum::<f64>();
    let (supplied, removed) = (positive(1.0), positive(-1.0));
    let absorbed = sides.iter().zip(areas).map(|(s, a)| s.sunlight * a).sum::<f64>();
    let [received, escaped] = sunlit.map_or([0.0; 2], |s| [s.received, s.escaped]);
    let infrared = supplied - removed + absorbed - to_environment;
    let exchanged = supplied.max(removed).max(to_environment.abs()).max(received);
    let missing = infrared.abs() + (received - escaped - absorbed).abs();
    HeatBalance {
        sides,
        surfaces,
        supplied,
        removed,
        to_environment,
        sunlight: [received, escaped, absorbed],
        imbalance: over(missing, exchanged),
        left_out: (0.0, 0),
        iterations: 0,
    }
}
