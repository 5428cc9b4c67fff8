//! How fast the classical algorithm is: `cargo bench --bench classical [SCENE [PATCHES]]`.
//!
//! Prints what the exact solution of a furnace takes on all threads, then, for one thread, the
//! ray-triangle tests a second of whole rows.

#![allow(clippy::print_stdout, reason = "a report for people")]

use std::time::Instant;

use hemicube::direct;
use hemicube::engines::{Classical, Engine, Hemicube, HemicubeOptions};
use hemicube::form_factors::{FormFactors, Row};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::builtin;
use hemicube::solve::{Method, SolveOptions, System, solve};

/// Rows measured.
const ROWS: usize = 16;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let scenes = match args.first() {
        Some(scene) => vec![scene.as_str()],
        None => vec!["cornell-box", "room"],
    };
    let counts = match args.get(1).and_then(|a| a.parse().ok()) {
        Some(count) => vec![count],
        None => vec![1_000, 8_000, 40_000],
    };
    for area in [0.01, 0.002] {
        if let Err(error) = eliminate(area) {
            println!("{error}");
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    for scene in scenes {
        let Some(scene) = builtin::build(scene) else { continue };
        for &count in &counts {
            let area = Patches::area_adding(&scene.geometry, count);
            let Ok(patches) = Patches::uniform(&scene.geometry, area) else { continue };
            if let Ok(pool) = &pool {
                pool.install(|| measure(&scene.name, &scene.geometry, &patches));
            }
        }
    }
}

fn measure(name: &str, geometry: &hemicube::scene::Geometry, patches: &Patches) {
    let step = patches.len().div_ceil(ROWS);
    let ids: Vec<PatchId> = patches.ids().step_by(step).collect();
    let mut rows = vec![Row::default(); ids.len()];
    let mut engine = Classical::new(geometry, patches);
    let start = Instant::now();
    if engine.fill(&ids, &mut rows).is_err() {
        return;
    }
    let seconds = start.elapsed().as_secs_f64();
    let rate = engine.tests() as f64 / seconds;

    println!(
        "{name}: {} patches, {:.2} ms/row, {rate:.2e} tests/s",
        patches.len(),
        1e3 * seconds / ids.len() as f64,
    );
}

fn eliminate(patch_size: f64) -> Result<(), Box<dyn std::error::Error>> {
    let Some(scene) = builtin::build("furnace") else { return Ok(()) };
    let patches = Patches::uniform(&scene.geometry, patch_size)?;
    let ids: Vec<PatchId> = patches.ids().collect();
    let mut factors = FormFactors::new(ids.len(), 4 << 30);
    let mut engine = Hemicube::new(
        &scene.geometry,
        &patches,
        HemicubeOptions { resolution: 64, ..HemicubeOptions::default() },
    )?;
    engine.make(&ids, &mut factors, &Silent)?;
    let rho = direct::reflectance(&scene.optics, &patches);
    let emission = direct::emission(&scene.optics, &patches);
    let direct = direct::through_rows(&factors, &emission, scene.sky);
    let areas: Vec<f64> = ids.iter().map(|&i| patches.area(i)).collect();
    let system = System { factors: &factors, rho: &rho, direct: &direct, areas: &areas };
    for method in [Method::GaussSeidel, Method::Direct] {
        let start = Instant::now();
        let options = SolveOptions { method, ..SolveOptions::default() };
        let (_, report) = solve(&system, &options, &Silent)?;
        println!(
            "{method:?}: {} patches, {} iterations or factorisations, {:.3} s, residual {:.1e}",
            ids.len(),
            report.iterations,
            start.elapsed().as_secs_f64(),
            report.residual
        );
    }
    Ok(())
}
