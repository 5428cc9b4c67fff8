//! Lamps in closed cubes, for which the answer is known: CIE 171:2006 and others.
//!
//! In a closed room of one reflectance ρ and area S, with lamps of flux Φ in it, the mean
//! irradiance of the walls is
//!
//! ```text
//! H = Φ / (S (1 - ρ))
//! ```

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec2Swizzles as _};
use hemicube::engines::EngineOptions;
use hemicube::engines::{Draw, ExactOptions, HemicubeOptions, RaysOptions};
use hemicube::patches::{Patches, SurfacePoint};
use hemicube::progress::Silent;
use hemicube::scene::builtin::closed_room;
use hemicube::scene::{Lamp, Photometry, Rgb, Scene, Side, ies};
use hemicube::solution::{LightOptions, Solution, light};

/// A closed cube of edge `size` (m) and reflectance `rho`, with a lamp of `candela` in the centre.
fn cube(size: f64, rho: f64, candela: f64) -> Scene {
    let room = DVec3::splat(size);
    let mut scene = closed_room("cube", room, Rgb::splat(rho), [Rgb::ZERO; 6]);
    let (position, intensity) = (0.5 * room, Rgb::splat(candela));
    let name = "lamp".into();
    scene.lamps =
        vec![Lamp::Point { name, position, intensity, x_axis: DVec3::X, photometry: None }];
    scene
}

/// Hemicubes, rays, and exact form factors.
fn engines() -> [EngineOptions; 3] {
    let rows = RaysOptions { samples: 1024, seed: 0 };
    [
        EngineOptions::Hemicube(HemicubeOptions { resolution: 64, draw: Draw::Sources }),
        EngineOptions::Rays(rows),
        EngineOptions::Exact(ExactOptions::default()),
    ]
}

fn solve(scene: &Scene, patch_size: f64, engine: EngineOptions) -> Solution {
    let options = LightOptions { patch_size: Some(patch_size), engine, ..LightOptions::default() };
    light(scene, &options, &Silent).unwrap()
}

/// The area-weighted mean of the irradiance of the patches for which `which` holds.
fn mean(solution: &Solution, which: impl Fn(&Patches, usize) -> bool) -> f64 {
    let patches = &solution.patches;
    let (mut sum, mut area) = (0.0, 0.0);
    for id in patches.ids().filter(|i| which(patches, i.index())) {
        sum += patches.area(id) * solution.irradiance[id.index()].x;
        area += patches.area(id);
    }
    sum / area
}

/// Test case 5.8 of CIE 171:2006: 4 m, reflectance .5, a lamp of 10 klm: 208.333 lx on average.
#[test]
fn cie_171_case_5_8_interreflection_in_a_closed_cube() {
    let scene = cube(4.0, 0.5, 10_000.0 / (4.0 * PI));
    let cases = [(0.5, 0.01), (0.04, 0.002)];
    for ((patch_size, tolerance), engine) in cases.iter().flat_map(|c| engines().map(|e| (*c, e))) {
        let solution = solve(&scene, patch_size, engine);
        let got = mean(&solution, |_, _| true);
        let error = got / (10_000.0 / (96.0 * 0.5)) - 1.0;
        println!("{} patches: {got:.3} lx, error {:.3} %", solution.patches.len(), 100.0 * error);
        assert!(error.abs() < tolerance, "{engine:?}: {got} lx");
    }
}

/// The same flux from a luminaire that shines only downwards, with the cosine.
#[test]
fn the_mean_does_not_depend_on_the_photometry() {
    let mut scene = cube(4.0, 0.5, 1.0);
    assert!(scene.set_photometry("lamp", diffuse(10_000.0)));
    for engine in engines() {
        let solution = solve(&scene, 0.04, engine);
        let got = mean(&solution, |_, _| true);
        println!("{got:.3} lx");
        assert!((got / (10_000.0 / (96.0 * 0.5)) - 1.0).abs() < 0.005, "{got} lx");
        // All of the ceiling's light was reflected.
        let ceiling = mean(&solution, |p, i| {
            let cell = p.cell(hemicube::patches::PatchId(i as u32));
            scene.geometry.normal(cell.triangle, Side::Front).y < -0.5
        });
        assert!(ceiling > 50.0 && ceiling < 0.8 * got, "{ceiling} lx");
    }
}

