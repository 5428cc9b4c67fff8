//! `hemicube view`: a scene in a browser, while it is lit and after.

mod live;
mod server;
mod subdivisions;

use std::io::ErrorKind;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use glam::DVec3;
use hemicube::bake::{BakeOptions, Layers};
use hemicube::export::{PageView, live_page, page_data, page_facets};
use hemicube::progress::Progress;
use hemicube::scene::Scene;
use hemicube::store::Store;
use hemicube::uncertainty::Uncertainty;

use crate::args::{EngineArg, Light, View as Args};
use crate::bake::{failure, gathering};
use crate::failure::Failure;
use crate::input;
use crate::page::{check, look_first, mixed};
use crate::render::{memory, say_patches, set_threads, tone_of};
use crate::solutions::{self, is_solution};
use crate::staging::{Setup, prepare};
use crate::terminal::{Bar, catch_interrupts, print, say};
use live::{Lit, Live, Told};
use server::{Answer, Request, Server};
use subdivisions::Subdivisions;

/// Rays a row of the first light.
const FIRST_SAMPLES: usize = 64;

/// So long the page may still hear why work has failed.
const FAREWELL: Duration = Duration::from_millis(500);

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    catch_interrupts();
    let (look, run) = (&args.look, &args.look.light.run);
    set_threads(run.threads)?;
    let unused = [
        ("--factors", look.light.factors.is_some()),
        ("--report", look.light.run.report.is_some()),
    ];
    if let Some((flag, _)) = unused.iter().find(|f| f.1) {
        return Err(Failure::Input(format!("{flag} is not used with view; leave it out")));
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
    if let Err(failure) = worked.as_ref().map_err(ToString::to_string) {
        live.fail(failure);
        thread::sleep(FAREWELL);
    }
    worked
}

/// Lights the scene, first roughly, and again whenever the page wishes for other reflectances or
/// patches.
fn work(mut scene: Scene, args: &Args, setup: Setup, told: &Told<'_>) -> Result<(), Failure> {
    let look = &args.look;
    let quiet = look.light.run.quiet;
    let mut view = PageView {
        cameras: setup.cameras,
        exposure: setup.exposure.unwrap_or_default(),
        tone: tone_of(look.tone),
        unit: args.false_colour.text().into(),
        error: None,
        served: true,
    };
    let show = |scene: &Scene, store: &Store, view: &mut PageView, roughly: bool| {
        // Later light does not jump.
        let chosen = if told.live.is_shown() { Some(view.exposure) } else { setup.exposure };
        show(scene, store, args, (view, chosen), roughly, told)
    };
    let sampled = look.light.engine() == EngineArg::Rays && look.light.samples.is_none();
    if sampled && !is_solution(&look.input.model.scene) && look.light.error.is_none() {
        let light = Light { samples: Some(FIRST_SAMPLES), ..look.light.clone() };
        let (store, _) = solutions::store(&scene, &look.input, &light, &[], told)?;
        check(&store, &scene)?;
        show(&scene, &store, &mut view, true)?;
    }
    let mut solved = Subdivisions::new(&scene, &look.input, &look.light, told)?;
    check(&solved.shown().store, &scene)?;
    if !quiet {
        say_patches(&scene, &solved.shown().store.report(&scene), &look.light);
    }
    told.live.heed();
    // The first time, light by few rays is there already.
    let (mut roughly, mut is_shown) = (false, false);
    loop {
        if !is_shown && !told.live.is_wished() {
            let store = &solved.shown().store;
            let first = if roughly { show(&scene, store, &mut view, true) } else { Ok(()) };
            match first.and_then(|()| show(&scene, store, &mut view, false)) {
                // Something else is wished for meanwhile.
                Err(_) if told.live.is_wished() => {}
                Err(failure) => return Err(failure),
                Ok(()) => {
                    is_shown = true;
                    told.bar.finish();
                    if !quiet {
                        say("all light is there; Ctrl-C ends");
                    }
                }
            }
        }
        if is_shown {
            told.live.rest();
        }
        let wishes = told.live.wishes();
        // A texture may have to give way even to the colour that it has on the average.
        let is_recoloured = !wishes.reflectances.is_empty();
        for (name, reflectance) in wishes.reflectances {
            for m in 0..scene.optics.materials.len() {
                if scene.optics.materials[m].name == name {
                    scene.optics.set_reflectance(m, reflectance);
                }
            }
        }
        match solved.make(&scene, wishes.subdivision, told) {
            Ok(is_new) if is_new || is_recoloured => (roughly, is_shown) = (true, false),
            Ok(_) => {}
            // The scene keeps what it was given, and so does the subdivision.
            Err(_) if told.live.is_wished() => is_shown = false,
            Err(failure) => return Err(failure),
        }
    }
}

