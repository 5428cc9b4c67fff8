//! Fields of every sensible engine against random paths, which know nothing of patches.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::f64::consts::PI;

use common::engines::Kind;
use common::paths::{Paths, irradiance};
use common::scenes::{grey, rectangle, scene_of};
use glam::{DVec2, DVec3, dvec3};
use hemicube::engines::Draw;
use hemicube::patches::SurfacePoint;
use hemicube::progress::Silent;
use hemicube::scene::builtin::{self, FURNACE_REFLECTANCE};
use hemicube::scene::{Camera, Lamp, Rgb, Scene, Side, Sides, luminance};
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

/// Every surface of the furnace emits, so each point of it counts by either way that leads there.
#[test]
fn led_paths_have_the_irradiance_of_the_furnace() {
    let scene = builtin::build("furnace").unwrap();
    let bvh = Bvh::new(&scene.geometry);
    let paths = Paths::led(&scene, &bvh);
    let exact = Rgb::splat(PI) / (Rgb::ONE - FURNACE_REFLECTANCE);
    for (point, normal) in [
        (dvec3(0.3, 0.0, 0.4), DVec3::Y),
        (dvec3(1.0, 0.99, 0.01), DVec3::NEG_X),
        (dvec3(0.999, 0.999, 0.0), DVec3::Z),
        (dvec3(0.5, 0.5, 0.5), dvec3(0.6, 0.0, 0.8)),
    ] {
        let (h, error) = paths.irradiance(point, normal, (0.0, 0.001), 1 << 20);
        println!("{h:.4} ± {error:.4}, exact {exact:.4}");
        assert!(luminance(error) < 0.001 * luminance(h), "{h} ± {error}");
        assert!((h - exact).abs().cmple(4.0 * error).all(), "{h} ± {error}: {exact}");
    }
}

/// A sheet of 1 x 1 m that shines on a point 1 m below its corner, a lamp, and a screen that hides
/// half of the sheet and, from elsewhere, the lamp.
#[test]
fn led_paths_bring_what_a_sheet_and_a_lamp_send_past_a_screen() {
    // From a point to a rectangle a x b, parallel at distance 1 and with a corner above it.
    let factor = |a: f64, b: f64| {
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
    };
    let sheet = rectangle([dvec3(0.0, 1.0, 0.0), DVec3::X, DVec3::Z]);
    let screen = rectangle([dvec3(0.25, 0.5, -0.1), dvec3(0.5, 0.0, 0.0), dvec3(0.0, 0.0, 0.7)]);
    let mut scene = scene_of([(&sheet, grey(0.0, 2.0)), (&screen, grey(0.0, 0.0))], Sides::One);
    let lamp = |position| Lamp::Point {
        name: "lamp".into(),
        position,
        intensity: Rgb::splat(1.5),
        x_axis: DVec3::X,
        photometry: None,
    };
    // The lamp is 2 m above, or hidden.
    let hidden = lamp(dvec3(1.0, 1.0, 0.5));
    scene.lamps = vec![lamp(dvec3(0.0, 2.0, -1e-3)), hidden];
    let bvh = Bvh::new(&scene.geometry);
    let error = (0.0, 0.001);
    let (h, error) = Paths::led(&scene, &bvh).irradiance(DVec3::ZERO, DVec3::Y, error, 1 << 20);
    let exact = 2.0 * PI * factor(0.5, 1.0) + 1.5 / 4.0;
    println!("{} ± {}, exact {exact}", h.x, error.x);
    assert!(error.x < 0.0011 * exact && (h.x - exact).abs() < 4.0 * error.x, "{h} ± {error}");
}

