//! The exact engine against brute force, which shares no code with it, on meshes that are hard.
//!
//! Of each mesh some pairs of triangles are found by rays: pairs drawn in proportion to what they
//! exchange, in proportion to what they would exchange if nothing were in between, and uniformly
//! among those that face each other; and some whole rows by diffuse rays. The bounds are those of
//! the error that the engine states, and account for the noise of the rays.
//!
//! `HEMICUBE_BRUTE_FORCE=PAIRS,POINTS` asks for more, as in `1000,30000`: that many pairs, and for
//! each 32 times that many rays. `--nocapture` shows the figures.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use common::compare::{check, make};
use common::meshes::{self, in_box, rounded, turned};
use common::random::Random;
use common::reference::{Tracer, pair};
use glam::DVec3;
use hemicube::scene::builtin::Mesh;

/// Independent turns of a pair that is checked.
const TURNS: u32 = 32;

/// A mesh as files have it: at any angle, in single precision.
fn as_file(mesh: Mesh, seed: u64) -> Mesh {
    rounded(turned(mesh, seed))
}

/// A test for each mesh, which may fail on its own.
macro_rules! meshes {
    ($($name:ident: $mesh:expr;)*) => {
        $(#[test]
        fn $name() {
            check(stringify!($name), &$mesh);
        })*
    };
}

meshes! {
    boxes_in_a_room: meshes::room_with_boxes(500, 3, 1);
    boxes_in_a_room_turned: as_file(meshes::room_with_boxes(300, 3, 1), 2);
    many_boxes_in_a_room_turned: as_file(meshes::room_with_boxes(200, 6, 3), 4);
    inside_a_sphere: as_file(meshes::inside_sphere(500), 5);
    spheres_in_a_room: as_file(meshes::spheres_in_room(700), 6);
    torus: as_file(in_box(meshes::torus(900)), 7);
    head: as_file(in_box(meshes::head(900)), 8);
    screw_thread: as_file(in_box(meshes::thread(900)), 9);
    fins: in_box(meshes::fins(400));
    fins_turned: as_file(in_box(meshes::fins(300)), 10);
    honeycomb: as_file(in_box(meshes::honeycomb(400)), 11);
    ball_in_a_chest_in_a_room: as_file(meshes::nested(300), 12);
    box_on_a_box: meshes::stacked(34);
    box_on_a_box_turned: as_file(meshes::stacked(34), 15);
    box_on_a_box_of_small_faces: meshes::stacked(300);
    gaps: meshes::gaps(400);
    gaps_turned: as_file(meshes::gaps(400), 13);
    large_faces_30: meshes::large_faces(30, 1);
    large_faces_30_turned: as_file(meshes::large_faces(30, 2), 2);
    large_faces_70: meshes::large_faces(70, 3);
    large_faces_70_turned: as_file(meshes::large_faces(70, 4), 4);
    large_faces_150: meshes::large_faces(150, 5);
    large_faces_150_turned: as_file(meshes::large_faces(150, 6), 6);
}

/// A closed box of which nothing is seen outside, and the other way round.
fn nothing_passes(name: &str, mesh: &Mesh, outside: usize) {
    let made = make(mesh);
    let mut most = 0.0_f64;
    for (i, row) in made.factors.iter().enumerate() {
        for (j, &f) in row.iter().enumerate() {
            if (i < outside) != (j < outside) {
                most = most.max(f);
            }
        }
    }
    println!("{name}: {most:.1e} passes closed walls; RMS {:.1e}", made.rms);
    assert!(most <= made.stated * made.rms, "{name}: {most:.1e}");
}

#[test]
fn nothing_is_seen_through_closed_walls() {
    let (mesh, outside) = meshes::sealed(500);
    nothing_passes("sealed box", &mesh, outside);
}

#[test]
fn nothing_is_seen_through_closed_walls_turned() {
    let (mesh, outside) = meshes::sealed(300);
    nothing_passes("sealed box, turned", &as_file(mesh, 14), outside);
}

/// The reference itself: by closed forms, and by its own points.
#[test]
fn brute_force_finds_what_is_known() {
    let square = |z: f64, up: bool| {
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, z));
        if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] }
    };
    let mut triangles = [square(0.0, true), square(1.0, false)].concat();
    let of_squares = |triangles: &[[DVec3; 3]], points: u32| -> [f64; 2] {
        let tracer = Tracer::new(triangles.to_vec());
        let mut random = Random::new(1);
        let pairs = [[0, 2], [0, 3], [1, 2], [1, 3]];
        let found = pairs.map(|p| pair(&tracer, p, [TURNS, points], &mut random));
        for p in &found {
            let off = (p.sampled[0] - p.open).abs();
            assert!(off < 4.0 * p.sampled[1] + 1e-12, "{p:?}");
        }
        let error = found.iter().map(|p| p.error.powi(2)).sum::<f64>().sqrt();
        [found.iter().map(|p| p.exchange).sum(), error]
    };
    let [open, _] = of_squares(&triangles, 1000);
    assert!((open - 0.199_824_895_7).abs() < 1e-9, "{open}");
    // A quarter of the plane midway between them hides a quarter of what they exchange.
    triangles.extend(square(0.5, true).map(|t| t.map(|v| v * DVec3::new(0.5, 0.5, 1.0))));
    let [found, error] = of_squares(&triangles, 4000);
    assert!(error < 2e-4 && (found - 0.149_868_672).abs() < 4.0 * error, "{found} {error}");
}

/// Triangles that share an edge, and that pass through each other's planes.
#[test]
fn outlines_and_points_agree_wherever_triangles_lie() {
    let mut random = Random::new(3);
    for k in 0..200 {
        let mut corner = || random.inside(DVec3::splat(-1.0), DVec3::ONE);
        let [a, b, c, d, e, f] = std::array::from_fn(|_| corner());
        let triangles = match k % 3 {
            0 => vec![[a, b, c], [d, e, f]],
            1 => vec![[a, b, c], [b, a, d]],
            _ => vec![[a, b, c], [a, d, e]],
        };
        let tracer = Tracer::new(triangles);
        let p = pair(&tracer, [0, 1], [TURNS, 200], &mut random);
        let off = (p.sampled[0] - p.open).abs();
        let few = p.rays[0] < 1000;
        assert!(few || off <= 5.0 * p.sampled[1] + 1e-9, "{k}: {p:?}");
    }
}
