//! Rows lumped to named groups: surfaces, materials or objects.

use std::collections::HashMap;
use std::io;

use rayon::prelude::*;

use super::entries::Matrix;
use super::rows::{FaceAccount, Precision, Rows, SurfaceRow};
use crate::scene::{Geometry, Grouping, Side};

/// What the backs of a surface are called after its name.
pub const BACK: &str = " (back)";

/// The matrix between named groups of triangles:
///
/// ```text
/// F_IJ = Σ_(i in I) A_i Σ_(j in J) F_ij / A_I
/// ```
///
/// With two-sided triangles the backs of a group are another one, `NAME (back)`.
#[derive(Debug, Clone)]
pub struct Lumped {
    pub(super) surfaces: Vec<SurfaceRow>,
    pub(super) rest: Vec<[f64; 2]>,
    pub(super) rows: Vec<(Vec<u32>, Vec<f64>)>,
    /// The row here of each row of the matrix.
    pub(super) group_of: Vec<u32>,
}

impl Lumped {
    /// Lumps the pieces of each of the file's triangles to one row, in the order of the file: first
    /// all fronts, then all backs. Fails only where its rows are not in memory.
    pub fn by_face(matrix: &Matrix, geometry: &Geometry) -> io::Result<Self> {
        let of: Vec<u32> = geometry.ids().map(|t| geometry.face(t)).collect();
        let count = geometry.faces() as u32;
        let names = (0..count).map(|face| face.to_string()).collect();
        let mut lumped = Self::new(matrix, geometry, &Grouping { names, of })?;
        // Rows ascend as the file's triangles do, so the first of a face has the next new number.
        let mut next = 0;
        for face in &matrix.layout.faces {
            let number =
                geometry.face(face.triangle) + if face.side == Side::Back { count } else { 0 };
            if number == next {
                let surface = geometry.surface_of[face.triangle.index()] as usize;
                let row = &mut lumped.surfaces[next as usize];
                row.triangle = Some(geometry.face(face.triangle));
                row.name = geometry.surfaces.get(surface).map_or("", |s| &s.name).to_owned();
                next += 1;
            }
        }
        Ok(lumped)
    }

    /// Lumps a matrix to groups of the triangles that it is of. Fails only where its rows are not
    /// in memory.
    pub fn new(matrix: &Matrix, geometry: &Geometry, grouping: &Grouping) -> io::Result<Self> {
        let two = matrix.layout.faces.iter().any(|f| f.side == Side::Back);
        let mut number: HashMap<(u32, Side), u32> = HashMap::new();
        let mut members: Vec<Vec<usize>> = Vec::new();
        let group_of: Vec<u32> = (0..matrix.len())
            .map(|i| {
                let face = matrix.layout.faces[i];
                let key = (grouping.of[face.triangle.index()], face.side);
                let group = *number.entry(key).or_insert(members.len() as u32);
                if group as usize == members.len() {
                    members.push(Vec::new());
                }
                members[group as usize].push(i);
                group
            })
            .collect();
        let mut names = vec![String::new(); members.len()];
        for ((name, side), group) in number {
            let name = &grouping.names[name as usize];
            let back = if two && side == Side::Back { BACK } else { "" };
            names[group as usize] = format!("{name}{back}");
        }
        let surfaces = members
            .iter()
            .zip(names)
            .map(|(rows, name)| SurfaceRow {
                name,
                ..mean(rows.iter().map(|&i| (matrix.area(i), matrix.surface_row(geometry, i))))
            })
            .collect();
        let rows = members.par_iter().map(|rows| lump(matrix, rows, &group_of, members.len()));
        let rest = members.iter().map(|rows| rest(matrix, rows)).collect();
        let rows = rows.collect::<io::Result<_>>()?;
        Ok(Self { surfaces, rest, rows, group_of })
    }

    /// The row that row `i` of the matrix was lumped to.
    #[must_use]
    pub fn group_of(&self, i: usize) -> usize {
        self.group_of[i] as usize
    }

    /// Area of row `i` in m².
    #[must_use]
    pub fn area(&self, i: usize) -> f64 {
        self.surfaces[i].area
    }

    /// Name of row `i`.
    #[must_use]
    pub fn name(&self, i: usize) -> &str {
        &self.surfaces[i].name
    }

    /// Columns of row `i`, ascending, with their factors.
    pub fn entries_of(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (columns, values) = &self.rows[i];
        columns.iter().map(|&j| j as usize).zip(values.iter().copied())
    }

    /// Leaves out the factors of pairs of rows that are not to be kept.
    pub fn keep(&mut self, kept: impl Fn(usize, usize) -> bool + Sync) {
        self.rows.par_iter_mut().enumerate().for_each(|(i, (columns, values))| {
            let entries = columns.iter().zip(values.iter());
            let left = entries.filter(|e| kept(i, *e.0 as usize)).map(|(&j, &f)| (j, f));
            (*columns, *values) = left.unzip();
        });
    }

