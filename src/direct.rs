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

/// Receivers that look at emitters together: neighbours, mostly.
const TOGETHER: usize = 64;

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
    let emits: Vec<bool> = emission.iter().map(|e| *e != Rgb::ZERO).collect();
    let ids: Vec<PatchId> = patches.ids().collect();
    let of_block = |room: &mut Room, ids: &[PatchId]| {
        let with_row = |id: &&PatchId| factors.has_row(**id);
        let receivers: Vec<Receiver> =
            ids.iter().filter(with_row).map(|&id| emitters.patch(patches, id)).collect();
        emitters.look(&receivers, room);
        let mut lights = vec![DirectLight::default(); ids.len()];
        let lit = ids.iter().zip(&mut lights).filter(|(id, _)| with_row(id));
        for ((&id, light), receiver) in lit.zip(&receivers) {
            *light = emitters.light_patch(receiver, patches, id, room);
            let left = |j: usize| {
                let left = emits[j] && !emitters.is_apart(receiver, side(j));
                if left { emission[j] } else { Rgb::ZERO }
            };
            let through = match &halves {
                Some(halves) => halves.each_ref().map(|half| half.gather_by(id, left)),
                None => [factors.gather_by(id, left); 2],
            };
            light.irradiance += (through[0] + through[1]) * 0.5;
            for (half, through) in light.halves.iter_mut().zip(through) {
                *half += through;
            }
            *light += sky * (PI * factors.account(id).environment);
        }
        lights
    };
    ids.par_chunks(TOGETHER).map_init(Room::default, of_block).flatten_iter().collect()
}
