//! Direct light: the irradiance D that arrives straight from emitters, lamps and the sky, and the
//! optics of patches that it starts from.

mod lamps;

use std::f64::consts::PI;

use rayon::prelude::*;

pub use lamps::from_lamps;

use crate::form_factors::FormFactors;
use crate::patches::{PatchId, Patches};
use crate::scene::{Optics, Rgb, Side, TriangleId};

/// Reflectance ρ of each patch, 0..1: its source triangle's; of a cluster the mean by area.
#[must_use]
pub fn reflectance(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, _| optics.reflectance[t.index()])
}

/// Emission E (self-emitted exitance, W/m² or lm/m²) of each patch: its source triangle side's; of
/// a cluster the mean by area.
#[must_use]
pub fn emission(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, side| optics.emission(t, side))
}

/// The mean over each patch of what its source triangles' sides have.
fn mean(patches: &Patches, value: impl Fn(TriangleId, Side) -> Rgb) -> Vec<Rgb> {
    let of = |id: PatchId| {
        let cell = patches.cell(id);
        let first = value(cell.triangle, cell.side);
        // Exact where all are alike, as nearly always.
        if patches.members(id).iter().all(|&t| value(t, cell.side) == first) {
            return first;
        }
        patches.shares(id).map(|(t, share)| value(t, cell.side) * share).sum()
    };
    patches.ids().map(of).collect()
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
            let id = PatchId(i);
            factors.gather(id, emission) + sky * (PI * factors.account(id).environment)
        })
        .collect()
}
