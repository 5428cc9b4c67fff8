//! The point of view of a picture, and light for a model that has none: what is chosen is said.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use hemicube::scene::{Camera, Scene};
use hemicube::staging::{Kind, Lens, Model, Stage, viewpoint};
use hemicube::visibility::{Occluders, Surroundings, solid_angle_fraction};

use crate::args::{CameraArg, EngineArg, KindArg, Look, StageArg};
use crate::dark::{closed, coordinates};
use crate::failure::Failure;
use crate::input::nothing_to_see;
use crate::solutions::is_solution;
use crate::terminal::say;

/// How a picture is taken.
pub struct Setup {
    /// The points of view; at least one.
    pub cameras: Vec<Camera>,
    /// The exposure in stops that the light was made for, if it was.
    pub exposure: Option<f64>,
}

/// Chooses the camera of a picture of that width over height, or of any, and lights the scene if
/// nothing does.
pub fn prepare(scene: &mut Scene, args: &Look, aspect: Option<f64>) -> Result<Setup, Failure> {
    let known = known_camera(scene, args)?;
    let authored = scene.optics.emits() && !scene.cameras.is_empty();
    let lit = !scene.lamps.is_empty() || args.input.sky.is_some() || authored;
    let stage = match args.stage {
        StageArg::On if is_solution(&args.input.model.scene) => {
            return Err(Failure::input("--stage on is not used with a solution; leave it out"));
        }
        _ if is_solution(&args.input.model.scene) => false,
        StageArg::Auto => {
            let engine = args.light.engine() != EngineArg::Classical;
            !lit && engine && args.light.factors.is_none()
        }
        StageArg::On => true,
        StageArg::Off => false,
    };
    if let Some(camera) = known.clone().filter(|_| !stage) {
        return without_stage(scene, args, turned(camera, scene, args));
    }
    let kind = args.kind.map(|k| match k {
        KindArg::Object => Kind::Object,
        KindArg::Room => Kind::Room,
    });
    let model = Model::of(scene).ok_or_else(|| nothing_to_see(scene))?;
    if args.input.model.up.is_none() && scene.up.z.abs() == 1.0 {
        let axis = if scene.up.z > 0.0 { "z" } else { "-z" };
        tell(args, &format!("up: {axis}, as the model stands (--up y if it lies)"));
    }
    let kind = kind.unwrap_or_else(|| {
        let kind = model.kind();
        tell(
            args,
            match kind {
                Kind::Object => "model: an object, shown from outside (--as room if it is one)",
                Kind::Room => "model: a room, shown from within (--as object if it is one)",
            },
        );
        kind
    });
    let camera = known.unwrap_or_else(|| chosen(&model, kind, aspect, args));
    let camera = turned(camera, scene, args);
    // What glows lights a room, but not an object that is seen from outside.
    let dark = kind == Kind::Object || !model.is_lit();
    let stage = (stage && (dark || args.stage == StageArg::On))
        .then(|| Stage::of(&model, kind, &camera, lit));
    let Some(stage) = stage else { return without_stage(scene, args, camera) };
    stage.set(scene);
    tell(
        args,
        match &stage {
            Stage::Studio(_) => "light: a studio with ground, key light and sky (--stage off)",
            Stage::Ground(_) => "light: what is given, and a ground (--stage off)",
            Stage::Ceiling(_) => "light: lights under the ceiling (--stage off, or --emission)",
            Stage::Daylight { sun: Some(_) } => {
                "light: sky and sun through the openings (--stage off)"
            }
            Stage::Daylight { sun: None } => "light: a sky outside (--stage off)",
        },
    );
    Ok(Setup { cameras: all(camera, scene, args), exposure: stage.exposure() })
}

fn tell(args: &Look, text: &str) {
    if !args.light.run.quiet {
        say(text);
    }
}

/// The camera asked for, or the scene's first.
fn known_camera(scene: &Scene, args: &Look) -> Result<Option<Camera>, Failure> {
    if let (Some(eye), Some(target)) = (args.eye, args.target) {
        return Ok(Some(Camera {
            name: String::from("command line"),
            up: scene.up,
            ..Camera::at(eye, target)
        }));
    }
    let name = match &args.camera {
        Some(CameraArg::Named(name)) => name,
        Some(CameraArg::All) if scene.cameras.is_empty() => {
            let text = "--camera all: the scene has no camera; give --camera orbit:N, or --eye and \
                        --target";
            return Err(Failure::input(text));
        }
        _ => return Ok(scene.cameras.first().cloned()),
    };
    let found = scene.cameras.iter().find(|c| c.name == *name).cloned();
    found.map(Some).ok_or_else(|| {
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        Failure::Input(if names.is_empty() {
            format!("no camera '{name}': the scene has none; give --eye and --target")
        } else {
            format!("no camera '{name}'; the scene has {}", names.join(", "))
        })
    })
}

