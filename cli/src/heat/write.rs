//! The files of `hemicube heat`.

use std::path::Path;

use hemicube::export::{
    ExportError, MATRIX_FORMATS, MatrixFormat, PictureFormat, sides_table, surfaces_table,
    write_conductors, write_heat_vtu, write_matrix, write_whole,
};
use hemicube::heat::{Gebhart, HeatBalance};
use hemicube::matrix::MatrixReport;
use hemicube::progress::Progress;
use serde_json::json;

use super::Model;
use super::given::OfRows;
use crate::args::Heat;
use crate::failure::Failure;
use crate::terminal::{Bar, print as tell, print_data};

/// Refuses what cannot be written, before any work is done.
pub fn check(args: &Heat) -> Result<(), Failure> {
    let table = |path: &Path| MatrixFormat::of(path) == Some(MatrixFormat::Csv);
    let refuse =
        |path: &Path, what: &str| Err(Failure::Input(format!("{}: {what}", path.display())));
    if let Some(path) = args.output.as_ref().filter(|p| !table(p) && !is_vtu(p)) {
        return refuse(path, "faces are written as .csv or .vtu");
    }
    let tables = [&args.surfaces, &args.conductors];
    if let Some(path) = tables.into_iter().flatten().find(|p| !table(p)) {
        return refuse(path, "is written as .csv");
    }
    if let Some(path) = args.gebhart.as_ref().filter(|p| MatrixFormat::of(p).is_none()) {
        return refuse(path, &format!("Gebhart factors are written as {MATRIX_FORMATS}"));
    }
    if let Some(path) =
        args.gebhart.as_ref().filter(|p| MatrixFormat::of(p) == Some(MatrixFormat::Idf))
    {
        return refuse(
            path,
            "Gebhart factors are no view factors; write them as .npz, .npy, .mtx or .csv",
        );
    }
    let plain = |p: &Path| PictureFormat::of(p).is_some_and(|f| !f.is_of_radiance());
    match args.picture.as_ref().filter(|p| !plain(p)) {
        Some(path) => refuse(path, "pictures of temperatures are written as .png or .jpg"),
        None => Ok(()),
    }
}

fn is_vtu(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtu"))
}

/// Writes all that is asked for but the picture.
pub fn all(
    args: &Heat,
    model: &Model<'_>,
    rows: &OfRows,
    found: &HeatBalance,
    factors: Option<&Gebhart>,
    bar: &Bar,
) -> Result<(), Failure> {
    let export = |e: ExportError| Failure::of(e, Failure::failed);
    if let Some(path) = &args.output {
        if is_vtu(path) {
            let row_of = |i| model.row_of(i);
            let geometry = &model.scene.geometry;
            write_heat_vtu(path, geometry, model.matrix, &row_of, &found.sides).map_err(export)?;
        } else {
            let table = sides_table(&model.rows, &rows.node_of, &rows.emissivity, &found.sides);
            write_whole(path, table.as_bytes()).map_err(export)?;
        }
    }
    if let Some(path) = &args.surfaces {
        let table = surfaces_table(&rows.surfaces, &found.surfaces);
        write_whole(path, table.as_bytes()).map_err(export)?;
    }
    let Some(factors) = factors else { return Ok(()) };
    if let Some(path) = &args.gebhart {
        let mut origin = model.matrix.origin(&model.scene.geometry);
        origin.lumped = true;
        write_matrix(path, factors, &model.rows, &origin, bar).map_err(export)?;
    }
    if let Some(path) = &args.conductors {
        bar.stage("conductors", rows.conditions.len() as u64);
        write_conductors(path, factors, &rows.node_of, bar).map_err(export)?;
    }
    Ok(())
}

/// The report, if that is wanted.
pub fn report(args: &Heat, report: &MatrixReport, found: &HeatBalance) -> Result<(), Failure> {
    let Some(path) = &args.run.report else { return Ok(()) };
    let mut all = serde_json::to_value(report).map_err(Failure::failed)?;
    let [received, escaped, absorbed] = found.sunlight;
    all["heat"] = json!({
        "iterations": found.iterations,
        "left_out_w": found.left_out.0,
        "supplied_w": found.supplied,
        "removed_w": found.removed,
        "to_environment_w": found.to_environment,
        "sunlight_received_w": received,
        "sunlight_escaped_w": escaped,
        "sunlight_absorbed_w": absorbed,
        "imbalance": found.imbalance,
    });
    let text = serde_json::to_string_pretty(&all).map_err(Failure::failed)?;
    write_whole(path, text.as_bytes()).map_err(Failure::failed)
}

/// Prints the surfaces, or the names of what was written.
pub fn print(args: &Heat, rows: &OfRows, found: &HeatBalance) {
    // With the table itself on stdout there is no place for names.
    if args.surfaces.is_none() {
        print_data(surfaces_table(&rows.surfaces, &found.surfaces).trim_end());
        return;
    }
    let files = [&args.output, &args.surfaces, &args.gebhart, &args.conductors, &args.picture];
    files.into_iter().flatten().for_each(|path| tell(&path.display().to_string()));
}
