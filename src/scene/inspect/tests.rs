use glam::DVec3;

use super::*;
use crate::scene::{Material, SceneBuilder, Setting, Surface};

/// A scene of one-sided triangles given by corners.
fn scene(triangles: &[[[f64; 3]; 3]]) -> Scene {
    let mut b = SceneBuilder::new("test");
    let surface = b.surface(Surface { name: "wall".into(), node: 0, primitive: 0 });
    let material = b.material(Material::default());
    for t in triangles {
        let corners = t.map(|p| b.vertex(p.into()));
        b.triangle(corners, None, surface, material, Sides::One);
    }
    b.finish()
}

fn said(triangles: &[[[f64; 3]; 3]]) -> Vec<String> {
    inspect(&scene(triangles)).iter().map(|f| format!("{}: {}", f.place, f.message)).collect()
}

fn has(said: &[String], part: &str) -> bool {
    said.iter().any(|m| m.contains(part))
}

const O: [f64; 3] = [0.0, 0.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const XY: [f64; 3] = [1.0, 1.0, 0.0];

#[test]
fn a_tetrahedron_is_closed_and_without_doubt() {
    let said = said(&[[O, Y, X], [O, X, Z], [O, Z, Y], [X, Y, Z]]);
    assert_eq!(said, ["model: closed: every edge is shared by triangles"]);
}

#[test]
fn an_open_model_says_where() {
    let said = said(&[[O, Y, X], [O, X, Z], [O, Z, Y]]);
    assert_eq!(
        said,
        ["surface wall, triangle 0 at (0.5, 0.5, 0): open: 3 boundary edges; the first is here"]
    );
}

#[test]
fn degenerate_and_duplicate_triangles_are_counted() {
    let said = said(&[[O, X, Y], [O, X, X], [Y, X, O], [O, X, Y]]);
    assert!(has(&said, "wall, triangle 1 at (0, 0, 0): 1 triangle is without area"), "{said:?}");
    assert!(has(&said, "triangle 2 at (0.333333, 0.333333, 0): 2 triangles coincide"), "{said:?}");
    assert!(has(&said, "1 of them facing the other way; the first coincides with triangle 0"));
}

#[test]
fn coplanar_overlaps_are_found_and_contacts_are_not() {
    let small = [[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]];
    let big = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let turned = [small[0], small[2], small[1]];
    let overlapping = said(&[big, small]);
    assert!(has(&overlapping, "triangle 1 at"), "{overlapping:?}");
    assert!(has(
        &overlapping,
        "1 triangle overlaps another in the same plane; the first lies on triangle 0"
    ));
    assert!(has(&said(&[big, turned]), "1 of them facing the other way"));
    // Neighbours, a parallel plane, and a plane across.
    let above = small.map(|[x, y, _]| [x, y, 0.01]);
    let across = [[0.1, 0.1, -1.0], [0.2, 0.1, 1.0], [0.1, 0.1, 1.0]];
    for clear in [&[[O, X, XY], [O, XY, Y]], &[big, above], &[big, across]] {
        assert!(!has(&said(clear), "overlap"), "{clear:?}");
    }
}

#[test]
fn overlaps_are_found_on_tilted_planes_far_from_the_origin() {
    let tilt = |[x, y, _]: [f64; 3]| [500.0 + 0.36 * x - 0.8 * y, 0.48 * x + 0.6 * y, 0.8 * x];
    let first = [O, X, Y].map(tilt);
    let second = [[0.2, 0.2, 0.0], [1.2, 0.2, 0.0], [0.2, 1.2, 0.0]].map(tilt);
    assert!(has(&said(&[first, second]), "same plane"));
}

#[test]
fn neighbours_that_face_opposite_ways_are_named() {
    let turned = said(&[[O, X, XY], [O, Y, XY]]);
    assert!(
        has(&turned, "opposite ways across 1 edge; the first is between triangles 0 and 1"),
        "{turned:?}"
    );
    assert!(!has(&said(&[[O, X, XY], [O, XY, Y]]), "opposite"));
    let severity = inspect(&scene(&[[O, X, XY], [O, Y, XY]]))
        .iter()
        .find(|f| f.message.contains("opposite"))
        .map(|f| f.severity);
    assert_eq!(severity, Some(Severity::Warning));
}

#[test]
fn a_vertex_on_an_edge_is_a_t_vertex() {
    let (half, below) = ([0.5, 0.0, 0.0], [0.5, -1.0, 0.0]);
    let split = said(&[[O, X, Y], [O, below, half], [half, below, X]]);
    assert!(has(&split, "1 vertex lies on another triangle's edge"), "{split:?}");
    assert!(has(&split, "triangle 1 at (0.5, 0, 0)"));
    assert!(!has(&said(&[[O, X, Y], [O, below, X]]), "vertex"));
    // Near the edge, but not on it.
    let near = [0.5, -0.001, 0.0];
    assert!(!has(&said(&[[O, X, Y], [O, below, near]]), "vertex"));
}

#[test]
fn units_are_guessed_from_the_size() {
    let room = |s: f64| [[O, X, Y].map(|[x, y, z]| [x * 5.2 * s, y * 2.7 * s, z])];
    assert!(!has(&said(&room(1.0)), "measures"));
    assert!(has(&said(&room(1000.0)), "model: it measures 5,200 x 2,700 x 0 m: millimetres?"));
    assert!(has(&said(&room(100.0)), "centimetres"));
    assert!(has(&said(&room(0.001)), "another unit"));
    let found = inspect(&scene(&room(1000.0))).pop().unwrap();
    assert_eq!(found.remedy, "in mm it is 5.2 x 2.7 x 0 m");
    assert_eq!(found.setting, Some(Setting::Unit(&["mm"])));
}

#[test]
fn nothing_and_nonsense_do_not_stall() {
    assert!(inspect(&Scene::default()).is_empty());
    let far = 1e300;
    said(&[[[far, 0.0, 0.0], [-far, far, 0.0], [0.0, 0.0, far]], [O, X, [0.0, far, 0.0]]]);
    said(&[[[f64::NAN, 0.0, 0.0], X, Y], [O, X, [f64::INFINITY, 0.0, 0.0]], [O, X, Y]]);
}

#[test]
fn a_fine_flat_grid_overlaps_only_what_lies_under_it() {
    let n = 60;
    let at = |i: i32, j: i32| [f64::from(i) / f64::from(n), 0.0, f64::from(j) / f64::from(n)];
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
        triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
    }
    let flat = said(&triangles);
    assert_eq!(flat.len(), 1, "{flat:?}");
    assert!(has(&flat, "open: 240 boundary edges"));
    // One large triangle below all of them.
    triangles.push([[-1.0, 0.0, -1.0], [-1.0, 0.0, 5.0], [5.0, 0.0, -1.0]]);
    assert!(has(&said(&triangles), "7200 triangles overlap another"));
}

#[test]
fn coordinates_keep_six_digits() {
    assert_eq!(coordinate(DVec3::new(1.0 / 3.0, -12_345.678_9, 0.0)), "(0.333333, -12345.7, 0)");
}

#[test]
fn a_star_of_long_edges_takes_little_time() {
    let n = 40_000;
    let at = |i: i32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
        [cos, sin, 0.0]
    };
    let triangles: Vec<_> = (0..n).map(|i| [[0.0; 3], at(2 * i), at(2 * i + 1)]).collect();
    let start = std::time::Instant::now();
    said(&triangles);
    // Trying all edges for all vertices takes a minute.
    assert!(start.elapsed().as_secs() < 20);
}
