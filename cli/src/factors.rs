//! `hemicube factors`: the matrix of form factors of a model.

pub mod accuracy;
mod dense;
mod drawn;
mod group;
mod idf;
mod losses;
mod parts;
mod room;
pub mod say;

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::Instant;

use hemicube::export::{
    ExportError, MATRIX_FORMATS, MatrixFormat, write_csv, write_idf, write_matrix, write_row_cells,
    write_surfaces, write_whole,
};
use hemicube::matrix::{
    Forecast, Lumped, Matrix, MatrixOptions, Origin, Rows, SurfaceRow, make_where, merge_where,
};
use hemicube::progress::{Cancelled, Progress};
use hemicube::report::Stage;
use hemicube::scene::Scene;

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
    match (&args.plan, args.part, &args.outcome.output) {
        (Some(plan), Some(part), Some(folder)) => parts::part(args, plan, part, folder),
        (Some(plan), None, _) if args.parts.is_none() => parts::plan(args, plan),
        _ => matrix(args),
    }
}

/// Reads the model.
fn read_model(args: &Factors) -> Result<Scene, Failure> {
    let scene = input::read_model(&args.model, args.sides.choice(), 0.9)?;
    input::say_findings(&scene, args.run.quiet);
    Ok(scene)
}

/// Makes the matrix, or joins its parts.
fn matrix(args: &Factors) -> Result<(), Failure> {
    let format = format_of(args)?;
    let light = args.light();
    if light.engine() == EngineArg::Rays && args.error.is_some() {
        return Err(Failure::input(
            "--error is not used by factors with --engine rays; leave it out, or use --engine \
             exact",
        ));
    }
    if args.outcome.strict && light.engine() != EngineArg::Exact {
        return Err(Failure::input("--strict needs an error that is stated; use --engine exact"));
    }
    let engine = engine_of(&light)?;
    let scene = read_model(args)?;
    let mut files = vec![("-o", args.outcome.output.as_ref())];
    files.extend(args.outcome.surfaces.iter().map(|path| ("--surfaces", Some(path))));
    files.push(("--report", args.run.report.as_ref()));
    let parts = parts::files(args);
    outputs::check(&files, scene.files.iter().chain(&parts))?;
    let zone = idf::zone_of(args, format, &scene)?;
    drawn::check_names(args, &scene)?;
    let bar = Bar::new(args.run.quiet);
    let joined = parts::open(args, &bar)?;
    let patch_size = joined.as_ref().map_or(args.patch_size, |(plan, _)| plan.patch_size);
    let options = MatrixOptions {
        patch_size,
        engine,
        enclosure: args.outcome.enclosure,
        threshold: args.outcome.threshold.unwrap_or_default(),
        memory: args.run.memory.unwrap_or_else(machine::available_memory),
    };
    // Pieces of a face that a mask cuts are one row, unless faces are cut anyway.
    let by_face = patch_size.is_none() && !scene.geometry.face_of.is_empty();
    let grouping = args.outcome.group.map(|group| scene.grouping(group.by().0));
    let mut store = |forecast: &Forecast| {
        let lumped = grouping.as_ref().map(|g| g.names.len());
        let lumped = lumped.or(by_face.then(|| scene.geometry.faces()));
        let sides = if args.sides == FaceSides::Two { 2 } else { 1 };
        let rows = lumped.map_or(forecast.rows, |rows| sides * rows);
        drawn::check_numbers(args, &scene, rows)?;
        room::store(args, format, forecast)
    };
    let made = match &joined {
        Some((plan, parts)) => {
            merge_where(&scene.geometry, (plan, parts), &options, &mut store, &bar)
        }
        None => make_where(&scene.geometry, &options, &mut store, &bar),
    };
    let mut matrix = made.map_err(|e| {
        let remedy = |e: &_| remedy::of_matrix(e, args.outcome.enclosure);
        remedy::matrix_failure(&args.model.scene, e, remedy)
    })?;
    matrix.report.scene.clone_from(&scene.name);
    let start = Instant::now();
    let mut origin = matrix.origin(&scene.geometry);
    matrix.report.fingerprint.clone_from(&origin.fingerprint);
    let lumped = match &grouping {
        Some(grouping) => Some(Lumped::new(&matrix, &scene.geometry, grouping)),
        None => by_face.then(|| Lumped::by_face(&matrix, &scene.geometry)),
    };
    let lumped = lumped.transpose().map_err(Failure::failed)?;
    matrix.report.grouped_by =
        args.outcome.group.map(|group| group.by().1).or(by_face.then_some("face"));
    matrix.report.groups = lumped.as_ref().map(Rows::len);
    origin.lumped = lumped.is_some();
    let rows: &dyn Rows = lumped.as_ref().map_or(&matrix, |lumped| lumped);
    let surfaces = rows.surfaces(&scene.geometry);
    write(args, (format, &zone), rows, &surfaces, &origin, &bar)?;
    write_tables(args, &scene, &matrix, lumped.as_ref(), &surfaces)?;
    bar.finish();
    if format == MatrixFormat::Idf {
        idf::warn_if_open(args, rows, &surfaces);
    }
    let seconds = start.elapsed().as_secs_f64();
    let npz = args.outcome.output.as_ref().filter(|_| format == MatrixFormat::Npz);
    let npz = npz.and_then(|path| Some((path, dense::compare(path, rows)?)));
    matrix.report.npz = npz.map(|npz| npz.1);
    matrix.report.stages.push(Stage { name: "write", seconds });
    matrix.report.peak_memory_bytes = machine::peak_memory();
    if let Some(path) = &args.run.report {
        let json = serde_json::to_string_pretty(&matrix.report).map_err(Failure::failed)?;
        write_whole(path, json.as_bytes()).map_err(Failure::failed)?;
    }
    if !args.run.quiet {
        say::report(&matrix.report, args.run.verbose);
        if let Some(text) = args.outcome.group.and_then(|group| group::of_one_group(&scene, group))
        {
            say(&format!("warning: {text}"));
        }
        if let Some(text) = npz.and_then(|(path, npz)| dense::note(path, &npz)) {
            say(&format!("note: {text}"));
        }
    }
    // With the matrix itself on stdout there is no place for names.
    if let Some(path) = &args.outcome.output {
        for path in [path].into_iter().chain(&args.outcome.surfaces) {
            print(&path.display().to_string());
        }
    }
    accuracy::verdict(args, &matrix.report)
}

