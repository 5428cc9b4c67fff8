//! Closure of matrices whose scales are known, of unsymmetric ones, and of ones that have none.

use proptest::prelude::*;

use super::*;
use crate::form_factors::{Row, RowBlock, RowSink, Weights};
use crate::progress::Silent;

/// A matrix of dense rows, zeros left out, with `back` of each row.
fn matrix(rows: &[Vec<f64>], back: &[f64]) -> FormFactors {
    let n = rows.len();
    let row = |i: usize| {
        let entries = || (0..).map(PatchId).zip(&rows[i]).filter(|e| *e.1 > 0.0);
        Row {
            columns: entries().map(|e| e.0).collect(),
            weights: Weights::Each(entries().map(|e| *e.1 as f32).collect()),
            back: back[i],
            ..Row::default()
        }
    };
    let mut f = FormFactors::new(n, 1 << 24);
    let ids: Vec<PatchId> = (0..n as u32).map(PatchId).collect();
    let rows: Vec<Row> = (0..n).map(row).collect();
    f.take(RowBlock::of(&ids, &rows).unwrap()).unwrap();
    f
}

/// The closed form factors, dense.
fn dense(f: &FormFactors, c: &Closure) -> Vec<Vec<f64>> {
    let rows = f.plain_rows();
    let n = rows.len();
    let mut all = vec![vec![0.0; n]; n];
    for (i, (columns, weights)) in rows.iter().enumerate() {
        for (&j, &w) in columns.iter().zip(*weights) {
            all[i][j.index()] = c.left[i] * f64::from(w) * c.right[j.index()];
        }
    }
    all
}

fn check_closed(f: &FormFactors, c: &Closure, areas: &[f64], taken: impl Fn(usize) -> bool) {
    let all = dense(f, c);
    for i in 0..areas.len() {
        let sum: f64 = all[i].iter().sum();
        assert!((sum - if taken(i) { 1.0 } else { 0.0 }).abs() <= 1.01e-9, "row {i}: {sum}");
        for j in 0..areas.len() {
            let (there, back) = (areas[i] * all[i][j], areas[j] * all[j][i]);
            assert!((there - back).abs() <= 1e-15 * there, "{i} {j}: {there} {back}");
        }
    }
}

/// Any positive matrix with a few zeros.
fn any_rows() -> impl Strategy<Value = (Vec<Vec<f64>>, Vec<f64>)> {
    (4..20_usize).prop_flat_map(|n| {
        let rows = prop::collection::vec(prop::collection::vec(0.02..1.0_f64, n), n);
        (rows, prop::collection::vec(0.5..2.0_f64, n), 0..n, 0..n).prop_map(
            |(mut rows, areas, a, b)| {
                rows[a][b] = 0.0;
                for row in &mut rows {
                    let sum: f64 = row.iter().sum();
                    row.iter_mut().for_each(|f| *f /= sum);
                }
                (rows, areas)
            },
        )
    })
}

proptest! {
    #[test]
    fn any_enclosure_closes_and_is_reciprocal((rows, areas) in any_rows()) {
        let n = rows.len();
        let mut f = matrix(&rows, &vec![0.0; n]);
        let closure = close(&mut f, &areas, 0.0, &Silent).unwrap();
        check_closed(&f, &closure, &areas, |_| true);
        let all = dense(&f, &closure);
        for (i, row) in rows.iter().enumerate() {
            for j in 0..n {
                let known = row[j] > 0.0 || rows[j][i] > 0.0;
                prop_assert_eq!(all[i][j] > 0.0, known, "{} {}", i, j);
            }
        }
    }

    #[test]
    fn what_is_consistent_stays_as_it_is((rows, areas) in any_rows()) {
        let mut f = matrix(&rows, &vec![0.0; rows.len()]);
        let closure = close(&mut f, &areas, 0.0, &Silent).unwrap();
        let all = dense(&f, &closure);
        let mut again = matrix(&all, &vec![0.0; rows.len()]);
        let closure = close(&mut again, &areas, 0.0, &Silent).unwrap();
        prop_assert!(closure.asymmetry < 1e-6);
        for d in &closure.right {
            prop_assert!((d - 1.0).abs() < 1e-6, "{}", d);
        }
    }
}

