//! How far apart the two halves of sampled rows are, carried through the solution.

use super::options::LightOptions;
use crate::direct::DirectLight;
use crate::form_factors::FormFactors;
use crate::progress::Progress;
use crate::scene::Rgb;
use crate::solve::{SolveError, SolveOptions, System, solve_near};

/// Half of what irradiance would differ by if each half of the rays alone gave it, to the first
/// order: by what each half finds that the light that it gathers should be, and by where that light
/// then goes.
pub(super) fn solve_halves(
    system: &System<'_>,
    halves: &[FormFactors; 2],
    direct: &[DirectLight],
    irradiance: &[Rgb],
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Vec<Rgb>, SolveError> {
    /// Differences of halves are no better than the noise that they tell of.
    const TOLERANCE: f64 = 1e-2;
    let half = |k: usize| {
        let direct: Vec<Rgb> = direct.iter().map(|d| d.halves[k]).collect();
        System { factors: &halves[k], direct: &direct, ..*system }.gather(irradiance, TOLERANCE)
    };
    let (a, b) = (half(0)?, half(1)?);
    let found: Vec<Rgb> = a.iter().zip(&b).map(|(a, b)| (*a - *b) * 0.5).collect();
    let system = System { direct: &found, ..*system };
    let solving = SolveOptions { tolerance: TOLERANCE, ..options.solve(true) };
    Ok(solve_near(&system, &found, &solving, progress)?.0)
}
