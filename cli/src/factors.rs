//! `hemicube factors`: the matrix of form factors of a model.

mod accuracy;
mod group;
mod losses;
mod room;
mod say;

use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::time::Instant;

use hemicube::export::{
    ExportError, MATRIX_FORMATS, MatrixFormat, write_csv, write_matrix, write_surfaces, write_whole,
};
use hemicube::matrix::{Lumped, MatrixOptions, Origin, Rows, make_where};
use hemicube::progress::{Cancelled, Progress};
use hemicube::report::Stage;
use hemicube::scene::{Scene, SidesChoice};

use crate::args::{EngineArg, FaceSides, Factors};
use crate::failure::Failure;
use crate::input;
use crate::machine;
use crate::outputs;
use crate::remedy;
use crate::render::{engine_of, set_threads};
use crate::terminal::{Bar, hear_interrupts, print, say};

/// Runs the command.
pub fn run(args: &Factors) -> Result<(), Failure> {
    hear_interrupts();
    set_threads(args.run.threads)?;
    let format = format_of(args)?;
    let light = args.light();
    if light.engine() == EngineArg::Rays && args.error.is_some() {
        return Err(Failure::input(
            "--error is not used by factors with --engine rays; leave it out, or use --engine \
             exact",
        ));
    }
    if args.strict && light.engine() != EngineArg::Exact {
        return Err(Failure::input("--strict needs an error that is stated; use --engine exact"));
    }
    let engine = engine_of(&light)?;
    let sides = match args.sides {
        FaceSides::One => SidesChoice::One,
        FaceSides::Two => SidesChoice::Two,
    };
    let scene = input::read_model(&args.model, sides, 0.9)?;
    let files = [
        ("-o", args.output.as_ref()),
        ("--surfaces", args.surfaces.as_ref()),
        ("--report", args.run.report.as_ref()),
    ];
    outputs::check(&files, &scene.files)?;
    input::say_findings(&scene, args.run.quiet);
    let options = MatrixOptions {
        patch_size: args.patch_size,
        engine,
        enclosure: args.enclosure,
        threshold: args.threshold.unwrap_or_default(),
        memory: args.run.memory.unwrap_or_else(machine::available_memory),
    };
    let bar = Bar::new(args.run.quiet);
    let mut store = |forecast: &_| room::store(args, format, forecast);
    let mut matrix = make_where(&scene.geometry, &options, &mut store, &bar)
        .map_err(|e| remedy::matrix_failure(&args.model.scene, e, args.enclosure))?;
    matrix.report.scene.clone_from(&scene.name);
    let start = Instant::now();
    let mut origin = matrix.origin(&scene.geometry);
    matrix.report.fingerprint.clone_from(&origin.fingerprint);
    // Pieces of a face that a mask cuts are one row, unless faces are cut anyway.
    let by_face = args.patch_size.is_none() && !scene.geometry.face_of.is_empty();
    let lumped = match args.group.map(|group| scene.grouping(group.by().0)) {
        Some(grouping) => Some(Lumped::new(&matrix, &scene.geometry, &grouping)),
        None => by_face.then(|| Lumped::by_face(&matrix, &scene.geometry)),
    };
    let lumped = lumped.transpose().map_err(Failure::failed)?;
    matrix.report.grouped_by = args.group.map(|group| group.by().1).or(by_face.then_some("face"));
    matrix.report.groups = lumped.as_ref().map(Rows::len);
    origin.lumped = lumped.is_some();
    match &lumped {
        Some(lumped) => write(args, format, lumped, &scene, &origin, &bar)?,
        None => write(args, format, &matrix, &scene, &origin, &bar)?,
    }
    bar.finish();
    let seconds = start.elapsed().as_secs_f64();
    matrix.report.stages.push(Stage { name: "write", seconds });
    matrix.report.peak_memory_bytes = machine::peak_memory();
    if let Some(path) = &args.run.report {
        let json = serde_json::to_string_pretty(&matrix.report).map_err(Failure::failed)?;
        write_whole(path, json.as_bytes()).map_err(Failure::failed)?;
    }
    if !args.run.quiet {
        say::report(&matrix.report, args.run.verbose);
        if let Some(text) = args.group.and_then(|group| group::of_one_group(&scene, group)) {
            say(&format!("warning: {text}"));
        }
    }
    // With the matrix itself on stdout there is no place for names.
    if let Some(path) = &args.output {
        for path in [Some(path), args.surfaces.as_ref()].into_iter().flatten() {
            print(&path.display().to_string());
        }
    }
    accuracy::verdict(args, &matrix.report)
}

/// The format of the matrix (a table on stdout); refuses what cannot be written before any work is
/// done.
fn format_of(args: &Factors) -> Result<MatrixFormat, Failure> {
    let table = |path: &&PathBuf| MatrixFormat::of(path) == Some(MatrixFormat::Csv);
    if let Some(path) = args.surfaces.as_ref().filter(|p| !table(p)) {
        return Err(Failure::Input(format!("{}: --surfaces is written as .csv", path.display())));
    }
    let Some(path) = &args.output else { return Ok(MatrixFormat::Csv) };
    MatrixFormat::of(path).ok_or_else(|| {
        let path = path.display();
        Failure::Input(format!("{path}: form factors are written as {MATRIX_FORMATS}"))
    })
}

/// Writes the matrix, and what its rows stand for.
fn write(
    args: &Factors,
    format: MatrixFormat,
    rows: &dyn Rows,
    scene: &Scene,
    origin: &Origin,
    bar: &Bar,
) -> Result<(), Failure> {
    let surfaces = rows.surfaces(&scene.geometry);
    let passes = if format == MatrixFormat::Npz { 3 } else { 1 };
    bar.stage("write", passes * rows.len() as u64);
    let written = match &args.output {
        Some(path) => write_matrix(path, rows, &surfaces, origin, bar),
        None => {
            bar.finish();
            let mut out = std::io::BufWriter::new(std::io::stdout().lock());
            match write_csv(&mut out, rows, bar).and_then(|()| out.flush()) {
                Err(e) if e.kind() == ErrorKind::Interrupted => Err(Cancelled.into()),
                // Nothing happens if nobody listens.
                Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
                Err(source) => Err(ExportError::Io { path: "stdout".into(), source }),
                Ok(()) => Ok(()),
            }
        }
    };
    written.map_err(export_failure)?;
    if let Some(path) = &args.surfaces {
        write_surfaces(path, &surfaces).map_err(export_failure)?;
    }
    Ok(())
}

fn export_failure(error: ExportError) -> Failure {
    Failure::of(error, Failure::failed)
}
