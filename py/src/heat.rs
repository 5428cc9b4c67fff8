//! Heat by radiation, of matrices that Python holds.

use hemicube::heat::{
    self as library, Condition, Exchange, HeatBalance, HeatError, HeatInput, Sunlight, balance,
};
use hemicube::matrix::{Rows, SurfaceRow};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::PyMatrix;
use crate::failure::Failure;
use crate::remedy;
use crate::work::run;

/// What is known of rows (n,) and nodes (k,).
#[derive(FromPyObject)]
pub struct Given<'py> {
    emissivity: PyReadonlyArray1<'py, f64>,
    node_of: PyReadonlyArray1<'py, u32>,
    /// Of each node its temperature, K, or nan.
    temperature: PyReadonlyArray1<'py, f64>,
    /// Of each node the heat supplied to it where it has no temperature, W.
    supplied: PyReadonlyArray1<'py, f64>,
    environment: Option<f64>,
    absorptance: PyReadonlyArray1<'py, f64>,
    /// Of each row, W/m², if there is sunlight.
    sunlight: Option<PyReadonlyArray1<'py, f64>>,
    diffuse: f64,
    error: f64,
    memory: u64,
}

/// Temperatures and fluxes that settle, as arrays by name.
#[pyfunction]
#[pyo3(signature = (matrix, given, progress=None))]
pub fn heat<'py>(
    py: Python<'py>,
    matrix: PyMatrix<'py>,
    given: Given<'py>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let csr = matrix.csr()?;
    let [emissivity, absorptance] = [given.emissivity.as_slice()?, given.absorptance.as_slice()?];
    let nodes = given.temperature.as_slice()?.iter().zip(given.supplied.as_slice()?);
    let conditions: Vec<Condition> = nodes
        .map(|(t, q)| if t.is_nan() { Condition::Heat(*q) } else { Condition::Temperature(*t) })
        .collect();
    let node_of = given.node_of.as_slice()?;
    let direct = given.sunlight.as_ref().map(|s| s.as_slice()).transpose()?;
    let (environment, diffuse, error, memory) =
        (given.environment, given.diffuse, given.error, given.memory);
    let found = run(py, progress, |progress| {
        let whose = |e: HeatError| Failure::of(e, |e| remedy::of_heat(&e, node_of));
        let exchange = Exchange::new(&csr, csr.areas, environment.is_some(), memory, progress);
        let exchange = exchange.map_err(whose)?;
        let surface_of: Vec<u32> = (0..csr.len() as u32).collect();
        let input = HeatInput {
            exchange: &exchange,
            emissivity,
            node_of,
            conditions: &conditions,
            environment,
            sunlight: direct.map(|direct| Sunlight { absorptance, direct, diffuse }),
            surface_of: &surface_of,
            surfaces: csr.len(),
            error,
        };
        balance(&input, progress).map_err(whose)
    })?;
    settled(py, &found)
}

fn settled<'py>(py: Python<'py>, found: &HeatBalance) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let sides = || found.sides.iter();
    let columns: [(&str, Vec<f64>); 7] = [
        ("flux", sides().map(|s| s.net()).collect()),
        ("temperature", sides().map(|s| s.temperature.unwrap_or(f64::NAN)).collect()),
        ("radiosity", sides().map(|s| s.radiosity).collect()),
        ("irradiance", sides().map(|s| s.irradiance).collect()),
        ("sunlight", sides().map(|s| s.sunlight).collect()),
        ("flux_error", sides().map(|s| s.flux_error).collect()),
        ("temperature_error", sides().map(|s| s.temperature_error).collect()),
    ];
    for (name, values) in columns {
        all.set_item(name, values.into_pyarray(py))?;
    }
    all.set_item("supplied", found.supplied)?;
    all.set_item("removed", found.removed)?;
    all.set_item("to_environment", found.to_environment)?;
    all.set_item("imbalance", found.imbalance)?;
    all.set_item("left_out", found.left_out)?;
    Ok(all)
}

/// Gebhart factors (n, n).
#[pyfunction]
#[pyo3(signature = (matrix, emissivity, environment, memory, progress=None))]
pub fn gebhart<'py>(
    py: Python<'py>,
    matrix: PyMatrix<'py>,
    emissivity: PyReadonlyArray1<'py, f64>,
    environment: bool,
    memory: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let csr = matrix.csr()?;
    let emissivity = emissivity.as_slice()?;
    let n = csr.len();
    let dense = run(py, progress, |progress| {
        let whose = |e: HeatError| Failure::of(e, |e| remedy::of_heat(&e, &[]));
        let exchange = Exchange::new(&csr, csr.areas, environment, memory, progress);
        let exchange = exchange.map_err(whose)?;
        let surfaces = vec![SurfaceRow::default(); n];
        let left = memory.saturating_sub(exchange.bytes());
        let found = library::gebhart(&exchange, emissivity, surfaces, left, progress);
        let found = found.map_err(whose)?;
        let mut dense = vec![0.0; n * n];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for (i, row) in dense.chunks_exact_mut(n.max(1)).enumerate() {
            let read = found.row(i, &mut columns, &mut values);
            read.map_err(|e| Failure::Failed(e.to_string()))?;
            columns.iter().zip(&values).for_each(|(&j, f)| row[j as usize] = *f);
        }
        Ok(dense)
    })?;
    dense.into_pyarray(py).reshape([n, n])
}

/// Rows lumped to `groups` by the group (n,) of each, as arrays by name.
#[pyfunction]
pub fn lump<'py>(
    py: Python<'py>,
    matrix: PyMatrix<'py>,
    group_of: PyReadonlyArray1<'py, i64>,
    groups: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let csr = matrix.csr()?;
    let group_of = group_of.as_slice()?;
    let rows = run(py, None, |progress| {
        let mut members = vec![Vec::new(); groups];
        group_of.iter().enumerate().for_each(|(i, &group)| members[group as usize].push(i));
        let lump = |rows: &Vec<usize>| {
            progress.advance(0)?;
            Ok(csr.mean(rows, group_of, groups))
        };
        members.par_iter().map(lump).collect::<Result<Vec<_>, Failure>>()
    })?;
    let (mut starts, mut columns, mut values) = (vec![0_i64], Vec::new(), Vec::new());
    for (own, factors) in rows {
        columns.extend(own);
        values.extend(factors);
        starts.push(columns.len() as i64);
    }
    let all = PyDict::new(py);
    all.set_item("starts", starts.into_pyarray(py))?;
    all.set_item("columns", columns.into_pyarray(py))?;
    all.set_item("values", values.into_pyarray(py))?;
    Ok(all)
}
