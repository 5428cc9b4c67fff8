//! What the rows of a matrix stand for, drawn: the model's triangles with the account of their rows
//! and the form factors of chosen ones (`.vtu`).

use std::path::Path;

use super::ExportError;
use super::vtu::{CellArray, CellValues, write_vtu};
use crate::matrix::{BACK, Lumped, Matrix, SurfaceRow};
use crate::scene::{GroupBy, Scene};

/// Form factors to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnRow {
    /// What they are from.
    pub name: String,
    /// The form factor to each row of the matrix.
    pub factors: Vec<f64>,
}

/// Writes the triangles that rows stand for; parts of them where these have rows of their own. Each
/// has the numbers of the row that it belongs to, of a lumped matrix too: `surfaces` are what its
/// rows stand for, and `drawn` form factors to each of them.
///
/// # Errors
/// If the system refuses.
pub fn write_row_cells(
    path: &Path,
    scene: &Scene,
    matrix: &Matrix,
    lumped: Option<&Lumped>,
    surfaces: &[SurfaceRow],
    drawn: &[DrawnRow],
) -> Result<(), ExportError> {
    let cells = matrix.cells(&scene.geometry);
    let names = scene.grouping(GroupBy::Surface);
    let sides = [("", &cells.front), (BACK, &cells.back)];
    let mut numbers: Vec<(String, Vec<f64>)> = Vec::new();
    let mut indices: Vec<(String, Vec<i32>)> = Vec::new();
    for (side, rows) in sides.into_iter().filter(|side| !side.1.is_empty()) {
        let rows: Vec<usize> = rows
            .iter()
            .map(|&row| lumped.map_or(row as usize, |lumped| lumped.group_of(row as usize)))
            .collect();
        for row in drawn {
            let factors = rows.iter().map(|&j| row.factors[j]).collect();
            numbers.push((format!("F from {}{side}", row.name), factors));
        }
        let mut column = |name: &str, value: &dyn Fn(&SurfaceRow) -> f64| {
            // Rounding leaves zeros of either sign.
            let values = rows.iter().map(|&j| value(&surfaces[j]) + 0.0).collect();
            numbers.push((format!("{name}{side}"), values));
        };
        column("area", &|s| s.area);
        column("row_sum", &|s| s.account.front);
        column("back", &|s| s.account.back);
        column("environment", &|s| s.account.environment);
        indices.push((format!("row{side}"), rows.iter().map(|&j| j as i32).collect()));
    }
    let surface = cells.source.iter().map(|t| names.of[t.index()] as i32).collect();
    indices.push(("surface".to_owned(), surface));
    let numbers = numbers.iter().map(|(name, v)| (name, CellValues::Numbers(v)));
    let indices = indices.iter().map(|(name, v)| (name, CellValues::Indices(v)));
    let arrays: Vec<CellArray<'_>> =
        numbers.chain(indices).map(|(name, values)| CellArray { name, values }).collect();
    let names: Vec<(&str, i32)> = names.names.iter().map(String::as_str).zip(0..).collect();
    write_vtu(path, &cells.points, &cells.triangles, &arrays, &names)
}
