//! Compressed sparse rows that Python holds, as the library reads them; and arrays for it.

use std::io;

use hemicube::matrix::{Precision, Rows, SurfaceRow};
use hemicube::scene::Geometry;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

/// A matrix of form factors as Python holds it.
#[derive(FromPyObject)]
pub struct PyMatrix<'py> {
    starts: PyReadonlyArray1<'py, i64>,
    columns: PyReadonlyArray1<'py, i32>,
    values: PyValues<'py>,
    area: PyReadonlyArray1<'py, f64>,
    escape: PyReadonlyArray1<'py, f64>,
    back: PyReadonlyArray1<'py, f64>,
}

#[derive(FromPyObject)]
enum PyValues<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
}

/// The same, borrowed.
pub struct Csr<'a> {
    starts: &'a [i64],
    columns: &'a [i32],
    values: Values<'a>,
    /// Areas of the rows, m².
    pub areas: &'a [f64],
    escape: &'a [f64],
    back: &'a [f64],
}

enum Values<'a> {
    Single(&'a [f32]),
    Double(&'a [f64]),
}

impl PyMatrix<'_> {
    /// A view of it, whose arrays must be contiguous.
    pub fn csr(&self) -> PyResult<Csr<'_>> {
        Ok(Csr {
            starts: self.starts.as_slice()?,
            columns: self.columns.as_slice()?,
            values: match &self.values {
                PyValues::Single(values) => Values::Single(values.as_slice()?),
                PyValues::Double(values) => Values::Double(values.as_slice()?),
            },
            areas: self.area.as_slice()?,
            escape: self.escape.as_slice()?,
            back: self.back.as_slice()?,
        })
    }
}

impl Csr<'_> {
    fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// The mean over the area of `rows`, its columns added up by the group of each: columns and
    /// factors that are not zero.
    pub fn mean(&self, rows: &[usize], group_of: &[i64], groups: usize) -> (Vec<i32>, Vec<f64>) {
        let (mut sums, mut area) = (vec![0.0; groups], 0.0);
        for &i in rows {
            let (own, range) = (self.areas[i], self.range(i));
            area += own;
            for (k, &j) in range.clone().zip(&self.columns[range]) {
                let factor = match self.values {
                    Values::Single(all) => f64::from(all[k]),
                    Values::Double(all) => all[k],
                };
                sums[group_of[j as usize] as usize] += own * factor;
            }
        }
        let seen = (0..).zip(sums).filter(|s| s.1 > 0.0);
        seen.map(|(group, sum)| (group, sum / area)).unzip()
    }
}

impl Rows for Csr<'_> {
    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn entries(&self) -> u64 {
        self.columns.len() as u64
    }

    fn precision(&self) -> Precision {
        match self.values {
            Values::Single(_) => Precision::Single,
            Values::Double(_) => Precision::Double,
        }
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        let range = self.range(i);
        columns.clear();
        columns.extend(self.columns[range.clone()].iter().map(|&j| j as u32));
        values.clear();
        match self.values {
            Values::Single(all) => values.extend(all[range].iter().map(|&f| f64::from(f))),
            Values::Double(all) => values.extend_from_slice(&all[range]),
        }
        Ok(())
    }

    fn label(&self, i: usize) -> String {
        i.to_string()
    }

    fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
        Vec::new()
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        [self.escape[i], self.back[i]]
    }
}

/// Rows of rows of a matrix, as Python is to hold them.
pub struct Collected {
    pub starts: Vec<i64>,
    pub columns: Vec<i32>,
    pub single: Option<Vec<f32>>,
    pub double: Option<Vec<f64>>,
}

/// Copies these rows, once.
pub fn collected(
    rows: &dyn Rows,
    which: impl ExactSizeIterator<Item = usize>,
) -> io::Result<Collected> {
    let is_single = rows.precision() == Precision::Single;
    let (mut single, mut double) = (Vec::new(), Vec::new());
    let entries = rows.entries() as usize;
    let mut starts = Vec::with_capacity(which.len() + 1);
    let mut all = Vec::with_capacity(entries);
    if is_single {
        single.reserve_exact(entries)
    } else {
        double.reserve_exact(entries)
    }
    starts.push(0);
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for i in which {
        rows.row(i, &mut columns, &mut values)?;
        all.extend(columns.iter().map(|&j| j as i32));
        match is_single {
            true => single.extend(values.iter().map(|&f| f as f32)),
            false => double.extend_from_slice(&values),
        }
        starts.push(all.len() as i64);
    }
    let (single, double) = (is_single.then_some(single), (!is_single).then_some(double));
    Ok(Collected { starts, columns: all, single, double })
}

/// Triples of numbers as an array (n, 3).
pub fn triples<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    rows: impl Iterator<Item = [T; 3]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let flat: Vec<T> = rows.flatten().collect();
    let rows = flat.len() / 3;
    flat.into_pyarray(py).reshape([rows, 3])
}

/// Triangles as an array (n, 3, 3).
pub fn corners<'py>(
    py: Python<'py>,
    triangles: impl Iterator<Item = [glam::DVec3; 3]>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: Vec<f64> = triangles.flatten().flat_map(|corner| corner.to_array()).collect();
    let triangles = flat.len() / 9;
    flat.into_pyarray(py).reshape([triangles, 3, 3])
}
