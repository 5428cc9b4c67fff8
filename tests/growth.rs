//! How the counted work of the exact engine grows with the number of facets of one and the same
//! body.
//!
//! The number of pairs that see each other grows as n²: that many numbers are asked for. Work
//! beyond that is what pairs cost that are partly hidden, and rays.
//!
//! `HEMICUBE_GROWTH=N` begins with N facets. `--nocapture` shows the figures.

#![allow(clippy::unwrap_used, reason = "a test")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::collections::HashMap;

use common::meshes::{self, in_box, rounded, scene_of, turned};
use hemicube::engines::PairsReport;
use hemicube::scene::builtin::Mesh;
use hemicube::{MatrixOptions, Silent};

/// Work grows at most as this power of the number of facets.
const MOST: f64 = 1.6;

/// Fewer events than this are no measure of work.
const FEW: f64 = 1e4;

fn work_of(mesh: &Mesh) -> PairsReport {
    let scene = scene_of(&rounded(turned(mesh.clone(), 1)));
    let matrix = scene.form_factors(&MatrixOptions::default(), &Silent).unwrap();
    matrix.report.pairs.unwrap()
}

/// Compares the work of a body of so many facets and of four times as many.
fn grows(name: &str, body: fn(usize) -> Mesh) {
    let n = std::env::var("HEMICUBE_GROWTH").map_or(200, |n| n.parse().unwrap());
    let meshes = [n, 4 * n].map(body);
    let facets = meshes.each_ref().map(|m| m.triangles.len() as f64);
    let [few, many] = meshes.each_ref().map(work_of);
    let power = |a: u64, b: u64| {
        let [a, b] = [a as f64, b as f64];
        // What hardly happens may happen more often.
        if b < FEW { 0.0 } else { (b / a.max(1.0)).ln() / (facets[1] / facets[0]).ln() }
    };
    let [evaluated, partly, rays] = [
        power(few.evaluated, many.evaluated),
        power(few.partly_hidden, many.partly_hidden),
        power(few.shadow_rays, many.shadow_rays),
    ];
    println!(
        "{name}, {} and {} facets: {} and {} pairs (n^{evaluated:.2}), {} and {} partly hidden \
         (n^{partly:.2}), {} and {} rays (n^{rays:.2}); stated {:.2} and {:.2} %",
        facets[0],
        facets[1],
        few.evaluated,
        many.evaluated,
        few.partly_hidden,
        many.partly_hidden,
        few.shadow_rays,
        many.shadow_rays,
        100.0 * few.error,
        100.0 * many.error,
    );
    assert!(evaluated <= 2.05, "{name}: pairs grow as n^{evaluated:.2}");
    assert!(partly <= MOST, "{name}: partly hidden pairs grow as n^{partly:.2}");
    assert!(rays <= MOST, "{name}: rays grow as n^{rays:.2}");
}

#[test]
fn inside_a_sphere() {
    grows("inside a sphere", meshes::inside_sphere);
}

#[test]
#[ignore = "not reached yet (docs/benchmarks.md): rays to small blockers grow faster"]
fn spheres_in_a_room() {
    grows("spheres in a room", meshes::spheres_in_room);
}

#[test]
#[ignore = "not reached yet (docs/benchmarks.md): rays to small blockers grow faster"]
fn torus() {
    grows("torus", |n| in_box(meshes::torus(n)));
}

#[test]
#[ignore = "not reached yet (docs/benchmarks.md): rays to small blockers grow faster"]
fn screw_thread() {
    grows("screw thread", |n| in_box(meshes::thread(n)));
}

#[test]
fn head() {
    grows("head", |n| in_box(meshes::head(n)));
}

/// Edges that are not met by their opposite exactly once.
fn open_edges(mesh: &Mesh) -> usize {
    let mut count: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            *count.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    count.iter().filter(|((a, b), n)| **n != 1 || count.get(&(*b, *a)) != Some(&1)).count()
}

#[test]
fn meshes_are_closed_and_have_the_size_asked_for() {
    let closed: [fn(usize) -> Mesh; 4] =
        [meshes::inside_sphere, meshes::torus, meshes::thread, meshes::head];
    for body in closed {
        for n in [500, 2000, 20_000] {
            let mesh = body(n);
            assert_eq!(open_edges(&mesh), 0);
            let size = mesh.triangles.len() as f64 / n as f64;
            assert!((0.8..1.3).contains(&size), "{} for {n}", mesh.triangles.len());
        }
        assert_eq!(body(700), body(700));
    }
    let others: [fn(usize) -> Mesh; 6] = [
        meshes::fins,
        meshes::honeycomb,
        meshes::nested,
        meshes::gaps,
        meshes::spheres_in_room,
        |n| meshes::room_with_boxes(n, 3, 1),
    ];
    for body in others {
        let [few, many] = [1000, 4000].map(|n| body(n).triangles.len() as f64);
        assert!((3.0..5.5).contains(&(many / few)), "{few} {many}");
        assert_eq!(body(300), body(300));
    }
    for faces in [20, 60, 200] {
        let count = meshes::large_faces(faces, 9).triangles.len();
        assert!((faces..faces + 30).contains(&count), "{count} for {faces}");
    }
}
