//! `hemicube render`: from a model to a lit picture.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::ValueEnum;
use hemicube::direct::DirectOptions;
use hemicube::engines::{
    Draw, EngineError, EngineOptions, ExactOptions, HemicubeOptions, RaysOptions,
};
use hemicube::export::{read_npz, write_whole};
use hemicube::form_factors::FormFactors;
use hemicube::gather::{GatherOptions, Gatherer};
use hemicube::patches::Patches;
use hemicube::refine::factor::RefineError;
use hemicube::render::{RenderError, Renderer};
use hemicube::report::{PictureError, Report, Stage};
use hemicube::scene::{Lamp, Scene, TriangleId};
use hemicube::solution::{Adaptive, Clustering, LightError, LightOptions, Solution, light_by};
use hemicube::solve::Method;
use hemicube::tone::Tone;
use hemicube::uncertainty::Uncertainty;
use hemicube::units::{Area, significant};
use hemicube::visibility::Bvh;

use crate::args::{
    ClusterArg, DeviceArg, DrawChoice, EngineArg, Exposure, Input, Light, Render, SolverChoice,
    StageArg, ToneChoice,
};
use crate::dark::lamp_before;
use crate::doubts;
use crate::failure::Failure;
use crate::input;
use crate::machine;
use crate::pictures::{Outputs, Pictures, Taken, views};
use crate::remedy;
use crate::solutions::{is_solution, relit};
use crate::staging::{Setup, prepare};
use crate::terminal::{Bar, catch_interrupts, print, say};

/// Rays a row of drafts, which show the noise of patches.
const DRAFT_SAMPLES: usize = 1024;

/// Runs the command.
pub fn run(args: &Render) -> Result<(), Failure> {
    catch_interrupts();
    set_threads(args.look.light.run.threads)?;
    if args.look.light.factors.is_some() && args.look.light.seed.is_some() {
        return Err(Failure::input("--seed is not used with --factors; leave it out"));
    }
    let mut scene = input::read(&args.look.input)?;
    input::say_findings(&scene, args.look.light.run.quiet);
    let aspect = args.size.map(|(w, h)| w.max(1) as f64 / h.max(1) as f64);
    let Setup { cameras, exposure } = prepare(&mut scene, &args.look, aspect)?;
    let views = views(cameras, exposure, args)?;
    let outputs = Outputs::of(&scene, &views, args)?;
    let bar = Bar::new(args.look.light.run.quiet);
    let mut light = args.look.light.clone();
    let solved = is_solution(&args.look.input.model.scene);
    if args.draft && !solved && light.engine() == EngineArg::Rays && light.factors.is_none() {
        light.samples = light.samples.or(light.error.is_none().then_some(DRAFT_SAMPLES));
    }
    let mut solution = lit(&scene, &args.look.input, &light, &bar)?;

    let start = Instant::now();
    let field = solution.field_heard(&scene, &bar)?;
    let error = if args.draft {
        Uncertainty::of(&scene.geometry, &solution, &field)
    } else {
        let reflected = solution.reflected_field_heard(&scene, &bar)?;
        Uncertainty::of_reflected(&scene.geometry, &solution, &reflected)
    };
    let error = error.report(&solution);
    let seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let bvh = (!args.draft).then(|| Bvh::new(&scene.geometry));
    let usual = GatherOptions::of_pictures(args.look.light.seed.unwrap_or_default());
    let options = GatherOptions { error: args.look.light.error_of_light(), ..usual };
    let gathering = |bvh| Gatherer::new_heard(&scene, &solution, &field, bvh, options, &bar);
    let gatherer = bvh.as_ref().map(gathering).transpose()?;
    let renderer = match &gatherer {
        Some(gatherer) => Renderer::gathering(&scene, &field, gatherer),
        None => Renderer::new(&scene, &field),
    };
    let pictures = Pictures { renderer: &renderer, outputs: &outputs, args, bar: &bar };
    let Taken { stops, known } = pictures.take(&views)?;
    let view = &views[0];
    let aspect = view.picture.width as f64 / view.picture.height as f64;
    let shares = renderer.shares(&view.camera, aspect).map_err(picture_failure)?;
    bar.finish();
    let picture_seconds = start.elapsed().as_secs_f64();
    let auto = stops.filter(|_| args.look.exposure == Exposure::Auto);
    if let Some(stops) = auto.filter(|_| !args.look.light.run.quiet) {
        say(&format!("exposure: --exposure {stops:.2}"));
    }
    if !args.look.light.run.quiet {
        let taken = doubts::Taken {
            stops: auto,
            sunlit: scene.lamps.iter().any(|l| matches!(l, Lamp::Directional { .. })),
            stage_off: args.look.stage == StageArg::Off,
            flipped: args.look.input.model.flip,
            solved,
        };
        let lamp = || lamp_before(&scene, view.camera.eye);
        let doubts = doubts::of_picture(&shares, &taken, &lamp).into_iter();
        let of_error = match known {
            Some(known) => doubts::of_pixels(known, args.look.light.error_of_light()),
            None => doubts::of_error(&error, solution.halves.is_some()),
        };
        let of_balance = doubts::of_balance(&solution.report);
        for doubt in doubts.chain(of_error).chain(of_balance) {
            say(&format!("warning: {doubt}"));
        }
    }
    solution.report.error = Some(error);
    solution.report.picture_error =
        known.map(|[total, of_solution]| PictureError { total, of_solution });
    solution.report.stages.push(Stage { name: "reconstruct", seconds });
    solution.report.stages.push(Stage { name: "picture", seconds: picture_seconds });
    if args.look.light.run.verbose {
        say_details(&solution.report);
        if let Some([all, of_solution]) = known {
            say(&format!(
                "picture: on 80 % of it light is known to {:.2} % (95 % intervals), to {:.2} % but \
                 for its own noise",
                100.0 * all,
                100.0 * of_solution
            ));
        }
    }
    write_report(&mut solution.report, &args.look.light)?;
    for path in outputs.all() {
        print(&path.display().to_string());
    }
    Ok(())
}

