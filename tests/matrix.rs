//! A closed matrix, written and read back, is what solvers take: energy is conserved to their
//! residual.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use hemicube::engines::EngineOptions;
use hemicube::engines::RaysOptions;
use hemicube::export::{read_npz, write_npz};
use hemicube::matrix::{MatrixOptions, Rows, make};
use hemicube::progress::Silent;
use hemicube::scene::{Rgb, builtin};
use hemicube::solve::{Method, SolveOptions, System, solve};

const REFLECTANCE: f64 = 0.7;

#[test]
fn solvers_conserve_energy_by_a_closed_matrix_read_back() {
    let rays = EngineOptions::Rays(RaysOptions { samples: 256, ..RaysOptions::default() });
    for engine in [MatrixOptions::default().engine, rays] {
        conserves_energy(engine);
    }
}

fn conserves_energy(engine: EngineOptions) {
    let scene = builtin::build("furnace").unwrap();
    let options = MatrixOptions {
        patch_size: Some(0.02),
        engine,
        enclosure: true,
        ..MatrixOptions::default()
    };
    let matrix = make(&scene.geometry, &options, &Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.npz");
    let surfaces = matrix.surfaces(&scene.geometry);
    let origin = matrix.origin(&scene.geometry);
    write_npz(&path, &matrix, &surfaces, &origin, &Silent).unwrap();
    let stored = read_npz(&path, 1 << 30).unwrap();
    let (patches, factors) = stored.restore(&scene.geometry, 1 << 30).unwrap();
    assert_eq!((patches.len(), factors.entries()), (matrix.len(), matrix.entries()));

    // Σ A H = Σ A E / (1 - ρ) for any emission, as rows sum to 1 and exchange is mutual.
    let areas: Vec<f64> = patches.ids().map(|i| patches.area(i)).collect();
    let emission: Vec<Rgb> =
        patches.ids().map(|i| Rgb::new(1.0, f64::from(i.0 % 7), f64::from(i.0 == 3))).collect();
    let rho = vec![Rgb::splat(REFLECTANCE); patches.len()];
    let direct: Vec<Rgb> = patches.ids().map(|i| factors.gather(i, &emission)).collect();
    let system = System { factors: &factors, rho: &rho, direct: &direct, areas: &areas };
    let total = |x: &[Rgb]| -> Rgb { x.iter().zip(&areas).map(|(x, a)| *x * *a).sum() };
    let expected = total(&emission) / (1.0 - REFLECTANCE);
    for method in [Method::Direct, Method::Jacobi, Method::GaussSeidel, Method::Shooting] {
        let options = SolveOptions { method, tolerance: 1e-8, ..SolveOptions::default() };
        let (irradiance, _) = solve(&system, &options, &Silent).unwrap();
        let share = total(&irradiance) / expected;
        assert!((share - Rgb::ONE).abs().max_element() < 1e-6, "{engine:?} {method:?}: {share}");
    }
}
