//! Direct light: the irradiance D that arrives straight from emitters, lamps and the sky, and the
//! optics of patches that it starts from.

mod emitters;
mod lamps;

pub use emitters::{Apart, ApartOptions, DirectLight, Emitters, MOST_SHADOW, Receiver, Room};
pub use lamps::from_lamps;
pub(crate) use lamps::lamps_at;

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::form_factors::FormFactors;
use crate::patches::{PatchId, Patches, side_index};
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

/// Direct irradiance of each patch with a row: from the emitters set apart for it by shadow rays, from
/// the others and the sky through its sampled row.
#[must_use]
pub fn apart(
    emitters: &Emitters<'_>,
    patches: &Patches,
    factors: &FormFactors,
    emission: &[Rgb],
    sky: Rgb,
) -> Vec<DirectLight> {
    let halves = factors.halves();
    let side = |j: usize| {
        let cell = patches.cell(PatchId(j as u32));
        side_index(cell.triangle, cell.side)
    };
    (0..patches.len() as u32)
        .into_par_iter()
        .map_init(Room::default, |room, i| {
            let id = PatchId(i);
            if !factors.has_row(id) {
                return DirectLight::default();
            }
            let receiver = emitters.patch(patches, id);
            let mut light = emitters.light_patch(&receiver, patches, id, room);
            let left = |j: usize| {
                let e = emission[j];
                if e == Rgb::ZERO || emitters.is_apart(&receiver, side(j)) { Rgb::ZERO } else { e }
            };
            let through = factors.gather_by(id, left);
            light.irradiance += through;
            for (k, half) in light.halves.iter_mut().enumerate() {
                *half += halves.as_ref().map_or(through, |h| h[k].gather_by(id, left));
            }
            light += sky * (PI * factors.account(id).environment);
            light
        })
        .collect()
}
