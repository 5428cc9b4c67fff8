//! `hemicube view`: a scene in a browser, while it is lit and after.

mod live;
mod server;

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;

use glam::DVec3;
use hemicube::bake::{BakeOptions, Layers};
use hemicube::export::{PageView, live_page, page_data};
use hemicube::gather::{GatherOptions, Gatherer};
use hemicube::progress::Progress;
use hemicube::render::Renderer;
use hemicube::scene::Scene;
use hemicube::uncertainty::Uncertainty;
use hemicube::visibility::Bvh;

use crate::args::{EngineArg, Light, View as Args};
use crate::bake::{failure, gathering, stops_of};
use crate::failure::Failure;
use crate::input;
use crate::render::{memory, say_patches, set_threads, tone_of};
use crate::solutions::{self, is_solution};
use crate::staging::{Setup, prepare};
use crate::terminal::{Bar, catch_interrupts, print, say};
use live::{Lit, Live, Told};
use server::{Answer, Request, Server};

/// Rays a row of the first light.
const FIRST_SAMPLES: usize = 64;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    catch_interrupts();
    let (look, run) = (&args.look, &args.look.light.run);
    set_threads(run.threads)?;
    if look.light.factors.is_some() {
        return Err(Failure::input("--factors is not used with view; leave it out"));
    }
    let mut scene = input::read(&look.input)?;
    input::say_findings(&scene, run.quiet);
    let setup = prepare(&mut scene, look, None)?;
    let server = Server::new(args.port)
        .map_err(|e| Failure::Failed(format!("cannot listen on this machine: {e}")))?;
    let address = server.address().map_err(Failure::failed)?;
    let live = Arc::new(Live::default());
    let (page, asked) = (live_page(&scene.name).into_bytes(), Arc::clone(&live));
    let page = Arc::new(page);
    let serve = move || server.serve(move |request| answer(request, &page, &asked));
    thread::Builder::new().name("server".into()).spawn(serve).map_err(Failure::failed)?;
    print(&address);
    if !args.no_open {
        open(&address);
    }
    let bar = Bar::new(run.quiet);
    let told = Told { bar: &bar, live: &live };
    let worked = work(scene, args, setup, &told);
    bar.finish();
    live.finish(worked.as_ref().err().map(ToString::to_string));
    worked?;
    if !run.quiet {
        say("all light is there; Ctrl-C ends");
    }
    loop {
        thread::park();
    }
}

/// Lights the scene, first roughly.
fn work(scene: Scene, args: &Args, setup: Setup, told: &Told<'_>) -> Result<(), Failure> {
    let look = &args.look;
    let sampled = look.light.engine() == EngineArg::Rays && look.light.samples.is_none();
    let mut view = PageView {
        cameras: setup.cameras,
        exposure: 0.0,
        tone: tone_of(look.tone),
        unit: "lx".into(),
        error: None,
        names_patches: true,
    };
    if sampled && !is_solution(&look.input.model.scene) && look.light.error.is_none() {
        let light = Light { samples: Some(FIRST_SAMPLES), ..look.light.clone() };
        show(scene.clone(), args, &light, (&mut view, setup.exposure), true, told)?;
    }
    show(scene, args, &look.light, (&mut view, setup.exposure), false, told)
}

/// Lights the scene and shows it; `first` light is rough.
fn show(
    scene: Scene,
    args: &Args,
    light: &Light,
    (view, made_for): (&mut PageView, Option<f64>),
    first: bool,
    told: &Told<'_>,
) -> Result<(), Failure> {
    let look = &args.look;
    let (store, _) = solutions::store(&scene, &look.input, light, &[], told)?;
    let path: &Path = &look.input.model.scene;
    let solution = store.mix(&scene).map_err(|e| solutions::mix_failure(path, &e))?;
    let gather: GatherOptions = gathering(look);
    let uncertainty;
    {
        let field = solution.field_heard(&scene, told).map_err(Failure::failed)?;
        let bvh = Bvh::new(&scene.geometry);
        let gatherer = Gatherer::new(&scene, &solution, &field, &bvh, gather);
        let renderer = Renderer::gathering(&scene, &field, &gatherer);
        // Later light does not jump.
        if !told.live.is_shown() {
            view.exposure = stops_of(&renderer, &view.cameras[0], look, made_for)?;
        }
        uncertainty = Uncertainty::of(&scene.geometry, &solution, &field);
        view.error = Some(uncertainty.report(&solution).total).filter(|e| e.is_finite());
    }
    let options = BakeOptions { texel: args.texel, memory: memory(light) };
    let how = (!first).then_some(gather);
    let layers = Layers::new(&scene, &store, &options, how, told).map_err(failure)?;
    let data = page_data(&scene, &store, &layers, view, told as &dyn Progress)
        .map_err(|e| Failure::of(e, Failure::failed))?;
    if !first && !look.light.run.quiet {
        say_patches(&scene, &store.report(&scene), light);
    }
    told.live.show(data, Lit { scene, solution, uncertainty, facets: layers.facets() });
    Ok(())
}

/// What the page is told.
fn answer(request: &Request, page: &Arc<Vec<u8>>, live: &Live) -> Answer {
    const JSON: &str = "application/json";
    let json = |value: &serde_json::Value| Answer::of(JSON, value.to_string().into_bytes());
    let unknown = || Answer::refusal(404);
    match request.path.as_str() {
        "" => Answer { status: 200, kind: "text/html; charset=utf-8", body: Arc::clone(page) },
        "state" => json(&live.state()),
        "data" => Answer { status: 200, kind: "application/zip", body: live.data() },
        "row" => {
            let facet = request.value("facet").and_then(|f| f.parse().ok());
            let at = request.value("at").and_then(point);
            let found = facet.zip(at).zip(live.lit());
            found
                .and_then(|((facet, at), lit)| lit.row(facet, at))
                .map_or_else(unknown, |r| json(&r))
        }
        "hemicube" => {
            let patch = request.value("patch").and_then(|p| p.parse().ok());
            let found = patch.zip(live.lit()).and_then(|(patch, lit)| lit.hemicube(patch));
            found.map_or_else(unknown, |png| Answer::of("image/png", png))
        }
        _ => unknown(),
    }
}

fn point(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    Some(DVec3::from_array(numbers.try_into().ok()?)).filter(|p| p.is_finite())
}

/// Opens an address in the user's browser, where there is one.
fn open(address: &str) {
    let program = match std::env::consts::OS {
        "macos" => "open",
        "windows" => "explorer",
        _ => "xdg-open",
    };
    let quiet = || Stdio::null();
    let _ =
        Command::new(program).arg(address).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn();
}
