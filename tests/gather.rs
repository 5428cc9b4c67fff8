//! Irradiance at points against exact answers, and its stated error against its true one.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::f64::consts::{FRAC_PI_2, PI};

use common::scenes::{grey, rectangle, scene_of};
use glam::DVec3;
use hemicube::direct::DirectOptions;
use hemicube::engines::EngineOptions;
use hemicube::engines::RaysOptions;
use hemicube::gather::{Estimate, GatherOptions, Gatherer, Place, Probe};
use hemicube::progress::Silent;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Lamp, Rgb, Scene, Sides, builtin, luminance};
use hemicube::solution::{LightOptions, light};
use hemicube::visibility::Bvh;

/// A rectangle by a corner and two edges, and what it reflects and emits; its front is `u` x `v`.
type Sheet = ([DVec3; 3], f64, f64);

fn scene(sheets: &[Sheet], lamp: Option<Lamp>) -> Scene {
    let meshes: Vec<Mesh> = sheets.iter().map(|sheet| rectangle(sheet.0)).collect();
    let materials = sheets.iter().map(|sheet| grey(sheet.1, sheet.2));
    let mut scene = scene_of(meshes.iter().zip(materials), Sides::One);
    scene.lamps.extend(lamp);
    scene
}

/// Lights a scene with `samples` rays a row and `rays` a point.
fn measure(
    scene: &Scene,
    probes: &[Probe],
    (samples, rays): (usize, usize),
    seed: u32,
) -> Vec<Estimate> {
    let options = LightOptions {
        patch_size: Some(0.1),
        engine: EngineOptions::Rays(RaysOptions { samples, seed }),
        direct: DirectOptions { seed, ..DirectOptions::default() },
        ..LightOptions::default()
    };
    let solution = light(scene, &options, &Silent).unwrap();
    let field = solution.field(scene);
    let bvh = Bvh::new(&scene.geometry);
    let options = GatherOptions { samples: rays, seed, ..GatherOptions::default() };
    Gatherer::new(scene, &solution, &field, &bvh, options).all(probes, &Silent).unwrap()
}

fn measure_one(scene: &Scene, point: DVec3, normal: DVec3) -> Estimate {
    measure(scene, &[Probe { point, normal }], (64, 4096), 0)[0]
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A sheet of 1 x 1 m at height 1 above the quarter x, z > 0 of a plane; it shines down.
fn ceiling(radiance: f64) -> Sheet {
    ([v(0.0, 1.0, 0.0), DVec3::X, DVec3::Z], 0.0, radiance)
}

/// Form factor from a point to a rectangle a x b, parallel at distance 1 and with a corner above
/// it.
fn parallel(a: f64, b: f64) -> f64 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
}

#[test]
fn rectangles_give_a_point_what_is_known() {
    assert!((parallel(1.0, 1.0) - 0.138_531_606).abs() < 1e-9);
    let above = measure_one(&scene(&[ceiling(2.0)], None), DVec3::ZERO, DVec3::Y);
    let exact = 2.0 * PI * 0.138_531_606;
    assert!((above.irradiance.x / exact - 1.0).abs() < 1e-4, "{above:?}, exactly {exact}");

    let wall = ([v(0.0, 0.0, 1.0), DVec3::Y, DVec3::X], 0.0, 3.0);
    let beside = measure_one(&scene(&[wall], None), DVec3::ZERO, DVec3::Y);
    let exact = 3.0 * PI * 0.055_734_197;
    assert!((beside.irradiance.x / exact - 1.0).abs() < 1e-4, "{beside:?}, exactly {exact}");
    assert_eq!((above.place, beside.place), (Place::Free, Place::Free));
}

#[test]
fn what_a_screen_leaves_of_a_rectangle_arrives() {
    // From the origin the screen hides what has x > 0.5.
    let screen = ([v(0.25, 0.5, -0.1), v(0.5, 0.0, 0.0), v(0.0, 0.0, 0.7)], 0.0, 0.0);
    let found = measure_one(&scene(&[ceiling(2.0), screen], None), DVec3::ZERO, DVec3::Y);
    let exact = 2.0 * PI * parallel(0.5, 1.0);
    let off = (found.irradiance.x - exact).abs();
    assert!(off < 0.005 * exact, "{found:?}, exactly {exact}");
    assert!(off < 1.5 * found.error.x && found.error.x < 0.02 * exact, "{found:?}, {exact}");
}

