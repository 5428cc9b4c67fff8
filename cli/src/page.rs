//! `hemicube bake -o FILE.html`: a page that shows the model, its lamps under sliders.

use std::path::Path;
use std::time::Instant;

use hemicube::bake::{BakeOptions, Layers};
use hemicube::export::{ExportError, PageView, write_html};
use hemicube::gather::Gatherer;
use hemicube::render::Renderer;
use hemicube::report::Stage;
use hemicube::scene::{Rgb, Scene};
use hemicube::store::Store;
use hemicube::uncertainty::Uncertainty;
use hemicube::units::{Bytes, significant};
use hemicube::visibility::Bvh;

use crate::args::{Bake as Args, Exposure};
use crate::bake::{failure, gathering, stops_of};
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
    refuse_lost(&store, &scene)?;
    let start = Instant::now();
    let mut view = PageView {
        cameras,
        exposure: 0.0,
        tone: tone_of(look.tone),
        unit: "lx".into(),
        error: None,
        served: false,
    };
    let gather = gathering(look);
    let solution =
        store.mix(&scene).map_err(|e| solutions::mix_failure(&look.input.model.scene, &e))?;
    {
        let field = solution.field_heard(&scene, &bar)?;
        let bvh = Bvh::new(&scene.geometry);
        let gatherer = Gatherer::new(&scene, &solution, &field, &bvh, gather);
        let renderer = Renderer::gathering(&scene, &field, &gatherer);
        view.exposure = stops_of(&renderer, &view.cameras[0], look, exposure)?;
        let reflected = solution.reflected_field_heard(&scene, &bar)?;
        let error = Uncertainty::of_reflected(&scene.geometry, &solution, &reflected);
        view.error = Some(error.report(&solution).total).filter(|e| e.is_finite());
    }
    let options = BakeOptions { texel: args.texel, memory: memory(&look.light) };
    let layers = Layers::new(&scene, &store, &options, Some(gather), &bar).map_err(failure)?;
    write_html(output, &scene, &store, &layers, &view, &bar)
        .map_err(|e: ExportError| Failure::of(e, Failure::failed))?;
    bar.finish();
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

/// Refuses sources whose light cannot be brought back: what a texture says of triangles is lost
/// once it is multiplied by nothing.
fn refuse_lost(store: &Store, scene: &Scene) -> Result<(), Failure> {
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
