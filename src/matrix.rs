//! The matrix of form factors itself, as a result: whole, closed, thinned out, lumped.
//!
//! Row i is face i of the model, whatever the light. [`make`] has a row of every patch made, one
//! entry a pair, drops tiny ones and closes enclosures if that is wanted; [`Lumped`] adds patches up to
//! named surfaces. `export` writes either.

mod layout;
mod lumped;
mod names;
mod report;
mod stored;

use glam::DVec3;
use thiserror::Error;

pub use layout::{Face, Layout};
pub use lumped::Lumped;
use names::{Names, name_of};
pub use report::{ClosureReport, MatrixReport, NamedRow, ThresholdReport};
pub use stored::{Origin, Stored, StoredError, hexadecimal};

use crate::form_factors::{
    AssembleError, BLOCK, Engine, EngineError, FormFactors, Row, RowAccount, SinkError,
    assemble_whole, close, drop_below,
};
use crate::patches::{PatchId, Patches, PatchesError};
use crate::progress::Progress;
use crate::scene::{Geometry, Part, Side};
use crate::solution::{Clock, EngineOptions, LightError, amount, rows_report};
use crate::visibility::{Bvh, COVERED, looks_inside_out, uncover};

/// How a matrix is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatrixOptions {
    /// Largest area of a patch, m². Default: every triangle of the file is a patch.
    pub patch_size: Option<f64>,
    /// Who makes the form factors.
    pub engine: EngineOptions,
    /// Whether the model is an enclosure, whose matrix is to be [closed](close).
    pub enclosure: bool,
    /// Form factors below this are left out, 0..1; 0 keeps all.
    pub threshold: f64,
    /// Bytes that the work may take.
    pub memory: u64,
}

/// Why a matrix was not made.
#[derive(Debug, Error)]
pub enum MatrixError {
    /// The model could not be subdivided.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// The engine cannot be had, or its options are wrong.
    #[error(transparent)]
    Engine(#[from] LightError),
    /// Making rows failed.
    #[error(transparent)]
    Assemble(AssembleError),
    /// The model is inside out.
    #[error(
        "most faces see nothing while their backs see surfaces: the normals point outwards; turn them round with --flip, or use --sides two"
    )]
    InsideOut,
    /// The matrix is not that of an enclosure.
    #[error(
        "--enclosure: {0} lose more than 1 % to the environment or to backs; close the gaps or turn the faces round that they see, or leave --enclosure out"
    )]
    Open(String),
    /// No scales close the matrix.
    #[error(
        "--enclosure: no scaling makes all rows sum to 1, furthest off are {0}; give more --samples or --resolution, or a lower --threshold"
    )]
    Stalled(String),
    /// The engine does not say what escapes.
    #[error(
        "--enclosure: --engine classical does not know what escapes; use --engine hemicube or rays"
    )]
    NoAccount,
    /// It does not fit in memory.
    #[error(
        "the form factors of {rows} patches take about {}, {} are allowed; allow more with --memory, or use fewer patches", amount(*needed), amount(*allowed)
    )]
    Memory {
        /// Number of patches.
        rows: usize,
        /// Predicted need in bytes, or what they had taken already.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// How exactly entries are known, and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// As engines make them.
    Single,
    /// Scaled or added up.
    Double,
}

/// A matrix row by row, as formats write it.
pub trait Rows: Sync {
    /// Number of rows, and of columns.
    fn len(&self) -> usize;

    /// Whether there is no row.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of entries that are not zero.
    fn entries(&self) -> u64;

    /// How exactly entries are known.
    fn precision(&self) -> Precision;

    /// Replaces `columns`, ascending, and `values` by those of row `i`.
    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>);

    /// What row `i` is called.
    fn label(&self, i: usize) -> String;

    /// What each row stands for.
    fn surfaces(&self, geometry: &Geometry) -> Vec<SurfaceRow>;

    /// Shares of row `i` that go with its entries as they are: to the environment, and to backs that
    /// have no row.
    fn rest(&self, i: usize) -> [f64; 2];
}

/// What a row saw when it was made, as shares of 1; the rest is lost numerically.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Account {
    /// Share that ends on sides with a row: the row's sum before closure.
    pub front: f64,
    /// Share that ends on backs that have none.
    pub back: f64,
    /// Share that escapes.
    pub environment: f64,
}

/// What a row stands for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceRow {
    /// The source triangle; `None` where several are lumped.
    pub triangle: Option<u32>,
    /// Its side; `None` likewise.
    pub side: Option<Side>,
    /// Name of the surface.
    pub name: String,
    /// m².
    pub area: f64,
    /// Metres.
    pub centroid: DVec3,
    /// Unit normal; zero without a direction.
    pub normal: DVec3,
    /// Where its light goes.
    pub account: Account,
}

