//! `hemicube factors`: the matrix of form factors of a model.

mod group;
mod room;

use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::time::Instant;

use hemicube::engines::EngineError;
use hemicube::export::{
    ExportError, MATRIX_FORMATS, MatrixFormat, write_csv, write_matrix, write_surfaces, write_whole,
};
use hemicube::form_factors::SinkError;
use hemicube::matrix::{
    Lumped, Matrix, MatrixError, MatrixOptions, MatrixReport, NamedRow, Origin, Rows, make_where,
};
use hemicube::progress::{Cancelled, Progress};
use hemicube::report::Stage;
use hemicube::scene::{Scene, SidesChoice};

use crate::args::{EngineArg, FaceSides, Factors};
use crate::failure::Failure;
use crate::input;
use crate::machine;
use crate::remedy;
use crate::render::{engine_of, ensure_folder, set_threads};
use crate::terminal::{Bar, catch_interrupts, print, say};

/// Runs the command.
pub fn run(args: &Factors) -> Result<(), Failure> {
    catch_interrupts();
    set_threads(args.threads)?;
    let format = format_of(args)?;
    let light = args.light();
    if light.engine() == EngineArg::Rays && args.error.is_some() {
        return Err(Failure::input(
            "--error is not used by factors with --engine rays; leave it out, or use --engine \
             exact",
        ));
    }
    let engine = engine_of(&light)?;
    let sides = match args.sides {
        FaceSides::One => SidesChoice::One,
        FaceSides::Two => SidesChoice::Two,
    };
    let scene = input::read_model(&args.model, sides, 0.9)?;
    input::say_findings(&scene, args.quiet);
    let options = MatrixOptions {
        patch_size: args.patch_size,
        engine,
        enclosure: args.enclosure,
        threshold: args.threshold.unwrap_or_default(),
        memory: args.memory.unwrap_or_else(machine::available_memory),
    };
    let bar = Bar::new(args.quiet);
    let mut store = |forecast: &_| room::store(args, format, forecast);
    let mut matrix =
        make_where(&scene.geometry, &options, &mut store, &bar).map_err(|e| failure_of(args, e))?;
    matrix.report.scene.clone_from(&scene.name);
    let start = Instant::now();
    let mut origin = matrix.origin(&scene.geometry);
    matrix.report.fingerprint.clone_from(&origin.fingerprint);
    let grouping = args.group.map(|group| scene.grouping(group.by().0));
    let lumped = grouping.map(|g| Lumped::new(&matrix, &scene.geometry, &g)).transpose();
    let lumped = lumped.map_err(Failure::failed)?;
    matrix.report.grouped_by = args.group.map(|group| group.by().1);
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
    if let Some(path) = &args.report {
        let json = serde_json::to_string_pretty(&matrix.report).map_err(Failure::failed)?;
        write_whole(path, json.as_bytes()).map_err(Failure::failed)?;
    }
    if !args.quiet {
        say_report(&matrix, args.verbose);
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
    Ok(())
}

/// The format of the matrix (a table on stdout); refuses what cannot be written before any work is
/// done.
fn format_of(args: &Factors) -> Result<MatrixFormat, Failure> {
    for path in [&args.output, &args.surfaces, &args.report].into_iter().flatten() {
        ensure_folder(path)?;
    }
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

fn failure_of(args: &Factors, error: MatrixError) -> Failure {
    let scene = &args.model.scene;
    Failure::of(error, |error| {
        let text = format!("{error}{}", remedy::of_matrix(&error, args.enclosure));
        match error {
            MatrixError::Engine(EngineError::Device(_)) => Failure::Failed(text),
            MatrixError::Sink(SinkError::Store(_)) => Failure::Failed(text),
            MatrixError::Engine(_) | MatrixError::NoAccount | MatrixError::Unwanted(_) => {
                Failure::Input(text)
            }
            _ => Failure::Input(format!("{scene}: {text}")),
        }
    })
}

/// Says what the matrix is like.
fn say_report(matrix: &Matrix, verbose: bool) {
    let r = &matrix.report;
    let per_cent = 100.0 * r.entries as f64 / (r.rows as f64).powi(2).max(1.0);
    let mut line = format!(
        "{}: {} faces, {} rows, {} form factors ({per_cent:.1} % of all pairs)",
        r.scene, r.source_triangles, r.rows, r.entries
    );
    for (count, kind) in
        [(r.degenerate, "degenerate"), (r.duplicate, "duplicate"), (r.transparent, "transparent")]
    {
        if count > 0 {
            line += &format!(", {count} {kind} faces without factors");
        }
    }
    if let (Some(groups), Some(kind)) = (r.groups, r.grouped_by) {
        line += &format!(", lumped to {groups} {kind}s");
    }
    say(&line);
    if let Some(a) = r.account {
        say(&format!(
            "rows: on average {:.5} to faces, {:.5} to the environment, {:.5} to backs{}",
            a.entries_share,
            a.environment,
            a.back,
            a.reciprocity_rms.map_or(String::new(), reciprocity)
        ));
    }
    if let Some(lost) = &r.lost {
        say(&format!(
            "rows: what is missing to 1 is {:.1e} on average, at most {:+.1e} (row {} of {})",
            lost.mean, lost.worst.value, lost.worst.row, lost.worst.surface
        ));
    }
    if let Some(p) = r.pairs {
        say(&format!(
            "pairs: {} evaluated, {} of them with something in between ({:.1} %), {} shadow rays; \
             error about {:.2} % (RMS over all factors)",
            p.evaluated,
            p.partly_hidden,
            100.0 * p.partly_hidden as f64 / p.evaluated.max(1) as f64,
            p.shadow_rays,
            100.0 * p.error
        ));
    }
    if r.through_a_file {
        say("memory: rows went through a temporary file, as all do not fit (--memory)");
    }
    name_rows("covered (most of their view is the back of something)", &r.covered, verbose);
    if let Some(t) = r.threshold {
        say(&format!("threshold: {} form factors below {} dropped", t.dropped, t.below));
    }
    if let Some(c) = &r.closure {
        say(&format!(
            "enclosure: rows sum to 1 within {:.0e} after {} steps; scales from {:.4} to {:.4}; \
             {:.2} % \
             RMS of asymmetry averaged out",
            c.residual.max(f64::EPSILON),
            c.steps,
            c.smallest_scale,
            c.largest_scale,
            100.0 * c.asymmetry
        ));
        name_rows("scaled by less than .9 or more than 1.1", &c.outside, verbose);
    }
    if verbose {
        stages(r);
    }
}

/// How far factors of a pair are from agreeing.
fn reciprocity(rms: f64) -> String {
    /// Single precision leaves this much between two roundings of a number.
    const ROUNDING: f64 = f32::EPSILON as f64;
    match rms <= ROUNDING {
        true => String::from("; reciprocal to the last digit stored"),
        false => format!("; reciprocity error {:.2} % RMS", 100.0 * rms),
    }
}

fn stages(report: &MatrixReport) {
    for stage in &report.stages {
        say(&format!("{:14} {:8.3} s", stage.name, stage.seconds));
    }
}

/// Says of which rows something is to be said: the first of them; the report names all.
fn name_rows(what: &str, rows: &[NamedRow], verbose: bool) {
    if rows.is_empty() {
        return;
    }
    let shown = rows.len().min(if verbose { 32 } else { 4 });
    let names: Vec<String> = rows[..shown]
        .iter()
        .map(|r| format!("{} of {} ({:.3})", r.row, r.surface, r.value))
        .collect();
    let more = match rows.len() - shown {
        0 => String::new(),
        more => format!(" and {more} more (--report names all)"),
    };
    say(&format!("{} rows {what}: {}{more}", rows.len(), names.join(", ")));
}
