//! The triangles that the rows of a matrix stand for, to draw numbers on them.

use std::collections::HashMap;
use std::io;

use glam::DVec3;

use super::entries::Matrix;
use super::rows::{Rows, SurfaceRow};
use crate::scene::{Geometry, Side, TriangleId};

/// Triangles of a model, each with the rows of its sides.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowCells {
    /// Corners in metres; equal places are one.
    pub points: Vec<DVec3>,
    /// Indices in [`points`](Self::points), counter-clockwise seen from the front: the triangles of
    /// the model, or their parts where these have rows of their own.
    pub triangles: Vec<[u32; 3]>,
    /// The source triangle that each is, or is a part of.
    pub source: Vec<TriangleId>,
    /// The row of each front.
    pub front: Vec<u32>,
    /// The row of each back; empty where backs have no rows.
    pub back: Vec<u32>,
}

impl Matrix {
    /// The triangles that rows stand for, in the order of the rows of their fronts.
    #[must_use]
    pub fn cells(&self, geometry: &Geometry) -> RowCells {
        let faces = &self.layout.faces;
        let fronts = faces.iter().take_while(|f| f.side == Side::Front).count();
        let mut cells = RowCells::default();
        let mut number: HashMap<[u64; 3], u32> = HashMap::new();
        for (row, face) in faces[..fronts].iter().enumerate() {
            let corners = match face.patch {
                Some(patch) => self.patches.cell(patch).corners(geometry),
                None => geometry.corners(face.triangle),
            };
            cells.triangles.push(corners.map(|corner| {
                // Zeros of either sign are one place.
                let place = (corner + 0.0).to_array().map(f64::to_bits);
                *number.entry(place).or_insert_with(|| {
                    cells.points.push(corner);
                    cells.points.len() as u32 - 1
                })
            }));
            cells.source.push(face.triangle);
            cells.front.push(row as u32);
        }
        // Sides that are cut are cut alike; one without patches has one row for all its parts.
        let mut backs = (fronts..faces.len()).peekable();
        for parts in cells.source.chunk_by(|a, b| a == b) {
            let mut rows = Vec::new();
            while let Some(row) = backs.next_if(|&row| faces[row].triangle == parts[0]) {
                rows.push(row as u32);
            }
            let row = |k: usize| if rows.len() == parts.len() { rows[k] } else { rows[0] };
            if !rows.is_empty() {
                cells.back.extend((0..parts.len()).map(row));
            }
        }
        cells
    }
}

/// The form factors from several rows together to every row: the mean of theirs over the area,
/// `surfaces` being those of all rows.
///
/// # Errors
/// Only where rows are not in memory.
pub fn mean_row(rows: &dyn Rows, surfaces: &[SurfaceRow], which: &[usize]) -> io::Result<Vec<f64>> {
    let area: f64 = which.iter().map(|&i| surfaces[i].area).sum();
    let mut mean = vec![0.0; rows.len()];
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for &i in which {
        rows.row(i, &mut columns, &mut values)?;
        let share = if area > 0.0 { surfaces[i].area / area } else { 0.0 };
        for (&j, value) in columns.iter().zip(&values) {
            mean[j as usize] += share * value;
        }
    }
    Ok(mean)
}
