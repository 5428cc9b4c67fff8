//! `hemicube probe`: irradiance at points, as a table.

use std::io::Read;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use hemicube::export::write_whole;
use hemicube::gather::{self, Estimate, GatherOptions, Gatherer, Place};
use hemicube::patches::Patches;
use hemicube::progress::Progress;
use hemicube::report::Stage;
use hemicube::scene::{Scene, luminance};
use hemicube::staging::Model;
use hemicube::tone::FalseColour;
use hemicube::visibility::Bvh;

use crate::args::{ClusterArg, EngineArg, Light, Probe, UnitArg};
use crate::doubts::of_balance;
use crate::failure::Failure;
use crate::input;
use crate::outputs;
use crate::plan::is_plan;
use crate::points::{self, Table, error, number};
use crate::render::{inputs, lit, say_details, set_threads, write_report};
use crate::solutions::is_solution;
use crate::terminal::{Bar, catch_interrupts, print, print_data, say};

/// Number of patches aimed at, beyond one a side of each source triangle. Points average over what
/// they see, and the noise of patches with it; the size of patches beside a contact they do not.
const PATCHES: u64 = 30_000;

/// Models of up to so many source triangles are not clustered for it.
const SMALL: usize = 50_000;

/// Runs the command.
pub fn run(args: &Probe) -> Result<(), Failure> {
    catch_interrupts();
    set_threads(args.light.run.threads)?;
    let table = table(args)?;
    let scene = input::read(&args.input)?;
    if let Some(path) = args.plan.as_ref().filter(|p| !is_plan(p)) {
        let text = format!("{}: plans are written as .png, .jpg or .svg", path.display());
        return Err(Failure::Input(text));
    }
    let files = [
        ("-o", args.output.as_ref()),
        ("--plan", args.plan.as_ref()),
        ("--report", args.light.run.report.as_ref()),
    ];
    outputs::check(&files, inputs(&scene, &args.input, &args.light).chain(&args.points))?;
    let quiet = args.light.run.quiet;
    input::say_findings(&scene, quiet);
    let first = table.points.probes.first();
    // Off the surface that it lies on.
    let ahead = |model: &Model<'_>| {
        first.map_or(DVec3::ZERO, |p| p.point + p.normal * (1e-3 * model.size()))
    };
    if !is_solution(&args.input.model.scene) {
        input::ensure_lit(&scene, &ahead)?;
    }
    let bar = Bar::new(quiet);
    let mut solution = lit(&scene, &args.input, &light_of(args, &scene), &bar)?;

    let start = Instant::now();
    let field = solution.field(&scene);
    let bvh = Bvh::new(&scene.geometry);
    let seed = args.light.seed.unwrap_or_default();
    let usual = GatherOptions::default();
    let samples = args.rays.unwrap_or(usual.samples);
    let options = GatherOptions { samples, seed, error: args.light.error_of_light(), ..usual };
    let gatherer = Gatherer::new(&scene, &solution, &field, &bvh, options);
    bar.stage("points", table.points.probes.len() as u64);
    let mut found = gatherer.all(&table.points.probes, &bar)?;
    tell_outside(&mut found, &table.points.probes, &scene, &bvh);
    bar.finish();
    let seconds = start.elapsed().as_secs_f64();
    let text = table.with(&found);
    match &args.output {
        Some(path) => {
            write_whole(path, text.as_bytes()).map_err(Failure::failed)?;
            print(&path.display().to_string());
        }
        None => print_data(text.trim_end()),
    }
    if let Some((path, plane)) = args.plan.as_ref().zip(table.plane) {
        let unit = args.false_colour.unwrap_or(UnitArg::Lux).text().into();
        let colours = FalseColour { range: args.range, unit };
        plane.write(path, &found, &colours).map_err(Failure::failed)?;
        print(&path.display().to_string());
    }
    solution.report.stages.push(Stage { name: "points", seconds });
    if !quiet {
        say(&summary(&found));
        if let Some(missed) = args.light.error_of_light().and_then(|e| missed(&found, e)) {
            say(&format!("warning: {missed}"));
        }
        if let Some(doubt) = of_balance(&solution.report) {
            say(&format!("warning: {doubt}"));
        }
    }
    if args.light.run.verbose {
        say_details(&solution.report);
    }
    write_report(&mut solution.report, &args.light)
}

