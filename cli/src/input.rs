//! The scene of the command line: read, given a camera, and given light.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hemicube::scene::builtin::UnknownBuiltin;
use hemicube::scene::inspect::doubtful_unit;
use hemicube::scene::{
    Finding, ImportOptions, Lamp, Scene, Severity, SidesChoice, TriangleState, ies, load,
};
use hemicube::staging::Model as Surroundings;

use hemicube::store::{Emitter, emitters};

use crate::args::{Emission, Input, LampArg, MOST_RADIANCE, Model, SidesArg, SunArg};
use crate::dark::lamp_flag;
use crate::failure::Failure;
use crate::remedy;
use crate::solutions::{self, is_solution};
use crate::terminal::say;

/// Reads the model: an existing path, or else a built-in's name.
pub fn read_model(
    model: &Model,
    sides: SidesChoice,
    max_reflectance: f64,
) -> Result<Scene, Failure> {
    let path = &model.scene;
    let mut scene = if is_solution(path) {
        solutions::scene(model)?
    } else if path.exists() {
        let (unit, up) = (model.unit.metres(), model.up);
        load(path, &ImportOptions { unit, up, max_reflectance, sides })
            .map_err(|e| Failure::Input(format!("{e}{}", remedy::of_import(&e))))?
    } else {
        Scene::builtin(&path.to_string_lossy()).map_err(no_such_scene)?
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
    let solved = is_solution(&args.model.scene);
    if solved {
        solutions::refuse(args)?;
    }
    let mut scene = read_model(&args.model, sides, args.max_reflectance)?;
    if !solved {
        scene.optics.limit_reflectance(args.max_reflectance);
    }
    for (name, reflectance) in &args.reflectance {
        set_reflectance(&mut scene, name, *reflectance)?;
    }
    if let Some(sky) = args.sky {
        if sky.min_element() < 0.0 || sky.max_element() > MOST_RADIANCE {
            return Err(Failure::input("--sky: a radiance lies between 0 and 1e30"));
        }
        scene.sky = sky;
    }
    for lamp in &args.lamp {
        hang(&mut scene, lamp)?;
    }
    if let Some(sun) = args.sun {
        scene.lamps.push(sunlight(&scene, sun));
    }
    for (lamp, file) in &args.ies {
        set_photometry(&mut scene, lamp, file)?;
    }
    let sources = if solved && !args.emission.is_empty() {
        solutions::sources(&args.model.scene)?
    } else {
        Vec::new()
    };
    for (name, emission) in &args.emission {
        match sources.iter().find(|s| s.name == *name) {
            Some(source) => solutions::set_emission(&mut scene, source, *emission)?,
            None => set_emission(&mut scene, name, *emission)?,
        }
    }
    Ok(scene)
}

/// A flux that differs by more than this share from that of the photometric file is said.
const FLUX_DOUBT: f64 = 0.05;

/// Hangs a lamp; one with a photometric file sends out the flux asked for, or else the file's own,
/// spread as the file says.
fn hang(scene: &mut Scene, lamp: &LampArg) -> Result<(), Failure> {
    let (mut intensity, mut photometry) = (lamp.flux.unwrap_or(0.0) / (4.0 * PI), None);
    if let Some(file) = &lamp.file {
        let read = ies::read(file).map_err(Failure::input)?;
        if read.flux() <= 0.0 {
            return Err(Failure::Input(format!("{}: sends out no light", file.display())));
        }
        let own = read.flux();
        intensity = lamp.flux.unwrap_or(own) / own;
        if (intensity - 1.0).abs() > FLUX_DOUBT {
            scene.findings.push(Finding::new(
                Severity::Warning,
                format!("lamp {}", lamp.name),
                format!(
                    "sends out {:.0} lm, as was asked for; its file, {}, says {own:.0} lm",
                    own * intensity,
                    file.display()
                ),
                "leave the flux out to take that of the file",
            ));
        }
        photometry = Some(Arc::new(read));
    }
    scene.lamps.push(Lamp::Point {
        name: lamp.name.clone(),
        position: lamp.position,
        intensity: DVec3::splat(intensity),
        x_axis: DVec3::X,
        photometry,
    });
    Ok(())
}

/// The sun at an azimuth clockwise from north, seen from above.
pub fn sunlight(scene: &Scene, sun: SunArg) -> Lamp {
    let up = scene.up.normalize_or(DVec3::Y);
    let ahead = if up.y.abs() > 0.5 { DVec3::NEG_Z } else { DVec3::Y };
    let north = ahead.reject_from(up).normalize_or(up.any_orthonormal_vector());
    let east = north.cross(up);
    let (sin, cos) = sun.azimuth.to_radians().sin_cos();
    let (rise, level) = sun.elevation.to_radians().sin_cos();
    Lamp::Directional {
        name: "sun".into(),
        direction: -((north * cos + east * sin) * level + up * rise),
        irradiance: DVec3::splat(sun.irradiance),
    }
}

fn no_such_scene(UnknownBuiltin { name, known }: UnknownBuiltin) -> Failure {
    Failure::Input(format!(
        "{name}: no such file, nor a built-in scene; the built-in scenes are {known}"
    ))
}

fn set_emission(scene: &mut Scene, name: &str, emission: Emission) -> Result<(), Failure> {
    let all = emitters(scene);
    let found: Vec<Emitter> = all.iter().filter(|e| e.0 == name).map(|e| e.1).collect();
    if found.is_empty() {
        let lamps: Vec<&str> = scene.lamps.iter().map(Lamp::name).collect();
        let lamps = match lamps.is_empty() {
            true => String::new(),
            false => format!("; its lamps are {}", lamps.join(", ")),
        };
        return Err(Failure::Input(format!(
            "--emission {name}: no such material or lamp; the scene has the materials {}{lamps}",
            material_names(scene)
        )));
    }
    for emitter in found {
        match emission {
            Emission::Radiance(radiance) => emitter.set_emission(scene, radiance),
            Emission::Share(share) => emitter.scale(scene, share),
        }
    }
    Ok(())
}

fn set_reflectance(scene: &mut Scene, name: &str, reflectance: DVec3) -> Result<(), Failure> {
    let optics = &mut scene.optics;
    let found: Vec<usize> =
        (0..optics.materials.len()).filter(|&m| optics.materials[m].name == name).collect();
    if found.is_empty() {
        return Err(Failure::Input(format!(
            "--reflectance {name}: no such material; the scene has {}",
            material_names(scene)
        )));
    }
    let most = optics.max_reflectance;
    if reflectance.max_element() > most {
        return Err(Failure::Input(format!(
            "--reflectance {name}: is brighter than the {most} that is allowed; raise \
             --max-reflectance, with the model"
        )));
    }
    found.into_iter().for_each(|m| optics.set_reflectance(m, reflectance));
    Ok(())
}

/// Refuses a scene without light: figures from an assumed sky would mean nothing. `ahead` is a
/// point that light should come to.
pub fn ensure_lit(
    scene: &Scene,
    ahead: &dyn Fn(&Surroundings<'_>) -> DVec3,
) -> Result<(), Failure> {
    if scene.optics.emits() || !scene.lamps.is_empty() || scene.sky != DVec3::ZERO {
        return Ok(());
    }
    let model = Surroundings::of(scene).ok_or_else(|| nothing_to_see(scene))?;
    let lamp = model.pendant(ahead(&model));
    Err(Failure::Input(format!(
        "{}: nothing emits light; {}",
        scene.name,
        if lamp.closed {
            format!("hang a lamp, for example by {}", lamp_flag(&lamp, model.size()))
        } else {
            "give --sky 1,1,1, or hang a --lamp".to_owned()
        }
    )))
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

/// Why there is nothing to look at.
pub fn nothing_to_see(scene: &Scene) -> Failure {
    let states = scene.geometry.state.iter().zip(&scene.optics.material_of);
    let clear: BTreeSet<&str> = states
        .filter(|(state, _)| **state == TriangleState::Transparent)
        .map(|(_, &m)| scene.optics.materials[m as usize].name.as_str())
        .collect();
    let name = &scene.name;
    Failure::Input(if clear.is_empty() {
        format!("{name}: no triangle that blocks light, nothing to see")
    } else {
        format!(
            "{name}: no triangle that blocks light, nothing to see; these materials let it \
             through, give them d 1 (MTL) or an alpha of at least .5: {}",
            clear.into_iter().collect::<Vec<_>>().join(", ")
        )
    })
}

/// Says warnings that import left, and a doubt about the unit; `info` says all.
pub fn say_findings(scene: &Scene, quiet: bool) {
    if quiet {
        return;
    }
    let unit = doubtful_unit(&scene.geometry);
    say_warnings(&scene.findings.iter().chain(&unit).collect::<Vec<_>>());
}

/// Says those findings that are warnings, as many as are read.
pub fn say_warnings(findings: &[&Finding]) {
    const SHOWN: usize = 8;
    let warnings = grouped(findings, Severity::Warning);
    for text in warnings.iter().take(SHOWN) {
        say(&format!("warning: {text}"));
    }
    if warnings.len() > SHOWN {
        say(&format!("warning: and {} more; see hemicube info", warnings.len() - SHOWN));
    }
}

/// The findings of a severity as lines of text; equal ones at several places are one line.
pub fn grouped(findings: &[&Finding], severity: Severity) -> Vec<String> {
    let mut groups: Vec<(&Finding, usize)> = Vec::new();
    for &f in findings.iter().filter(|f| f.severity == severity) {
        let same = |g: &&mut (&Finding, usize)| g.0.message == f.message && g.0.remedy == f.remedy;
        match groups.iter_mut().find(same) {
            Some(group) => group.1 += 1,
            None => groups.push((f, 1)),
        }
    }
    let line = |(f, count): &(&Finding, usize)| {
        let others = match count - 1 {
            0 => String::new(),
            1 => " and 1 more".to_owned(),
            n => format!(" and {n} more"),
        };
        format!("{}{others}: {}{}", f.place, f.message, remedy::of_finding(f))
    };
    groups.iter().map(line).collect()
}
