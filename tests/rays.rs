//! Sampled rows and direct light apart: unbiased, and no emitter counted twice or left out.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::sync::atomic::{AtomicUsize, Ordering};

use common::scenes::{grey, lit_by_first, rectangle, scene_of};
use glam::{DVec3, dvec3};
use hemicube::direct::{Analytic, DirectOptions};
use hemicube::engines::EngineOptions;
use hemicube::engines::{Engine, Rays, RaysOptions};
use hemicube::form_factors::{Row, RowBlock, RowSink, SinkError};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::{Cancelled, Progress, Silent};
use hemicube::scene::builtin::{self, Mesh};
use hemicube::scene::{Scene, Sides};
use hemicube::solution::{LightOptions, Solution, light};
use hemicube::visibility::Bvh;

fn lit(scene: &Scene, size: f64, rows: RaysOptions, direct: DirectOptions) -> Solution {
    let options = LightOptions {
        patch_size: Some(size),
        engine: EngineOptions::Rays(rows),
        direct,
        ..LightOptions::default()
    };
    light(scene, &options, &Silent).unwrap()
}

/// A room with a lamp of many facets, a glowing panel and a box that shades.
fn room_with_lamps() -> Scene {
    let parts = [
        (Mesh::cuboid(dvec3(4.0, 2.5, 3.0), [1; 3]).inverted(), grey(0.6, 0.0)),
        (Mesh::geodesic(0.2, 4).at(0.9, 1.7, 0.4), grey(0.8, 10.0)),
        (Mesh::cuboid(dvec3(0.8, 0.02, 0.3), [1; 3]).at(-0.8, 2.2, -0.3), grey(0.8, 20.0)),
        (Mesh::cuboid(dvec3(0.7, 0.9, 0.6), [1; 3]).turned(20.0).at(0.2, 0.3, 0.0), grey(0.5, 0.0)),
    ];
    scene_of(parts.iter().map(|(mesh, material)| (mesh, material.clone())), Sides::One)
}

/// Area-weighted mean of H, and RMS of differences over it.
fn compare(a: &Solution, b: &Solution) -> (f64, f64, f64) {
    let (mut area, mut means, mut square) = (0.0, [0.0; 2], 0.0);
    for i in a.patches.ids() {
        let w = a.patches.area(i);
        let (x, y) = (a.irradiance[i.index()].x, b.irradiance[i.index()].x);
        area += w;
        means[0] += w * x;
        means[1] += w * y;
        square += w * (x - y) * (x - y);
    }
    (means[0] / area, means[1] / area, (square / area).sqrt() / (means[0] / area))
}

#[test]
fn reflecting_emitters_give_the_same_light_whichever_are_set_apart() {
    let scene = room_with_lamps();
    let rows = RaysOptions { samples: 4096, seed: 0 };
    let run = |which| {
        lit(
            &scene,
            0.02,
            rows,
            DirectOptions { analytic: which, shadow: 256, ..DirectOptions::default() },
        )
    };
    let suitable = run(Analytic::Suitable);
    for which in [Analytic::None, Analytic::All] {
        let (a, b, rms) = compare(&suitable, &run(which));
        println!("{which:?}: mean irradiance {b:.5}, by the rule {a:.5}; RMS difference {rms:.4}");
        assert!((a / b - 1.0).abs() < 2e-3, "{which:?}: {a} {b}");
        assert!(rms < 0.03, "{which:?}: {rms}");
    }
}

/// The form factor between unit squares that face each other at distance 1.
const OPPOSITE: f64 = 0.199_824_895_7;

fn opposite_squares() -> Scene {
    let floor = rectangle([DVec3::ZERO, DVec3::X, DVec3::Y]);
    let above = rectangle([DVec3::Z, DVec3::Y, DVec3::X]);
    lit_by_first(&[&floor, &above], Sides::One)
}

#[test]
fn rows_meet_analytic_factors_within_four_standard_errors() {
    let scene = opposite_squares();
    let g = &scene.geometry;
    let (patches, bvh) = (Patches::uniform(g, 1.0).unwrap(), Bvh::new(g));
    let mut found = Vec::new();
    for seed in 0..64 {
        let mut rays = Rays::new(g, &patches, &bvh, RaysOptions { samples: 256, seed });
        let mut rows = vec![Row::default(); 2];
        rays.fill(&[PatchId(0), PatchId(1)], &mut rows).unwrap();
        found.push(0.5 * rows.iter().map(|r| r.weights.sum()).sum::<f64>());
        for row in rows {
            assert!((row.total() - 1.0).abs() < 1e-12);
            assert!(row.half <= 128 && row.columns.len() - row.half <= 128);
        }
    }
    let n = found.len() as f64;
    let mean = found.iter().sum::<f64>() / n;
    let variance = found.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let error = (variance / n).sqrt();
    println!("opposite squares: {mean:.6} +- {error:.6}");
    assert!((mean - OPPOSITE).abs() < 4.0 * error, "{mean} {error}");
    // Random rays would have .0177; an even sequence has a fraction of it.
    assert!(variance.sqrt() < 0.012, "{}", variance.sqrt());
}

#[test]
fn a_row_ends_on_no_backs_in_a_closed_room() {
    let scene = room_with_lamps();
    let g = &scene.geometry;
    let (patches, bvh) = (Patches::uniform(g, 0.05).unwrap(), Bvh::new(g));
    let mut rays = Rays::new(g, &patches, &bvh, RaysOptions::default());
    let ids: Vec<PatchId> = patches.ids().step_by(7).collect();
    let mut rows = vec![Row::default(); ids.len()];
    rays.fill(&ids, &mut rows).unwrap();
    let lost: f64 = rows.iter().map(|r| r.back + r.environment).sum::<f64>() / rows.len() as f64;
    assert!(lost <= 1e-5, "{lost}");
}

