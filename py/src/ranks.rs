//! Light by several processes, which speak to each other through what Python gives.

use std::path::PathBuf;
use std::sync::Arc;

use hemicube::export::{RowFolder, can_write, write_hemi};
use hemicube::ranks::{Communicator, Ranks, RanksError};
use hemicube::solution::Work;
use hemicube::store::sources;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

use crate::failure::Failure;
use crate::light::Asked;
use crate::remedy;
use crate::scene::Scene;
use crate::work::run;

/// `hemicube.mpi.Communicator`. Python is held for its calls alone.
#[derive(Debug)]
struct Spoken {
    rank: usize,
    size: usize,
    by: Py<PyAny>,
}

impl Spoken {
    fn of(by: &Bound<'_, PyAny>) -> PyResult<Self> {
        let number = |name| by.getattr(name)?.extract();
        Ok(Self { rank: number("rank")?, size: number("size")?, by: by.clone().unbind() })
    }

    fn call(&self, name: &str, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        Python::attach(|py| {
            let found = self.by.call_method1(py, name, (PyBytes::new(py, own),))?;
            let found: Vec<PyBackedBytes> = found.extract(py)?;
            Ok(found.iter().map(|bytes| bytes.to_vec()).collect())
        })
        .map_err(|e: PyErr| RanksError::Unreachable(e.to_string()))
    }
}

impl Communicator for Spoken {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn all_gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        self.call("all_gather", own)
    }

    fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        self.call("gather", own)
    }
}

/// Solves a scene for each of its sources, and writes `output`; rows are kept beside it meanwhile.
/// All ranks call it; yields what happened, as JSON.
#[pyfunction]
#[pyo3(signature = (scene, asked, output, communicator, progress=None))]
pub fn solve_shared(
    py: Python<'_>,
    scene: &Scene,
    asked: Asked,
    output: PathBuf,
    communicator: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let (scene, options) = (Arc::clone(&scene.0), asked.options());
    let ranks = Ranks::of(Arc::new(Spoken::of(communicator)?));
    run(py, progress, |progress| {
        if ranks.is_first() {
            can_write(&output).map_err(remedy::of_export)?;
        }
        let found = sources(&scene, &[]).map_err(|e| Failure::Input(e.to_string()))?;
        if found.is_empty() {
            return Err(remedy::of_darkness(&scene));
        }
        let folder = RowFolder::beside(&output);
        let work = Work { ranks: ranks.clone(), kept: Some(&folder) };
        let solved = scene.solve_shared(found, &options, &work, progress);
        let (store, factors) = solved.map_err(remedy::of_light)?;
        write_hemi(&output, &scene, &store, &factors, progress).map_err(remedy::of_export)?;
        let unreachable = |e: RanksError| Failure::Failed(e.to_string());
        let own = [factors.own_rows() as u64, folder.taken_up()];
        let all = ranks.every(own).map_err(unreachable)?;
        if ranks.is_first() {
            folder.remove().map_err(remedy::of_export)?;
        }
        let mut report = serde_json::to_value(store.report(&scene))
            .map_err(|e| Failure::Failed(e.to_string()))?;
        report["ranks"] = serde_json::json!({
            "rows": all.iter().map(|n| n[0]).collect::<Vec<_>>(),
            "taken_up": all.iter().map(|n| n[1]).sum::<u64>(),
        });
        Ok(report.to_string())
    })
}
