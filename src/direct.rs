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
use crate::scene::{Optics, Rgb, Scene, Side, TriangleId};
use crate::visibility::Bvh;

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

/// Direct light apart from the rows of `factors`: of the emitters that `options` set apart for each
/// patch by shadow rays, of the others and the sky through its sampled row.
///
/// An emitter that reflects is seen with its own light upon it, which no shadow ray knows: a small
/// bright thing, which rays find badly. So what emitters are thought to reflect is set apart with what
/// they emit, and taken away again where rays meet it (a control variate): the thought need
/// not be right, as the mean stays what it is, but the better it is the less noise is left.
#[must_use]
pub fn apart(
    scene: &Scene,
    patches: &Patches,
    factors: &FormFactors,
    bvh: &Bvh,
    options: ApartOptions,
) -> Vec<DirectLight> {
    let (geometry, optics) = (&scene.geometry, &scene.optics);
    let emission = emission(optics, patches);
    let rho = reflectance(optics, patches);
    let emits: Vec<bool> = emission.iter().map(|e| *e != Rgb::ZERO).collect();
    let reflects = |i: &PatchId| emits[i.index()] && rho[i.index()] != Rgb::ZERO;
    let mirrors: Vec<PatchId> =
        patches.ids().filter(|i| reflects(i) && factors.has_row(*i)).collect();
    let mut light = Apartness {
        patches,
        factors,
        halves: factors.halves(),
        emits,
        emission,
        reflected: vec![Rgb::ZERO; patches.len()],
        sky: scene.sky,
    };
    let mut reflected = vec![Rgb::ZERO; 2 * geometry.len()];
    if options.which != Apart::None && !mirrors.is_empty() {
        /// Shadow rays that are good enough for a guess.
        const FEW: usize = 16;
        let guess = ApartOptions { shadow: FEW.min(options.shadow), ..options };
        let emitters = Emitters::new(geometry, optics, patches, bvh, guess, |_| Rgb::ZERO);
        let direct = light.of(&emitters, &mirrors);
        let h = among(factors, patches.len(), &mirrors, &rho, &direct);
        let mut areas = vec![0.0; reflected.len()];
        for &i in &mirrors {
            let side = light.side(i.index());
            reflected[side] += rho[i.index()] * h[i.index()] * patches.own_area(i);
            areas[side] += patches.own_area(i);
        }
        for &i in &mirrors {
            let side = light.side(i.index());
            let mean = reflected[side] / areas[side];
            light.reflected[i.index()] = of_a_lamp(mean, light.emission[i.index()]);
        }
        for &i in &mirrors {
            reflected[light.side(i.index())] = light.reflected[i.index()];
        }
    }
    let emitters = Emitters::new(geometry, optics, patches, bvh, options, |side| reflected[side]);
    light.of(&emitters, &patches.ids().collect::<Vec<_>>())
}

/// How much of what an emitter reflects is set apart: if that is more than it emits, it is less a lamp
/// than a wall, of which rays find enough.
pub(crate) fn of_a_lamp(reflected: Rgb, emission: Rgb) -> Rgb {
    reflected.min(emission)
}

/// Irradiance of some patches by their own `direct` light and what they reflect to each other.
fn among(
    factors: &FormFactors,
    patches: usize,
    ids: &[PatchId],
    rho: &[Rgb],
    direct: &[DirectLight],
) -> Vec<Rgb> {
    /// Bounces after which the rest is too little to matter for a guess.
    const BOUNCES: usize = 4;
    let mut h = vec![Rgb::ZERO; patches];
    for _ in 0..BOUNCES {
        let next: Vec<Rgb> = ids
            .par_iter()
            .zip(direct)
            .map(|(&i, d)| d.irradiance + factors.gather_by(i, |j| rho[j.index()] * h[j.index()]))
            .collect();
        for (&i, next) in ids.iter().zip(next) {
            h[i.index()] = next;
        }
    }
    h
}

/// What is needed to find the direct light of any patch.
struct Apartness<'a> {
    patches: &'a Patches,
    factors: &'a FormFactors,
    halves: Option<[FormFactors; 2]>,
    emits: Vec<bool>,
    emission: Vec<Rgb>,
    /// What emitters reflect of the light set apart.
    reflected: Vec<Rgb>,
    sky: Rgb,
}

impl Apartness<'_> {
    fn side(&self, j: usize) -> usize {
        let cell = self.patches.cell(PatchId(j as u32));
        side_index(cell.triangle, cell.side)
    }

    /// Direct light of some patches; none of those without a row.
    fn of(&self, emitters: &Emitters<'_>, ids: &[PatchId]) -> Vec<DirectLight> {
        /// Receivers that look at emitters together: neighbours, mostly.
        const TOGETHER: usize = 64;
        let with_row = |id: &&PatchId| self.factors.has_row(**id);
        let of_block = |room: &mut Room, ids: &[PatchId]| {
            let receivers: Vec<Receiver> =
                ids.iter().filter(with_row).map(|&id| emitters.patch(self.patches, id)).collect();
            emitters.look(&receivers, room);
            let mut lights = vec![DirectLight::default(); ids.len()];
            let lit = ids.iter().zip(&mut lights).filter(|(id, _)| with_row(id));
            for ((&id, light), receiver) in lit.zip(&receivers) {
                *light = emitters.light_patch(receiver, self.patches, id, room);
                let through = self.through(emitters, receiver, id);
                light.irradiance += (through[0] + through[1]) * 0.5;
                for (half, through) in light.halves.iter_mut().zip(through) {
                    *half += through;
                }
                *light += self.sky * (PI * self.factors.account(id).environment);
            }
            lights
        };
        ids.par_chunks(TOGETHER).map_init(Room::default, of_block).flatten_iter().collect()
    }

    /// What each half of a row adds: the light of emitters that are not set apart, less what those that
    /// are were thought to reflect.
    fn through(&self, emitters: &Emitters<'_>, receiver: &Receiver, id: PatchId) -> [Rgb; 2] {
        let left = |j: PatchId| {
            let j = j.index();
            if !self.emits[j] {
                Rgb::ZERO
            } else if emitters.is_apart(receiver, self.side(j)) {
                -self.reflected[j]
            } else {
                self.emission[j]
            }
        };
        match &self.halves {
            Some(halves) => halves.each_ref().map(|half| half.gather_by(id, left)),
            None => [self.factors.gather_by(id, left); 2],
        }
    }
}
