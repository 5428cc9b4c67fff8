//! Where all the light goes: emitted = absorbed + absorbed by backs + escaped.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::System;
use crate::patches::PatchId;
use crate::scene::Rgb;

/// Flux in W (or lm) per channel; each term is computed on its own.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Emitted by surfaces, Σ A E.
    pub emitted: [f64; 3],
    /// Arriving from the sky, Σ A π L F_environment, and from lamps.
    pub received: [f64; 3],
    /// Absorbed by patches, Σ A (1 - ρ) H.
    pub absorbed: [f64; 3],
    /// Absorbed by backs which do not reflect, Σ A B back.
    pub absorbed_by_backs: [f64; 3],
    /// Escaped, Σ A B F_environment.
    pub escaped: [f64; 3],
    /// Lost numerically, Σ A B lost.
    pub lost: [f64; 3],
    /// (absorbed + absorbed by backs + escaped + lost) / (emitted + received) - 1, the worst
    /// channel: how far the form factors are from reciprocity.
    pub imbalance: f64,
}

impl EnergyBalance {
    /// The balance of a solution `h`; `lamps` is the part of D that comes from lamps, or empty.
    #[must_use]
    pub fn of(system: &System<'_>, emission: &[Rgb], sky: Rgb, lamps: &[Rgb], h: &[Rgb]) -> Self {
        let mut t = [Rgb::ZERO; 6];
        for (i, h) in h.iter().enumerate() {
            let id = PatchId(i as u32);
            let (a, rho, account) = (system.areas[i], system.rho[i], system.factors.account(id));
            let b = emission[i] + rho * *h;
            t[0] += emission[i] * a;
            t[1] += sky * (PI * account.environment * a);
            t[1] += lamps.get(i).map_or(Rgb::ZERO, |l| *l * a);
            t[2] += (Rgb::ONE - rho) * *h * a;
            t[3] += b * (a * account.back);
            t[4] += b * (a * account.environment);
            t[5] += b * (a * account.lost);
        }
        let [emitted, received, absorbed, absorbed_by_backs, escaped, lost] =
            t.map(|t| t.to_array());
        let imbalance = 0.0;
        let me = Self { emitted, received, absorbed, absorbed_by_backs, escaped, lost, imbalance };
        me.balanced()
    }

    /// The balance of light that is a sum, each part multiplied by a factor.
    pub(crate) fn sum<'a>(parts: impl Iterator<Item = (Rgb, &'a Self)>) -> Self {
        let mut me = Self::default();
        for (factor, part) in parts {
            let terms = me.terms_mut().into_iter().zip(part.terms());
            terms.for_each(|(all, term)| {
                (0..3).for_each(|c| all[c] += factor[c] * term[c]);
            });
        }
        me.balanced()
    }

    /// Lets so much be received.
    pub(crate) fn receive(&mut self, received: [f64; 3]) {
        *self = Self { received, ..*self }.balanced();
    }

    /// All fluxes.
    pub(crate) fn terms(&self) -> [[f64; 3]; 6] {
        let Self { emitted, received, absorbed, absorbed_by_backs, escaped, lost, .. } = *self;
        [emitted, received, absorbed, absorbed_by_backs, escaped, lost]
    }

    fn terms_mut(&mut self) -> [&mut [f64; 3]; 6] {
        let Self { emitted, received, absorbed, absorbed_by_backs, escaped, lost, .. } = self;
        [emitted, received, absorbed, absorbed_by_backs, escaped, lost]
    }

    /// The same with its imbalance.
    fn balanced(self) -> Self {
        let [source, sink] = [0..2, 2..6].map(|terms| {
            let terms = &self.terms()[terms];
            [0, 1, 2].map(|c| terms.iter().map(|t| t[c]).sum::<f64>())
        });
        let imbalance = (0..3)
            .filter(|&c| source[c] > 0.0)
            .map(|c| sink[c] / source[c] - 1.0)
            .fold(0.0, |worst: f64, x| if x.abs() > worst.abs() { x } else { worst });
        Self { imbalance, ..self }
    }
}