/// The tone curve asked for.
pub fn tone_of(choice: ToneChoice) -> Tone {
    match choice {
        ToneChoice::Agx => Tone::Agx,
        ToneChoice::Reinhard => Tone::Reinhard,
        ToneChoice::Linear => Tone::Linear,
    }
}

/// Works on so many threads; 0: one a core.
pub fn set_threads(threads: usize) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::failed)
}

/// All files that a scene and its light are read from.
pub fn inputs<'a>(
    scene: &'a Scene,
    input: &'a Input,
    light: &'a Light,
) -> impl Iterator<Item = &'a PathBuf> {
    let lamps = input.lamp.iter().filter_map(|lamp| lamp.file.as_ref());
    let photometry = input.ies.iter().map(|(_, file)| file).chain(lamps);
    scene.files.iter().chain(photometry).chain(&light.factors)
}

/// Lights the scene as the command line says.
pub fn lit(scene: &Scene, input: &Input, args: &Light, bar: &Bar) -> Result<Solution, Failure> {
    if is_solution(&input.model.scene) {
        return relit(scene, &input.model.scene, args, bar);
    }
    let options = options_of(args)?;
    let solution = match &args.factors {
        Some(path) => {
            let (patches, factors) = stored(path, scene, args, options.memory)?;
            light_by(scene, patches, factors, &options, bar)
        }
        None => scene.light(&options, bar).map(|lit| lit.solution),
    };
    let solution = solution.map_err(|e| light_failure(e, args))?;
    bar.finish();
    if !args.run.quiet {
        say_patches(scene, &solution.report, args);
    }
    let missed = args.error.zip(solution.report.error).filter(|(target, e)| e.total > *target);
    if let Some((target, error)) = missed.filter(|_| options.error.is_some() && !args.run.quiet) {
        say(&format!(
            "--error {}%: not reached, the best is {:.2} % (noise {:.2} %, size of patches {:.2} \
             %); \
             allow a larger error, or more --memory",
            100.0 * target,
            100.0 * error.total,
            100.0 * error.noise,
            100.0 * error.refinement
        ));
    }
    Ok(solution)
}