#[test]
fn an_open_sky_and_a_lamp_with_a_shadow() {
    let lamp = Lamp::Point {
        name: "lamp".into(),
        position: v(-0.5, 2.0, -0.5),
        intensity: Rgb::splat(100.0),
        x_axis: DVec3::X,
        photometry: None,
    };
    let floor = ([v(-1.0, 0.0, -1.0), v(0.0, 0.0, 2.0), v(2.0, 0.0, 0.0)], 0.0, 0.0);
    let screen = ([v(0.0, 0.5, 0.0), DVec3::X, DVec3::Z], 0.0, 0.0);
    let mut scene = scene(&[floor, screen], Some(lamp));
    let below = measure_one(&scene, v(-0.5, 0.0, -0.5), DVec3::Y);
    assert!((below.irradiance.x / 25.0 - 1.0).abs() < 1e-3, "100 cd at 2 m: {below:?}");
    let shaded = measure_one(&scene, v(0.75, 0.0, 0.75), DVec3::Y);
    assert_eq!(shaded.irradiance, Rgb::ZERO);
    scene.lamps.clear();
    scene.sky = Rgb::splat(3.0);
    let open = measure_one(&scene, v(-0.2, 1.0, 0.2), DVec3::Y);
    assert!((open.irradiance.x / (3.0 * PI) - 1.0).abs() < 1e-12, "{open:?}");
    assert_eq!(open.escaped, 1.0);
    // From far away, in the plane of the floor.
    let far = measure_one(&scene, v(50.0, 0.0, 0.0), DVec3::Y);
    assert!((far.irradiance.x / (3.0 * PI) - 1.0).abs() < 1e-12, "{far:?}");
}

#[test]
fn a_furnace_is_alike_everywhere() {
    let scene = builtin::build("furnace").unwrap();
    let (low, high) = scene.geometry.bounds().unwrap();
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let at = |x, y, z| centre + half * v(x, y, z);
    let probes = [
        (at(0.0, 0.0, 0.0), v(0.6, 0.0, 0.8)),
        (at(0.3, -0.9, 0.7), DVec3::Y),
        (at(0.99, 0.99, 0.99), -DVec3::X),
        (at(0.2, -1.0, -0.4), DVec3::Y),
        (at(-1.0, 0.97, -0.97), DVec3::X),
    ]
    .map(|(point, normal)| Probe { point, normal });
    let exact = Rgb::splat(PI) / (Rgb::ONE - builtin::FURNACE_REFLECTANCE);
    let found = measure(&scene, &probes, (256, 4096), 0);
    for (e, p) in found.iter().zip(&probes) {
        let off = (e.irradiance / exact - Rgb::ONE).abs().max_element();
        let stated = (e.error / exact).max_element();
        assert!(off < 1e-2 && off < 5e-3_f64.max(stated), "{e:?}, exactly {exact}, at {p:?}");
    }
}

/// Points on the floor and in the air of the Cornell box, and their normals.
fn scattered(count: usize) -> Vec<Probe> {
    let scene = builtin::build("cornell-box").unwrap();
    let (low, high) = scene.geometry.bounds().unwrap();
    let golden = |k: usize, step: f64| (k as f64 * step).fract();
    (0..count)
        .map(|k| {
            let share = v(golden(k, 0.819_172_5), golden(k, 0.671_043_6), golden(k, 0.549_700_5));
            let on_floor = k % 2 == 0;
            let share = if on_floor { v(share.x, 0.0, share.z) } else { share };
            let (turn, rise) = (golden(k, 0.618_034) * 4.0 * FRAC_PI_2, golden(k, 0.414_214));
            let (sin, cos) = turn.sin_cos();
            let slope = (1.0 - rise * rise).sqrt();
            let normal = if on_floor { DVec3::Y } else { v(slope * cos, rise, slope * sin) };
            Probe { point: low + (high - low) * share, normal }
        })
        .collect()
}

#[test]
fn the_truth_lies_within_the_stated_error() {
    let scene = builtin::build("cornell-box").unwrap();
    let probes = scattered(260);
    let found = measure(&scene, &probes, (64, 512), 0);
    let truth = measure(&scene, &probes, (4096, 1 << 16), 7);
    let free: Vec<_> = found.iter().zip(&truth).filter(|(f, _)| f.place == Place::Free).collect();
    assert!(free.len() >= 200, "{} points", free.len());
    let within = |(f, t): &&(&Estimate, &Estimate)| {
        luminance((f.irradiance - t.irradiance).abs()) <= luminance(f.error)
    };
    let share = free.iter().filter(within).count() as f64 / free.len() as f64;
    assert!(share >= 0.9, "{share}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = builtin::build("cornell-box").unwrap();
    let probes = scattered(20);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| measure(&scene, &probes, (64, 512), 3))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn places_inside_solids_and_on_emitters_are_told() {
    let scene = builtin::build("cornell-box").unwrap();
    let g = &scene.geometry;
    let lamp = g.ids().find(|t| scene.optics.emission[t.index()] != Rgb::ZERO).unwrap();
    let [a, b, c] = g.corners(lamp);
    let on = measure_one(&scene, (a + b + c) / 3.0, g.normal(lamp, hemicube::scene::Side::Front));
    assert_eq!(on.place, Place::OnEmitter);
    // Some are within the blocks.
    let places: Vec<Place> =
        measure(&scene, &scattered(260), (64, 512), 0).iter().map(|e| e.place).collect();
    let covered = places.iter().filter(|p| **p == Place::Covered).count();
    assert!((5..80).contains(&covered), "{covered} of 260");
}
