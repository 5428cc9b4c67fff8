//! Direct light: the irradiance D that arrives straight from emitters, lamps and the sky, and the
//! optics of patches that it starts from.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::form_factors::FormFactors;
use crate::patches::Patches;
use crate::scene::{Optics, Rgb};

/// Reflectance ρ of each patch, 0..1: its source triangle's.
#[must_use]
pub fn reflectance(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    patches.ids().map(|i| optics.reflectance[patches.cell(i).triangle.index()]).collect()
}

/// Emission E (self-emitted exitance, W/m² or lm/m²) of each patch: its source triangle side's.
#[must_use]
pub fn emission(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    patches
        .ids()
        .map(|i| {
            let cell = patches.cell(i);
            optics.emission(cell.triangle, cell.side)
        })
        .collect()
}

/// Direct irradiance of each patch (W/m² or lx) through its stored row:
///
/// ```text
/// D = F E + π L F_environment
/// ```
///
/// with the sky's uniform radiance L.
#[must_use]
pub fn through_rows(factors: &FormFactors, emission: &[Rgb], sky: Rgb) -> Vec<Rgb> {
    (0..factors.len() as u32)
        .into_par_iter()
        .map(|i| {
            let id = crate::patches::PatchId(i);
            factors.gather(id, emission) + sky * (PI * factors.account(id).environment)
        })
        .collect()
}
