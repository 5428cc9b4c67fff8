//! The band of sunlight: what arrives, is reflected between the surfaces, and is absorbed.

use super::error::HeatError;
use super::exchange::Exchange;
use super::network::Network;
use crate::progress::Progress;

/// Sunlight that comes to the surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Sunlight<'a> {
    /// Share of it that each row absorbs, 0..1; the rest it reflects diffusely.
    pub absorptance: &'a [f64],
    /// Irradiance of each row straight from the sun, W/m².
    pub direct: &'a [f64],
    /// What the environment sends in from everywhere, as irradiance of what faces nothing else,
    /// W/m².
    pub diffuse: f64,
}

/// What becomes of sunlight.
#[derive(Debug, Clone)]
pub struct Sunlit {
    /// Irradiance of each row, reflections included, W/m².
    pub irradiance: Vec<f64>,
    /// What each row absorbs, W/m².
    pub absorbed: Vec<f64>,
    /// What comes in, W.
    pub received: f64,
    /// What leaves again, W.
    pub escaped: f64,
}

impl Sunlight<'_> {
    /// Solves `H = D + F ρ H` for it to a relative residual of `tolerance`.
    pub(super) fn solve(
        &self,
        exchange: &Exchange,
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Sunlit, HeatError> {
        self.check()?;
        let (areas, out) = (&exchange.areas, &exchange.environment);
        let network = Network::of_reflectors(exchange, self.absorptance);
        let direct: Vec<f64> = areas.iter().zip(self.direct).map(|(a, d)| a * d).collect();
        // W that arrive before anything is reflected.
        let first: Vec<f64> = direct.iter().zip(out).map(|(d, s)| d + s * self.diffuse).collect();
        let (arriving, _) = network.solve(&first, tolerance, progress)?;
        let sent = network.sent(&arriving);
        let again = exchange.times(&sent);
        let per_area = |(w, a): (f64, &f64)| if *a > 0.0 { w / a } else { 0.0 };
        let irradiance: Vec<f64> =
            first.iter().zip(again).map(|(f, a)| f + a).zip(areas).map(per_area).collect();
        let absorbed = irradiance.iter().zip(self.absorptance).map(|(h, a)| h * a).collect();
        Ok(Sunlit {
            absorbed,
            received: first.iter().sum(),
            escaped: sent.iter().zip(out).map(|(j, s)| j * s).sum(),
            irradiance,
        })
    }

    fn check(&self) -> Result<(), HeatError> {
        let share = |value: &f64| (0.0..=1.0).contains(value);
        if let Some(row) = self.absorptance.iter().position(|a| !share(a)) {
            let value = self.absorptance[row];
            return Err(HeatError::Share { what: "an absorptance of", row, value });
        }
        let wrong = |d: &&f64| !(d.is_finite() && **d >= 0.0);
        match self.direct.iter().chain([&self.diffuse]).find(wrong) {
            Some(&flux) => Err(HeatError::Flux(flux)),
            None => Ok(()),
        }
    }
}