/// The options of light that the command line means.
pub fn options_of(args: &Light) -> Result<LightOptions, Failure> {
    let sampled = args.engine() == EngineArg::Rays && args.factors.is_none();
    let seed = args.seed.unwrap_or_default();
    Ok(LightOptions {
        patch_size: args.patch_size,
        cluster: match args.cluster {
            ClusterArg::Auto => Clustering::Auto,
            ClusterArg::On => Clustering::On,
            ClusterArg::Off => Clustering::Off,
        },
        adaptive: args
            .max_factor
            .zip(args.min_patch)
            .map(|(max_factor, min_area)| Adaptive { max_factor, min_area }),
        engine: engine_of(args)?,
        direct: DirectOptions { seed, ..DirectOptions::default() },
        method: match args.solver {
            SolverChoice::GaussSeidel => Method::GaussSeidel,
            SolverChoice::Jacobi => Method::Jacobi,
            SolverChoice::Shooting => Method::Shooting,
            SolverChoice::Direct => Method::Direct,
        },
        tolerance: None,
        error: args.error.filter(|_| sampled),
        memory: memory(args),
    })
}

/// Bytes that the work may take.
pub fn memory(args: &Light) -> u64 {
    args.run.memory.unwrap_or_else(machine::available_memory)
}

/// Why a scene could not be lit, and what to do about it.
pub fn light_failure(error: LightError, args: &Light) -> Failure {
    Failure::of(error, |e| {
        let direct = args.solver == SolverChoice::Direct;
        let text = format!("{e}{}", remedy::of_light(&e, direct));
        match e {
            LightError::Patches(_)
            | LightError::NoSky
            | LightError::Refine(RefineError::Tolerance(_) | RefineError::Clusters)
            | LightError::Engine(EngineError::Clusters(_) | EngineError::Hemicube(_))
            | LightError::Memory { .. } => Failure::Input(text),
            _ => Failure::Failed(text),
        }
    })
}

/// Says into what a scene was subdivided.
pub fn say_patches(scene: &Scene, report: &Report, args: &Light) {
    say(&format!(
        "{}: {} source triangles, {} patches{}{}",
        report.scene,
        // Without those of a stage.
        scene.geometry.whole_from.map_or(report.source_triangles, TriangleId::index),
        report.patches,
        if report.clusters == 0 {
            String::new()
        } else {
            format!(", {} of them of several source triangles (--cluster)", report.clusters)
        },
        if args.max_factor.is_some() || !report.patch_size.is_finite() {
            String::new()
        } else {
            format!(
                " of at most {} (--patch-size {})",
                Area(report.patch_size),
                significant(report.patch_size)
            )
        }
    ));
}

/// The first of the flags that say how form factors are made.
pub fn of_factors(args: &Light) -> Option<&'static str> {
    let flags = [
        ("--patch-size", args.patch_size.is_some()),
        ("--max-factor", args.max_factor.is_some()),
        ("--cluster", args.cluster != ClusterArg::Auto),
        ("--engine", args.engine.is_some()),
        ("--device", args.device.is_some()),
        ("--resolution", args.resolution.is_some()),
        ("--draw", args.draw.is_some()),
        ("--samples", args.samples.is_some()),
    ];
    flags.iter().find(|f| f.1).map(|f| f.0)
}

/// Form factors stored before for this scene.
fn stored(
    path: &Path,
    scene: &Scene,
    args: &Light,
    memory: u64,
) -> Result<(Patches, FormFactors), Failure> {
    let error = args.error.map(|_| "--error");
    if let Some(flag) = of_factors(args).or(error) {
        return Err(Failure::Input(format!("{flag} is not used with --factors; leave it out")));
    }
    let read = read_npz(path, memory)
        .map_err(|e| Failure::Input(format!("{e}{}", remedy::of_stored_file(&e))))?;
    read.restore(&scene.geometry, memory)
        .map_err(|e| Failure::Input(format!("{}: {e}{}", path.display(), remedy::of_stored(&e))))
}