/// Tells points that are outside of the model.
fn tell_outside(found: &mut [Estimate], probes: &[gather::Probe], scene: &Scene, bvh: &Bvh) {
    /// Less than this fraction of the brightest point's irradiance is darkness: a field lets a
    /// little light out under walls.
    const DARK: f64 = 1e-4;
    let brightest = found.iter().map(|e| luminance(e.irradiance)).fold(0.0, f64::max);
    for (e, probe) in found.iter_mut().zip(probes) {
        *e = e.or_outside(probe, &scene.geometry, bvh, DARK * brightest);
    }
}

/// How the scene is lit, where the command line leaves it open.
fn light_of(args: &Probe, scene: &Scene) -> Light {
    let mut light = args.light.clone();
    let rays = light.engine() == EngineArg::Rays && light.factors.is_none();
    // Large models may have their triangles joined, which says how large patches are.
    if is_solution(&args.input.model.scene) {
        return light;
    }
    let small = scene.geometry.len() <= SMALL && light.cluster != ClusterArg::On;
    if rays && small && light.error.is_none() && light.max_factor.is_none() {
        light.patch_size.get_or_insert(Patches::area_adding(&scene.geometry, PATCHES));
    }
    light
}

/// The points asked for.
fn table(args: &Probe) -> Result<Table, Failure> {
    if let Some(grid) = &args.grid {
        return points::grid(grid).map_err(Failure::Input);
    }
    let path = args.points.as_deref().unwrap_or(Path::new("-"));
    let (name, bytes) = if path == Path::new("-") {
        let mut bytes = Vec::new();
        let read = std::io::stdin().lock().read_to_end(&mut bytes);
        (String::from("stdin"), read.map(|_| bytes))
    } else {
        (path.display().to_string(), std::fs::read(path))
    };
    let bytes = bytes.map_err(|e| Failure::Input(format!("{name}: {e}")))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Failure::Input(format!("{name}: is not text in UTF-8; save it as CSV")))?;
    points::read(&name, &text).map_err(Failure::Input)
}

/// How many points are not known as well as was asked for.
fn missed(found: &[Estimate], wanted: f64) -> Option<String> {
    let relative = |e: &Estimate| error(e) / luminance(e.irradiance);
    let free = found.iter().filter(|e| e.place == Place::Free);
    let missed: Vec<f64> = free.map(relative).filter(|r| *r > wanted).collect();
    let worst = match missed.iter().copied().fold(0.0, f64::max) {
        all if all > 1.0 => "more than they receive".to_owned(),
        share => format!("{:.2} %", 100.0 * share),
    };
    (!missed.is_empty()).then(|| {
        format!(
            "{} of {} points are not known to {:.3} %, the worst to {worst}: what is left is the \
             solution's, or takes more rays than a point may have; use a smaller --patch-size, or \
             allow a larger error",
            missed.len(),
            found.len(),
            100.0 * wanted
        )
    })
}

/// What people ask of a work plane, in a line.
fn summary(found: &[Estimate]) -> String {
    let free: Vec<f64> =
        found.iter().filter(|e| e.place == Place::Free).map(|e| luminance(e.irradiance)).collect();
    let count = |place| found.iter().filter(|e| e.place == place).count();
    let mut line = format!("{} points", free.len());
    if !free.is_empty() {
        let mean = free.iter().sum::<f64>() / free.len() as f64;
        let low = free.iter().copied().fold(f64::INFINITY, f64::min);
        let high = free.iter().copied().fold(0.0, f64::max);
        let worst = found.iter().filter(|e| e.place == Place::Free).map(error).fold(0.0, f64::max);
        line += &format!(
            ": mean {}, min {}, max {}, uniformity {:.3} (min/mean), error at most {}",
            number(mean),
            number(low),
            number(high),
            if mean > 0.0 { low / mean } else { 0.0 },
            number(worst)
        );
    }
    let dark = free.iter().filter(|e| **e == 0.0).count();
    if dark > 0 {
        line += &format!("; {dark} get no light: see whether they are in the scene, in metres");
    }
    for (place, what) in [
        (Place::Covered, "inside solids (covered)"),
        (Place::OnEmitter, "on emitters"),
        (Place::Outside, "outside the model"),
    ] {
        if count(place) > 0 {
            line += &format!("; {} {what} left out", count(place));
        }
    }
    line
}