/// Shows the scene lit: roughly by the light of patches, or gathered at each texel.
fn show(
    scene: &Scene,
    store: &Store,
    args: &Args,
    (view, exposure): (&mut PageView, Option<f64>),
    roughly: bool,
    told: &Told<'_>,
) -> Result<(), Failure> {
    let look = &args.look;
    let solution = mixed(store, scene, look)?;
    let how = (!roughly).then(|| gathering(look));
    look_first(view, (scene, &solution), look, exposure, how, told)?;
    let field = solution.field_heard(scene, told)?;
    let uncertainty = Uncertainty::of(&scene.geometry, &solution, &field);
    let options = BakeOptions { texel: args.texel, memory: memory(&look.light) };
    let layers = Layers::new(scene, store, &options, how, told).map_err(failure)?;
    let data =
        page_data(scene, store, &layers, view, told as &dyn Progress).map_err(|e| {
            match e.kind() {
                ErrorKind::Interrupted => Failure::Cancelled,
                _ => Failure::failed(e),
            }
        })?;
    let (scene, facets) = (scene.clone(), page_facets(scene, &layers));
    told.live.show(data, Lit { scene, solution, uncertainty, facets });
    Ok(())
}

/// What the page is told.
fn answer(request: &Request, page: &Arc<Vec<u8>>, live: &Live) -> Answer {
    const JSON: &str = "application/json";
    let json = |value: &serde_json::Value| Answer::of(JSON, value.to_string().into_bytes());
    let unknown = || Answer::refusal(404);
    if request.posted {
        return if wish(request, live) { json(&live.state()) } else { unknown() };
    }
    match request.path.as_str() {
        "" => Answer { status: 200, kind: "text/html; charset=utf-8", body: Arc::clone(page) },
        "state" => json(&live.state()),
        "data" => Answer { status: 200, kind: "application/zip", body: live.data() },
        "row" => {
            let facet = request.value("facet").and_then(|f| f.parse().ok());
            let at = request.value("at").and_then(point);
            let version = request.value("version").and_then(|v| v.parse().ok());
            let found = facet.zip(at).zip(version.and_then(|v| live.lit_of(v)));
            found
                .and_then(|((facet, at), lit)| lit.row(facet, at))
                .map_or_else(unknown, |r| json(&r))
        }
        "hemicube" => {
            let patch = request.value("patch").and_then(|p| p.parse().ok());
            let version = request.value("version").and_then(|v| v.parse().ok());
            let lit = version.and_then(|v| live.lit_of(v));
            let found = patch.zip(lit).and_then(|(patch, lit)| lit.hemicube(patch));
            found.map_or_else(unknown, |png| Answer::of("image/png", png))
        }
        _ => unknown(),
    }
}

/// Has a wish fulfilled; false if it is none.
fn wish(request: &Request, live: &Live) -> bool {
    match request.path.as_str() {
        "reflectance" => {
            let material = request.value("material").map(unescaped);
            let colour = request.value("reflectance").and_then(point);
            let colour = colour.filter(|c| c.min_element() >= 0.0 && c.max_element() <= 1.0);
            let wished = material.zip(colour);
            wished.map(|(material, colour)| live.wish_reflectance(material, colour)).is_some()
        }
        "subdivision" => match request.value("tolerance") {
            Some("uniform") => live.wish_subdivision(None),
            tolerance => tolerance
                .and_then(|t| t.parse().ok())
                .filter(|t| (f64::MIN_POSITIVE..=1.0).contains(t))
                .is_some_and(|t| live.wish_subdivision(Some(t))),
        },
        _ => false,
    }
}

fn point(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    Some(DVec3::from_array(numbers.try_into().ok()?)).filter(|p| p.is_finite())
}

/// A text of a query, in which bytes may be written as %XX.
fn unescaped(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let [first, more @ ..] = rest {
        let code = more.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        let code = code.filter(|_| *first == b'%').and_then(|d| u8::from_str_radix(d, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &more[2..] } else { more };
    }
    String::from_utf8_lossy(&bytes).into_owned()
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