#[test]
fn led_paths_agree_with_others_where_both_are_good() {
    let scene = builtin::build("cornell-box").unwrap();
    let bvh = Bvh::new(&scene.geometry);
    let paths = Paths::led(&scene, &bvh);
    for (point, normal) in [
        (dvec3(1.0, 0.0, 4.0), DVec3::Y),
        (dvec3(5.56, 3.0, 2.0), DVec3::NEG_X),
        (dvec3(2.0, 5.488, 1.0), DVec3::NEG_Y),
    ] {
        let (plain, error) = irradiance(&scene, &bvh, point, normal, 1 << 20);
        let start = std::time::Instant::now();
        let (led, own) = paths.irradiance(point, normal, (0.0, 0.0015), 1 << 22);
        println!("{led:.4} ± {own:.4}, not led {plain:.4} ± {error:.4}, {:?}", start.elapsed());
        let allowed = (error * error + own * own).map(f64::sqrt) * 4.0;
        assert!((led - plain).abs().cmple(allowed).all(), "{led} ± {own}, {plain} ± {error}");
    }
}

/// In the furnace a camera sees B / π everywhere, of which all but E / π is reflected.
#[test]
fn a_picture_of_the_furnace_is_alike_everywhere() {
    let scene = builtin::build("furnace").unwrap();
    let bvh = Bvh::new(&scene.geometry);
    let camera = Camera::at(dvec3(0.2, 0.3, 0.4), dvec3(1.0, 0.6, 0.7));
    let exact = FURNACE_REFLECTANCE / (Rgb::ONE - FURNACE_REFLECTANCE);
    let blocks = Paths::led(&scene, &bvh).picture(&camera, (30, 20), 8, 0.002, 1 << 18);
    assert_eq!(blocks.len(), 4 * 3);
    for b in blocks {
        assert!((b.emitted - Rgb::ONE).abs().max_element() < 1e-9, "{b:?}");
        assert!((b.reflected - exact).abs().cmple(4.5 * b.error).all(), "{b:?}, exactly {exact}");
    }
}

/// A sheet that shines fills the left half of a picture; in the right half a grey one is lit by a
/// lamp from straight before it, H = I cos θ / r².
#[test]
fn a_picture_shows_each_thing_where_it_is() {
    let left = rectangle([dvec3(-2.0, -2.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 4.0, 0.0)]);
    let right = rectangle([dvec3(0.0, -2.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 4.0, 0.0)]);
    let mut scene = scene_of([(&left, grey(0.0, 3.0)), (&right, grey(0.5, 0.0))], Sides::One);
    let eye = dvec3(0.0, 0.0, 2.0);
    scene.lamps = vec![Lamp::Point {
        name: "lamp".into(),
        position: eye,
        intensity: Rgb::splat(8.0),
        x_axis: DVec3::X,
        photometry: None,
    }];
    let camera = Camera { vfov: 0.5_f64.atan() * 2.0, ..Camera::at(eye, DVec3::ZERO) };
    let bvh = Bvh::new(&scene.geometry);
    // Blocks are 0.5 x 0.5 m of the sheets.
    let blocks = Paths::led(&scene, &bvh).picture(&camera, (32, 32), 8, 0.001, 1 << 18);
    for (k, b) in blocks.iter().enumerate() {
        let (column, row) = (k % 4, k / 4);
        if column < 2 {
            assert!((b.emitted.x - 3.0).abs() < 1e-9 && b.reflected == Rgb::ZERO, "{k}: {b:?}");
            continue;
        }
        // Mean of ρ / π I cos θ / r² over the block, by a fine grid.
        let mean: f64 = (0..10_000)
            .map(|i| {
                let x = (column as f64 - 2.0 + (f64::from(i % 100) + 0.5) / 100.0) * 0.5;
                let y = (row as f64 - 2.0 + (f64::from(i / 100) + 0.5) / 100.0) * 0.5;
                let r2 = x * x + y * y + 4.0;
                0.5 / PI * 8.0 * 2.0 / r2.powf(1.5) / 10_000.0
            })
            .sum();
        assert!(b.emitted == Rgb::ZERO, "{k}: {b:?}");
        assert!((b.reflected.x / mean - 1.0).abs() < 2e-3, "{k}: {b:?}, exactly {mean}");
    }
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
