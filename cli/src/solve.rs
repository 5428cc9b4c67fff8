//! `hemicube solve`: a solution for each source of light.

use std::path::PathBuf;
use std::time::Instant;

use hemicube::export::{ExportError, write_hemi};
use hemicube::report::Stage;
use hemicube::units::Bytes;

use crate::args::Solve;
use crate::failure::Failure;
use crate::input;
use crate::outputs;
use crate::render::{inputs, say_details, say_patches, set_threads, write_report};
use crate::solutions::{self, is_solution};
use crate::terminal::{Bar, catch_interrupts, print, say};

/// Runs the command.
pub fn run(args: &Solve) -> Result<(), Failure> {
    catch_interrupts();
    let (light, quiet) = (&args.light, args.light.run.quiet);
    set_threads(light.run.threads)?;
    if light.factors.is_some() {
        return Err(Failure::input("--factors is not used with solve; leave it out"));
    }
    let scene = input::read(&args.input)?;
    let output =
        args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.hemi", scene.name)));
    if !is_solution(&output) {
        return Err(Failure::Input(format!(
            "{}: solutions are written as .hemi",
            output.display()
        )));
    }
    let files = [("-o", Some(&output)), ("--report", light.run.report.as_ref())];
    outputs::check(&files, inputs(&scene, &args.input, light))?;
    input::say_findings(&scene, quiet);
    let bar = Bar::new(quiet);
    let (store, factors) = solutions::store(&scene, &args.input, light, &args.group, &bar)?;
    let start = Instant::now();
    write_hemi(&output, &scene, &store, &factors, &bar)
        .map_err(|e: ExportError| Failure::of(e, Failure::failed))?;
    bar.finish();
    let mut report = store.report(&scene);
    report.stages.push(Stage { name: "write", seconds: start.elapsed().as_secs_f64() });
    if !quiet {
        say_patches(&scene, &report, light);
        for source in &store.sources {
            say(&format!("source: {}", solutions::line(source, &scene)));
        }
        let bytes = std::fs::metadata(&output).map_or(0, |m| m.len());
        say(&format!("{}: {}", output.display(), Bytes(bytes)));
    }
    if light.run.verbose {
        say_details(&report);
    }
    write_report(&mut report, light)?;
    print(&output.display().to_string());
    Ok(())
}
