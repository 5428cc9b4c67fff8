//! What happened: one tree, from the scene to the picture.

use std::time::Instant;

use serde::Serialize;

use crate::engines::EngineReport;
use crate::form_factors::RowsReport;
use crate::solve::{EnergyBalance, SolveReport};

/// Everything worth knowing about one run; serialises to JSON.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Name of the scene.
    pub scene: String,
    /// Source triangles, flagged ones included.
    pub source_triangles: usize,
    /// Patches, with and without a row.
    pub patches: usize,
    /// How many of them join several source triangles.
    pub clusters: usize,
    /// Largest area of a patch, m².
    pub patch_size: f64,
    /// The engine and its options.
    pub engine: Option<EngineReport>,
    /// The matrix of form factors.
    pub rows: Option<RowsReport>,
    /// The solution.
    pub solve: Option<SolveReport>,
    /// How well irradiance is known, once somebody asked for it.
    pub error: Option<ErrorReport>,
    /// Where the light went.
    pub energy: Option<EnergyBalance>,
    /// The stages in order, with wall-clock seconds.
    pub stages: Vec<Stage>,
    /// Bytes that the work was foretold to take.
    pub foretold_memory_bytes: Option<u64>,
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Estimated standard errors of irradiance as a field over the surfaces, each relative to
/// irradiance or 1 % of its mean: what they are at most on four fifths of the lit surface. (An
/// average would tell of the darkest corners alone.)
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorReport {
    /// All of it: the sum of both, patch by patch.
    pub total: f64,
    /// What is due to sampling.
    pub noise: f64,
    /// What is due to the size of patches.
    pub refinement: f64,
    /// All of it, at most on half of the surface.
    pub half: f64,
}

/// One stage of the work.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// Seconds of one stage after the other.
pub(crate) struct Clock {
    last: Instant,
    pub(crate) stages: Vec<Stage>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        self.stages.push(Stage { name, seconds: self.last.elapsed().as_secs_f64() });
        self.last = Instant::now();
    }
}
