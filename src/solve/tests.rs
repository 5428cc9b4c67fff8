//! Every method on small systems whose solution is known.

use super::*;
use crate::form_factors::{FormFactors, Row, RowBlock, RowSink, Weights};
use crate::patches::PatchId;
use crate::progress::Silent;

const ALL: [Method; 4] = [Method::GaussSeidel, Method::Jacobi, Method::Shooting, Method::Direct];

/// Three patches that see each other unevenly; row sums below one.
fn three() -> FormFactors {
    let one = f64::from(u32::MAX);
    let mut f = FormFactors::new(3, 1 << 20);
    let row = |entries: &[(u32, f64)]| Row {
        columns: entries.iter().map(|e| PatchId(e.0)).collect(),
        weights: Weights::Fixed(entries.iter().map(|e| (e.1 * one) as u32).collect()),
        ..Row::default()
    };
    let rows = [row(&[(1, 0.5), (2, 0.5)]), row(&[(0, 0.25), (2, 0.6)]), row(&[(0, 0.9)])];
    f.take(RowBlock::of(&[0, 1, 2].map(PatchId), &rows).unwrap()).unwrap();
    f
}

#[test]
fn every_method_solves_the_same_system() {
    let f = three();
    let rho = [Rgb::new(0.9, 0.5, 0.0), Rgb::splat(0.7), Rgb::new(0.2, 0.8, 0.6)];
    let direct = [Rgb::ZERO, Rgb::new(3.0, 0.0, 1.0), Rgb::new(0.0, 2.0, 0.0)];
    let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0, 2.0, 3.0] };
    let solutions: Vec<Vec<Rgb>> = ALL
        .into_iter()
        .map(|method| {
            let o = SolveOptions { method, tolerance: 1e-12, ..SolveOptions::default() };
            let (h, report) = solve(&system, &o, &Silent).unwrap();
            assert!(report.residual <= 1e-12);
            assert!(system.residual(&h, 1e-12).unwrap() <= 1e-12);
            h
        })
        .collect();
    for h in &solutions[1..] {
        for (a, b) in h.iter().zip(&solutions[0]) {
            assert!((*a - *b).abs().max_element() < 1e-10);
        }
    }
}

#[test]
fn running_out_of_iterations_is_an_error() {
    let f = three();
    let rho = [Rgb::splat(0.9); 3];
    let system = System { factors: &f, rho: &rho, direct: &[Rgb::ONE; 3], areas: &[1.0; 3] };
    for method in [Method::GaussSeidel, Method::Jacobi, Method::Shooting] {
        let o =
            SolveOptions { method, tolerance: 1e-14, max_iterations: 2, ..SolveOptions::default() };
        assert!(
            matches!(solve(&system, &o, &Silent), Err(SolveError::NoConvergence { .. })),
            "{method:?}"
        );
    }
}

#[test]
fn darkness_stays_dark() {
    let f = three();
    let system = System {
        factors: &f,
        rho: &[Rgb::splat(0.5); 3],
        direct: &[Rgb::ZERO; 3],
        areas: &[1.0; 3],
    };
    for method in ALL {
        let o = SolveOptions { method, ..SolveOptions::default() };
        assert_eq!(solve(&system, &o, &Silent).unwrap().0, [Rgb::ZERO; 3]);
    }
}

#[test]
fn elimination_factorises_once_for_each_distinct_reflectance() {
    let f = three();
    let direct = [Rgb::new(1.0, 2.0, 3.0); 3];
    for (rho, expected) in [([0.5; 3], 1), ([0.5, 0.25, 0.5], 2), ([0.1, 0.2, 0.3], 3)] {
        let rho = [Rgb::from_array(rho); 3];
        let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0; 3] };
        let o = SolveOptions { method: Method::Direct, ..SolveOptions::default() };
        let (_, report) = solve(&system, &o, &Silent).unwrap();
        assert_eq!(report.iterations, expected);
        assert!(report.residual < 1e-14);
    }
}

#[test]
fn patches_without_a_row_keep_their_direct_light_and_reflect_it() {
    let mut f = FormFactors::new(3, 1 << 20);
    let row = |columns: &[u32], weights: &[f32]| Row {
        columns: columns.iter().map(|&j| PatchId(j)).collect(),
        weights: Weights::Each(weights.to_vec()),
        ..Row::default()
    };
    let rows = [row(&[0, 1], &[0.5, 0.25]), row(&[2], &[0.5])];
    f.take(RowBlock::of(&[2, 0].map(PatchId), &rows).unwrap()).unwrap();
    let direct = [Rgb::splat(1.0), Rgb::splat(4.0), Rgb::ZERO];
    let rho = [Rgb::splat(0.5); 3];
    let system = System { factors: &f, rho: &rho, direct: &direct, areas: &[1.0; 3] };
    for method in ALL {
        let o = SolveOptions { method, tolerance: 1e-12, ..SolveOptions::default() };
        let (h, _) = solve(&system, &o, &Silent).unwrap();
        // h2 = .25 h0 + .125 × 4, h0 = 1 + .25 h2
        let h2 = 0.75 / (1.0 - 0.0625);
        for (h, expected) in h.iter().zip([1.0 + 0.25 * h2, 4.0, h2]) {
            assert!((h.x - expected).abs() < 1e-10, "{method:?}: {h} {expected}");
        }
    }
}

#[test]
fn what_does_not_fit_or_has_no_solution_is_refused() {
    let f = three();
    let system = System {
        factors: &f,
        rho: &[Rgb::splat(0.5); 3],
        direct: &[Rgb::ONE; 3],
        areas: &[1.0; 3],
    };
    let o = SolveOptions { method: Method::Direct, memory: 70, ..SolveOptions::default() };
    let error = solve(&system, &o, &Silent).unwrap_err();
    assert_eq!(error, SolveError::TooLarge { patches: 3, needed: 79, allowed: 70 });

    let mut closed = FormFactors::new(2, 1 << 20);
    let all = |j| Row { columns: vec![j], weights: Weights::Each(vec![1.0]), ..Row::default() };
    let rows = [all(PatchId(1)), all(PatchId(0))];
    closed.take(RowBlock::of(&[0, 1].map(PatchId), &rows).unwrap()).unwrap();
    let system =
        System { factors: &closed, rho: &[Rgb::ONE; 2], direct: &[Rgb::ONE; 2], areas: &[1.0; 2] };
    let o = SolveOptions { method: Method::Direct, ..SolveOptions::default() };
    assert!(matches!(solve(&system, &o, &Silent), Err(SolveError::NoConvergence { .. })));
}
