//! `hemicube view3d`: what View3D does, from its files to its files.

use std::time::Instant;

use hemicube::engines::{EngineOptions, ExactOptions};
use hemicube::export::{View3dTable, write_view3d, write_view3d_row, write_whole};
use hemicube::matrix::{GreyError, Lumped, Matrix, MatrixOptions, Rows, grey, make};
use hemicube::progress::Progress;
use hemicube::report::Stage;
use hemicube::scene::View3d as Task;

use crate::args::View3d;
use crate::factors::{accuracy, say as factors_say};
use crate::failure::Failure;
use crate::input::say_warnings;
use crate::machine;
use crate::outputs;
use crate::remedy;
use crate::render::set_threads;
use crate::terminal::{Bar, hear_interrupts, print, say};

/// Runs the command.
pub fn run(args: &View3d) -> Result<(), Failure> {
    hear_interrupts();
    set_threads(args.run.threads)?;
    let task = Task::load(&args.input).map_err(Failure::input)?;
    let files = [("OUTPUT", Some(&args.output)), ("--report", args.run.report.as_ref())];
    outputs::check(&files, &task.scene.files)?;
    check(args, &task)?;
    if !args.run.quiet {
        say_warnings(&task.scene.findings.iter().collect::<Vec<_>>());
    }
    let options = MatrixOptions {
        engine: EngineOptions::Exact(ExactOptions {
            error: args.error.unwrap_or_else(|| aim(&task)),
            ..ExactOptions::default()
        }),
        enclosure: task.control.enclosure,
        memory: args.run.memory.unwrap_or_else(machine::available_memory),
        ..MatrixOptions::default()
    };
    let bar = Bar::new(args.run.quiet);
    let geometry = &task.scene.geometry;
    let mut matrix = make(geometry, &options, &bar).map_err(|e| {
        Failure::of(e, |e| {
            let text = format!("{e}{}", remedy::of_view3d(&e));
            Failure::Input(format!("{}: {text}", args.input.display()))
        })
    })?;
    let start = Instant::now();
    let mut surfaces =
        Lumped::new(&matrix, geometry, &task.by_surface()).map_err(Failure::failed)?;
    let most = task.control.max_distance;
    if most.is_finite() {
        let centre = |i: usize| task.surfaces[i].centre;
        surfaces.keep(|i, j| centre(i).distance(centre(j)) <= most);
    }
    let areas = areas(&task, &surfaces);
    let rows = finish(args, &task, &surfaces, &areas, options.memory, &bar)?;
    bar.finish();
    let seconds = start.elapsed().as_secs_f64();
    let report = &mut matrix.report;
    report.scene.clone_from(&task.scene.name);
    report.grouped_by = Some("surface");
    report.groups = Some(rows.len());
    report.stages.push(Stage { name: "write", seconds });
    report.peak_memory_bytes = machine::peak_memory();
    if let Some(path) = &args.run.report {
        let json = serde_json::to_string_pretty(report).map_err(Failure::failed)?;
        write_whole(path, json.as_bytes()).map_err(Failure::failed)?;
    }
    if !args.run.quiet {
        summary(&task, &matrix, &rows);
        if args.run.verbose {
            factors_say::report(&matrix.report, true);
        }
        if task.control.list > 0 {
            list(&task, &rows, &areas);
        }
        let promised = args.error.unwrap_or_else(|| promised(&task));
        let stated = matrix.report.pairs.map(|pairs| pairs.error);
        if let Some(text) = stated.and_then(|stated| accuracy::exceeded(promised, stated)) {
            say(&format!("warning: {text}; allow a larger --error, or divide large surfaces"));
        }
    }
    print(&args.output.display().to_string());
    Ok(())
}

/// The error that is promised for want of another: ten times View3D's criterion of convergence, so
/// that View3D's default is ours.
fn promised(task: &Task) -> f64 {
    const TIMES: f64 = 10.0;
    task.control.eps.map_or(ExactOptions::default().error, |eps| (TIMES * eps).min(1.0))
}

/// The error aimed at: of few triangles less, as that costs next to nothing.
fn aim(task: &Task) -> f64 {
    const MANY: f64 = 1000.0;
    const LEAST: f64 = 1e-5;
    let promised = promised(task);
    let share = task.scene.geometry.len() as f64 / MANY;
    (promised * share.min(1.0)).max(LEAST.min(promised)).max(1e-6)
}

