//! Matrices of form factors (view factors).

use std::sync::Arc;

use glam::DVec3;
use hemicube::direct::from_lamps;
use hemicube::engines::{EngineOptions, ExactOptions};
use hemicube::matrix::{Face, Layout, Lumped, Matrix, MatrixOptions, Rows, make, make_rows};
use hemicube::patches::Patches;
use hemicube::scene::{self, Lamp, Side};
use hemicube::visibility::Bvh;
use numpy::{IntoPyArray, PyArray1, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{collected, corners};
use crate::failure::Failure;
use crate::remedy;
use crate::scene::Scene;
use crate::work::run;

/// The pieces of surface that rows are of; a row has one or more.
#[pyclass(module = "hemicube._hemicube", frozen)]
pub struct Pieces {
    scene: Arc<scene::Scene>,
    patches: Patches,
    layout: Layout,
}

#[pymethods]
impl Pieces {
    /// Corners (p, 3, 3), m.
    fn corners<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let geometry = &self.scene.geometry;
        corners(
            py,
            self.layout.faces.iter().map(|face| match face.patch {
                Some(patch) => self.patches.cell(patch).corners(geometry),
                None => geometry.corners(face.triangle),
            }),
        )
    }

    /// Areas (p,), m²; 0 of those that take no part.
    fn areas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let area = |face: &Face| face.patch.map_or(0.0, |patch| self.patches.own_area(patch));
        PyArray1::from_iter(py, self.layout.faces.iter().map(area))
    }

    /// Which (p,) are backs.
    fn backs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.layout.faces.iter().map(|f| f.side == Side::Back))
    }

    /// Irradiance (p,) by parallel light from where `toward`, of length 1, points, W/m².
    #[pyo3(signature = (toward, irradiance, progress=None))]
    fn sunlight<'py>(
        &self,
        py: Python<'py>,
        toward: [f64; 3],
        irradiance: f64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = run(py, progress, |progress| {
            progress.stage("sunlight", 0);
            let mut scene = scene::Scene::clone(&self.scene);
            let direction = -DVec3::from(toward);
            let (name, irradiance) = ("sun".to_owned(), DVec3::splat(irradiance));
            scene.lamps = vec![Lamp::Directional { name, direction, irradiance }];
            let direct = from_lamps(&scene, &self.patches, &Bvh::new(&scene.geometry));
            let own = |face: &Face| face.patch.map_or(0.0, |patch| direct[patch.index()].x);
            Ok(self.layout.faces.iter().map(own).collect::<Vec<f64>>())
        })?;
        Ok(found.into_pyarray(py))
    }
}

/// What is asked of a matrix; as of `hemicube.view_factors`.
#[derive(FromPyObject)]
pub struct Options {
    error: f64,
    patch_size: Option<f64>,
    enclosure: bool,
    threshold: f64,
    rows: Option<Vec<usize>>,
    seed: u32,
    memory: u64,
}

impl Options {
    fn of_matrix(&self) -> MatrixOptions {
        MatrixOptions {
            patch_size: self.patch_size,
            engine: EngineOptions::Exact(ExactOptions {
                error: self.error,
                seed: self.seed,
                ..ExactOptions::default()
            }),
            enclosure: self.enclosure,
            threshold: self.threshold,
            // The arrays that Python gets take as much again.
            memory: self.memory / 2,
        }
    }

    fn make(
        &self,
        scene: &scene::Scene,
        progress: &dyn hemicube::Progress,
    ) -> Result<Made, Failure> {
        let options = self.of_matrix();
        let geometry = &scene.geometry;
        // Pieces of a face that a mask cuts are one row, unless faces are cut anyway.
        let by_face = self.patch_size.is_none() && !geometry.face_of.is_empty();
        let matrix = match &self.rows {
            None => make(geometry, &options, progress),
            Some(rows) if by_face => {
                let ids = geometry.ids().filter(|t| rows.contains(&(geometry.face(*t) as usize)));
                make_rows(geometry, &options, &ids.map(|t| t.index()).collect::<Vec<_>>(), progress)
            }
            Some(rows) => make_rows(geometry, &options, rows, progress),
        };
        let mut matrix = matrix.map_err(|e| remedy::of_matrix(e, &options))?;
        matrix.report.scene.clone_from(&scene.name);
        matrix.report.fingerprint = matrix.origin(geometry).fingerprint;
        let lumped = by_face.then(|| Lumped::by_face(&matrix, geometry)).transpose();
        let lumped = lumped.map_err(|e| Failure::Failed(e.to_string()))?;
        Made::new(scene, matrix, lumped, self.rows.as_deref())
    }
}

