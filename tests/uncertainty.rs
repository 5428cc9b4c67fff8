//! What solutions and points say of their own error, against the truth.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

use glam::DVec2;
use hemicube::direct::DirectOptions;
use hemicube::engines::EngineOptions;
use hemicube::engines::{HemicubeOptions, RaysOptions};
use hemicube::gather::{Estimate, GatherOptions, Gatherer, Place, Probe};
use hemicube::patches::{PatchId, SurfacePoint};
use hemicube::progress::Silent;
use hemicube::scene::{Rgb, Scene, builtin, luminance};
use hemicube::solution::{LightOptions, Solution, light};
use hemicube::uncertainty::{Uncertainty, light_within};
use hemicube::visibility::Bvh;

fn options(patch_size: f64, samples: usize, seed: u32) -> LightOptions {
    LightOptions {
        patch_size: Some(patch_size),
        engine: EngineOptions::Rays(RaysOptions { samples, seed }),
        direct: DirectOptions { seed, ..DirectOptions::default() },
        ..LightOptions::default()
    }
}

/// Points all over the usable surface, as many to an area everywhere, contacts and borders of
/// shadows included.
fn scattered(scene: &Scene, solution: &Solution, count: usize) -> Vec<(PatchId, SurfacePoint)> {
    let patches = &solution.patches;
    let usable: Vec<PatchId> = patches.ids().filter(|i| solution.usable[i.index()]).collect();
    let area: f64 = usable.iter().map(|&i| patches.area(i)).sum();
    let lamp = |p: SurfacePoint| scene.optics.emission(p.triangle, p.side) != Rgb::ZERO;
    let (mut below, mut next) = (0.0, 0);
    let mut points = Vec::new();
    for &i in &usable {
        below += patches.area(i);
        while (next as f64 + 0.5) * area < below * count as f64 {
            let u = DVec2::new(0.754_877_67, 0.569_840_29) * f64::from(next);
            let p = patches.sample(i, u.fract());
            if !lamp(p) && patches.at(p) == Some(i) {
                points.push((i, p));
            }
            next += 1;
        }
    }
    points
}

fn gathered(
    scene: &Scene,
    solution: &Solution,
    points: &[(PatchId, SurfacePoint)],
    rays: (usize, usize),
) -> Vec<Estimate> {
    let (field, bvh) = (solution.field(scene), Bvh::new(&scene.geometry));
    let options =
        GatherOptions { samples: rays.0, shadow: rays.1, seed: 5, ..GatherOptions::default() };
    let g = &scene.geometry;
    let probes: Vec<Probe> = points
        .iter()
        .map(|(_, p)| Probe { point: p.position(g), normal: g.normal(p.triangle, p.side) })
        .collect();
    Gatherer::new(scene, solution, &field, &bvh, options).all(&probes, &Silent).unwrap()
}

/// Shares of at least 500 points at which the truth lies within twice the error stated: by the
/// field of a solution, and by points of their own.
fn coverage(name: &str, patch_size: f64) -> [f64; 2] {
    let scene = builtin::build(name).unwrap();
    let solution = light(&scene, &options(patch_size, 256, 0), &Silent).unwrap();
    let points = scattered(&scene, &solution, 640);
    let best = light(&scene, &options(patch_size / 8.0, 1024, 9), &Silent).unwrap();
    let truth = gathered(&scene, &best, &points, (1 << 16, 1 << 15));
    let field = solution.field(&scene);
    let known = Uncertainty::of(&scene.geometry, &solution, &field);
    let probed = gathered(&scene, &solution, &points, (1024, 512));
    let (mut within, mut count) = ([0, 0], 0);
    for ((&(id, p), truth), probed) in points.iter().zip(&truth).zip(&probed) {
        if truth.place != Place::Free {
            continue;
        }
        count += 1;
        let off = |h: Rgb| luminance(h - truth.irradiance).abs();
        let stated = luminance(known.error(id));
        within[0] += usize::from(off(field.at(p)) <= 2.0 * stated);
        within[1] += usize::from(off(probed.irradiance) <= 2.0 * luminance(probed.error));
    }
    assert!(count >= 500, "{count} points");
    within.map(|w| f64::from(w as u32) / count as f64)
}

#[test]
fn the_truth_lies_within_twice_the_error_stated() {
    for (name, patch_size) in [("cornell-box", 0.02), ("room", 0.02), ("paper-1", 0.3)] {
        let [field, probed] = coverage(name, patch_size);
        println!("{name}: field {:.1} %, points {:.1} %", 100.0 * field, 100.0 * probed);
        assert!(field >= 0.93, "{name}: {field} of the field");
        assert!(probed >= 0.93, "{name}: {probed} of points");
    }
}

#[test]
fn one_knob_reaches_the_error_asked_for() {
    let scene = builtin::build("cornell-box").unwrap();
    let mut open = options(0.0, 32, 0);
    open.patch_size = None;
    let mut last = f64::INFINITY;
    for target in [0.05, 0.02] {
        let (solution, _) = light_within(&scene, &open, target, &Silent).unwrap();
        let error = solution.report.error.unwrap();
        println!("{target}: {error:?}, {} patches", solution.patches.len());
        assert!(error.total <= target && error.total < last);
        assert!(error.half <= error.total && error.noise.max(error.refinement) <= error.total);
        last = error.total;
    }
    // With patches as they are told to be, only rays are left to choose.
    let (fixed, _) = light_within(&scene, &options(0.2, 32, 0), 1e-4, &Silent).unwrap();
    assert_eq!(fixed.report.patch_size, 0.2);
    assert!(fixed.report.error.unwrap().total > 1e-4);
}

#[test]
fn a_furnace_is_known_to_be_even() {
    let scene = builtin::build("furnace").unwrap();
    let solution = light(&scene, &options(0.02, 1024, 0), &Silent).unwrap();
    let field = solution.field(&scene);
    let known = Uncertainty::of(&scene.geometry, &solution, &field);
    // Nothing to blur; and no noise but where a wall is set apart in one part and left to rays in
    // another.
    assert!(known.report(&solution).total < 1e-2, "{:?}", known.report(&solution));
}

#[test]
fn solutions_that_are_not_sampled_state_what_patches_blur() {
    let scene = builtin::build("cornell-box").unwrap();
    let engine = EngineOptions::Hemicube(HemicubeOptions::default());
    let options = LightOptions { engine, ..options(0.05, 32, 0) };
    let (solution, _) = light_within(&scene, &options, 0.01, &Silent).unwrap();
    let error = solution.report.error.unwrap();
    assert!(error.noise == 0.0 && error.refinement > 0.0 && error.total == error.refinement);
}
