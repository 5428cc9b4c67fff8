//! Files of solutions (`.hemi`) as scenes: read, given other lamps and colours, and lit.

use std::path::Path;

use glam::DVec3;
use hemicube::export::{ReadError, read_factors, read_scene, read_sources, read_store};
use hemicube::form_factors::FormFactors;
use hemicube::progress::Progress;
use hemicube::scene::Scene;
use hemicube::solution::Solution;
use hemicube::store::{self, Group, MixError, Source, Store};

use crate::args::{Emission, Input, Light, Model, SidesArg, Unit};
use crate::failure::Failure;
use crate::input::ensure_lit;
use crate::remedy;
use crate::render::{light_failure, memory, of_factors, options_of, say_patches};
use crate::terminal::{Bar, print, say};

/// Whether a scene is a file of solutions, by its extension.
pub fn is_solution(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hemi"))
}

/// What is wrong with a file of solutions, and what to do about it.
pub fn failure(error: ReadError) -> Failure {
    Failure::of(error, |e| Failure::Input(format!("{e}{}", remedy::of_solutions(&e))))
}

/// The scene of a file of solutions.
pub fn scene(model: &Model) -> Result<Scene, Failure> {
    let unused =
        [("--unit", model.unit != Unit::M), ("--up", model.up.is_some()), ("--flip", model.flip)];
    refuse_first(&unused)?;
    read_scene(&model.scene).map_err(failure)
}

/// Refuses what a solved scene can no longer be given.
pub fn refuse(input: &Input) -> Result<(), Failure> {
    refuse_first(&[
        ("--sides", input.sides != SidesArg::File),
        ("--max-reflectance", input.max_reflectance != hemicube::scene::MAX_REFLECTANCE),
        ("--lamp", !input.lamp.is_empty()),
        ("--sun", input.sun.is_some()),
        ("--ies", !input.ies.is_empty()),
    ])
}

fn refuse_first(flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|f| f.1) {
        Some((flag, _)) => Err(Failure::Input(format!(
            "{flag} is not used with a solution; give it to hemicube solve, with the model"
        ))),
        None => Ok(()),
    }
}

/// The sources that a file has solutions of.
pub fn sources(path: &Path) -> Result<Vec<Source>, Failure> {
    read_sources(path).map_err(failure)
}

/// Lets a source emit otherwise: all that is in it together.
pub fn set_emission(scene: &mut Scene, source: &Source, emission: Emission) -> Result<(), Failure> {
    for member in &source.members {
        match emission {
            Emission::Share(share) => member.emitter.scale(scene, share),
            Emission::Radiance(_) if source.keeps_its_colour() => {
                let name = &source.name;
                return Err(Failure::Input(format!(
                    "--emission {name}: was solved in its own colours; give a share, like \
                     '{name}=50%'"
                )));
            }
            Emission::Radiance(brightest) => {
                member.emitter.set_emission(scene, brightest * member.emission);
            }
        }
    }
    Ok(())
}

/// Light of a solved scene: of its sources as they are now, and solved again if surfaces reflect
/// otherwise.
pub fn relit(scene: &Scene, path: &Path, args: &Light, bar: &Bar) -> Result<Solution, Failure> {
    let factors = args.factors.as_ref().map(|_| "--factors");
    if let Some(flag) = of_factors(args).or(factors) {
        return Err(Failure::Input(format!(
            "{flag} is not used with a solution; give it to hemicube solve, with the model"
        )));
    }
    let memory = memory(args);
    let store = read_store(path, scene, memory, bar).map_err(failure)?;
    let again = !store.reflects_as(scene);
    let solution = if again {
        let factors = read_factors(path, memory).map_err(failure)?;
        let options = options_of(args)?;
        let solved = store.solve_mixed(scene, &factors, &options, bar);
        solved.map_err(|e| light_failure(e, args))?
    } else {
        store.mix(scene)
    };
    let solution = solution.map_err(|e| mix_failure(path, &e))?;
    bar.finish();
    if !args.run.quiet {
        say_patches(scene, &solution.report, args);
        let count = store.sources.len();
        let solved = if again { ", solved again" } else { "" };
        say(&format!(
            "light: of {count} {}{solved}",
            if count == 1 { "source" } else { "sources" }
        ));
    }
    Ok(solution)
}

/// Solutions of a scene and the form factors that they are made by: solved, or read from a file.
pub fn store(
    scene: &Scene,
    input: &Input,
    light: &Light,
    groups: &[Group],
    progress: &dyn Progress,
) -> Result<(Store, FormFactors), Failure> {
    let options = options_of(light)?;
    let path = &input.model.scene;
    if !is_solution(path) {
        let found = store::sources(scene, groups)
            .map_err(|e| Failure::Input(format!("--group: {e}{}", remedy::of_group(&e, scene))))?;
        if found.is_empty() {
            ensure_lit(scene, &|_| DVec3::ZERO)?;
        }
        return scene.solve(found, &options, progress).map_err(|e| light_failure(e, light));
    }
    let grouped = (!groups.is_empty()).then_some("--group");
    let error = light.error.map(|_| "--error");
    if let Some(flag) = of_factors(light).or(grouped).or(error) {
        return Err(Failure::Input(format!(
            "{flag} is not used with a solution; give it with the model"
        )));
    }
    let memory = memory(light);
    let store = read_store(path, scene, memory, progress).map_err(failure)?;
    let factors = read_factors(path, memory).map_err(failure)?;
    let store = match store.reflects_as(scene) {
        true => Ok(store),
        false => store.solve_again(scene, &factors, &options, progress),
    };
    Ok((store.map_err(|e| light_failure(e, light))?, factors))
}

/// Why solutions are not the light of a scene, and what to do about it.
pub fn mix_failure(path: &Path, error: &MixError) -> Failure {
    Failure::Input(format!("{}: {error}{}", path.display(), remedy::of_mix(error)))
}

/// Prints the sources of a file of solutions, as `scene` has them now; of other files nothing.
pub fn describe(path: &Path, scene: &Scene) -> Result<(), Failure> {
    if is_solution(path) {
        for source in sources(path)? {
            print(&format!("  source:    {}", line(&source, scene)));
        }
    }
    Ok(())
}

/// A source and how it is lit.
pub fn line(source: &Source, scene: &Scene) -> String {
    let count = match source.members.len() {
        1 => String::new(),
        n => format!(" ({n} together)"),
    };
    let now = source.weight(scene).unwrap_or_default();
    let unit = if source.keeps_its_colour() { " times its own" } else { "" };
    format!("{}{count}: {:.4},{:.4},{:.4}{unit}", source.name, now.x, now.y, now.z)
}
