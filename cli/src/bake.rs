//! `hemicube bake`: the model with its light.

use std::path::{Path, PathBuf};
use std::time::Instant;

use hemicube::View;
use hemicube::bake::{Bake, BakeError, BakeOptions};
use hemicube::export::{BakeMode, ExportError, write_exr, write_glb, write_whole};
use hemicube::gather::{GatherOptions, Gatherer};
use hemicube::render::{Renderer, Sight};
use hemicube::report::Stage;
use hemicube::scene::Camera;
use hemicube::tone::KEY;
use hemicube::units::significant;
use hemicube::visibility::Bvh;

use crate::args::{Bake as Args, Exposure, Look, ModeArg};
use crate::doubts::of_balance;
use crate::failure::Failure;
use crate::input;
use crate::outputs;
use crate::page;
use crate::render::{inputs, lit, memory, say_details, set_threads, tone_of, write_report};
use crate::staging::{Setup, prepare};
use crate::terminal::{Bar, catch_interrupts, print, say};

/// The files of a bake: the model, and beside a lightmap the same as floats, and its layout.
struct Outputs {
    model: PathBuf,
    map: Option<PathBuf>,
    layout: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    catch_interrupts();
    if let Some(output) = args.output.as_ref().filter(|o| has_extension(o, "html")) {
        return page::run(args, output);
    }
    let (look, run) = (&args.look, &args.look.light.run);
    set_threads(run.threads)?;
    if args.false_colour.is_some() {
        return Err(Failure::input("--false-colour is of pages; write one with -o FILE.html"));
    }
    let mode = args.mode.unwrap_or(ModeArg::Unlit);
    if args.direct && mode != ModeArg::Lightmap {
        return Err(Failure::input("--direct is of --mode lightmap; the others hold all light"));
    }
    let mut scene = input::read(&look.input)?;
    let outputs = outputs_of(&scene.name, args)?;
    let files = [
        ("-o", Some(&outputs.model)),
        ("the floats of -o", outputs.map.as_ref()),
        ("the layout of -o", outputs.layout.as_ref()),
        ("--report", run.report.as_ref()),
    ];
    outputs::check(&files, inputs(&scene, &look.input, &look.light))?;
    input::say_findings(&scene, run.quiet);
    let Setup { cameras, exposure } = prepare(&mut scene, look, None)?;
    let bar = Bar::new(run.quiet);
    let mut solution = lit(&scene, &look.input, &look.light, &bar)?;

    let start = Instant::now();
    let field = solution.field_heard(&scene, &bar)?;
    let bvh = Bvh::new(&scene.geometry);
    let options = gathering(look);
    let gatherer = Gatherer::new_heard(&scene, &solution, &field, &bvh, options, &bar)?;
    let mut renderer = Renderer::gathering(&scene, &field, &gatherer);
    let mode = match mode {
        ModeArg::Unlit => BakeMode::Unlit,
        ModeArg::Vertex => BakeMode::Vertex,
        ModeArg::Lightmap => BakeMode::Lightmap { keeps_lamps: !args.direct },
    };
    if mode == (BakeMode::Lightmap { keeps_lamps: true }) {
        renderer = renderer.without_lamps();
    }
    let stops = stops_of(&renderer, &cameras[0], look, exposure)?;
    let tone = tone_of(look.tone);
    let factor = stops.exp2();
    let shown = |s: &Sight| match mode {
        BakeMode::Unlit => tone.map(s.radiance * factor),
        _ => [0.0; 3],
    };
    let options = BakeOptions { texel: args.texel, memory: memory(&look.light) };
    let bake = Bake::new(&scene, &solution, &renderer, &options, shown, &bar).map_err(failure)?;
    bar.finish();
    let failed = |e: ExportError| Failure::of(e, Failure::failed);
    if let Some(path) = &outputs.map {
        write_exr(path, bake.size(), &bake.lambertian()).map_err(failed)?;
    }
    let baked = write_glb(&outputs.model, &scene, &bake, mode).map_err(failed)?;
    if let Some(path) = &outputs.layout {
        let text = serde_json::to_string_pretty(&bake.layout()).map_err(Failure::failed)?;
        write_whole(path, text.as_bytes()).map_err(failed)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    if !run.quiet {
        let [width, height] = bake.size();
        if mode == BakeMode::Vertex {
            say(&format!(
                "{} triangles; COLOR_0 times {} is radiance",
                baked.triangles,
                significant(baked.scale)
            ));
        } else {
            say(&format!(
                "atlas: {width} x {height} texels of {} m in {} charts (--texel {})",
                significant(bake.texel()),
                bake.charts(),
                significant(bake.texel())
            ));
        }
        if mode == BakeMode::Unlit && look.exposure == Exposure::Auto {
            say(&format!("exposure: --exposure {stops:.2}"));
        }
    }
    if let Some(doubt) = of_balance(&solution.report).filter(|_| !run.quiet) {
        say(&format!("warning: {doubt}"));
    }
    solution.report.stages.push(Stage { name: "bake", seconds });
    if run.verbose {
        say_details(&solution.report);
    }
    write_report(&mut solution.report, &look.light)?;
    for path in [Some(&outputs.model), outputs.map.as_ref(), outputs.layout.as_ref()] {
        path.into_iter().for_each(|p| print(&p.display().to_string()));
    }
    Ok(())
}

/// How light is gathered for an atlas.
pub fn gathering(look: &Look) -> GatherOptions {
    GatherOptions {
        error: look.light.error_of_light(),
        ..GatherOptions::of_pictures(look.light.seed.unwrap_or_default())
    }
}

/// The exposure asked for, that which the light was made for, or else that which suits what a
/// camera sees; in stops.
pub fn stops_of(
    renderer: &Renderer<'_>,
    camera: &Camera,
    look: &Look,
    made_for: Option<f64>,
) -> Result<f64, Failure> {
    let usual = View::through(camera.clone()).picture;
    let aspect = usual.width as f64 / usual.height as f64;
    match (look.exposure, made_for) {
        (Exposure::Stops(stops), _) | (Exposure::Auto, Some(stops)) => Ok(stops),
        (Exposure::Auto, None) => {
            Ok(renderer.auto_exposure(camera, aspect, KEY).map_err(Failure::input)?.log2())
        }
    }
}

/// Why nothing was baked, and what to do about it.
pub fn failure(error: BakeError) -> Failure {
    Failure::of(error, |e| Failure::Input(format!("{e}{}", remedy(&e))))
}

fn remedy(error: &BakeError) -> &'static str {
    match error {
        BakeError::Atlas(_) => "; give a larger --texel",
        BakeError::Memory { .. } => "; give a larger --texel, or allow more with --memory",
        BakeError::Nothing => "; does the model face inwards? Try --flip",
        BakeError::Mix(_) | BakeError::Cancelled(_) => "",
    }
}

fn outputs_of(scene: &str, args: &Args) -> Result<Outputs, Failure> {
    let model = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{scene}-baked.glb")));
    if !has_extension(&model, "glb") {
        let text = format!("{}: baked models are written as .glb or .html", model.display());
        return Err(Failure::Input(text));
    }
    let beside = |extension: &str| {
        (args.mode == Some(ModeArg::Lightmap)).then(|| model.with_extension(extension))
    };
    Ok(Outputs { map: beside("exr"), layout: beside("json"), model })
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