/// The engine asked for; a flag that it does not use is an error.
pub fn engine_of(args: &Light) -> Result<EngineOptions, Failure> {
    let engine = args.engine();
    let hemicubes = [
        ("--device", args.device.is_some()),
        ("--resolution", args.resolution.is_some()),
        ("--draw", args.draw.is_some()),
    ];
    let samples = [("--samples", args.samples.is_some())];
    let seed = [("--seed", args.seed.is_some())];
    let error = [("--error", args.error.is_some())];
    let unused: &[&[(&str, bool)]] = match engine {
        EngineArg::Rays => &[&hemicubes],
        EngineArg::Exact => &[&hemicubes, &samples],
        EngineArg::Hemicube => &[&samples, &seed, &error],
        EngineArg::Classical => &[&hemicubes, &samples, &seed, &error],
    };
    if let Some((flag, _)) = unused.iter().flat_map(|flags| *flags).find(|f| f.1) {
        let name = engine.to_possible_value();
        let name = name.as_ref().map_or("", |n| n.get_name());
        let user = match *flag {
            "--samples" => "rays",
            "--seed" | "--error" => "rays or --engine exact",
            _ => "hemicube",
        };
        return Err(Failure::Input(format!(
            "{flag} is not used by --engine {name}; leave it out, or use --engine {user}"
        )));
    }
    match engine {
        EngineArg::Exact => {
            let default = ExactOptions::default();
            return Ok(EngineOptions::Exact(ExactOptions {
                error: args.error.unwrap_or(default.error),
                seed: args.seed.unwrap_or(default.seed),
                ..default
            }));
        }
        EngineArg::Classical => return Ok(EngineOptions::Classical),
        EngineArg::Rays => {
            let seed = args.seed.unwrap_or_default();
            let samples = args.samples.unwrap_or(RaysOptions::default().samples);
            return Ok(EngineOptions::Rays(RaysOptions { samples, seed }));
        }
        EngineArg::Hemicube => {}
    }
    let hemicube = HemicubeOptions {
        resolution: args.resolution.unwrap_or(HemicubeOptions::default().resolution),
        draw: match args.draw {
            Some(DrawChoice::Patches) => Draw::Patches,
            Some(DrawChoice::Sources) | None => Draw::Sources,
        },
    };
    match args.device {
        Some(DeviceArg::Gpu) => gpu_hemicube(hemicube),
        Some(DeviceArg::Cpu) | None => Ok(EngineOptions::Hemicube(hemicube)),
    }
}

#[cfg(feature = "gpu")]
fn gpu_hemicube(options: HemicubeOptions) -> Result<EngineOptions, Failure> {
    Ok(EngineOptions::HemicubeGpu(options))
}

#[cfg(not(feature = "gpu"))]
fn gpu_hemicube(_: HemicubeOptions) -> Result<EngineOptions, Failure> {
    Err(Failure::input(
        "this program was built without its GPU engine; build it with `cargo install --path cli \
         --features gpu` (or run it by `cargo run --release --features gpu -- ...`), or use \
         --device cpu",
    ))
}

/// Says how long each stage took and where the light went.
pub fn say_details(report: &Report) {
    for stage in &report.stages {
        say(&format!("{:14} {:8.3} s", stage.name, stage.seconds));
    }
    if let Some(device) = report.engine.as_ref().and_then(|e| e.device.as_ref()) {
        say(&format!("device: {device}"));
    }
    if let Some(r) = report.rows {
        say(&format!(
            "rows: {} with {} entries ({} MiB); on average {:.4} to patches, {:.4} to the \
             environment, \
             {:.4} to backs, {:.4} lost; {} covered{}",
            r.rows,
            r.entries,
            r.bytes >> 20,
            r.entries_share,
            r.environment,
            r.back,
            r.lost,
            r.covered,
            r.reciprocity_rms.map_or(String::new(), |rms| format!(
                "; reciprocity error {:.1} % RMS",
                100.0 * rms
            ))
        ));
    }
    if let Some(s) = report.solve {
        say(&format!("solution: {} iterations, residual {:.1e}", s.iterations, s.residual));
    }
    if let Some(e) = report.error {
        say(&format!("error: {}", doubts::known_to(&e)));
    }
    if let Some(e) = report.energy {
        say(&format!("energy: {:+.2} % imbalance of all that is emitted", 100.0 * e.imbalance));
    }
}

pub fn picture_failure(error: RenderError) -> Failure {
    Failure::of(error, |e| Failure::Input(format!("{e}{}", remedy::of_picture(&e))))
}

/// Writes what happened, if it is wanted.
pub fn write_report(report: &mut Report, args: &Light) -> Result<(), Failure> {
    let Some(path) = &args.run.report else { return Ok(()) };
    report.peak_memory_bytes = machine::peak_memory();
    let json = serde_json::to_string_pretty(report).map_err(Failure::failed)?;
    write_whole(path, json.as_bytes()).map_err(Failure::failed)
}