/// A diffuse luminaire of so many lumens: I = Φ / π cos γ.
fn diffuse(lumens: f64) -> Photometry {
    let words = |f: &dyn Fn(f64) -> f64| -> String {
        (0..=90).map(|a| format!("{:.3} ", f(f64::from(a)))).collect()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diffuse.ies");
    let text = format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 {lumens} {} 91 1 1 2 0 0 0 1 1 50\n{}\n0\n{}",
        lumens / PI / 1000.0,
        words(&|a| a),
        words(&|a| 1000.0 * a.to_radians().cos())
    );
    std::fs::write(&path, text).unwrap();
    ies::read(&path).unwrap()
}

/// CUBE of A. Khodulev and E. Kopylov (1996), "Physically accurate lighting simulation in computer
/// graphics software": 10 m, reflectance 2/3, a lamp of 50,000 cd: 666.667 cd/m² on average.
#[test]
fn cube_of_khodulev_and_kopylov() {
    let scene = cube(10.0, 2.0 / 3.0, 50_000.0);
    // Hemicubes and exact factors see all walls alike, but for rounding; rays with noise.
    for (engine, apart) in engines().into_iter().zip([0.005, 0.01, 0.005]) {
        cube_by(&scene, engine, apart);
    }
}

fn cube_by(scene: &Scene, engine: EngineOptions, apart: f64) {
    let solution = solve(scene, 0.25, engine);
    let luminance = |h: f64| h * 2.0 / 3.0 / PI;
    let got = luminance(mean(&solution, |_, _| true));
    println!("{} patches: {got:.2} cd/m²", solution.patches.len());
    assert!((got / 666.667 - 1.0).abs() < 0.002, "{got} cd/m²");

    // All walls are alike, and so are the four quarters of each.
    let field = solution.field(scene);
    let g = &scene.geometry;
    let at = |place: DVec2| -> Vec<f64> {
        let mut values = Vec::new();
        for t in g.ids() {
            let [a, b, c] = g.corners(t);
            let axis = g.normal(t, Side::Front).abs().max_position();
            for k in 0..8 {
                let signs = DVec2::new([1.0, -1.0][k & 1], [1.0, -1.0][k >> 1 & 1]);
                let flat = signs * if k & 4 == 0 { place } else { place.yx() };
                let mut p = DVec3::splat(5.0);
                p[(axis + 1) % 3] += flat.x;
                p[(axis + 2) % 3] += flat.y;
                p[axis] = a[axis];
                let plane = glam::DMat3::from_cols(b - a, c - a, g.normal(t, Side::Front));
                let uv = (plane.inverse() * (p - a)).truncate();
                if uv.min_element() >= 0.0 && uv.x + uv.y <= 1.0 {
                    let point = SurfacePoint { triangle: t, side: Side::Front, uv };
                    values.push(luminance(field.at(point).x));
                }
            }
        }
        values
    };
    for (name, place) in [
        ("centre", DVec2::new(0.1, 0.2)),
        ("between", DVec2::new(1.9, 3.1)),
        ("edge", DVec2::new(4.6, 0.7)),
        ("corner", DVec2::new(4.7, 4.5)),
    ] {
        let values = at(place);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let worst = values.iter().map(|v| (v / mean - 1.0).abs()).fold(0.0, f64::max);
        println!(
            "{name}: {mean:.1} cd/m² at {} points, {:.2} % apart",
            values.len(),
            100.0 * worst
        );
        assert_eq!(values.len(), 48, "{name}");
        assert!(worst < apart, "{name}: {values:?}");
    }
}
