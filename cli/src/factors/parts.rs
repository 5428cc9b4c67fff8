//! Matrices in parts: `--plan`, `--part`, and what `hemicube merge` reads.

use std::path::{Path, PathBuf};
use std::time::Instant;

use hemicube::engines::PairsTally;
use hemicube::export::{
    Damage, Parts, PartsError, has_part, part_path, read_plan, write_part, write_plan, write_whole,
};
use hemicube::matrix::{MatrixOptions, Plan};
use hemicube::progress::Progress;
use hemicube::units::Bytes;
use serde::Serialize;

use super::{export_failure, read_model};
use crate::args::{EngineArg, Factors};
use crate::failure::Failure;
use crate::machine;
use crate::outputs;
use crate::remedy;
use crate::render::engine_of;
use crate::terminal::{Bar, print, say};

/// `--report` of a part.
#[derive(Serialize)]
struct PartReport {
    scene: String,
    part: u32,
    of: u32,
    /// Pairs of tiles.
    tiles: usize,
    pairs: PairsTally,
    seconds: f64,
    peak_memory_bytes: Option<u64>,
    file_bytes: u64,
}

/// Plans a matrix.
pub fn plan(args: &Factors, path: &PathBuf) -> Result<(), Failure> {
    if args.outcome.output.is_some() {
        return Err(Failure::input(
            "-o goes with --part K/N, as the folder of the parts; --plan alone writes the plan",
        ));
    }
    if args.light().engine() != EngineArg::Exact {
        return Err(Failure::input("--plan is for --engine exact"));
    }
    let scene = read_model(args)?;
    let files = [("--plan", Some(path)), ("--report", args.run.report.as_ref())];
    outputs::check(&files, &scene.files)?;
    let options = MatrixOptions {
        patch_size: args.patch_size,
        engine: engine_of(&args.light())?,
        ..MatrixOptions::default()
    };
    let bar = Bar::new(args.run.quiet);
    let mut plan = Plan::new(&scene.geometry, &options, &bar).map_err(|e| failure(args, e))?;
    plan.scene.clone_from(&scene.name);
    bar.finish();
    write_plan(path, &plan).map_err(export_failure)?;
    report(args, &plan)?;
    if !args.run.quiet {
        let (tiles, pairs) = (plan.tiling.tiles, plan.tiling.pairs());
        say(&format!(
            "{}: {} patches in {tiles} tiles: {pairs} pairs of tiles, of which parts are made",
            plan.scene, plan.patches
        ));
    }
    print(&path.display().to_string());
    Ok(())
}

/// Makes a part of a planned matrix; one that is there already is left as it is.
pub fn part(
    args: &Factors,
    plan_file: &PathBuf,
    part: (u32, u32),
    folder: &Path,
) -> Result<(), Failure> {
    let plan = read(plan_file)?;
    let scene = read_model(args)?;
    plan.check_geometry(&scene.geometry).map_err(|e| failure(args, e))?;
    let (number, of) = part;
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::Input(format!("{}: {e}", folder.display())))?;
    let path = part_path(folder, part);
    let files = [("-o", Some(&path)), ("--report", args.run.report.as_ref())];
    outputs::check(&files, scene.files.iter().chain([plan_file]))?;
    if has_part(folder, &plan, part) {
        if !args.run.quiet {
            let unsaid =
                if args.run.report.is_some() { "; --report is of parts that are made" } else { "" };
            say(&format!("part {number} of {of}: is there already, complete{unsaid}"));
        }
        print(&path.display().to_string());
        return Ok(());
    }
    let bar = Bar::new(args.run.quiet);
    let start = Instant::now();
    let memory = args.run.memory.unwrap_or_else(machine::available_memory);
    let made = plan.part(&scene.geometry, part, memory, &bar).map_err(|e| failure(args, e))?;
    bar.stage("write", 0);
    write_part(folder, &plan, &made, &bar).map_err(export_failure)?;
    bar.finish();
    let file_bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
    let seconds = start.elapsed().as_secs_f64();
    let peak_memory_bytes = machine::peak_memory();
    let (tiles, pairs) = (made.tiles.len(), made.tally);
    let scene = scene.name;
    let of_part = PartReport {
        scene,
        part: number,
        of,
        tiles,
        pairs,
        seconds,
        peak_memory_bytes,
        file_bytes,
    };
    report(args, &of_part)?;
    if !args.run.quiet {
        say(&format!(
            "part {number} of {of}: {tiles} pairs of tiles, {} pairs of patches that exchange \
             anything, {} shadow rays, {seconds:.1} s, {}",
            pairs.pairs,
            pairs.rays,
            Bytes(file_bytes)
        ));
    }
    print(&path.display().to_string());
    Ok(())
}

/// The plan and the parts that are read.
pub fn files(args: &Factors) -> Vec<PathBuf> {
    let of_folder = |folder: &PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let parts = args.parts.iter().flat_map(of_folder).map(|entry| entry.path());
    args.plan.iter().cloned().chain(parts).collect()
}

/// The parts that `hemicube merge` joins, all of them checked, and their plan; nothing otherwise.
pub fn open(args: &Factors, bar: &Bar) -> Result<Option<(Plan, Parts)>, Failure> {
    let (Some(plan), Some(folder)) = (&args.plan, &args.parts) else { return Ok(None) };
    let plan = read(plan)?;
    let parts = Parts::open(folder, &plan, bar);
    let parts = parts.map_err(|e| Failure::of(e, parts_failure))?;
    Ok(Some((plan, parts)))
}

fn read(path: &Path) -> Result<Plan, Failure> {
    read_plan(path).map_err(|e| {
        Failure::Input(format!("{e}; make it again with hemicube factors MODEL --plan FILE.json"))
    })
}

fn parts_failure(error: PartsError) -> Failure {
    match &error {
        PartsError::Incomplete { of, damages, .. } => {
            let numbers = numbers(damages);
            Failure::Failed(format!(
                "{error}; make part {numbers} of {of} again with hemicube factors --part, and \
                 merge again (as an array of jobs: {numbers})"
            ))
        }
        PartsError::Mixed { .. } => {
            Failure::Input(format!("{error}; take those away that belong to another division"))
        }
        _ => Failure::input(error),
    }
}

/// Numbers as job schedulers take them: runs as `3-5`.
fn numbers(damages: &[Damage]) -> String {
    let mut runs: Vec<[u32; 2]> = Vec::new();
    for Damage { part, .. } in damages {
        match runs.last_mut() {
            Some(last) if last[1] + 1 == *part => last[1] = *part,
            _ => runs.push([*part; 2]),
        }
    }
    let text = |&[a, b]: &[u32; 2]| if a == b { a.to_string() } else { format!("{a}-{b}") };
    runs.iter().map(text).collect::<Vec<_>>().join(",")
}

fn report(args: &Factors, what: &impl Serialize) -> Result<(), Failure> {
    let Some(path) = &args.run.report else { return Ok(()) };
    let json = serde_json::to_string_pretty(what).map_err(Failure::failed)?;
    write_whole(path, json.as_bytes()).map_err(Failure::failed)
}

fn failure(args: &Factors, error: hemicube::matrix::MatrixError) -> Failure {
    remedy::matrix_failure(&args.model.scene, error, remedy::of_part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_parts_are_written_as_schedulers_take_them() {
        let of = |parts: &[u32]| -> Vec<Damage> {
            parts.iter().map(|&part| Damage { part, problem: String::new() }).collect()
        };
        assert_eq!(numbers(&of(&[3])), "3");
        assert_eq!(numbers(&of(&[1, 2, 3, 7, 9, 10])), "1-3,7,9-10");
    }
}
