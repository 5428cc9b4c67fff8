//! What happened: one tree, from the scene to the picture.

use serde::Serialize;

use crate::solve::{EnergyBalance, SolveReport};

/// Everything worth knowing about one run; serialises to `--report out.json`.
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
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Estimated standard errors of irradiance as a field over the surfaces, each relative to irradiance or 1 %
/// of its mean: what they are at most on four fifths of the lit surface. (An average would tell of
/// the darkest corners alone.)
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

/// Which engine made the form factors.
#[derive(Debug, Clone, Serialize)]
pub struct EngineReport {
    /// Its name.
    pub name: &'static str,
    /// The graphics device, if one made them; says so when it is one in software.
    pub device: Option<String>,
    /// Pixels along a hemicube's top.
    pub resolution: Option<usize>,
    /// What was projected.
    pub draw: Option<&'static str>,
    /// Rays a row.
    pub samples: Option<usize>,
    /// RMS error of form factors aimed at, as a share of their RMS.
    pub error: Option<f64>,
}

/// Account of all rows.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct RowsReport {
    /// Rows made; patches that no light can reach have none.
    pub rows: usize,
    /// Form factors stored.
    pub entries: u64,
    /// Bytes that they take.
    pub bytes: u64,
    /// Area-weighted mean share of entries.
    pub entries_share: f64,
    /// Area-weighted mean share that escapes.
    pub environment: f64,
    /// Area-weighted mean share that ends on backs which do not reflect.
    pub back: f64,
    /// Area-weighted mean share lost numerically.
    pub lost: f64,
    /// Patches most of whose view is the back of something: covered.
    pub covered: usize,
    /// RMS of `A_i F_ij - A_j F_ji` over RMS of `A_i F_ij`, over a sample of rows; `None` where rows are
    /// themselves samples.
    pub reciprocity_rms: Option<f64>,
}

/// One stage of the work.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
}