/// The matrix of form factors of a model.
#[derive(Debug, Clone)]
pub struct Matrix {
    /// The patches.
    pub patches: Patches,
    /// Which row is which patch.
    pub layout: Layout,
    factors: FormFactors,
    /// Sum of each patch's row as it was made.
    sums: Vec<f64>,
    /// Of each patch, what its row and its column are multiplied with.
    scales: Option<[Vec<f64>; 2]>,
    /// How it came about.
    pub report: MatrixReport,
}

/// The patches that rows are of: whole triangles, or parts of at most `patch_size` m².
pub fn subdivide(
    geometry: &Geometry,
    bvh: &Bvh,
    patch_size: Option<f64>,
) -> Result<Patches, PatchesError> {
    let patches = Patches::uniform(geometry, patch_size.unwrap_or(f64::INFINITY))?;
    Ok(uncover(geometry, patches, bvh))
}

/// Makes the matrix of a model.
pub fn make(
    geometry: &Geometry,
    options: &MatrixOptions,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    if options.enclosure && options.engine == EngineOptions::Classical {
        return Err(MatrixError::NoAccount);
    }
    if !geometry.ids().any(|t| geometry.exchanges(t, Side::Back)) && looks_inside_out(geometry) {
        return Err(MatrixError::InsideOut);
    }
    let mut clock = Clock::start();
    let bvh = Bvh::new(geometry);
    let patches = subdivide(geometry, &bvh, options.patch_size)?;
    let layout = Layout::new(geometry, &patches);
    clock.lap("subdivide");
    let (mut factors, engine) = whole(geometry, &patches, &bvh, options, progress)?;
    clock.lap("form factors");

    let areas: Vec<f64> = patches.ids().map(|i| patches.area(i)).collect();
    let rows = rows_report(&factors, &areas);
    let sums = patches.ids().map(|i| factors.row_sum(i)).collect();
    let named = Names { geometry, patches: &patches, layout: &layout };
    let covered = patches.ids().filter(|&i| factors.account(i).back > COVERED);
    let count = |part: Part| geometry.part.iter().filter(|&&p| p == part).count();
    let mut report = MatrixReport {
        source_triangles: geometry.len(),
        rows: layout.len(),
        degenerate: count(Part::Degenerate),
        duplicate: count(Part::Duplicate),
        transparent: count(Part::Transparent),
        two_sided: layout.faces.iter().any(|f| f.side == Side::Back),
        patch_size: options.patch_size,
        engine: Some(engine),
        account: Some(rows),
        covered: covered.map(|i| named.row(i, factors.account(i).back)).collect(),
        ..MatrixReport::default()
    };
    let made = factors.entries();
    let too_large = |e| too_large(e, patches.len(), options.memory);
    let mut scales = None;
    if options.enclosure {
        progress.stage("closure", 0);
        let closure = close(&mut factors, &areas, options.threshold, progress)
            .map_err(|e| named.failure(e, too_large))?;
        clock.lap("closure");
        report.closure = Some(named.closure(&closure));
        scales = Some([closure.left, closure.right]);
    } else if options.threshold > 0.0 {
        let restored = drop_below(&mut factors, options.threshold).map_err(too_large)?;
        clock.lap("threshold");
        scales = Some([restored, vec![1.0; patches.len()]]);
    }
    report.threshold = (options.threshold > 0.0).then(|| ThresholdReport {
        below: options.threshold,
        dropped: made.saturating_sub(factors.entries()),
    });
    report.entries = factors.entries();
    report.stages = clock.stages;
    Ok(Matrix { patches, layout, factors, sums, scales, report })
}

/// The one place where the rows of a whole matrix come from: all patches, one entry a pair.
fn whole(
    geometry: &Geometry,
    patches: &Patches,
    bvh: &Bvh,
    options: &MatrixOptions,
    progress: &dyn Progress,
) -> Result<(FormFactors, crate::report::EngineReport), MatrixError> {
    let mut engine = options.engine.engine(geometry, patches, bvh, options.memory)?;
    let report = options.engine.report(&*engine);
    let room = room_for_rows(&mut *engine, patches, options.memory)?;
    progress.stage("form factors", patches.len() as u64);
    let factors = assemble_whole(&mut *engine, patches, room, progress).map_err(|e| match e {
        AssembleError::Cancelled => MatrixError::Cancelled,
        AssembleError::Sink(e) => too_large(e, patches.len(), options.memory),
        e => MatrixError::Assemble(e),
    })?;
    Ok((factors, report))
}