#[test]
fn close_plates_between_narrow_walls_take_few_steps() {
    // Two plates that see each other but for 1 part in 10,000, which walls see: Sinkhorn's method
    // needs tens of thousands of sweeps here.
    let e = 1e-4;
    let rows = [vec![0.0, 1.0 - e, e], vec![1.01 - e, 0.0, e], vec![0.5, 0.5, 0.0]];
    let areas = [1.0, 1.0, 2.0 * e];
    let mut f = matrix(&rows, &[0.0; 3]);
    let closure = close(&mut f, &areas, 0.0, &Silent).unwrap();
    check_closed(&f, &closure, &areas, |_| true);
    assert!(closure.steps < 12, "{}", closure.steps);
}

#[test]
fn covered_rows_are_zero_and_named() {
    let rows = [
        vec![0.0, 0.6, 0.4, 0.02],
        vec![0.5, 0.0, 0.5, 0.0],
        vec![0.45, 0.55, 0.0, 0.0],
        vec![0.01, 0.0, 0.0, 0.0],
    ];
    let mut f = matrix(&rows, &[0.0, 0.0, 0.0, 0.99]);
    let areas = [1.0, 1.0, 1.0, 3.0];
    let closure = close(&mut f, &areas, 0.0, &Silent).unwrap();
    assert_eq!(closure.covered, [PatchId(3)]);
    check_closed(&f, &closure, &areas, |i| i < 3);
}

#[test]
fn open_rows_are_refused() {
    let rows = [vec![0.0, 0.97], vec![1.0, 0.0]];
    let mut f = matrix(&rows, &[0.03, 0.0]);
    let error = close(&mut f, &[1.0, 1.0], 0.0, &Silent).unwrap_err();
    let ClosureError::Open(open) = error else { panic!("{error}") };
    assert_eq!(open.len(), 1);
    assert_eq!(open[0].0, PatchId(0));
}

#[test]
fn what_no_scaling_closes_is_refused() {
    // The first sees only the second, which is smaller: some of its light has nowhere to go.
    let rows = [vec![0.0, 1.0, 0.0], vec![0.9, 0.0, 0.1], vec![0.0, 1.0, 0.0]];
    let mut f = matrix(&rows, &[0.0; 3]);
    let error = close(&mut f, &[2.0, 1.0, 0.5], 0.0, &Silent).unwrap_err();
    assert!(matches!(&error, ClosureError::Stalled(rows) if !rows.is_empty()), "{error}");
    // A row without entries is one of those.
    let mut f = matrix(
        &[vec![0.0, 1.0], vec![1.0, 0.0], vec![0.0, 0.0]].map(|mut r| {
            r.resize(3, 0.0);
            r
        }),
        &[0.0; 3],
    );
    let error = close(&mut f, &[1.0; 3], 0.0, &Silent).unwrap_err();
    let ClosureError::Stalled(rows) = error else { panic!("{error}") };
    assert_eq!(rows, [(PatchId(2), 0.0)]);
}

#[test]
fn dropped_pairs_leave_a_closed_and_reciprocal_matrix() {
    let n = 12;
    let near = |i: usize, j: usize| if i == j { 0.0 } else { (i.abs_diff(j) as f64).powi(-2) };
    let rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let sum: f64 = (0..n).map(|j| near(i, j)).sum();
            (0..n).map(|j| near(i, j) / sum).collect()
        })
        .collect();
    let mut f = matrix(&rows, &vec![0.0; n]);
    let areas = vec![1.0; n];
    let before = f.entries();
    let closure = close(&mut f, &areas, 0.02, &Silent).unwrap();
    assert!(f.entries() < before, "{before}");
    check_closed(&f, &closure, &areas, |_| true);
}
