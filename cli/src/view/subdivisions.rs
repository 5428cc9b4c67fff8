//! The solutions that a viewer has: on the patches that its command asks for, and on those of
//! another subdivision that its page wishes for.

use hemicube::form_factors::FormFactors;
use hemicube::progress::Progress;
use hemicube::scene::Scene;
use hemicube::store::Store;

use super::live::Told;
use crate::args::{EngineArg, Input, Light};
use crate::failure::Failure;
use crate::render::{light_failure, options_of};
use crate::solutions::{self, is_solution};

/// So many patches of one size are as small as adaptive subdivision makes any, where no smallest
/// size is given.
const FINEST: f64 = 5_000.0;

/// Solutions on the patches of one subdivision.
pub struct Solved {
    /// The tolerance of adaptive subdivision; `None` if it is uniform.
    tolerance: Option<f64>,
    pub store: Store,
    factors: FormFactors,
}

/// All that is solved, and which of it is shown.
pub struct Subdivisions<'a> {
    input: &'a Input,
    light: &'a Light,
    /// On the patches that the command asks for.
    asked: Solved,
    /// On those of another subdivision, which is shown if there is one.
    other: Option<Solved>,
    /// The subdivision that is wished for.
    wanted: Option<f64>,
}

impl<'a> Subdivisions<'a> {
    /// Solves as the command asks.
    pub fn new(
        scene: &Scene,
        input: &'a Input,
        light: &'a Light,
        told: &Told<'_>,
    ) -> Result<Self, Failure> {
        let (store, factors) = solutions::store(scene, input, light, &[], told)?;
        let tolerance = light.max_factor;
        // A file of solutions keeps its patches.
        told.live.subdivided(tolerance, !is_solution(&input.model.scene));
        let asked = Solved { tolerance, store, factors };
        Ok(Self { input, light, asked, other: None, wanted: tolerance })
    }

    /// What is shown.
    pub fn shown(&self) -> &Solved {
        self.other.as_ref().unwrap_or(&self.asked)
    }

    /// Solves for the reflectances that the scene has now, on the patches of the subdivision that
    /// is wished for; whether that is anything new. One that cannot be made is told of, and gives
    /// way to what the command asks for.
    pub fn make(
        &mut self,
        scene: &Scene,
        subdivision: Option<Option<f64>>,
        told: &Told<'_>,
    ) -> Result<bool, Failure> {
        let before = self.shown().tolerance;
        self.wanted = subdivision.unwrap_or(self.wanted);
        if self.wanted != before {
            // Memory holds two at a time.
            self.other = None;
        }
        if self.wanted != self.shown().tolerance {
            match self.subdivided(scene, told) {
                Ok(other) => self.other = Some(other),
                Err(failure) if told.live.is_wished() => return Err(failure),
                Err(Failure::Cancelled) => return Err(Failure::Cancelled),
                Err(failure) => {
                    self.wanted = self.asked.tolerance;
                    told.live.refuse(failure.to_string(), self.wanted);
                    told.warn(&failure.to_string());
                    told.bar.finish();
                }
            }
        }
        let (options, light) = (options_of(self.light)?, self.light);
        let shown = self.other.as_mut().unwrap_or(&mut self.asked);
        if !shown.store.reflects_as(scene) {
            let solved = shown.store.clone().solve_again(scene, &shown.factors, &options, told);
            shown.store = solved.map_err(|e| light_failure(e, light))?;
            return Ok(true);
        }
        Ok(shown.tolerance != before)
    }

    /// Solutions on the patches of the subdivision that is wished for.
    fn subdivided(&self, scene: &Scene, told: &Told<'_>) -> Result<Solved, Failure> {
        let (light, tolerance) = (self.light, self.wanted);
        let patches = &self.asked.store.patches;
        let area: f64 = patches.ids().map(|id| patches.area(id)).sum();
        let light = Light {
            max_factor: tolerance,
            min_patch: tolerance.and(light.min_patch.or(Some(area / FINEST))),
            // Form factors drive the subdivision, so each row of them is whole.
            engine: light.engine.filter(|&e| e == EngineArg::Hemicube),
            samples: None,
            error: None,
            ..light.clone()
        };
        let (store, factors) = solutions::store(scene, self.input, &light, &[], told)?;
        Ok(Solved { tolerance, store, factors })
    }
}