    /// Lumps rows once more: row `i` becomes a part of row `new[i]`, which has the name of its
    /// first part. New numbers ascend from 0 as they first occur.
    #[must_use]
    pub fn combine(&self, new: &[usize]) -> Self {
        let mut members: Vec<Vec<usize>> = Vec::new();
        for (i, &group) in new.iter().enumerate() {
            members.resize_with(members.len().max(group + 1), Vec::new);
            members[group].push(i);
        }
        let mean_of = |parts: &[usize], share: &dyn Fn(usize) -> f64| {
            let area: f64 = parts.iter().map(|&i| self.area(i)).sum();
            let sum: f64 = parts.iter().map(|&i| self.area(i) * share(i)).sum();
            if area > 0.0 { sum / area } else { 0.0 }
        };
        let surfaces = members.iter().map(|parts| SurfaceRow {
            name: parts.first().map_or(String::new(), |&i| self.surfaces[i].name.clone()),
            ..mean(parts.iter().map(|&i| (self.area(i), self.surfaces[i].clone())))
        });
        let rest = members.iter().map(|parts| [0, 1].map(|k| mean_of(parts, &|i| self.rest[i][k])));
        let rows = members.par_iter().map(|parts| {
            let (mut sums, mut area) = (vec![0.0; members.len()], 0.0);
            for &i in parts {
                area += self.area(i);
                self.entries_of(i).for_each(|(j, f)| sums[new[j]] += self.area(i) * f);
            }
            let seen = (0_u32..).zip(sums).filter(|s| s.1 > 0.0);
            seen.map(|(group, sum)| (group, sum / area)).unzip()
        });
        let group_of = self.group_of.iter().map(|&row| new[row as usize] as u32).collect();
        let (surfaces, rest) = (surfaces.collect(), rest.collect());
        Self { surfaces, rest, rows: rows.collect(), group_of }
    }
}

/// The row of one group.
fn lump(
    matrix: &Matrix,
    rows: &[usize],
    group_of: &[u32],
    groups: usize,
) -> io::Result<(Vec<u32>, Vec<f64>)> {
    let (mut sums, mut area) = (vec![0.0; groups], 0.0);
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for &i in rows {
        let a = matrix.area(i);
        area += a;
        matrix.row(i, &mut columns, &mut values)?;
        for (&j, f) in columns.iter().zip(&values) {
            sums[group_of[j as usize] as usize] += a * f;
        }
    }
    let seen = (0_u32..).zip(sums).filter(|s| s.1 > 0.0);
    Ok(seen.map(|(group, sum)| (group, sum / area)).unzip())
}

/// What goes with the entries of one group.
fn rest(matrix: &Matrix, rows: &[usize]) -> [f64; 2] {
    let area: f64 = rows.iter().map(|&i| matrix.area(i)).sum();
    let sum = |k: usize| rows.iter().map(|&i| matrix.area(i) * matrix.rest(i)[k]).sum::<f64>();
    if area > 0.0 { [sum(0) / area, sum(1) / area] } else { [0.0; 2] }
}

/// Several faces as one: areas add up, the rest are means over the area.
fn mean(rows: impl Iterator<Item = (f64, SurfaceRow)>) -> SurfaceRow {
    let mut all = SurfaceRow::default();
    for (area, row) in rows {
        all.side = row.side;
        all.area += area;
        all.centroid += row.centroid * area;
        all.normal += row.normal * area;
        all.account.front += row.account.front * area;
        all.account.back += row.account.back * area;
        all.account.environment += row.account.environment * area;
    }
    if all.area > 0.0 {
        let FaceAccount { front, back, environment } = all.account;
        let [front, back, environment] = [front, back, environment].map(|s| s / all.area);
        all.account = FaceAccount { front, back, environment };
        all.centroid /= all.area;
    }
    // What closes upon itself faces nowhere.
    const NOWHERE: f64 = 1e-9;
    let faces = all.normal.length() > NOWHERE * all.area;
    all.normal = if faces { all.normal.normalize() } else { glam::DVec3::ZERO };
    all
}

impl Rows for Lumped {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn entries(&self) -> u64 {
        self.rows.iter().map(|r| r.0.len() as u64).sum()
    }

    fn precision(&self) -> Precision {
        Precision::Double
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        columns.clone_from(&self.rows[i].0);
        values.clone_from(&self.rows[i].1);
        Ok(())
    }

    fn label(&self, i: usize) -> String {
        let row = &self.surfaces[i];
        if row.triangle.is_some() { i.to_string() } else { row.name.clone() }
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        self.rest[i]
    }

    fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
        self.surfaces.clone()
    }
}
