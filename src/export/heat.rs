//! Heat balances as tables, and on the model for ParaView.

use std::io::{self, Write};
use std::path::Path;

use super::ExportError;
use super::csv::{field, push_number};
use super::target::write_with;
use super::vtu::{CellArray, CellValues, write_vtu};
use crate::heat::{Gebhart, SideHeat, SurfaceHeat};
use crate::matrix::{BACK, Matrix, Precision, SurfaceRow};
use crate::progress::Progress;
use crate::scene::{Geometry, Side};

/// Numbers with commas before each; nothing where there is none.
fn numbers(line: &mut Vec<u8>, values: &[Option<f64>]) {
    for value in values {
        line.push(b',');
        if let Some(value) = value {
            // Rounding leaves zeros of either sign.
            push_number(line, rounded(*value) + 0.0, Precision::Double);
        }
    }
    line.push(b'\n');
}

/// A number to twelve digits, which is more than any of them is known to.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Names are in UTF-8, and so is the rest.
fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap_or_default()
}

/// One line a row: what it stands for, its temperature and net fluxes. Units stand in the names of
/// the columns.
#[must_use]
pub fn sides_table(
    rows: &[SurfaceRow],
    node_of: &[u32],
    emissivity: &[f64],
    sides: &[SideHeat],
) -> String {
    let mut all = b"row,node,face,side,name,area_m2,emissivity,temperature_K,net_flux_W_m2,\
        infrared_flux_W_m2,sunlight_W_m2,radiosity_W_m2,irradiance_W_m2,temperature_error_K,\
        net_flux_error_W_m2\n"
        .to_vec();
    for (i, ((row, e), side)) in rows.iter().zip(emissivity).zip(sides).enumerate() {
        let face = row.triangle.map_or(String::new(), |t| t.to_string());
        let which = match row.side {
            Some(Side::Front) => "front",
            Some(Side::Back) => "back",
            None => "",
        };
        all.extend(format!("{i},{},{face},{which},{}", node_of[i], field(&row.name)).into_bytes());
        let known = side.temperature.map(|_| side.temperature_error);
        let some = [row.area, *e].map(Some);
        let fluxes = [side.net(), side.flux, side.sunlight, side.radiosity, side.irradiance];
        let values = [&some[..], &[side.temperature], &fluxes.map(Some), &[known]];
        numbers(&mut all, &[values.concat(), vec![Some(side.flux_error)]].concat());
    }
    text(all)
}

/// One line a surface.
#[must_use]
pub fn surfaces_table(names: &[String], surfaces: &[SurfaceHeat]) -> String {
    let mut all = b"surface,area_m2,temperature_K,lowest_K,highest_K,net_W,sunlight_W,\
        temperature_error_K,net_error_W\n"
        .to_vec();
    for (name, s) in names.iter().zip(surfaces) {
        all.extend(field(name).into_bytes());
        let [mean, low, high] =
            s.temperature.map_or([None; 3], |temperatures| temperatures.map(Some));
        let error = s.temperature.map(|_| s.temperature_error);
        let values = [Some(s.area), mean, low, high, Some(s.net), Some(s.sunlight), error];
        numbers(&mut all, &[&values[..], &[Some(s.net_error)]].concat());
    }
    text(all)
}

/// Writes radiative conductors between nodes, a line each pair: `i,j,GR,from,to`, GR in m². Nodes
/// are those that `node_of` says of each row, and have the names of their first rows; the
/// environment is the one after the last. Advances `progress` by one a node.
///
/// # Errors
/// If the system refuses, or the caller cancelled.
pub fn write_conductors(
    path: &Path,
    factors: &Gebhart,
    node_of: &[u32],
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let nodes = node_of.iter().max().map_or(0, |k| *k as usize + 1);
    let mut names = vec![String::from("environment"); nodes + 1];
    for (side, k) in factors.sides().iter().zip(node_of).rev() {
        names[*k as usize] = field(&side.name);
    }
    write_with(path, |file| {
        writeln!(file, "i,j,GR_m2,from,to")?;
        factors.between_nodes(node_of, |i, others, out| {
            let out = out.map(|conductor| (nodes, conductor));
            let mut lines = Vec::new();
            for (j, conductor) in others.iter().copied().chain(out) {
                lines.extend(format!("{i},{j},").into_bytes());
                push_number(&mut lines, conductor, Precision::Double);
                lines.extend(format!(",{},{}\n", names[i], names[j]).into_bytes());
            }
            file.write_all(&lines)?;
            progress.advance(1).map_err(|_| io::ErrorKind::Interrupted.into())
        })
    })
}

/// Writes the triangles that rows stand for with their temperatures (K) and fluxes (W/m²), as
/// ParaView reads them; arrays of backs end in ` (back)`. `row_of` is the row here of each row of
/// the matrix.
///
/// # Errors
/// If the system refuses.
pub fn write_heat_vtu(
    path: &Path,
    geometry: &Geometry,
    matrix: &Matrix,
    row_of: &dyn Fn(usize) -> usize,
    sides: &[SideHeat],
) -> Result<(), ExportError> {
    type Value = fn(&SideHeat) -> f64;
    const ARRAYS: [(&str, Value); 8] = [
        ("temperature", |s| s.temperature.unwrap_or(f64::NAN)),
        ("net_flux", SideHeat::net),
        ("infrared_flux", |s| s.flux),
        ("sunlight", |s| s.sunlight),
        ("radiosity", |s| s.radiosity),
        ("irradiance", |s| s.irradiance),
        ("temperature_error", |s| s.temperature_error),
        ("net_flux_error", |s| s.flux_error),
    ];
    let cells = matrix.cells(geometry);
    let (mut numbers, mut indices) = (Vec::new(), Vec::new());
    for (side, rows) in [("", &cells.front), (BACK, &cells.back)] {
        if rows.is_empty() {
            continue;
        }
        let rows: Vec<usize> = rows.iter().map(|&row| row_of(row as usize)).collect();
        for (name, value) in ARRAYS {
            let values: Vec<f64> = rows.iter().map(|&i| value(&sides[i]) + 0.0).collect();
            numbers.push((format!("{name}{side}"), values));
        }
        let rows: Vec<i32> = rows.into_iter().map(|i| i as i32).collect();
        indices.push((format!("row{side}"), rows));
    }
    let numbers = numbers.iter().map(|(name, v)| (name, CellValues::Numbers(v)));
    let indices = indices.iter().map(|(name, v)| (name, CellValues::Indices(v)));
    let arrays: Vec<CellArray<'_>> =
        numbers.chain(indices).map(|(name, values)| CellArray { name, values }).collect();
    write_vtu(path, &cells.points, &cells.triangles, &arrays, &[])
}
