//! What happened on the way to a matrix.

use serde::Serialize;

use crate::engines::{EngineReport, PairsReport};
use crate::form_factors::RowsReport;
use crate::report::Stage;

/// Scales that closure needs where form factors are right but for their noise; those outside are
/// reported.
pub const MODEST: std::ops::RangeInclusive<f64> = 0.9..=1.1;

/// Everything worth knowing about one matrix; serialises to JSON.
#[derive(Debug, Clone, Default, Serialize)]
pub struct MatrixReport {
    /// Name of the scene.
    pub scene: String,
    /// Fingerprint of its geometry, in hexadecimal.
    pub fingerprint: String,
    /// Source triangles, flagged ones included.
    pub source_triangles: usize,
    /// Rows, and columns, of the matrix before lumping.
    pub rows: usize,
    /// Triangles without area: their rows are zero.
    pub degenerate: usize,
    /// Triangles that coincide with an earlier one: their rows are zero.
    pub duplicate: usize,
    /// Triangles that let light through: their rows are zero.
    pub transparent: usize,
    /// Whether most fronts see nothing while their backs see surfaces, which have no rows: bodies
    /// seen from outside, or a room that is inside out.
    pub faces_outwards: bool,
    /// Whether the backs of triangles have rows too.
    pub two_sided: bool,
    /// Largest area of a patch in m²; none if every triangle is a patch.
    pub patch_size: Option<f64>,
    /// The engine and its options.
    pub engine: Option<EngineReport>,
    /// The account of all rows as they were made, before thinning and closure.
    pub account: Option<RowsReport>,
    /// What rows lose numerically.
    pub lost: Option<LostReport>,
    /// Rows that lose much, and where it goes; none without such rows, or if the engine does not
    /// know what escapes.
    pub losses: Option<LossesReport>,
    /// What was done to the pairs of patches, where they are evaluated one by one.
    pub pairs: Option<PairsReport>,
    /// Whether rows went through a file because they do not fit in memory.
    pub through_a_file: bool,
    /// Rows that lose more than half to backs, each with that share: something stands there.
    pub covered: Vec<NamedRow>,
    /// What was left out.
    pub threshold: Option<ThresholdReport>,
    /// How the matrix was closed.
    pub closure: Option<ClosureReport>,
    /// Form factors in the result before lumping.
    pub entries: u64,
    /// What rows were lumped by: surface, material or object.
    pub grouped_by: Option<&'static str>,
    /// How many rows they were lumped to.
    pub groups: Option<usize>,
    /// What the .npz takes, if one was written.
    pub npz: Option<NpzReport>,
    /// The stages in order, with wall-clock seconds.
    pub stages: Vec<Stage>,
    /// Bytes that the work was foretold to take.
    pub foretold_memory_bytes: u64,
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// What a file of compressed sparse rows takes, beside a dense array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct NpzReport {
    /// Bytes of the file.
    pub file_bytes: u64,
    /// Bytes of memory that its rows take where SciPy has read them.
    pub read_bytes: u64,
    /// Bytes of a dense array of the same factors, in memory and as .npy.
    pub dense_bytes: u64,
}

/// A row with the surface that it is of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedRow {
    /// The row.
    pub row: usize,
    /// Name of its surface.
    pub surface: String,
    /// What is said of it.
    pub value: f64,
}

/// What rows lose numerically: what entries, environment and backs leave of 1. It is negative where
/// they exceed it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LostReport {
    /// Area-weighted mean of its size.
    pub mean: f64,
    /// The row whose size is largest.
    pub worst: NamedRow,
}

/// Rows that lose much of what they send out.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LossesReport {
    /// How many.
    pub rows: usize,
    /// Those that lose more than 1 % to backs.
    pub to_backs: usize,
    /// Those that lose, or exceed 1 by, more than 1 % numerically.
    pub numerically: usize,
    /// Those of one-sided faces that send less than a tenth to faces, and more than half to the
    /// environment, in a model where rows on average send more than half to faces.
    pub see_hardly_any_face: usize,
    /// The worst of them, 32 at most: that of each surface first.
    pub worst: Vec<RowLoss>,
}

/// Where what a row sends out goes, as fractions that add up to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowLoss {
    /// The row.
    pub row: usize,
    /// Name of its surface.
    pub surface: String,
    /// To faces: the sum of its entries as they were made.
    pub faces: f64,
    /// To the environment.
    pub environment: f64,
    /// To backs without a row.
    pub back: f64,
    /// Lost numerically; negative where the others exceed 1.
    pub lost: f64,
    /// The surface that most of these backs are of, as far as some rays tell.
    pub backs_of: Option<String>,
}

/// What the threshold did.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ThresholdReport {
    /// Form factors below this were dropped, 0..1.
    pub below: f64,
    /// How many.
    pub dropped: u64,
}

/// What closing the matrix did.
#[derive(Debug, Clone, Serialize)]
pub struct ClosureReport {
    /// Newton steps taken.
    pub steps: usize,
    /// Largest `|Σ_j F_ij - 1|` left.
    pub residual: f64,
    /// RMS of `A_i F_ij - A_j F_ji` over RMS of `A_i F_ij` as rows were made; the mean of the two
    /// was taken.
    pub asymmetry: f64,
    /// Smallest scale of a patch.
    pub smallest_scale: f64,
    /// Largest scale of a patch.
    pub largest_scale: f64,
    /// Rows whose scale lies outside .9 to 1.1, each with it.
    pub outside: Vec<NamedRow>,
}
