//! Some rows of a matrix: for who divides the work, or asks of few faces only.

use super::entries::Matrix;
use super::error::MatrixError;
use super::layout::Layout;
use super::options::MatrixOptions;
use super::report::{MatrixReport, ThresholdReport};
use super::storage::Storage;
use super::stored::subdivide;
use crate::form_factors::{Account, FormFactors, Tallied, drop_below};
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::report::Clock;
use crate::scene::{Geometry, Side};

/// Makes these `rows` of the matrix of a model, in memory: the same as [`make`](super::make) makes
/// them. All others are empty. Closing a matrix takes all of its rows, so
/// [`MatrixOptions::enclosure`] is not used.
///
/// # Errors
/// As [`make`](super::make), and if there is no such row.
pub fn make_rows(
    geometry: &Geometry,
    options: &MatrixOptions,
    rows: &[usize],
    progress: &dyn Progress,
) -> Result<Matrix, MatrixError> {
    let mut clock = Clock::start();
    let (bvh, patches) = subdivide(geometry, options.patch_size, progress)?;
    let layout = Layout::new(geometry, &patches);
    clock.lap("subdivide");
    if let Some(&row) = rows.iter().find(|&&row| row >= layout.len()) {
        return Err(MatrixError::NoRow { row, rows: layout.len() });
    }
    let mut engine = options.engine.engine(geometry, &patches, &bvh, options.memory, progress)?;
    let patch_of = |&row: &usize| layout.faces.get(row)?.patch;
    let mut ids: Vec<PatchId> = rows.iter().filter_map(patch_of).collect();
    ids.sort_unstable();
    ids.dedup();
    progress.stage("form factors", ids.len() as u64);
    let n = patches.len();
    let mut factors = FormFactors::new(n, options.memory);
    engine.make(&ids, &mut Tallied::new(&mut factors, n), progress)?;
    let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
    let mut account = Account::new(&areas, &ids);
    account.add_all(&factors);
    let mut report = MatrixReport {
        source_triangles: geometry.faces(),
        rows: layout.len(),
        two_sided: layout.faces.iter().any(|f| f.side == Side::Back),
        patch_size: options.patch_size,
        engine: Some(options.engine.report(&*engine)),
        account: Some(account.report()),
        pairs: engine.pairs(),
        ..MatrixReport::default()
    };
    let sums = account.sums;
    drop(engine);
    clock.lap("form factors");
    let mut scales = None;
    if options.threshold > 0.0 {
        let made = factors.entries();
        let restored = drop_below(&mut factors, options.threshold)?;
        scales = Some([restored, vec![1.0; n]]);
        let dropped = made - factors.entries();
        report.threshold = Some(ThresholdReport { below: options.threshold, dropped });
        clock.lap("threshold");
    }
    report.entries = factors.entries();
    report.stages = clock.stages;
    Ok(Matrix { patches, layout, storage: Storage::Memory(factors), sums, scales, report })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::{Rows, make};
    use crate::progress::Silent;
    use crate::scene::Scene;

    #[test]
    fn some_rows_are_those_of_the_whole() {
        let scene = Scene::builtin("cornell-box").unwrap();
        let options = MatrixOptions { threshold: 1e-3, ..MatrixOptions::default() };
        let whole = make(&scene.geometry, &options, &Silent).unwrap();
        let wanted = [7, 3, 7];
        let some = make_rows(&scene.geometry, &options, &wanted, &Silent).unwrap();
        assert_eq!(some.len(), whole.len());
        let row = |matrix: &Matrix, i: usize| {
            let (mut columns, mut values) = (Vec::new(), Vec::new());
            matrix.row(i, &mut columns, &mut values).unwrap();
            (columns, values)
        };
        for i in 0..whole.len() {
            let there = wanted.contains(&i);
            let own = if there { row(&whole, i) } else { Default::default() };
            assert_eq!(row(&some, i), own, "row {i}");
            assert!(!there || some.rest(i) == whole.rest(i) && !own.0.is_empty());
        }
        assert_eq!(some.report.account.unwrap().rows, 2);
        let none = make_rows(&scene.geometry, &options, &[3, 1_000_000], &Silent).unwrap_err();
        assert!(matches!(none, MatrixError::NoRow { row: 1_000_000, .. }));
    }
}
