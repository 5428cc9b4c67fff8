//! The scene of the command line: read, given a camera, and given light.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;
use hemicube::render::viewpoint;
use hemicube::scene::builtin::UnknownBuiltin;
use hemicube::scene::{Camera, ImportOptions, Lamp, Scene, Severity, SidesChoice, ies, load};
use hemicube::visibility::{Occluders, Surroundings, solid_angle_fraction};

use crate::args::{Emission, Input, MOST_RADIANCE, Model, Render, SidesArg};
use crate::failure::Failure;
use crate::remedy;
use crate::terminal::say;

/// Reads the model: an existing path, or else a built-in's name.
pub fn read_model(
    model: &Model,
    sides: SidesChoice,
    max_reflectance: f64,
) -> Result<Scene, Failure> {
    let path = Path::new(&model.scene);
    let mut scene = if path.exists() {
        let (unit, up) = (model.unit.metres(), model.up);
        load(path, &ImportOptions { unit, up, max_reflectance, sides })
            .map_err(|e| Failure::Input(format!("{e}{}", remedy::of_import(&e))))?
    } else {
        Scene::builtin(&model.scene).map_err(no_such_scene)?
    };
    scene.choose_sides(sides);
    if model.flip {
        scene.flip();
    }
    if let Some(up) = model.up {
        scene.up =
            up.try_normalize().ok_or_else(|| Failure::input("--up 0,0,0 has no direction"))?;
    }
    Ok(scene)
}

/// Reads the scene and lights it as the command line says.
pub fn read(args: &Input) -> Result<Scene, Failure> {
    let sides = match args.sides {
        SidesArg::File => SidesChoice::File,
        SidesArg::One => SidesChoice::One,
        SidesArg::Two => SidesChoice::Two,
    };
    let mut scene = read_model(&args.model, sides, args.max_reflectance)?;
    scene.optics.limit_reflectance(args.max_reflectance);
    if let Some(sky) = args.sky {
        if sky.min_element() < 0.0 || sky.max_element() > MOST_RADIANCE {
            return Err(Failure::input("--sky: a radiance lies between 0 and 1e30"));
        }
        scene.sky = sky;
    }
    for (name, emission) in &args.emission {
        set_emission(&mut scene, name, *emission)?;
    }
    for (lamp, file) in &args.ies {
        set_photometry(&mut scene, lamp, file)?;
    }
    Ok(scene)
}

fn no_such_scene(UnknownBuiltin { name, known }: UnknownBuiltin) -> Failure {
    Failure::Input(format!(
        "{name}: no such file, nor a built-in scene; the built-in scenes are {known}"
    ))
}

fn set_emission(scene: &mut Scene, name: &str, emission: Emission) -> Result<(), Failure> {
    let optics = &mut scene.optics;
    let found: Vec<usize> =
        (0..optics.materials.len()).filter(|&m| optics.materials[m].name == name).collect();
    if found.is_empty() {
        return Err(Failure::Input(format!(
            "--emission {name}: no such material; the scene has {}",
            material_names(scene)
        )));
    }
    for m in found {
        match emission {
            Emission::Radiance(radiance) => optics.set_radiance(m, radiance),
            Emission::Share(share) => optics.scale_radiance(m, share),
        }
    }
    Ok(())
}

fn set_photometry(scene: &mut Scene, lamp: &str, file: &Path) -> Result<(), Failure> {
    let photometry = ies::read(file).map_err(Failure::input)?;
    if scene.set_photometry(lamp, photometry) {
        return Ok(());
    }
    let local = |l: &&Lamp| !matches!(l, Lamp::Directional { .. });
    let names: Vec<&str> = scene.lamps.iter().filter(local).map(Lamp::name).collect();
    Err(Failure::Input(if names.is_empty() {
        format!(
            "--ies {lamp}: no such lamp; the scene has no point or spot lamps: add them in glTF"
        )
    } else {
        format!("--ies {lamp}: no such point or spot lamp; the scene has {}", names.join(", "))
    }))
}

