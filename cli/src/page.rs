//! `hemicube bake -o FILE.html`: a page that shows the model, its lamps under sliders.

use std::path::Path;
use std::time::Instant;

use hemicube::bake::{BakeOptions, Layers};
use hemicube::export::{ExportError, MOST_LAYERS, PageView, write_html};
use hemicube::gather::{GatherOptions, Gatherer};
use hemicube::progress::Progress;
use hemicube::render::Renderer;
use hemicube::report::Stage;
use hemicube::scene::{Rgb, Scene};
use hemicube::solution::Solution;
use hemicube::store::Store;
use hemicube::uncertainty::Uncertainty;
use hemicube::units::{Bytes, significant};
use hemicube::visibility::Bvh;

use crate::args::{Bake as Args, Exposure, Look, UnitArg};
use crate::bake::{failure, gathering, stops_of};
use crate::doubts::of_balance;
use crate::failure::Failure;
use crate::input;
use crate::outputs;
use crate::render::{inputs, memory, say_details, say_patches, set_threads, tone_of, write_report};
use crate::solutions;
use crate::staging::{Setup, prepare};
use crate::terminal::{Bar, print, say};

/// Runs the command.
pub fn run(args: &Args, output: &Path) -> Result<(), Failure> {
    let (look, run) = (&args.look, &args.look.light.run);
    set_threads(run.threads)?;
    let mode = args.mode.map(|_| "--mode").or(args.direct.then_some("--direct"));
    let factors = look.light.factors.as_ref().map(|_| "--factors");
    if let Some(flag) = mode.or(factors) {
        return Err(Failure::Input(format!("{flag} is not used with a page; leave it out")));
    }
    let mut scene = input::read(&look.input)?;
    let files = [("-o", Some(&output.to_owned())), ("--report", run.report.as_ref())];
    outputs::check(&files, inputs(&scene, &look.input, &look.light))?;
    input::say_findings(&scene, run.quiet);
    let Setup { cameras, exposure } = prepare(&mut scene, look, None)?;
    let bar = Bar::new(run.quiet);
    let (store, _) = solutions::store(&scene, &look.input, &look.light, &[], &bar)?;
    check(&store, &scene)?;
    let start = Instant::now();
    let mut view = PageView {
        cameras,
        exposure: 0.0,
        tone: tone_of(look.tone),
        unit: args.false_colour.unwrap_or(UnitArg::Lux).text().into(),
        error: None,
        served: false,
    };
    let gather = gathering(look);
    let solution = mixed(&store, &scene, look)?;
    look_first(&mut view, (&scene, &solution), look, exposure, Some(gather), &bar)?;
    let options = BakeOptions { texel: args.texel, memory: memory(&look.light) };
    let layers = Layers::new(&scene, &store, &options, Some(gather), &bar).map_err(failure)?;
    write_html(output, &scene, &store, &layers, &view, &bar)
        .map_err(|e: ExportError| Failure::of(e, Failure::failed))?;
    bar.finish();
    if let Some(doubt) = of_balance(&solution.report).filter(|_| !run.quiet) {
        say(&format!("warning: {doubt}"));
    }
    let mut report = store.report(&scene);
    report.stages.push(Stage { name: "page", seconds: start.elapsed().as_secs_f64() });
    if !run.quiet {
        say_patches(&scene, &report, &look.light);
        for source in &store.sources {
            say(&format!("source: {}", solutions::line(source, &scene)));
        }
        let [width, height] = layers.size();
        let texel = significant(layers.texel());
        let charts = layers.charts();
        say(&format!(
            "atlas: {width} x {height} texels of {texel} m in {charts} charts (--texel {texel})"
        ));
        if look.exposure == Exposure::Auto {
            say(&format!("exposure: --exposure {:.2}", view.exposure));
        }
        let bytes = std::fs::metadata(output).map_or(0, |m| m.len());
        say(&format!("{}: {}", output.display(), Bytes(bytes)));
    }
    if run.verbose {
        say_details(&report);
    }
    write_report(&mut report, &look.light)?;
    print(&output.display().to_string());
    Ok(())
}

/// The light of the scene as its sources now are.
pub fn mixed(store: &Store, scene: &Scene, look: &Look) -> Result<Solution, Failure> {
    store.mix(scene).map_err(|e| solutions::mix_failure(&look.input.model.scene, &e))
}

/// Finds the exposure of a page, `made_for` if that is given, and how well its light is known; that
/// of patches where nothing is gathered.
pub fn look_first(
    view: &mut PageView,
    (scene, solution): (&Scene, &Solution),
    look: &Look,
    made_for: Option<f64>,
    gather: Option<GatherOptions>,
    progress: &dyn Progress,
) -> Result<(), Failure> {
    let field = solution.field_heard(scene, progress)?;
    let camera = &view.cameras[0];
    let error = match gather {
        Some(options) => {
            let bvh = Bvh::new(&scene.geometry);
            let gatherer = Gatherer::new_heard(scene, solution, &field, &bvh, options, progress)?;
            let renderer = Renderer::gathering(scene, &field, &gatherer);
            view.exposure = stops_of(&renderer, camera, look, made_for)?;
            let reflected = solution.reflected_field_heard(scene, progress)?;
            Uncertainty::of_reflected(&scene.geometry, solution, &reflected)
        }
        None => {
            view.exposure = stops_of(&Renderer::new(scene, &field), camera, look, made_for)?;
            Uncertainty::of(&scene.geometry, solution, &field)
        }
    };
    view.error = Some(error.report(solution).total).filter(|e| e.is_finite());
    Ok(())
}

/// Refuses more sources than graphics cards have layers, and those whose light cannot be brought
/// back: what a texture says of triangles is lost once it is multiplied by nothing.
pub fn check(store: &Store, scene: &Scene) -> Result<(), Failure> {
    let count = store.sources.len();
    if count > MOST_LAYERS {
        return Err(Failure::Input(format!(
            "{}: {count} sources of light are more than the {MOST_LAYERS} that a page holds; put \
             some together with hemicube solve --group, and give that",
            scene.name
        )));
    }
    let lost = store.sources.iter().find(|source| {
        source.members.iter().any(|m| m.textured)
            && source.weight(scene).is_ok_and(|weight| weight == Rgb::ZERO)
    });
    match lost {
        Some(source) => Err(Failure::Input(format!(
            "--emission {}=0%: emits by a texture; leave it a share, and turn it down in the page",
            source.name
        ))),
        None => Ok(()),
    }
}
