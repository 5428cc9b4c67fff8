//! Direct light of patches from emitters, analytic for those that rays find badly.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::emitters::{Emitters, Receiver, Workspace};
use super::light::DirectLight;
use super::optics::{emission, reflectance};
use super::options::{Analytic, DirectOptions};
use crate::form_factors::FormFactors;
use crate::patches::{PatchId, Patches, side_index};
use crate::ranks::RanksError;
use crate::scene::{Rgb, Scene};
use crate::visibility::Bvh;

/// Direct light of each patch by a sum over emitters: analytic and with shadow rays for those that
/// `options` choose, through the patch's sampled row for the others and the sky.
///
/// An emitter that reflects is seen with its own light upon it, which no shadow ray knows: a small
/// bright thing, which rays find badly. So an estimate of what emitters reflect is added to what
/// they emit, and taken away again where rays meet it (a control variate). The estimate need not be
/// right, as the mean stays what it is; but the better it is, the less noise is left.
pub fn analytic(
    scene: &Scene,
    patches: &Patches,
    factors: &FormFactors,
    bvh: &Bvh,
    options: DirectOptions,
) -> Result<Vec<DirectLight>, RanksError> {
    let (geometry, optics) = (&scene.geometry, &scene.optics);
    let emission = emission(optics, patches);
    let rho = reflectance(optics, patches);
    let emits: Vec<bool> = emission.iter().map(|e| *e != Rgb::ZERO).collect();
    let reflects = |i: &PatchId| emits[i.index()] && rho[i.index()] != Rgb::ZERO;
    let mirrors: Vec<PatchId> =
        patches.ids().filter(|i| reflects(i) && factors.has_row(*i)).collect();
    let mut light = PatchLight {
        patches,
        factors,
        halves: factors.halves(),
        emits,
        emission,
        reflected: vec![Rgb::ZERO; patches.len()],
        sky: scene.sky,
    };
    let mut reflected = vec![Rgb::ZERO; 2 * geometry.len()];
    if options.analytic != Analytic::None && !mirrors.is_empty() {
        /// Shadow rays that are good enough for a guess.
        const FEW: usize = 16;
        let guess = DirectOptions { shadow: FEW.min(options.shadow), ..options };
        let emitters = Emitters::new(geometry, optics, patches, bvh, guess, |_| Rgb::ZERO);
        let direct = light.of(&emitters, &mirrors)?;
        let h = among(factors, &mirrors, &rho, &direct)?;
        let mut areas = vec![0.0; reflected.len()];
        for &i in &mirrors {
            let side = light.side(i);
            reflected[side] += rho[i.index()] * h[i.index()] * patches.own_area(i);
            areas[side] += patches.own_area(i);
        }
        for &i in &mirrors {
            let side = light.side(i);
            let mean = reflected[side] / areas[side];
            light.reflected[i.index()] = like_a_lamp(mean, light.emission[i.index()]);
        }
        for &i in &mirrors {
            reflected[light.side(i)] = light.reflected[i.index()];
        }
    }
    let emitters = Emitters::new(geometry, optics, patches, bvh, options, |side| reflected[side]);
    light.of(&emitters, &patches.ids().collect::<Vec<_>>())
}

/// How much of what an emitter reflects is taken with what it emits: no more than that. An emitter
/// that reflects more is less a lamp than a wall, of which rays find enough.
pub(super) fn like_a_lamp(reflected: Rgb, emission: Rgb) -> Rgb {
    reflected.min(emission)
}

/// Irradiance of some patches by their own `direct` light and what they reflect to each other.
fn among(
    factors: &FormFactors,
    ids: &[PatchId],
    rho: &[Rgb],
    direct: &[DirectLight],
) -> Result<Vec<Rgb>, RanksError> {
    /// Bounces after which the rest is too little to matter for a guess.
    const BOUNCES: usize = 4;
    let mut h = vec![Rgb::ZERO; factors.len()];
    let own: Vec<PatchId> = factors.own(ids).concat();
    for _ in 0..BOUNCES {
        let gather =
            |&i: &PatchId| factors.gather_by(i, |j| rho[j.index()] * h[j.index()]).to_array();
        let gathered = factors.share(ids, own.par_iter().map(gather).collect())?;
        for ((&i, d), gathered) in ids.iter().zip(direct).zip(gathered) {
            h[i.index()] = d.irradiance + Rgb::from_array(gathered);
        }
    }
    Ok(h)
}

/// What is needed to find the direct light of any patch.
struct PatchLight<'a> {
    patches: &'a Patches,
    factors: &'a FormFactors,
    halves: Option<[FormFactors; 2]>,
    emits: Vec<bool>,
    emission: Vec<Rgb>,
    /// An estimate of what emitters reflect of each other's light.
    reflected: Vec<Rgb>,
    sky: Rgb,
}

impl PatchLight<'_> {
    fn side(&self, id: PatchId) -> usize {
        let cell = self.patches.cell(id);
        side_index(cell.triangle, cell.side)
    }

    /// Direct light of some patches; none of those without a row.
    fn of(&self, emitters: &Emitters<'_>, ids: &[PatchId]) -> Result<Vec<DirectLight>, RanksError> {
        /// Receivers that look at emitters together: neighbours, mostly.
        const TOGETHER: usize = 64;
        let with_row = |id: &&PatchId| self.factors.has_row(**id);
        let of_block = |work: &mut Workspace, ids: &[PatchId]| {
            let receivers: Vec<Receiver> =
                ids.iter().filter(with_row).map(|&id| emitters.patch(self.patches, id)).collect();
            emitters.look(&receivers, work);
            let mut lights = vec![DirectLight::default(); ids.len()];
            let lit = ids.iter().zip(&mut lights).filter(|(id, _)| with_row(id));
            for ((&id, light), receiver) in lit.zip(&receivers) {
                *light = emitters.light_patch(receiver, self.patches, id, work);
                let through = self.through(emitters, receiver, id);
                light.irradiance += (through[0] + through[1]) * 0.5;
                for (half, through) in light.halves.iter_mut().zip(through) {
                    *half += through;
                }
                *light += self.sky * (PI * self.factors.account(id).environment);
            }
            lights
        };
        let own = self.factors.own(ids).into_iter().flat_map(|part| part.chunks(TOGETHER));
        let blocks: Vec<&[PatchId]> = own.collect();
        let found = blocks.into_par_iter().map_init(Workspace::default, of_block).flatten_iter();
        let found = found.map(DirectLight::to_array).collect();
        let all = self.factors.share(ids, found)?;
        Ok(all.into_iter().map(DirectLight::from_array).collect())
    }

    /// What each half of a row adds: the light of emitters that are not analytic, less the estimate
    /// of what the analytic ones reflect.
    fn through(&self, emitters: &Emitters<'_>, receiver: &Receiver, id: PatchId) -> [Rgb; 2] {
        let left = |j: PatchId| {
            if !self.emits[j.index()] {
                Rgb::ZERO
            } else if emitters.is_analytic(receiver, self.side(j)) {
                -self.reflected[j.index()]
            } else {
                self.emission[j.index()]
            }
        };
        match &self.halves {
            Some(halves) => halves.each_ref().map(|half| half.gather_by(id, left)),
            None => [self.factors.gather_by(id, left); 2],
        }
    }
}