/// What the rows may take of the memory allowed, in bytes; refuses what a sample of rows foretells not
/// to fit.
fn room_for_rows(
    engine: &mut dyn Engine,
    patches: &Patches,
    allowed: u64,
) -> Result<u64, MatrixError> {
    /// Rows made beforehand to learn how many entries a row has.
    const SAMPLE: usize = 32;
    /// Bytes a patch takes beside its row: cells, areas, scales.
    const PATCH_BYTES: u64 = 400;
    /// Bytes of an entry.
    const ENTRY_BYTES: u64 = 8;
    let rows = patches.len();
    let step = rows.div_ceil(SAMPLE).max(1);
    let ids: Vec<PatchId> = patches.ids().step_by(step).collect();
    let mut made = vec![Row::default(); ids.len()];
    engine.fill(&ids, &mut made).map_err(|e: EngineError| MatrixError::Assemble(e.into()))?;
    let listed: usize = made.iter().map(|row| row.columns.len()).sum();
    let distinct = |row: &mut Row| {
        row.columns.sort_unstable();
        row.columns.dedup();
        row.columns.len()
    };
    let kept: usize = made.iter_mut().map(distinct).sum();
    let bytes = |entries: usize, rows: usize| {
        (ENTRY_BYTES as f64 * entries as f64 * rows as f64 / ids.len().max(1) as f64) as u64
    };
    // A block is there as it was made and as it is kept.
    let under_way = bytes(listed + 2 * kept, BLOCK.min(rows));
    let beside = PATCH_BYTES * rows as u64 + engine.bytes(rows) + under_way;
    let needed = beside + bytes(kept, rows);
    if needed > allowed {
        return Err(MatrixError::Memory { rows, needed, allowed });
    }
    Ok(allowed - beside)
}

fn too_large(_: SinkError, rows: usize, allowed: u64) -> MatrixError {
    MatrixError::Memory { rows, needed: allowed, allowed }
}

impl Matrix {
    /// What a stored file says of it.
    #[must_use]
    pub fn origin(&self, geometry: &Geometry) -> Origin {
        Origin {
            scene: self.report.scene.clone(),
            fingerprint: hexadecimal(&geometry.fingerprint()),
            patch_size: self.report.patch_size,
            engine: self.report.engine.as_ref().map_or("", |e| e.name).to_owned(),
            enclosure: self.report.closure.is_some(),
            threshold: self.report.threshold.map_or(0.0, |t| t.below),
            lumped: false,
        }
    }

    /// Area of the patch of row `i` in m²; 0 for a triangle that takes no part.
    #[must_use]
    pub fn area(&self, i: usize) -> f64 {
        self.layout.faces[i].patch.map_or(0.0, |p| self.patches.area(p))
    }

    /// Name of the surface of row `i`.
    #[must_use]
    pub fn name<'a>(&self, geometry: &'a Geometry, i: usize) -> &'a str {
        name_of(geometry, &self.layout, i)
    }

    /// What row `i` held beside its entries when it was made.
    #[must_use]
    pub fn account(&self, i: usize) -> RowAccount {
        let account = |p| self.factors.account(p);
        self.layout.faces[i].patch.map_or(RowAccount::default(), account)
    }

    /// What row `i` stands for.
    #[must_use]
    pub fn surface_row(&self, geometry: &Geometry, i: usize) -> SurfaceRow {
        let face = self.layout.faces[i];
        let corners = match face.patch {
            Some(patch) => self.patches.cell(patch).corners(geometry),
            None => geometry.corners(face.triangle),
        };
        let account = self.account(i);
        let area = |p| self.patches.area(p);
        SurfaceRow {
            triangle: Some(face.triangle.0),
            side: Some(face.side),
            name: self.name(geometry, i).to_owned(),
            area: face.patch.map_or_else(|| geometry.area(face.triangle), area),
            centroid: corners.iter().sum::<DVec3>() / 3.0,
            normal: geometry.normal(face.triangle, face.side),
            account: Account {
                front: face.patch.map_or(0.0, |p| self.sums[p.index()]),
                back: account.back,
                environment: account.environment,
            },
        }
    }
}

impl Rows for Matrix {
    fn len(&self) -> usize {
        self.layout.len()
    }

    fn entries(&self) -> u64 {
        self.factors.entries()
    }

    fn precision(&self) -> Precision {
        if self.scales.is_some() { Precision::Double } else { Precision::Single }
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) {
        columns.clear();
        values.clear();
        let Some(patch) = self.layout.faces[i].patch else { return };
        let Some(row) = self.factors.row(patch) else { return };
        columns.extend(row.columns.iter().map(|&j| self.layout.row_of(j)));
        match &self.scales {
            None => values.extend(row.entries().map(|e| e.1)),
            Some([left, right]) => {
                let left = left[patch.index()];
                values.extend(row.entries().map(|(j, f)| left * f * right[j.index()]));
            }
        }
    }

    fn label(&self, i: usize) -> String {
        i.to_string()
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        let RowAccount { environment, back, .. } = self.account(i);
        let closed = self.report.closure.is_some() && back <= COVERED;
        if closed { [0.0; 2] } else { [environment, back] }
    }

    fn surfaces(&self, geometry: &Geometry) -> Vec<SurfaceRow> {
        (0..self.len()).map(|i| self.surface_row(geometry, i)).collect()
    }
}
