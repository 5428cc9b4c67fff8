//! Heat balances as tables, and on the model for ParaView.

use std::path::Path;

use glam::DVec3;

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

/// Writes the patches with the temperatures and fluxes of their rows, as ParaView reads them.
/// `row_of` is the row of each row of the matrix. Backs lie on the same places as fronts, after
/// them.
///
/// # Errors
/// If the system refuses.
pub fn write_heat_vtu(
    path: &Path,
    geometry: &Geometry,
    matrix: &Matrix,
    row_of: &dyn Fn(usize) -> usize,
    rows: &[SurfaceRow],
    sides: &[SideHeat],
) -> Result<(), ExportError> {
    let (mut points, mut triangles, mut row) = (Vec::<DVec3>::new(), Vec::new(), Vec::new());
    for (i, face) in matrix.layout.faces.iter().enumerate() {
        let Some(patch) = face.patch else { continue };
        let first = points.len() as u32;
        points.extend(matrix.patches.cell(patch).corners(geometry));
        triangles.push([first, first + 1, first + 2]);
        row.push(row_of(i));
    }
    let of = |value: &dyn Fn(&SideHeat) -> f64| -> Vec<f64> {
        row.iter().map(|&i| value(&sides[i])).collect()
    };
    let arrays = [
        ("temperature", of(&|s| s.temperature.unwrap_or(f64::NAN))),
        ("net_flux", of(&|s| s.net())),
        ("infrared_flux", of(&|s| s.flux)),
        ("sunlight", of(&|s| s.sunlight)),
        ("radiosity", of(&|s| s.radiosity)),
        ("irradiance", of(&|s| s.irradiance)),
        ("temperature_error", of(&|s| s.temperature_error)),
        ("net_flux_error", of(&|s| s.flux_error)),
        ("area", row.iter().map(|&i| rows[i].area).collect()),
    ];
    let number: Vec<i32> = row.iter().map(|&i| i32::try_from(i).unwrap_or(-1)).collect();
    let back = |i: &usize| i32::from(rows[*i].side == Some(Side::Back));
    let side: Vec<i32> = row.iter().map(back).collect();
    let mut all: Vec<CellArray<'_>> = arrays
        .iter()
        .map(|(name, values)| CellArray { name, values: CellValues::Numbers(values) })
        .collect();
    all.push(CellArray { name: "row", values: CellValues::Indices(&number) });
    all.push(CellArray { name: "back", values: CellValues::Indices(&side) });
    write_vtu(path, &points, &triangles, &all, &[])
}
