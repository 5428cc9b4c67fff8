//! How well irradiance is known: what sampling leaves open, and what the size of patches blurs.
//!
//! **Noise.** Where rows are sampled, two independent halves of the rays are carried through the
//! whole solution; half of what they differ in is as large as the standard error of their mean. One
//! patch's difference has one degree of freedom, so squares are averaged over at least 16
//! neighbours.
//!
//! **Refinement.** A smooth field goes through the patches' values as well as it can. Where light
//! changes within a patch, at borders of shadows above all, it passes them by: the squares of these
//! distances, averaged over the same neighbours and less what noise alone would make them, tell
//! what patches of that size cannot show. It is an estimate and no bound: a shadow smaller than a
//! patch may leave no trace.
//!
//! The two are added, not their squares, as neither is independent of the surface.

mod within;

use glam::DVec3;
use rayon::prelude::*;

use crate::patches::PatchId;
use crate::reconstruct::Field;
use crate::report::ErrorReport;
use crate::scene::{Geometry, Rgb, luminance};
use crate::solution::Solution;

pub use within::light_within;

/// Neighbours whose squares are averaged, at least.
const NEIGHBOURS: usize = 16;

/// Variance of the distance between a patch's value and the field at its centre, relative to the
/// variance of values: within a regular grid, where the field takes a sixth of each value.
const SMOOTHED: f64 = 0.78;

/// Irradiance below this share of its mean is judged relative to that.
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
        let patches = &solution.patches;
        let usable: Vec<usize> = (0..patches.len()).filter(|&i| solution.usable[i]).collect();
        let (low, high) = geometry.bounds().unwrap_or_default();
        let size = (high - low).length().max(f64::MIN_POSITIVE);
        let mut places: Vec<Place> = usable
            .par_iter()
            .map(|&i| {
                let p = patches.center(PatchId(i as u32));
                let h = solution.irradiance[i];
                let half = |[a, b]: &[Vec<Rgb>; 2]| (a[i] - b[i]) * 0.5;
                let noise = solution.halves.as_ref().map_or(Rgb::ZERO, half);
                let off = field.at(p) - h;
                let at = (p.position(geometry) - low) / size;
                let turned = geometry.normal(p.triangle, p.side);
                Place { patch: i, at: [at, turned * TURN], noise: noise * noise, off: off * off }
            })
            .collect();
        let mut me = Self {
            noise: vec![Rgb::ZERO; patches.len()],
            refinement: vec![Rgb::ZERO; patches.len()],
        };
        halve(&mut places);
        for group in groups(&places) {
            let count = group.len() as f64;
            let noise = group.iter().map(|p| p.noise).sum::<Rgb>() / count;
            let off = group.iter().map(|p| p.off).sum::<Rgb>() / count;
            let refinement = (off - noise * SMOOTHED).max(Rgb::ZERO).map(f64::sqrt);
            let noise = noise.map(f64::sqrt);
            for p in group {
                (me.noise[p.patch], me.refinement[p.patch]) = (noise, refinement);
            }
        }
        me
    }

    /// Standard error of a patch's irradiance.
    #[must_use]
    pub fn error(&self, i: usize) -> Rgb {
        self.noise[i] + self.refinement[i]
    }

    /// Relative errors of the solution as a whole.
    #[must_use]
    pub fn report(&self, solution: &Solution) -> ErrorReport {
        let patches = &solution.patches;
        let lit: Vec<(usize, f64)> = patches
            .ids()
            .filter(|i| solution.usable[i.index()])
            .map(|i| (i.index(), patches.area(i)))
            .collect();
        let area: f64 = lit.iter().map(|l| l.1).sum();
        let h = |i: usize| luminance(solution.irradiance[i]);
        let mean = lit.iter().map(|&(i, a)| a * h(i)).sum::<f64>() / area.max(f64::MIN_POSITIVE);
        let within = |share: f64, error: &dyn Fn(usize) -> Rgb| {
            let relative = |i: usize| luminance(error(i)) / h(i).max(DARK * mean);
            let errors = lit.iter().map(|&(i, a)| (relative(i), a)).filter(|e| e.0.is_finite());
            let mut errors: Vec<(f64, f64)> = errors.collect();
            errors.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut below = 0.0;
            let reached = errors.iter().find(|e| {
                below += e.1;
                below >= share * area
            });
            reached.map_or(0.0, |e| e.0)
        };
        ErrorReport {
            total: within(MOST, &|i| self.error(i)),
            noise: within(MOST, &|i| self.noise[i]),
            refinement: within(MOST, &|i| self.refinement[i]),
            half: within(0.5, &|i| self.error(i)),
        }
    }
}

/// Share of the surface that [`ErrorReport`] speaks of.
const MOST: f64 = 0.8;

/// How far apart opposite normals are, in diameters of the scene.
const TURN: f64 = 0.5;

/// A patch, where it is and how it is turned.
struct Place {
    patch: usize,
    at: [DVec3; 2],
    /// Squares.
    noise: Rgb,
    off: Rgb,
}

/// Sorts so that groups are neighbours: halves of halves, each along its longest axis.
fn halve(places: &mut [Place]) {
    if places.len() < 2 * NEIGHBOURS {
        return;
    }
    let infinite = [(DVec3::INFINITY, DVec3::NEG_INFINITY); 2];
    let bounds = places.iter().fold(infinite, |[p, n], place| {
        [(p.0.min(place.at[0]), p.1.max(place.at[0])), (n.0.min(place.at[1]), n.1.max(place.at[1]))]
    });
    let (mut which, mut axis, mut longest) = (0, 0, -1.0);
    for (k, (low, high)) in bounds.iter().enumerate() {
        for a in 0..3 {
            if high[a] - low[a] > longest {
                (which, axis, longest) = (k, a, high[a] - low[a]);
            }
        }
    }
    let middle = places.len() / 2;
    places.select_nth_unstable_by(middle, |a, b| {
        a.at[which][axis].total_cmp(&b.at[which][axis]).then(a.patch.cmp(&b.patch))
    });
    let (a, b) = places.split_at_mut(middle);
    rayon::join(|| halve(a), || halve(b));
}

/// The groups that [`halve`] leaves.
fn groups(places: &[Place]) -> Vec<&[Place]> {
    if places.len() < 2 * NEIGHBOURS {
        return if places.is_empty() { Vec::new() } else { vec![places] };
    }
    let (a, b) = places.split_at(places.len() / 2);
    [groups(a), groups(b)].concat()
}