/// Whether a path of `--surfaces` has this extension, in either case.
fn is(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// The format of the matrix (a table on stdout); refuses what cannot be written before any work is
/// done.
fn format_of(args: &Factors) -> Result<MatrixFormat, Failure> {
    if let Some(path) = args.outcome.surfaces.iter().find(|p| !is(p, "csv") && !is(p, "vtu")) {
        let path = path.display();
        return Err(Failure::Input(format!("{path}: --surfaces is written as .csv or .vtu")));
    }
    if !args.outcome.row.is_empty() && !args.outcome.surfaces.iter().any(|path| is(path, "vtu")) {
        return Err(Failure::input("--row is used with --surfaces FILE.vtu only"));
    }
    let Some(path) = &args.outcome.output else { return Ok(MatrixFormat::Csv) };
    MatrixFormat::of(path).ok_or_else(|| {
        let path = path.display();
        Failure::Input(format!("{path}: form factors are written as {MATRIX_FORMATS}"))
    })
}

/// Writes the matrix; as an .idf, that of the zone.
fn write(
    args: &Factors,
    (format, zone): (MatrixFormat, &str),
    rows: &dyn Rows,
    surfaces: &[SurfaceRow],
    origin: &Origin,
    bar: &Bar,
) -> Result<(), Failure> {
    let passes = if format == MatrixFormat::Npz { 3 } else { 1 };
    bar.stage("write", passes * rows.len() as u64);
    let written = match &args.outcome.output {
        Some(path) if format == MatrixFormat::Idf => write_idf(path, rows, zone, origin, bar),
        Some(path) => write_matrix(path, rows, surfaces, origin, bar),
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
    written.map_err(export_failure)
}

/// Writes what rows stand for: tables, and triangles with numbers on them.
fn write_tables(
    args: &Factors,
    scene: &Scene,
    matrix: &Matrix,
    lumped: Option<&Lumped>,
    surfaces: &[SurfaceRow],
) -> Result<(), Failure> {
    let rows: &dyn Rows = lumped.map_or(matrix, |lumped| lumped);
    let drawn = drawn::drawn(args, rows, surfaces)?;
    for path in &args.outcome.surfaces {
        let written = match is(path, "vtu") {
            true => write_row_cells(path, scene, matrix, lumped, surfaces, &drawn),
            false => write_surfaces(path, surfaces),
        };
        written.map_err(export_failure)?;
    }
    Ok(())
}

fn export_failure(error: ExportError) -> Failure {
    Failure::of(error, Failure::failed)
}