/// The names of all materials in use.
pub fn material_names(scene: &Scene) -> String {
    let used: BTreeSet<&str> = scene
        .optics
        .material_of
        .iter()
        .map(|&m| scene.optics.materials[m as usize].name.as_str())
        .collect();
    used.into_iter().collect::<Vec<_>>().join(", ")
}

/// The camera asked for, the scene's first, or one that is chosen and said.
pub fn camera(scene: &Scene, args: &Render) -> Result<Camera, Failure> {
    let mut camera = if let (Some(eye), Some(target)) = (args.eye, args.target) {
        Camera {
            name: String::from("command line"),
            eye,
            forward: (target - eye).normalize_or_zero(),
            up: scene.up,
            vfov: 40_f64.to_radians(),
            aspect: None,
        }
    } else if let Some(name) = &args.camera {
        scene.cameras.iter().find(|c| c.name == *name).cloned().ok_or_else(|| {
            let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
            Failure::Input(if names.is_empty() {
                format!("no camera '{name}': the scene has none; give --eye and --target")
            } else {
                format!("no camera '{name}'; the scene has {}", names.join(", "))
            })
        })?
    } else if let Some(first) = scene.cameras.first() {
        first.clone()
    } else {
        chosen(scene, args.light.quiet)?
    };
    if args.input.model.up.is_some() {
        camera.up = scene.up;
    }
    if let Some(vfov) = args.vfov {
        camera.vfov = vfov.to_radians();
    }
    Ok(camera)
}

fn chosen(scene: &Scene, quiet: bool) -> Result<Camera, Failure> {
    let view = viewpoint(scene).ok_or_else(|| {
        Failure::Input(format!("{}: no triangle that blocks light, nothing to see", scene.name))
    })?;
    if !quiet {
        say(&format!(
            "camera: --eye {} --target {} --vfov {:.0} (the model has none; this one is {})",
            short(view.camera.eye),
            short(view.target),
            view.camera.vfov.to_degrees(),
            if view.inside { "inside" } else { "outside" },
        ));
    }
    Ok(view.camera)
}

fn short(v: DVec3) -> String {
    let digits = v.to_array().map(|x| {
        let text = format!("{x:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    });
    digits.join(",")
}

/// Says warnings that import left; `info` says all.
pub fn say_findings(scene: &Scene, quiet: bool) {
    if quiet {
        return;
    }
    const SHOWN: usize = 8;
    let warnings: Vec<_> =
        scene.findings.iter().filter(|f| f.severity == Severity::Warning).collect();
    for f in warnings.iter().take(SHOWN) {
        say(&format!("warning: {}: {}{}", f.place, f.message, remedy::of_finding(f)));
    }
    if warnings.len() > SHOWN {
        say(&format!("warning: and {} more; see hemicube info", warnings.len() - SHOWN));
    }
}

/// Lights a scene that has no light: an open one by a uniform sky. A closed one would stay dark.
pub fn ensure_light(scene: &mut Scene, camera: &Camera, quiet: bool) -> Result<(), Failure> {
    let lit = scene.optics.emits() || !scene.lamps.is_empty() || scene.sky != DVec3::ZERO;
    if lit {
        return Ok(());
    }
    let up = scene.up.normalize_or(DVec3::Y);
    let around = Surroundings::of(&Occluders::new(&scene.geometry), camera.eye, up, None);
    /// Below this share of emptiness around the eye a room is closed; cracks are narrower.
    const CLOSED: f64 = 1e-3;
    if solid_angle_fraction(around.glimpses(), |g| g.hit.is_none()) < CLOSED {
        return Err(Failure::Input(format!(
            "{}: nothing emits light and the room is closed: it would be dark. Let a material \
             emit, for example --emission \"{}=10,10,10\"; the materials are {}",
            scene.name,
            scene.optics.materials.first().map_or("NAME", |m| &m.name),
            material_names(scene)
        )));
    }
    scene.sky = DVec3::ONE;
    if !quiet {
        say("light: nothing emits; lit by a uniform sky of radiance 1 (--sky 1,1,1)");
    }
    Ok(())
}