/// Refuses control values that contradict each other, and says which are not heard.
fn check(args: &View3d, task: &Task) -> Result<(), Failure> {
    let control = &task.control;
    if control.enclosure && control.max_distance.is_finite() {
        return Err(Failure::Input(format!(
            "{}: encl=1 wants rows that sum to 1, and maxD leaves factors out; use one of them",
            args.input.display()
        )));
    }
    if control.emittances && control.row.is_some() {
        return Err(Failure::Input(format!(
            "{}: emit=1 needs all rows, and `row` asks for one; use one of them",
            args.input.display()
        )));
    }
    Ok(())
}

/// Area of each row once surfaces are combined, with that of triangles that exchange nothing: those
/// of a surface that is given again.
fn areas(task: &Task, surfaces: &Lumped) -> Vec<f64> {
    let (geometry, rows) = (&task.scene.geometry, task.rows());
    let mut areas = vec![0.0; rows.iter().max().map_or(0, |last| last + 1)];
    for (i, &row) in rows.iter().enumerate() {
        areas[row] += surfaces.area(i);
    }
    let idle = geometry.ids().filter(|&t| !geometry.is_solid(t));
    for (t, surface) in idle.map(|t| (t, geometry.surface_of[t.index()] as usize)) {
        if let Some(&row) = rows.get(surface) {
            areas[row] += geometry.area(t);
        }
    }
    areas
}

/// Combines surfaces, counts reflection if that is asked for, and writes the result; returns its
/// rows.
fn finish(
    args: &View3d,
    task: &Task,
    surfaces: &Lumped,
    areas: &[f64],
    memory: u64,
    bar: &Bar,
) -> Result<Lumped, Failure> {
    let of = task.rows();
    let combined = surfaces.combine(&of);
    if let Some(row) = task.control.row {
        let mut factors = vec![0.0; if task.control.col.is_some() { 1 } else { combined.len() }];
        for (j, f) in surfaces.entries_of(row) {
            match task.control.col {
                None => factors[of[j]] += f,
                Some(col) if col == j => factors[0] = f,
                Some(_) => {}
            }
        }
        write_view3d_row(&args.output, &factors).map_err(|e| Failure::of(e, Failure::failed))?;
        return Ok(combined);
    }
    let kept = task.surfaces.iter().filter(|s| s.combined.is_none());
    let emittances: Vec<f64> = kept.map(|s| s.emittance).collect();
    let rows = match task.control.emittances {
        false => combined,
        true => grey(&combined, &emittances, memory, bar).map_err(|e| {
            Failure::of(e, |e: GreyError| {
                let remedy = "allow more with --memory, or write emit=0";
                Failure::Input(format!("{}: {e}; {remedy}", args.input.display()))
            })
        })?,
    };
    bar.stage("write", rows.len() as u64);
    let table = View3dTable {
        rows: &rows,
        areas,
        emittances: &emittances,
        enclosure: task.control.enclosure,
        grey: task.control.emittances,
    };
    write_view3d(&args.output, table, task.control.out, bar)
        .map_err(|e| Failure::of(e, Failure::failed))?;
    Ok(rows)
}

/// Says in a line what the matrix is like, and in another what is wrong with it.
fn summary(task: &Task, matrix: &Matrix, rows: &Lumped) {
    let report = &matrix.report;
    let mut line = format!(
        "{}: {} surfaces, {} rows, {} factors",
        task.scene.name,
        task.surfaces.len(),
        rows.len(),
        rows.entries()
    );
    if let Some(a) = report.account {
        line += &format!(
            "; on average {:.5} to surfaces, {:.5} to the environment, {:.5} to backs",
            a.entries_share, a.environment, a.back
        );
    }
    if let Some(pairs) = report.pairs {
        line += &format!("; error about {:.2} %", 100.0 * pairs.error);
    }
    say(&line);
    if let Some((losses, worst)) = report.losses.as_ref().and_then(|l| Some((l, l.worst.first()?)))
        && losses.to_backs > 0
    {
        say(&format!(
            "note: {} triangles see surfaces from behind, which absorb; {} {:.1} % of all; right \
             where surfaces stand in the way, else turn their vertices round",
            losses.to_backs,
            worst.surface,
            100.0 * worst.back
        ));
    }
}

/// Says what the rows are like: View3D lists it in its log.
fn list(task: &Task, rows: &Lumped, areas: &[f64]) {
    if !task.title.is_empty() {
        say(&task.title);
    }
    say("   row           area    sum of factors  surface");
    for (i, area) in areas.iter().enumerate() {
        let sum = rows.entries_of(i).fold(0.0, |sum, e| sum + e.1);
        say(&format!("{:6} {:14.6} {sum:17.6}  {}", i + 1, area, rows.name(i)));
    }
}
