//! Standard errors of the irradiance of patches, and what they say of the whole solution.

use rayon::prelude::*;

use super::neighbours::{Neighbour, TURN, groups, halve};
use crate::patches::PatchId;
use crate::reconstruct::Field;
use crate::report::ErrorReport;
use crate::scene::{Geometry, Rgb, luminance};
use crate::solution::Solution;

/// Variance of the distance between a patch's value and the field at its centre, relative to the
/// variance of values: within a regular grid, where the field takes a sixth of each value.
const SMOOTHED: f64 = 0.78;

/// Irradiance below this fraction of its mean is judged relative to that.
const DARK: f64 = 0.01;

/// Standard errors of the irradiance of each patch.
#[derive(Debug, Clone)]
pub struct Uncertainty {
    /// Standard error due to sampling, W/m² or lx; zero where rows are not sampled.
    pub noise: Vec<Rgb>,
    /// RMS error of the field over the patch due to its size.
    pub refinement: Vec<Rgb>,
}

impl Uncertainty {
    /// Of a solution, whose field is `field`. Patches without a usable value are taken to be
    /// exact.
    #[must_use]
    pub fn of(geometry: &Geometry, solution: &Solution, field: &Field<'_>) -> Self {
        Self::of_values(geometry, solution, field, solution.halves.as_ref())
    }

    /// Of the light that arrives by way of other surfaces alone, whose field is `field`.
    #[must_use]
    pub fn of_reflected(geometry: &Geometry, solution: &Solution, field: &Field<'_>) -> Self {
        Self::of_values(geometry, solution, field, solution.reflected_halves.as_ref())
    }

    fn of_values(
        geometry: &Geometry,
        solution: &Solution,
        field: &Field<'_>,
        halves: Option<&[Vec<Rgb>; 2]>,
    ) -> Self {
        let patches = &solution.patches;
        let usable: Vec<PatchId> = patches.ids().filter(|i| solution.usable[i.index()]).collect();
        let (low, high) = geometry.bounds().unwrap_or_default();
        let size = (high - low).length().max(f64::MIN_POSITIVE);
        let mut neighbours: Vec<Neighbour> = usable
            .par_iter()
            .map(|&patch| {
                let (i, p) = (patch.index(), patches.center(patch));
                let h = field.of_patches()[i];
                let noise = halves.map_or(Rgb::ZERO, |[a, b]| (a[i] - b[i]) * 0.5);
                let off = field.at(p) - h;
                let at = (p.position(geometry) - low) / size;
                let turned = geometry.normal(p.triangle, p.side);
                let at = [at, turned * TURN];
                Neighbour { patch, at, noise: noise * noise, off: off * off }
            })
            .collect();
        let mut me = Self {
            noise: vec![Rgb::ZERO; patches.len()],
            refinement: vec![Rgb::ZERO; patches.len()],
        };
        halve(&mut neighbours);
        for group in groups(&neighbours) {
            let count = group.len() as f64;
            let noise = group.iter().map(|p| p.noise).sum::<Rgb>() / count;
            let off = group.iter().map(|p| p.off).sum::<Rgb>() / count;
            let refinement = (off - noise * SMOOTHED).max(Rgb::ZERO).map(f64::sqrt);
            let noise = noise.map(f64::sqrt);
            for p in group {
                let i = p.patch.index();
                (me.noise[i], me.refinement[i]) = (noise, refinement);
            }
        }
        me
    }

    /// Standard error of a patch's irradiance.
    #[must_use]
    pub fn error(&self, id: PatchId) -> Rgb {
        self.noise[id.index()] + self.refinement[id.index()]
    }

    /// Relative errors of the solution as a whole.
    #[must_use]
    pub fn report(&self, solution: &Solution) -> ErrorReport {
        let patches = &solution.patches;
        let lit: Vec<(PatchId, f64)> = patches
            .ids()
            .filter(|i| solution.usable[i.index()])
            .map(|i| (i, patches.area(i)))
            .collect();
        let area: f64 = lit.iter().map(|l| l.1).sum();
        let h = |i: PatchId| luminance(solution.irradiance[i.index()]);
        let mean = lit.iter().map(|&(i, a)| a * h(i)).sum::<f64>() / area.max(f64::MIN_POSITIVE);
        let within = |fraction: f64, error: &dyn Fn(PatchId) -> Rgb| {
            let relative = |i: PatchId| luminance(error(i)) / h(i).max(DARK * mean);
            let errors = lit.iter().map(|&(i, a)| (relative(i), a)).filter(|e| e.0.is_finite());
            let mut errors: Vec<(f64, f64)> = errors.collect();
            errors.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut below = 0.0;
            let reached = errors.iter().find(|e| {
                below += e.1;
                below >= fraction * area
            });
            reached.map_or(0.0, |e| e.0)
        };
        ErrorReport {
            total: within(MOST, &|i| self.error(i)),
            noise: within(MOST, &|i| self.noise[i.index()]),
            refinement: within(MOST, &|i| self.refinement[i.index()]),
            half: within(0.5, &|i| self.error(i)),
        }
    }
}

/// Fraction of the surface that [`ErrorReport`] speaks of.
const MOST: f64 = 0.8;
