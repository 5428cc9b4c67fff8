//! Heat balances as tables, and on the model for ParaView.

use std::path::Path;

use super::ExportError;
use super::csv::{field, push_number};
use super::vtu::{CellArray, CellValues, write_vtu};
use crate::heat::{Gebhart, SideHeat, SurfaceHeat};
use crate::matrix::{Matrix, Precision, SurfaceRow};
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

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One line a row: what it stands for, its temperature and net fluxes. Units stand in the names of
/// the columns.
#[must_use]
pub fn sides_table(rows: &[SurfaceRow], emissivity: &[f64], sides: &[SideHeat]) -> String {
    let mut all = b"row,face,side,name,area_m2,emissivity,temperature_K,net_flux_W_m2,\
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
        all.extend(format!("{i},{face},{which},{}", field(&row.name)).into_bytes());
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

/// One line a radiative conductor, each pair once: `i,j,GR,from,to`, GR in m². The environment is
/// the row after the last.
#[must_use]
pub fn conductors_table(factors: &Gebhart) -> String {
    let sides = factors.sides();
    let name = |i: usize| sides.get(i).map_or("environment", |s| s.name.as_str());
    let out = factors.to_environment().map(|(i, conductor)| (i, sides.len(), conductor));
    let mut all = b"i,j,GR_m2,from,to\n".to_vec();
    for (i, j, conductor) in factors.conductors().chain(out) {
        all.extend(format!("{i},{j},").into_bytes());
        push_number(&mut all, conductor, Precision::Double);
        all.extend(format!(",{},{}\n", field(name(i)), field(name(j))).into_bytes());
    }
    text(all)
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
    for (side, rows) in [("", &cells.front), (" (back)", &cells.back)] {
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
