//! The matrix of form factors itself, as a result: whole, closed, thinned out, lumped.
//!
//! Row i is face i of the model, whatever the light. [`make`] has a row of every patch made, one
//! entry a pair, drops tiny ones and closes enclosures if that is wanted; [`Lumped`] adds patches up to
//! named surfaces. `export` writes either.

mod held;
mod layout;
mod ledger;
mod lumped;
mod making;
mod names;
mod report;
mod stored;

use std::io;

use glam::DVec3;
use thiserror::Error;

use held::Held;
pub use held::Shelf;
pub use layout::{Face, Layout};
pub use lumped::Lumped;
pub use making::Forecast;
use making::{Made, Maker, NOT_CLOSED, TO_A_FILE, sink_failure};
use names::{Names, name_of};
pub use report::{ClosureReport, LostReport, MatrixReport, NamedRow, PairsReport, ThresholdReport};
pub use stored::{Origin, Stored, StoredError, hexadecimal};

use crate::engines::AssembleError;
use crate::form_factors::{RowAccount, close, drop_below};
use crate::patches::{Patches, PatchesError};
use crate::progress::{Cancelled, Progress};
use crate::scene::{Geometry, Side, TriangleState};
use crate::solution::{Clock, EngineOptions, LightError, amount};
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
        "--enclosure: --engine classical does not know what escapes; use --engine exact, hemicube or rays"
    )]
    NoAccount,
    /// It does not fit in memory.
    #[error(
        "the form factors of {rows} patches take about {}, {} are allowed; {remedy}", amount(*needed), amount(*allowed)
    )]
    Memory {
        /// Number of patches.
        rows: usize,
        /// Predicted need in bytes, or what they had taken already.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The caller found out from the [`Forecast`] that it does not want it.
    #[error("{0}")]
    Unwanted(String),
    /// The shelf that the caller gave failed.
    #[error(transparent)]
    Shelf(io::Error),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
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

    /// Replaces `columns`, ascending, and `values` by those of row `i`. Fails only where rows are not in
    /// memory.
    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()>;

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
#[derive(Debug)]
pub struct Matrix {
    /// The patches.
    pub patches: Patches,
    /// Which row is which patch.
    pub layout: Layout,
    held: Held,
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

/// Makes the matrix of a model in memory.
pub fn make(
    geometry: &Geometry,
    options: &MatrixOptions,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    make_where(geometry, options, &mut |_| Ok(None), progress)
}

/// Where a matrix goes that will be like this.
pub type Choice<'a> = &'a mut dyn FnMut(&Forecast) -> Result<Option<Box<dyn Shelf>>, String>;

/// Makes the matrix of a model where `shelf` says, which hears beforehand what it will be like: in
/// memory (`None`) or on a [`Shelf`]. The entries are the same. An error of it, in words for the user,
/// ends the work. A matrix that is to be closed has to be in memory.
pub fn make_where(
    geometry: &Geometry,
    options: &MatrixOptions,
    shelf: Choice<'_>,
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
    let mut maker = Maker::new(geometry, &patches, &bvh, options)?;
    let engine = maker.report(&options.engine);
    let forecast = maker.forecast(&patches, layout.len(), options.memory)?;
    clock.lap("forecast");
    let shelf = shelf(&forecast).map_err(MatrixError::Unwanted)?;
    let to_a_shelf = shelf.is_some();
    let refused = if to_a_shelf { options.enclosure } else { !forecast.fits() };
    if refused {
        return Err(MatrixError::Memory {
            rows: patches.len(),
            needed: forecast.whole,
            allowed: options.memory,
            remedy: if options.enclosure { NOT_CLOSED } else { TO_A_FILE },
        });
    }
    let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
    let made = maker.make(&patches, options, &forecast, shelf, &areas, progress)?;
    drop(maker);
    clock.lap("form factors");

    let Made { mut held, sums, covered, restored, pairs, account, lost } = made;
    let named = Names { geometry, patches: &patches, layout: &layout };
    let count = |state: TriangleState| geometry.state.iter().filter(|&&s| s == state).count();
    let mut report = MatrixReport {
        source_triangles: geometry.len(),
        rows: layout.len(),
        degenerate: count(TriangleState::Degenerate),
        duplicate: count(TriangleState::Duplicate),
        transparent: count(TriangleState::Transparent),
        two_sided: layout.faces.iter().any(|f| f.side == Side::Back),
        patch_size: options.patch_size,
        engine: Some(engine),
        account: Some(account),
        lost: lost.map(|(mean, (id, worst))| LostReport { mean, worst: named.row(id, worst) }),
        pairs,
        covered: covered.into_iter().map(|i| named.row(i, held.account(i).back)).collect(),
        through_a_file: to_a_shelf,
        ..MatrixReport::default()
    };
    let too_large = |e| sink_failure(e, patches.len(), options);
    let mut dropped = None;
    let mut scales = restored
        .filter(|_| options.threshold > 0.0)
        .map(|restored| [restored, vec![1.0; patches.len()]]);
    if let Held::Memory(factors) = &mut held {
        if options.enclosure {
            progress.stage("closure", 0);
            let closure = close(factors, &areas, options.threshold, progress)
                .map_err(|e| named.failure(e, too_large))?;
            clock.lap("closure");
            report.closure = Some(named.closure(&closure));
            dropped = Some(closure.dropped);
            scales = Some([closure.left, closure.right]);
        } else if options.threshold > 0.0 {
            let restored = drop_below(factors, options.threshold).map_err(too_large)?;
            clock.lap("threshold");
            scales = Some([restored, vec![1.0; patches.len()]]);
        }
    }
    report.threshold = (options.threshold > 0.0).then(|| ThresholdReport {
        below: options.threshold,
        dropped: dropped.unwrap_or_else(|| account.entries.saturating_sub(held.entries())),
    });
    report.entries = held.entries();
    report.stages = clock.stages;
    Ok(Matrix { patches, layout, held, sums, scales, report })
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
        self.layout.faces[i].patch.map_or(0.0, |p| self.patches.own_area(p))
    }

    /// Name of the surface of row `i`.
    #[must_use]
    pub fn name<'a>(&self, geometry: &'a Geometry, i: usize) -> &'a str {
        name_of(geometry, &self.layout, i)
    }

    /// What row `i` held beside its entries when it was made.
    #[must_use]
    pub fn account(&self, i: usize) -> RowAccount {
        let account = |p| self.held.account(p);
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
        let area = |p: crate::patches::PatchId| self.patches.own_area(p);
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
        self.held.entries()
    }

    fn precision(&self) -> Precision {
        if self.scales.is_some() { Precision::Double } else { Precision::Single }
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        columns.clear();
        values.clear();
        let Some(patch) = self.layout.faces[i].patch else { return Ok(()) };
        self.held.row(patch, |patches, factors| {
            columns.extend(patches.iter().map(|&j| self.layout.row_of(j)));
            let factors = factors.iter().map(|&f| f64::from(f));
            match &self.scales {
                None => values.extend(factors),
                Some([left, right]) => {
                    let left = left[patch.index()];
                    let scaled = patches.iter().zip(factors);
                    values.extend(scaled.map(|(&j, f)| left * f * right[j as usize]));
                }
            }
        })
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
