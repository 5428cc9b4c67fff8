//! Fields of every sensible engine against random paths, which know nothing of patches.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::f64::consts::PI;

use common::engines::Kind;
use common::paths::irradiance;
use glam::{DVec2, DVec3, dvec3};
use hemicube::engines::Draw;
use hemicube::patches::SurfacePoint;
use hemicube::progress::Silent;
use hemicube::scene::builtin::{self, FURNACE_REFLECTANCE};
use hemicube::scene::{Rgb, Scene, Side};
use hemicube::solution::{LightOptions, light};
use hemicube::visibility::Bvh;

const HEMICUBE: Kind = Kind::Hemicube(Draw::Sources);

/// In the furnace every point has H = E / (1 - ρ): the mean must be that within four standard
/// errors, and these must be what they are known to be.
#[test]
fn the_furnace_has_its_irradiance() {
    let scene = builtin::build("furnace").unwrap();
    let bvh = Bvh::new(&scene.geometry);
    let exact = Rgb::splat(PI) / (Rgb::ONE - FURNACE_REFLECTANCE);
    for (point, normal) in [
        (dvec3(0.3, 0.0, 0.4), DVec3::Y),
        (dvec3(1.0, 0.99, 0.01), DVec3::NEG_X),
        (dvec3(0.5, 0.5, 0.5), dvec3(0.6, 0.0, 0.8)),
    ] {
        let (h, error) = irradiance(&scene, &bvh, point, normal, 1 << 18);
        println!("{h:.4} ± {error:.4}, exact {exact:.4}");
        assert!((h - exact).abs().cmple(4.0 * error).all(), "{h} ± {error}: {exact}");
        // Paths go on with the largest reflectance p; in its channel one that lands n times brings
        // n E, and n has the standard deviation √p / (1 - p).
        let p = FURNACE_REFLECTANCE.max_element();
        let deviation = PI * p.sqrt() / (1.0 - p) / f64::from(1 << 18).sqrt();
        assert!((error.z / deviation - 1.0).abs() < 0.02, "{} {deviation}", error.z);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = builtin::build("cornell-box").unwrap();
    let bvh = Bvh::new(&scene.geometry);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| irradiance(&scene, &bvh, dvec3(2.0, 0.0, 1.0), DVec3::Y, 20_000))
    };
    assert!(run(1) == run(3));
}

/// Compares the fields of engines, each with its patch size, with paths at points of surfaces, well
/// away from borders of shadows, which patches blur. They may differ by the fraction `tolerance`,
/// what patches of that size cost, and four standard errors.
fn compare(scene: &Scene, engines: &[(Kind, f64)], points: &[DVec3], paths: u32, tolerance: f64) {
    let bvh = Bvh::new(&scene.geometry);
    let truth: Vec<_> = points
        .iter()
        .map(|&place| {
            let point = on_surface(scene, place);
            let normal = scene.geometry.normal(point.triangle, point.side);
            let position = point.position(&scene.geometry);
            (place, point, irradiance(scene, &bvh, position, normal, paths))
        })
        .collect();
    for &(kind, patch_size) in engines {
        let (patch_size, engine) = (Some(patch_size), kind.options());
        let options = LightOptions { patch_size, engine, ..LightOptions::default() };
        let solution = light(scene, &options, &Silent).unwrap();
        let field = solution.field(scene);
        for &(place, point, (exact, error)) in &truth {
            let h = field.at(point);
            let off = 100.0 * (h / exact - Rgb::ONE);
            println!("{kind:?} {place}: field {h:.3}, paths {exact:.3} ± {error:.3}: {off:.2} %");
            let allowed = tolerance * exact + 4.0 * error;
            assert!(
                (h - exact).abs().cmple(allowed).all(),
                "{kind:?} {place}: {h}, {exact} ± {error}"
            );
        }
    }
}

/// The front that a point in space lies on.
fn on_surface(scene: &Scene, place: DVec3) -> SurfacePoint {
    let g = &scene.geometry;
    let on = |t| {
        let [a, b, c] = g.corners(t);
        let plane = glam::DMat3::from_cols(b - a, c - a, g.normal(t, Side::Front));
        let [u, v, height] = (plane.inverse() * (place - a)).to_array();
        let inside = height.abs() < 1e-6 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        inside.then(|| SurfacePoint { triangle: t, side: Side::Front, uv: DVec2::new(u, v) })
    };
    g.ids().find_map(on).unwrap()
}

#[test]
fn the_cornell_box_has_the_irradiance_of_its_paths() {
    let points = [
        dvec3(1.0, 0.0, 4.0),
        dvec3(4.4, 0.0, 1.4),
        dvec3(1.6, 1.65, 1.5),
        dvec3(0.0, 2.5, 2.8),
        dvec3(5.56, 3.0, 2.0),
        dvec3(2.0, 2.5, 5.592),
        dvec3(1.0, 5.488, 2.8),
    ];
    let scene = builtin::build("cornell-box").unwrap();
    let engines = [(HEMICUBE, 0.04), (Kind::Rays, 0.04), (Kind::Exact, 0.1)];
    compare(&scene, &engines, &points, 1 << 21, 0.02);
}

#[test]
fn the_room_has_the_irradiance_of_its_paths() {
    let points = [
        dvec3(1.0, 0.0, 4.0),
        dvec3(2.0, 0.0, 4.6),
        dvec3(4.9, 0.0, 2.5),
        dvec3(0.0, 1.5, 2.5),
        dvec3(6.0, 1.2, 3.0),
        dvec3(1.0, 3.0, 2.5),
    ];
    let scene = builtin::build("room").unwrap();
    // A mean over a patch beside the bookcase is another thing than the view from its centre:
    // patches for rays must be as small as what shades them.
    compare(&scene, &[(HEMICUBE, 0.06), (Kind::Rays, 0.01)], &points, 1 << 20, 0.03);
}
