//! Seconds and the error of irradiance of a solution by rays, against final gathers.
//!
//! `cargo run --release --example accuracy -- SCENE AREA [SAMPLES [SHADOW [PATCHES]]]`
//!
//! SCENE is a built-in scene, AREA the largest of a patch in m². The error is the RMS of luminance
//! over its mean, at so many random patches (400; 0 for none): each is gathered by 4 × 65,536 rays
//! and 4 × 4,096 shadow rays, on a solution of its own seed with four times the rays (or as many,
//! beyond 200,000 patches).

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::time::Instant;

use hemicube::direct::{self, Analytic, DirectOptions, Emitters, MOST_SHADOW, Workspace};
use hemicube::engines::EngineOptions;
use hemicube::engines::rays::MOST_SAMPLES;
use hemicube::engines::{Rays, RaysOptions};
use hemicube::form_factors::{FormFactors, Row, RowBlock, RowSink};
use hemicube::patches::PatchId;
use hemicube::progress::Silent;
use hemicube::report::ErrorReport;
use hemicube::scene::{Rgb, builtin, luminance};
use hemicube::solution::{LightOptions, Solution, light};
use hemicube::uncertainty::Uncertainty;
use hemicube::visibility::Bvh;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: f64| arguments.get(i).map_or(Ok(default), |a| a.parse());
    let name = arguments.first().map_or("paper-3", String::as_str);
    let area = number(1, 0.1)?;
    let samples = number(2, 1024.0)? as usize;
    let shadow = number(3, 64.0)? as usize;
    let wanted = number(4, 400.0)? as usize;
    let scene = builtin::build(name).ok_or("no such scene")?;
    let lit = |samples, shadow, seed| -> Result<Solution, Box<dyn Error>> {
        let options = LightOptions {
            patch_size: Some(area),
            engine: EngineOptions::Rays(RaysOptions { samples, seed }),
            direct: DirectOptions { shadow, seed, ..DirectOptions::default() },
            memory: 20 << 30,
            ..LightOptions::default()
        };
        Ok(light(&scene, &options, &Silent)?)
    };
    let start = Instant::now();
    let solution = lit(samples, shadow, 0)?;
    let seconds = start.elapsed().as_secs_f64();
    let patches = &solution.patches;
    println!("{name}: {} patches, {samples} rays, {shadow} shadow rays", patches.len());
    for stage in &solution.report.stages {
        println!("  {:14} {:7.3} s", stage.name, stage.seconds);
    }
    println!("  {:14} {seconds:7.3} s", "all");
    println!("  {} sweeps", solution.report.solve.map_or(0, |s| s.iterations));
    let field = timed("field", || solution.field(&scene));
    let known = timed("uncertainty", || Uncertainty::of(&scene.geometry, &solution, &field));
    let ErrorReport { total, noise, refinement, half } = known.report(&solution);
    let [total, noise, refinement, half] = [total, noise, refinement, half].map(|e| 100.0 * e);
    println!(
        "  stated on 80 % of the surface {total:.3} %: noise {noise:.3} %, patch size \
         {refinement:.3} %; on half {half:.3} %"
    );

    if wanted == 0 {
        return Ok(());
    }
    let times = if patches.len() > 200_000 { 1 } else { 4 };
    let reference = lit(times * samples, (times * shadow).min(MOST_SHADOW), 77)?;
    let rho = direct::reflectance(&scene.optics, patches);
    let emission = direct::emission(&scene.optics, patches);
    let reflected: Vec<Rgb> =
        rho.iter().zip(&reference.irradiance).map(|(rho, h)| *rho * *h).collect();
    let bvh = Bvh::new(&scene.geometry);
    let usable: Vec<PatchId> = patches.ids().filter(|i| solution.usable[i.index()]).collect();
    let mut state = 1_u64;
    let chosen: Vec<PatchId> = (0..wanted)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            usable[(state >> 33) as usize % usable.len()]
        })
        .collect();
    let mut truth = vec![0.0; wanted];
    for seed in 1000..1004 {
        let rows =
            Rays::new(&scene.geometry, patches, &bvh, RaysOptions { samples: MOST_SAMPLES, seed });
        let apart = DirectOptions { analytic: Analytic::Suitable, shadow: MOST_SHADOW, seed };
        let emitters =
            Emitters::new(&scene.geometry, &scene.optics, patches, &bvh, apart, |_| Rgb::ZERO);
        let (mut row, mut room) = (Row::default(), Workspace::default());
        for (truth, &id) in truth.iter_mut().zip(&chosen) {
            rows.row(id, &mut row);
            let mut factors = FormFactors::new(patches.len(), u64::MAX);
            factors.take(RowBlock::of(&[id], std::slice::from_ref(&row))?)?;
            let receiver = emitters.patch(patches, id);
            emitters.look(std::slice::from_ref(&receiver), &mut room);
            let direct = emitters.light_patch(&receiver, patches, id, &mut room).irradiance;
            let through = factors.gather_by(id, |j| {
                let cell = patches.cell(j);
                let side = hemicube::patches::side_index(cell.triangle, cell.side);
                let own = !emitters.is_analytic(&receiver, side);
                reflected[j.index()] + if own { emission[j.index()] } else { Rgb::ZERO }
            });
            *truth += luminance(direct + through) / 4.0;
        }
    }
    let mean = truth.iter().sum::<f64>() / wanted as f64;
    let found = chosen.iter().map(|i| luminance(solution.irradiance[i.index()]));
    let mut errors: Vec<f64> = found.zip(&truth).map(|(h, t)| (h - t) / mean).collect();
    let dim: Vec<f64> = errors
        .iter()
        .zip(&chosen)
        .filter(|(_, i)| emission[i.index()] == Rgb::ZERO)
        .map(|e| e.0 * e.0)
        .collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / wanted as f64).sqrt();
    let mut worst: Vec<usize> = (0..wanted).collect();
    worst.sort_by(|&a, &b| errors[b].abs().total_cmp(&errors[a].abs()));
    for &k in worst.iter().take(5) {
        let (id, at) = (chosen[k], patches.center(chosen[k]).position(&scene.geometry));
        let h = luminance(solution.irradiance[id.index()]) / mean;
        println!("  patch {} at {at:.3}: {h:.4} of the mean, not {:.4}", id.0, truth[k] / mean);
    }
    errors.iter_mut().for_each(|e| *e = e.abs());
    errors.sort_by(f64::total_cmp);
    println!(
        "  against final gathers: RMS {:.3} % ({:.3} % at patches that do not emit), median {:.3} \
         %, worst {:.2} % of the mean",
        100.0 * rms,
        100.0 * (dim.iter().sum::<f64>() / dim.len() as f64).sqrt(),
        100.0 * errors[wanted / 2],
        100.0 * errors[wanted - 1]
    );
    Ok(())
}

fn timed<T>(stage: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    println!("  {stage:14} {:7.3} s", start.elapsed().as_secs_f64());
    result
}
