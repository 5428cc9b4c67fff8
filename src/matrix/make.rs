//! From a model to its matrix: subdivide, have rows made, thin out, close.

use super::assembly::{Assembled, assemble};
use super::entries::Matrix;
use super::error::MatrixError;
use super::forecast::Forecast;
use super::layout::Layout;
use super::losses::losses;
use super::names::Names;
use super::options::MatrixOptions;
use super::plan::{Plan, exact_engine};
use super::report::{LostReport, MatrixReport, ThresholdReport};
use super::storage::{RowStore, Storage};
use super::stored::subdivide;
use crate::engines::{Engine, EngineOptions, FoundPairs};
use crate::form_factors::{close, drop_below};
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::report::Clock;
use crate::scene::{Geometry, Side, TriangleState};
use crate::visibility::looks_inside_out;

/// Makes the matrix of a model in memory.
///
/// # Errors
/// If the options do not suit the model or each other, or the matrix does not fit in memory.
pub fn make(
    geometry: &Geometry,
    options: &MatrixOptions,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    make_where(geometry, options, &mut |_| Ok(None), progress)
}

/// Where a matrix goes that will be like this.
pub type Choice<'a> = &'a mut dyn FnMut(&Forecast) -> Result<Option<Box<dyn RowStore>>, String>;

/// Makes the matrix of a model where `store` says, which hears beforehand what it will be like: in
/// memory (`None`) or in a [`RowStore`]. The entries are the same. An error of it, in words for the
/// user, ends the work. A matrix that is to be closed has to be in memory.
///
/// # Errors
/// As [`make`].
pub fn make_where(
    geometry: &Geometry,
    options: &MatrixOptions,
    store: Choice<'_>,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    make_of(geometry, options, None, store, progress)
}

/// Joins a matrix that was made in parts: the entries are those of [`make_where`]. The plan says
/// how large patches are and who makes the form factors; the other options say what becomes of the
/// matrix.
///
/// # Errors
/// As [`make`], and if the model or its pairs are not the plan's.
pub fn merge_where(
    geometry: &Geometry,
    (plan, found): (&Plan, &dyn FoundPairs),
    options: &MatrixOptions,
    store: Choice<'_>,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    plan.check_geometry(geometry)?;
    let engine = EngineOptions::Exact(plan.exact());
    let options = MatrixOptions { patch_size: plan.patch_size, engine, ..*options };
    make_of(geometry, &options, Some((plan, found)), store, progress)
}

/// Makes a matrix, or joins the pairs of it that were found elsewhere.
fn make_of(
    geometry: &Geometry,
    options: &MatrixOptions,
    parts: Option<(&Plan, &dyn FoundPairs)>,
    store: Choice<'_>,
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    if options.enclosure && !options.engine.knows_environment() {
        return Err(MatrixError::NoAccount);
    }
    let one_sided = !geometry.ids().any(|t| geometry.exchanges(t, Side::Back));
    // Of bodies seen from outside that is as it should be; no enclosure is like it.
    let faces_outwards = one_sided && looks_inside_out(geometry);
    if options.enclosure && faces_outwards {
        return Err(MatrixError::InsideOut);
    }
    let mut clock = Clock::start();
    let (bvh, patches) = subdivide(geometry, options.patch_size, progress)?;
    let layout = Layout::new(geometry, &patches);
    clock.lap("subdivide");
    let mut engine: Box<dyn Engine> = match parts {
        Some((plan, found)) => {
            let exact = exact_engine(geometry, (&patches, &bvh), plan.exact(), progress)?;
            plan.check(&patches, &exact)?;
            Box::new(exact.joining(found))
        }
        None => options.engine.engine(geometry, &patches, &bvh, options.memory, progress)?,
    };
    let engine_report = options.engine.report(&*engine);
    let too_large = |needed, can_go_to_a_store| {
        let (patches, allowed) = (patches.len(), options.memory);
        Err(MatrixError::Memory { patches, needed, allowed, can_go_to_a_store })
    };
    let least = Forecast::least(&*engine, &patches);
    if least > options.memory {
        return too_large(least, false);
    }
    let forecast = Forecast::new(&mut *engine, &patches, layout.len(), options.memory)?;
    clock.lap("forecast");
    let store = store(&forecast).map_err(MatrixError::Unwanted)?;
    let through_a_file = store.is_some();
    let refused = if through_a_file { options.enclosure } else { !forecast.fits() };
    if refused {
        return too_large(forecast.whole, !options.enclosure);
    }
    let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
    let assembled =
        assemble(&mut *engine, &patches, &areas, options, (&forecast, store), progress)?;
    drop(engine);
    clock.lap("form factors");

    let Assembled { mut storage, sums, covered, restored, pairs, account, lost } = assembled;
    let named = Names { geometry, patches: &patches, layout: &layout };
    let back = |i: PatchId| storage.account(i).back;
    // The sum of nothing is a negative zero.
    let accounts = patches.ids().map(|i| (i, sums[i.index()] + 0.0, storage.account(i)));
    let count = |state: TriangleState| geometry.state.iter().filter(|&&s| s == state).count();
    let mut report = MatrixReport {
        source_triangles: geometry.faces(),
        rows: layout.len(),
        degenerate: count(TriangleState::Degenerate),
        duplicate: count(TriangleState::Duplicate),
        transparent: count(TriangleState::Transparent),
        faces_outwards,
        two_sided: layout.faces.iter().any(|f| f.side == Side::Back),
        patch_size: options.patch_size,
        engine: Some(engine_report),
        account: Some(account),
        lost: lost.map(|(mean, (id, worst))| LostReport { mean, worst: named.row(id, worst) }),
        losses: losses(&named, accounts, account.entries_share, &bvh)
            .filter(|_| options.engine.knows_environment()),
        pairs,
        covered: covered.into_iter().map(|i| named.row(i, back(i))).collect(),
        through_a_file,
        foretold_memory_bytes: if through_a_file { forecast.in_blocks } else { forecast.whole },
        ..MatrixReport::default()
    };
    let mut dropped = None;
    let mut scales = restored
        .filter(|_| options.threshold > 0.0)
        .map(|restored| [restored, vec![1.0; patches.len()]]);
    if let Storage::Memory(factors) = &mut storage {
        if options.enclosure {
            progress.stage("closure", 0);
            let closure = close(factors, &areas, options.threshold, progress)
                .map_err(|e| named.failure(e))?;
            clock.lap("closure");
            report.closure = Some(named.closure(&closure));
            dropped = Some(closure.dropped);
            scales = Some([closure.left, closure.right]);
        } else if options.threshold > 0.0 {
            let restored = drop_below(factors, options.threshold)?;
            clock.lap("threshold");
            scales = Some([restored, vec![1.0; patches.len()]]);
        }
    }
    report.threshold = (options.threshold > 0.0).then(|| ThresholdReport {
        below: options.threshold,
        dropped: dropped.unwrap_or_else(|| account.entries.saturating_sub(storage.entries())),
    });
    report.entries = storage.entries();
    report.stages = clock.stages;
    Ok(Matrix { patches, layout, storage, sums, scales, report })
}
