//! A closed matrix, written and read back, is what solvers take: energy is conserved to their
//! residual. An open one is reciprocal and accounted for as it is.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

#[path = "common/scenes.rs"]
#[allow(dead_code, reason = "each test file uses a part of it")]
mod scenes;

use std::collections::HashMap;

use glam::DVec3;
use hemicube::engines::EngineOptions;
use hemicube::engines::RaysOptions;
use hemicube::export::{read_npz, write_npz};
use hemicube::matrix::{MatrixOptions, Rows, make};
use hemicube::progress::Silent;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Rgb, Scene, Side, Sides, builtin};
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

/// Several bodies that stand free, without anything around them: a floor, a crate and a ball above
/// it, and a screen that shows some of them its back.
fn open_scene() -> Scene {
    let rectangle = scenes::rectangle;
    let floor = rectangle([[-2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]].map(DVec3::from));
    let crate_ = Mesh::cuboid(DVec3::splat(0.8), [1, 1, 1]).resting_on(0.2);
    let ball = Mesh::geodesic(0.4, 2).at(1.0, 1.0, 0.0);
    let screen = rectangle([[-1.0, 0.3, -1.0], [2.0, 0.0, 0.3], [0.0, 1.0, 0.1]].map(DVec3::from));
    let grey = |mesh| (mesh, scenes::grey(0.5, 0.0));
    scenes::scene_of([&floor, &crate_, &ball, &screen].map(grey), Sides::One)
}

#[test]
fn open_systems_are_reciprocal_and_every_row_is_accounted_for() {
    let scene = open_scene();
    for patch_size in [None, Some(0.1)] {
        let options = MatrixOptions { patch_size, ..MatrixOptions::default() };
        let matrix = make(&scene.geometry, &options, &Silent).unwrap();
        let mut exchange = HashMap::new();
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for i in 0..matrix.len() {
            matrix.row(i, &mut columns, &mut values).unwrap();
            let [environment, back] = matrix.rest(i);
            let sum = values.iter().sum::<f64>() + environment + back;
            assert!((sum - 1.0).abs() <= 1e-9, "row {i}: {sum}");
            let lost = matrix.account(i).lost;
            assert!(lost.abs() <= 1e-15, "row {i} loses {lost}");
            for (&j, f) in columns.iter().zip(&values) {
                exchange.insert((i as u32, j), matrix.area(i) * f);
            }
        }
        let account = matrix.report.account.unwrap();
        assert!(account.environment > 0.5 && account.back > 0.01, "{account:?}");
        for (&(i, j), there) in &exchange {
            let back = exchange[&(j, i)];
            // Two numbers of single precision, both rounded.
            let rounding = 2.0 * f64::from(f32::EPSILON) * there;
            assert!((there - back).abs() <= rounding, "{i} {j}: {there} {back}");
        }
    }
}

#[test]
fn cells_are_the_parts_of_triangles_that_rows_stand_for() {
    let mut scene = builtin::build("furnace").unwrap();
    let geometry = &mut scene.geometry;
    geometry.sides[..2].fill(Sides::Two);
    let cut = MatrixOptions { patch_size: Some(0.2), ..MatrixOptions::default() };
    let matrix = make(&scene.geometry, &cut, &Silent).unwrap();
    let cells = matrix.cells(&scene.geometry);
    let n = cells.triangles.len();
    assert_eq!((cells.front.len(), cells.back.len(), cells.source.len()), (n, n, n));
    assert!(n > 12 && cells.points.len() < 3 * n, "corners are shared");
    let faces = &matrix.layout.faces;
    for k in 0..n {
        let [front, back] = [cells.front[k], cells.back[k]].map(|row| row as usize);
        assert_eq!(front, k);
        assert_eq!((faces[front].triangle, faces[front].side), (cells.source[k], Side::Front));
        assert_eq!((faces[back].triangle, faces[back].side), (cells.source[k], Side::Back));
        let [a, b, c] = cells.triangles[k].map(|p| cells.points[p as usize]);
        let middle = (a + b + c) / 3.0;
        let row = matrix.surface_row(&scene.geometry, front);
        assert!((middle - row.centroid).length() < 1e-12);
        assert!(((b - a).cross(c - a).normalize() - row.normal).length() < 1e-12);
        // A back that is cut lies where its front does; one that has no part has one row.
        if faces[back].patch.is_some() {
            let back = matrix.surface_row(&scene.geometry, back);
            assert!((middle - back.centroid).length() < 1e-12);
        }
    }
    assert_eq!(faces.iter().filter(|f| f.side == Side::Back && f.patch.is_none()).count(), 10);

    let one = MatrixOptions::default();
    scene.geometry.sides.fill(Sides::One);
    let matrix = make(&scene.geometry, &one, &Silent).unwrap();
    let cells = matrix.cells(&scene.geometry);
    assert_eq!((cells.triangles.len(), cells.points.len(), cells.back.len()), (12, 8, 0));
}

#[test]
fn rows_of_faces_are_no_zone() {
    let scene = builtin::build("furnace").unwrap();
    let matrix = make(&scene.geometry, &MatrixOptions::default(), &Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zone.idf");
    let error = matrix.save(&path, &scene.geometry, &Silent).unwrap_err().to_string();
    assert!(error.contains("zone.idf") && error.contains("need names"), "{error}");
    assert!(!path.exists());
}
