//! Light to a wanted error: patches are made smaller and rays more until the error stated is small
//! enough.

use super::Uncertainty;
use crate::direct::MOST_SHADOW;
use crate::engines::EngineOptions;
use crate::engines::rays::MOST_SAMPLES;
use crate::patches::Patches;
use crate::progress::{Cancelled, Progress, is_cancelled};
use crate::report::ErrorReport;
use crate::scene::Scene;
use crate::solution::{LightError, LightOptions, Solution, Work, light_shared};
use crate::solve::SAMPLED_TOLERANCE;

/// Times that a scene is lit at most.
const TURNS: usize = 6;

/// Rays a row and patches of the first turn.
const FIRST: (usize, u64) = (256, 30_000);

/// Most by which rays or patches grow from turn to turn.
const GROWTH: f64 = 16.0;

/// Of what their size blurs, patches have this share in common: light that leaks beneath things,
/// for one, leaks everywhere.
pub(crate) const IN_COMMON: f64 = 0.25;

/// Patches become smaller than at first by this factor at most: beyond it light near by, which is
/// found anew, is all that they would show.
const SMALLEST: f64 = 0.25;

/// The solver may leave this fraction of the error that is allowed.
const SOLVER: f64 = 0.05;

/// Noise falls as this power of the number of rays, evenly spread as they are.
const NOISE_POWER: f64 = 0.7;

/// What patches blur falls as this power of their area: between that of smooth light (1) and that
/// of a shadow's border (1/4).
const SIZE_POWER: f64 = 0.4;

/// Lights a scene by sampled rows until the error stated ([`ErrorReport::total`]) of what arrives
/// by way of other surfaces is at most `target`, a share of all that arrives (0.01 is 1 %). From
/// turn to turn it takes more rays and, unless `options` say how large patches are, smaller
/// patches. Where memory or the largest number of rays puts that out of reach, it yields the best
/// solution, whose report says how good it is. The options that it was lit by come with it.
///
/// Engines other than [`EngineOptions::Rays`] light the scene once, with the options given.
///
/// # Errors
/// As [`light`](crate::solution::light).
pub fn light_within(
    scene: &Scene,
    options: &LightOptions,
    target: f64,
    progress: &dyn Progress,
) -> Result<(Solution, LightOptions), LightError> {
    light_within_shared(scene, options, target, &Work::default(), progress)
}

/// The same where several ranks share the work, or rows are kept for another run.
///
/// # Errors
/// As [`light_shared`].
pub fn light_within_shared(
    scene: &Scene,
    options: &LightOptions,
    target: f64,
    work: &Work<'_>,
    progress: &dyn Progress,
) -> Result<(Solution, LightOptions), LightError> {
    if !matches!(options.engine, EngineOptions::Rays(_)) {
        let mut solution = light_shared(scene, options, work, progress)?;
        solution.report.error = Some(error_of(scene, &solution, progress)?);
        return Ok((solution, *options));
    }
    let mut options = *options;
    let fixed = options.patch_size.is_some() || options.adaptive.is_some();
    if !fixed {
        options.patch_size = Some(Patches::area_adding(&scene.geometry, FIRST.1));
    }
    if let EngineOptions::Rays(rows) = &mut options.engine {
        rows.samples = FIRST.0;
    }
    // What the solver leaves is in no stated error.
    let usual = options.tolerance.unwrap_or(SAMPLED_TOLERANCE);
    options.tolerance = Some(usual.min(SOLVER * target));
    let least = options.patch_size.map_or(0.0, |size| SMALLEST * size);
    let mut best: Option<(f64, Solution, LightOptions)> = None;
    for _ in 0..TURNS {
        let mut solution = match light_shared(scene, &options, work, progress) {
            Ok(solution) => solution,
            Err(e) if best.is_some() && is_too_much(&e, work) => break,
            Err(error) => return Err(error),
        };
        let error = error_of(scene, &solution, progress)?;
        solution.report.error = Some(error);
        if best.as_ref().is_none_or(|b| error.total <= b.0) {
            best = Some((error.total, solution, options));
        }
        if error.total <= target || !better(&mut options, (fixed, least), error, target) {
            break;
        }
    }
    // There is one after the first turn.
    match best {
        Some((_, solution, options)) => Ok((solution, options)),
        None => Ok((light_shared(scene, &options, work, progress)?, options)),
    }
}

/// What a solution states of the light that surfaces send to each other: what arrives straight is
/// found anew wherever one looks.
fn error_of(
    scene: &Scene,
    solution: &Solution,
    progress: &dyn Progress,
) -> Result<ErrorReport, Cancelled> {
    let field = solution.reflected_field_heard(scene, progress)?;
    let found = Uncertainty::of_reflected(&scene.geometry, solution, &field);
    // What lies near by is found anew too, and not read from patches; what they have in common
    // beyond that, everything shows.
    let refinement = found.refinement.into_iter().map(|r| r * IN_COMMON).collect();
    Ok(Uncertainty { refinement, ..found }.report(solution))
}

/// Whether there was no room for what was asked, on all ranks alike.
fn is_too_much(error: &LightError, work: &Work<'_>) -> bool {
    let size = matches!(error, LightError::Patches(_)) && !is_cancelled(error);
    let own = work.ranks.is_alone() && matches!(error, LightError::Sink(_));
    size || own || matches!(error, LightError::Memory { .. })
}

/// Asks for more where an error is too large; `false` if there is nothing more to ask for.
fn better(
    options: &mut LightOptions,
    (fixed, smallest): (bool, f64),
    error: ErrorReport,
    target: f64,
) -> bool {
    let mut changed = false;
    // Each may have half; one that needs less leaves the rest to the other.
    let allowed = |other: f64| (target - other).max(0.5 * target) * 0.95;
    // Noise and refinement are quantiles over the surface: both may be small enough, and their
    // sum's quantile still too large.
    let enough =
        error.noise <= allowed(error.refinement) && error.refinement <= allowed(error.noise);
    let least = if enough { error.total / target } else { 0.0 };
    if let EngineOptions::Rays(rows) = &mut options.engine {
        let excess = (error.noise / allowed(error.refinement)).max(least);
        // Rays are rounded up to a power of two anyway: less would make the same rows.
        let samples = grown(rows.samples as f64, excess, NOISE_POWER) as usize;
        let samples = samples.next_power_of_two().min(MOST_SAMPLES);
        if excess > 1.0 && samples > rows.samples {
            let shadow = grown(options.direct.shadow as f64, excess, NOISE_POWER) as usize;
            (rows.samples, options.direct.shadow) = (samples, shadow.min(MOST_SHADOW));
            changed = true;
        }
    }
    if let (Some(size), false) = (&mut options.patch_size, fixed) {
        let excess = (error.refinement / allowed(error.noise)).max(least);
        if excess > 1.0 && *size > smallest {
            *size = (*size / grown(1.0, excess, SIZE_POWER)).max(smallest);
            changed = true;
        }
    }
    changed
}

/// How many are needed in place of `now` for an error that falls as their `power` to shrink by the
/// factor `excess`; at most [`GROWTH`] times as many.
fn grown(now: f64, excess: f64, power: f64) -> f64 {
    now * excess.powf(1.0 / power).clamp(1.0, GROWTH)
}