/// The errors of both halves of many rows are uncorrelated, and each is no larger than that of
/// random rays.
#[test]
fn halves_of_a_row_err_independently() {
    const SEEDS: u32 = 256;
    let scene = opposite_squares();
    let g = &scene.geometry;
    let (patches, bvh) = (Patches::uniform(g, 1.0).unwrap(), Bvh::new(g));
    let (mut both, mut each, mut count) = (0.0, [0.0; 2], 0.0);
    for seed in 0..SEEDS {
        let mut rays = Rays::new(g, &patches, &bvh, RaysOptions { samples: 256, seed });
        let mut rows = vec![Row::default(); 2];
        rays.fill(&[PatchId(0), PatchId(1)], &mut rows).unwrap();
        for row in rows {
            let halves = [row.half, row.columns.len() - row.half];
            let [a, b] = halves.map(|hits| hits as f64 / 128.0 - OPPOSITE);
            both += a * b;
            each[0] += a * a;
            each[1] += b * b;
            count += 1.0;
        }
    }
    let correlation = both / (each[0] * each[1]).sqrt();
    let deviations = each.map(|e| (e / count).sqrt());
    println!("errors of halves {deviations:.4?}, correlation {correlation:.3}");
    let random = (OPPOSITE * (1.0 - OPPOSITE) / 128.0).sqrt();
    assert!(deviations.iter().all(|&d| d > 0.0 && d < random), "{deviations:?}");
    // Four standard errors of the correlation of independent numbers.
    assert!(correlation.abs() < 4.0 / count.sqrt(), "{correlation}");
}

#[test]
fn halves_differ_by_about_the_error() {
    let scene = builtin::build("cornell-box").unwrap();
    let rows = |samples, seed| RaysOptions { samples, seed };
    let coarse = lit(&scene, 0.1, rows(256, 0), DirectOptions::default());
    let fine = lit(
        &scene,
        0.1,
        rows(16_384, 1),
        DirectOptions { shadow: 2048, seed: 1, ..DirectOptions::default() },
    );
    let halves = coarse.halves.as_ref().unwrap();
    let (mut truth, mut estimate, mut scale) = (0.0, 0.0, 0.0);
    for i in coarse.patches.ids().filter(|i| coarse.usable[i.index()]) {
        let k = i.index();
        truth += (coarse.irradiance[k] - fine.irradiance[k]).length_squared();
        estimate += (0.5 * (halves[0][k] - halves[1][k])).length_squared();
        scale += fine.irradiance[k].length_squared();
    }
    let (truth, estimate) = ((truth / scale).sqrt(), (estimate / scale).sqrt());
    println!("RMS error {truth:.5}, estimated from halves {estimate:.5}");
    assert!(truth < 0.02 && estimate < 0.02, "{truth} {estimate}");
    assert!(truth < 2.0 * estimate && estimate < 3.0 * truth, "{truth} {estimate}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = room_with_lamps();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lit(&scene, 0.1, RaysOptions::default(), DirectOptions::default()))
    };
    let one = run(1);
    for threads in [2, 8] {
        let many = run(threads);
        assert!(one.irradiance == many.irradiance && one.halves == many.halves, "{threads}");
    }
}

#[test]
fn rows_made_with_neighbours_are_those_of_each_patch_alone() {
    let ball = scene_of([(&Mesh::geodesic(1.0, 6).inverted(), grey(0.5, 1.0))], Sides::One);
    for scene in [room_with_lamps(), ball] {
        let g = &scene.geometry;
        let patches = Patches::uniform(g, 0.02).unwrap();
        let bvh = Bvh::new(g);
        let mut engine = Rays::new(g, &patches, &bvh, RaysOptions { samples: 256, seed: 0 });
        let ids: Vec<PatchId> = patches.ids().take(480).collect();
        let mut rows = vec![Row::default(); ids.len()];
        engine.fill(&ids, &mut rows).unwrap();
        let (mut differ, mut alone) = (0, Row::default());
        for (&id, row) in ids.iter().zip(&rows) {
            engine.row(id, &mut alone);
            assert!((row.columns.len(), row.half) == (alone.columns.len(), alone.half));
            differ += row.columns.iter().zip(&alone.columns).filter(|(a, b)| a != b).count();
        }
        // Packets differ in rounding: rays that end on a border of patches may end beyond it.
        assert!(differ <= 480 * 256 / 1000, "{differ} rays");
    }
}

/// Counts how often it could have stopped the work.
#[derive(Default)]
struct Chances(AtomicUsize);

impl Progress for Chances {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, _n: u64) -> Result<(), Cancelled> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

/// Takes rows and forgets them.
struct Nowhere;

impl RowSink for Nowhere {
    fn take(&mut self, _block: RowBlock) -> Result<(), SinkError> {
        Ok(())
    }
}

#[test]
fn long_rows_can_be_stopped_after_few_of_them() {
    let scene = room_with_lamps();
    let g = &scene.geometry;
    let patches = Patches::uniform(g, 0.05).unwrap();
    let bvh = Bvh::new(g);
    let mut engine = Rays::new(g, &patches, &bvh, RaysOptions { samples: 65_536, seed: 0 });
    let ids: Vec<PatchId> = patches.ids().take(64).collect();
    let chances = Chances::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| engine.make(&ids, &mut Nowhere, &chances)).unwrap();
    assert!(chances.0.into_inner() >= 4);
}