/// The cameras asked for, where `camera` is the one that counts for the light of a stage.
fn all(camera: Camera, scene: &Scene, args: &Look) -> Vec<Camera> {
    match args.camera {
        Some(CameraArg::All) => {
            scene.cameras.iter().map(|c| turned(c.clone(), scene, args)).collect()
        }
        Some(CameraArg::Orbit(count)) => orbit(&camera, scene, count),
        _ => vec![camera],
    }
}

/// Views around the middle of the model, beginning with a camera's; from within, it turns where it
/// stands.
fn orbit(camera: &Camera, scene: &Scene, count: usize) -> Vec<Camera> {
    let g = &scene.geometry;
    let own = g.ids().filter(|&t| g.is_solid(t) && !g.is_whole(t));
    let corners = own.flat_map(|t| g.corners(t));
    let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = corners.fold(start, |b, p| [b[0].min(p), b[1].max(p)]);
    let inside = camera.eye.cmpge(low).all() && camera.eye.cmple(high).all();
    let centre = if inside { camera.eye } else { (low + high) / 2.0 };
    let up = scene.up.normalize_or(DVec3::Y);
    let digits = count.to_string().len();
    (0..count)
        .map(|i| {
            let turn = DQuat::from_axis_angle(up, TAU * i as f64 / count as f64);
            Camera {
                name: format!("orbit-{:0digits$}", i + 1),
                eye: centre + turn * (camera.eye - centre),
                forward: turn * camera.forward,
                up: turn * camera.up,
                ..camera.clone()
            }
        })
        .collect()
}

/// The camera as `--up` and `--vfov` turn it.
fn turned(mut camera: Camera, scene: &Scene, args: &Look) -> Camera {
    if args.input.model.up.is_some() {
        camera.up = scene.up;
    }
    if let Some(vfov) = args.vfov {
        camera.vfov = vfov.to_radians();
    }
    camera
}

fn chosen(model: &Model<'_>, kind: Kind, aspect: Option<f64>, args: &Look) -> Camera {
    let lens = Lens { aspect, vfov: args.vfov.map(f64::to_radians) };
    let view = viewpoint(model, kind, &lens);
    let digits = |v| coordinates(v, model.size());
    tell(
        args,
        &format!(
            "camera: --eye {} --target {} --vfov {:.0} (the model has none; this one is {})",
            digits(view.camera.eye),
            digits(view.target),
            view.camera.vfov.to_degrees(),
            if view.inside { "inside" } else { "outside" },
        ),
    );
    view.camera
}

/// Lights a scene that has no light and gets no stage: by a uniform sky, unless it is closed.
fn without_stage(scene: &mut Scene, args: &Look, camera: Camera) -> Result<Setup, Failure> {
    let eye = camera.eye;
    let setup = Setup { cameras: all(camera, scene, args), exposure: None };
    let solved = is_solution(&args.input.model.scene);
    if scene.optics.emits() || !scene.lamps.is_empty() || scene.sky != DVec3::ZERO || solved {
        return Ok(setup);
    }
    if args.input.sky.is_some() {
        return Err(Failure::Input(format!(
            "{}: nothing emits light, and the sky is black; leave --sky out, and a light is \
             chosen, or hang a lamp with --lamp",
            scene.name
        )));
    }
    let up = scene.up.normalize_or(DVec3::Y);
    let around = Surroundings::of(&Occluders::new(&scene.geometry), eye, up, None);
    /// Below this share of emptiness around the eye a room is closed; cracks are narrower.
    const CLOSED: f64 = 1e-3;
    if solid_angle_fraction(around.glimpses(), |g| g.hit.is_none()) < CLOSED {
        return Err(closed(scene, args, eye));
    }
    scene.sky = DVec3::ONE;
    tell(args, "light: nothing emits; lit by a uniform sky of radiance 1 (--sky 1,1,1)");
    Ok(setup)
}