/// A matrix as Python is to hold it.
struct Made {
    starts: Vec<i64>,
    columns: Vec<i32>,
    single: Option<Vec<f32>>,
    double: Option<Vec<f64>>,
    area: Vec<f64>,
    escape: Vec<f64>,
    back: Vec<f64>,
    face: Vec<i64>,
    front: Vec<i64>,
    patches: Patches,
    layout: Layout,
    /// The row of each piece.
    row_of: Vec<i64>,
    error: f64,
    report: String,
}

impl Made {
    fn new(
        scene: &scene::Scene,
        matrix: Matrix,
        lumped: Option<Lumped>,
        wanted: Option<&[usize]>,
    ) -> Result<Self, Failure> {
        let geometry = &scene.geometry;
        let rows: &dyn Rows = lumped.as_ref().map_or(&matrix, |lumped| lumped);
        let n = rows.len();
        if let Some(row) = wanted.into_iter().flatten().find(|row| **row >= n) {
            let text = format!("rows=: there is no row {row}; the matrix has {n}, counted from 0");
            return Err(Failure::Input(text));
        }
        let which: Vec<usize> = wanted.map_or_else(|| (0..n).collect(), <[usize]>::to_vec);
        let entries = collected(rows, which.iter().copied());
        let entries = entries.map_err(|e| Failure::Failed(e.to_string()))?;
        let rest: Vec<[f64; 2]> = which.iter().map(|&i| rows.rest(i)).collect();
        let row_of: Vec<i64> = (0..matrix.len())
            .map(|i| lumped.as_ref().map_or(i, |lumped| lumped.group_of(i)) as i64)
            .collect();
        let (mut area, mut face, mut front) = (vec![0.0; n], vec![0; n], vec![0; n]);
        let fronts = matrix.layout.fronts();
        for (i, &row) in row_of.iter().enumerate() {
            let row = row as usize;
            area[row] += matrix.area(i);
            face[row] = i64::from(geometry.face(matrix.layout.faces[i].triangle));
            front[row] = row_of[fronts[i] as usize];
        }
        let error = matrix.report.pairs.map_or(0.0, |pairs| pairs.error);
        let report = serde_json::to_string(&matrix.report);
        let report = report.map_err(|e| Failure::Failed(e.to_string()))?;
        let Matrix { patches, layout, .. } = matrix;
        Ok(Self {
            starts: entries.starts,
            columns: entries.columns,
            single: entries.single,
            double: entries.double,
            area,
            escape: rest.iter().map(|r| r[0]).collect(),
            back: rest.iter().map(|r| r[1]).collect(),
            face,
            front,
            patches,
            layout,
            row_of,
            error,
            report,
        })
    }
}

/// The matrix of a scene: compressed sparse rows, and what they are of.
#[pyfunction]
#[pyo3(signature = (scene, options, progress=None))]
pub fn view_factors<'py>(
    py: Python<'py>,
    scene: &Scene,
    options: Options,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let made = run(py, progress, |progress| options.make(&scene.0, progress))?;
    let all = PyDict::new(py);
    all.set_item("starts", made.starts.into_pyarray(py))?;
    all.set_item("columns", made.columns.into_pyarray(py))?;
    match (made.single, made.double) {
        (Some(values), _) => all.set_item("values", values.into_pyarray(py))?,
        (None, values) => all.set_item("values", values.unwrap_or_default().into_pyarray(py))?,
    }
    all.set_item("escape", made.escape.into_pyarray(py))?;
    all.set_item("back", made.back.into_pyarray(py))?;
    all.set_item("face", made.face.into_pyarray(py))?;
    all.set_item("front", made.front.into_pyarray(py))?;
    all.set_item("error", made.error)?;
    all.set_item("report", made.report)?;
    let pieces = Pieces { scene: Arc::clone(&scene.0), patches: made.patches, layout: made.layout };
    all.set_item("row_of", made.row_of.into_pyarray(py))?;
    all.set_item("area", made.area.into_pyarray(py))?;
    all.set_item("pieces", Bound::new(py, pieces)?)?;
    Ok(all)
}
