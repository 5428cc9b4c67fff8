//! Form factors with a known answer: every engine must reach them.
//!
//! Each engine states how near it comes. Hemicubes and the classical algorithm look from the centre
//! of a patch, so their sums over many patches carry a bias that falls with the size of patches.
//! Rays begin all over the patch: noise instead of bias. Exact factors are means over both patches.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::f64::consts::PI;

use common::engines::{CENTRED, ENGINES, Kind, all_rows, rows_of, total_variation};
use common::scenes::{lit_by_first, quad, room};
use glam::{DVec3, dvec3};
use hemicube::engines::Draw;
use hemicube::form_factors::kernel::point_to_polygon;
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::builtin::{self, Mesh};
use hemicube::scene::{Geometry, Scene, Sides};

/// Which mesh of [`lit_by_first`] a patch belongs to.
fn mesh_of(g: &Geometry, p: &Patches, id: PatchId) -> u32 {
    g.surface_of[p.cell(id).triangle.index()]
}

/// Area-weighted form factor from mesh 0 to mesh 1.
fn mean_factor(g: &Geometry, p: &Patches, kind: Kind) -> f64 {
    let ids: Vec<PatchId> = p.ids().filter(|&i| mesh_of(g, p, i) == 0).collect();
    let (mut sum, mut area) = (0.0, 0.0);
    for (&i, row) in ids.iter().zip(rows_of(kind, g, p, &ids)) {
        let to: f64 = row.entries().filter(|e| mesh_of(g, p, e.0) == 1).map(|e| e.1).sum();
        sum += p.area(i) * to;
        area += p.area(i);
    }
    sum / area
}

/// Unit squares that face each other at distance 1, and at a right angle with a common edge.
fn unit_squares() -> [(Scene, f64); 2] {
    let floor =
        || quad([DVec3::ZERO, dvec3(1.0, 0.0, 0.0), dvec3(1.0, 1.0, 0.0), dvec3(0.0, 1.0, 0.0)]);
    let above = quad([
        dvec3(0.0, 0.0, 1.0),
        dvec3(0.0, 1.0, 1.0),
        dvec3(1.0, 1.0, 1.0),
        dvec3(1.0, 0.0, 1.0),
    ]);
    let beside =
        quad([DVec3::ZERO, dvec3(0.0, 1.0, 0.0), dvec3(0.0, 1.0, 1.0), dvec3(0.0, 0.0, 1.0)]);
    [
        (lit_by_first(&[&floor(), &above], Sides::One), 0.199_824_895_7),
        (lit_by_first(&[&floor(), &beside], Sides::One), 0.200_043_776_1),
    ]
}

#[test]
fn unit_squares_have_their_analytic_factors() {
    for kind in ENGINES {
        for (scene, exact) in unit_squares() {
            let p = Patches::uniform(&scene.geometry, 0.5 / 256.0).unwrap();
            assert_eq!(p.len(), 2 * 512);
            let mean = mean_factor(&scene.geometry, &p, kind);
            let tolerance = if kind == Kind::Exact { 1e-5 } else { 5e-3 };
            assert!((mean / exact - 1.0).abs() < tolerance, "{kind:?}: {mean} {exact}");
        }
    }
}

#[test]
fn unsplit_squares_have_the_point_factor_of_their_centre() {
    for kind in CENTRED {
        for (scene, _) in unit_squares() {
            let g = &scene.geometry;
            let p = Patches::uniform(g, 1.0).unwrap();
            assert_eq!(p.len(), 4);
            for (i, row) in p.ids().zip(all_rows(kind, g, &p)) {
                let cell = p.cell(i);
                let centre = p.center(i).position(g);
                let normal = g.normal(cell.triangle, cell.side);
                let other: Vec<PatchId> =
                    p.ids().filter(|&j| mesh_of(g, &p, j) != mesh_of(g, &p, i)).collect();
                let exact: f64 = other
                    .iter()
                    .map(|&j| point_to_polygon(centre, normal, &p.cell(j).corners(g)))
                    .sum();
                let sum: f64 = other.iter().map(|&j| row.factor_to(j)).sum();
                assert!((sum / exact - 1.0).abs() < 5e-3, "{kind:?}: {sum} {exact}");
                assert_eq!(row.columns.len(), 2);
            }
        }
    }
}

/// The inside of a sphere of 500 triangles.
fn sphere() -> Scene {
    lit_by_first(&[&Mesh::geodesic(2.0, 5).inverted()], Sides::One)
}

/// Inside a polyhedron every pair is unoccluded: rows must be those of Lambert's formula, whatever
/// the sphere would say.
#[test]
fn inside_a_polyhedral_sphere_rows_of_centres_are_the_polyhedrons() {
    let scene = sphere();
    let g = &scene.geometry;
    let p = Patches::uniform(g, 1.0).unwrap();
    assert_eq!(p.len(), 500);
    for kind in CENTRED {
        let mut worst = 0.0_f64;
        for (i, row) in p.ids().zip(all_rows(kind, g, &p)) {
            let centre = p.center(i).position(g);
            let normal = g.normal(p.cell(i).triangle, p.cell(i).side);
            let exact = |j| {
                if j == i { 0.0 } else { point_to_polygon(centre, normal, &p.cell(j).corners(g)) }
            };
            let variation: f64 = p.ids().map(|j| (row.factor_to(j) - exact(j)).abs()).sum();
            worst = worst.max(0.5 * variation);
        }
        println!("{kind:?}: worst row against Lambert's formula {worst:.5}");
        // Pixels of a hemicube are as wide as a third of a triangle here.
        let stated = if kind == Kind::Classical { 1e-5 } else { 0.02 };
        assert!(worst < stated, "{kind:?}: {worst}");
    }
}

/// In a sphere F_ij = A_j / A, whatever i: every patch sees every other alike.
#[test]
fn inside_a_polyhedral_sphere_rows_are_nearly_the_spheres() {
    let scene = sphere();
    let g = &scene.geometry;
    let p = Patches::uniform(g, 1.0).unwrap();
    let total: f64 = p.ids().map(|i| p.area(i)).sum();
    for kind in ENGINES {
        let (mut worst, mut mean) = (0.0_f64, 0.0);
        for row in all_rows(kind, g, &p) {
            let off: f64 = p.ids().map(|j| (row.factor_to(j) - p.area(j) / total).abs()).sum();
            worst = worst.max(0.5 * off);
            mean += 0.5 * off / p.len() as f64;
            let rounding = match kind {
                Kind::Hemicube(_) | Kind::Rays => 1e-12,
                Kind::Classical => 1e-5,
                Kind::Exact => 1e-4,
            };
            let sum = row.weights.sum();
            assert!((sum - 1.0).abs() < rounding, "{kind:?}: {sum}");
        }
        println!("{kind:?}: rows against A_j / A: mean {mean:.5}, worst {worst:.5}");
        // Of 1,024 rays two or three meet a patch: noise of .6 a pair.
        let stated = if kind == Kind::Rays { 0.3 } else { 0.1 };
        assert!(worst < stated, "{kind:?}: {worst}");
    }
}

/// Coaxial parallel discs of radii r at distance h: F = X - √(X² - 4) over 2 with X = 2 + h² / r².
#[test]
fn coaxial_discs_have_their_analytic_factor() {
    const CORNERS: u32 = 96;
    let disc = |z: f64, up: bool| {
        let mut mesh = Mesh { vertices: vec![dvec3(0.0, 0.0, z)], triangles: Vec::new() };
        for k in 0..CORNERS {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(CORNERS)).sin_cos();
            mesh.vertices.push(dvec3(cos, sin, z));
            mesh.triangles.push([0, k + 1, (k + 1) % CORNERS + 1]);
        }
        if up { mesh } else { mesh.inverted() }
    };
    let scene = lit_by_first(&[&disc(0.0, true), &disc(1.5, false)], Sides::One);
    let x = 2.0 + 1.5 * 1.5;
    let exact = 0.5 * (x - (x * x - 4.0_f64).sqrt());
    let p = Patches::uniform(&scene.geometry, 0.01).unwrap();
    for kind in ENGINES {
        let mean = mean_factor(&scene.geometry, &p, kind);
        println!("{kind:?}: {mean:.6}, exactly {exact:.6}");
        // Polygons of so many corners miss 7e-4 of the circles' area.
        let tolerance = if kind == Kind::Exact { 1e-3 } else { 5e-3 };
        assert!((mean / exact - 1.0).abs() < tolerance, "{kind:?}: {mean} {exact}");
    }
}

/// RMS of A_i F_ij - A_j F_ji over RMS of A_i F_ij.
fn reciprocity(g: &Geometry, p: &Patches, kind: Kind) -> f64 {
    let rows = all_rows(kind, g, p);
    let (mut difference, mut size) = (0.0, 0.0);
    for (i, row) in p.ids().zip(&rows) {
        for j in p.ids() {
            let there = p.area(i) * row.factor_to(j);
            let back = p.area(j) * rows[j.index()].factor_to(i);
            difference += (there - back) * (there - back);
            size += there * there;
        }
    }
    (difference / size).sqrt()
}

/// A ball that floats in a room.
fn floating() -> Scene {
    lit_by_first(&[&room(), &Mesh::geodesic(0.4, 2).at(0.3, 1.0, 0.1)], Sides::One)
}

#[test]
fn reciprocity_of_centres_comes_near_and_nearer_with_smaller_patches() {
    let g = floating().geometry;
    for kind in CENTRED {
        let at = |size: f64| {
            let p = Patches::uniform(&g, size).unwrap();
            (p.len(), reciprocity(&g, &p, kind))
        };
        let (coarse, fine) = (at(0.2), at(0.05));
        println!("{kind:?}: RMS(A_i F_ij - A_j F_ji) / RMS(A_i F_ij): {coarse:.4?} {fine:.4?}");
        assert!(coarse.1 <= 0.25 && fine.1 < coarse.1, "{kind:?}: {coarse:?} {fine:?}");
    }
}

/// Rays find F_ij and F_ji apart: they differ by noise alone, which falls with the size of factors.
#[test]
fn reciprocity_of_rays_is_within_their_noise_and_of_exact_factors_within_rounding() {
    let g = floating().geometry;
    let p = Patches::uniform(&g, 0.2).unwrap();
    let exact = reciprocity(&g, &p, Kind::Exact);
    let rays = reciprocity(&g, &p, Kind::Rays);
    println!("exact: {exact:.1e}, rays: {rays:.4}");
    assert!(exact < 1e-6, "{exact}");
    assert!(rays < 0.25, "{rays}");
}

#[test]
fn drawing_sources_equals_drawing_patches() {
    let scenes = [("furnace", 0.01, 1), ("cornell-box", 0.1, 40), ("room", 0.02, 1000)];
    for (name, size, step) in scenes {
        let g = builtin::build(name).unwrap().geometry;
        let p = Patches::uniform(&g, size).unwrap();
        let ids: Vec<PatchId> = p.ids().step_by(step).collect();
        let sources = rows_of(Kind::Hemicube(Draw::Sources), &g, &p, &ids);
        let patches = rows_of(Kind::Hemicube(Draw::Patches), &g, &p, &ids);
        let worst = sources.iter().zip(&patches).map(|(a, b)| total_variation(&p, a, b));
        let worst = worst.fold(0.0, f64::max);
        println!("{name}: {} rows of {}: total variation <= {worst:.1e}", ids.len(), p.len());
        assert!(worst <= 1e-3, "{name}: {worst}");
    }
}

#[test]
fn hemicubes_of_closed_scenes_without_contacts_sum_to_exactly_one() {
    let ball = Mesh::geodesic(0.4, 4).at(0.7, 1.2, 0.3);
    let ring = Mesh::torus(0.35, 0.1, 24, 12).tipped().turned(20.0).at(-0.6, 0.7, 0.4);
    let brick = Mesh::cuboid(dvec3(0.5, 0.2, 0.3), [1; 3]).turned(33.0).at(-0.5, 1.4, -0.6);
    let g = lit_by_first(&[&room(), &ball, &ring, &brick], Sides::One).geometry;
    let p = Patches::uniform(&g, 0.02).unwrap();
    for (draw, step) in [(Draw::Sources, 1), (Draw::Patches, 5)] {
        let ids: Vec<PatchId> = p.ids().step_by(step).collect();
        for (i, row) in ids.iter().zip(rows_of(Kind::Hemicube(draw), &g, &p, &ids)) {
            assert_eq!([row.environment, row.back, row.lost], [0.0; 3], "{draw:?} {i:?}");
            assert_eq!(row.weights.sum(), 1.0, "{draw:?} {i:?}");
        }
    }
}

#[test]
fn rows_of_a_closed_scene_account_for_all_but_the_engines_error() {
    let g = floating().geometry;
    let p = Patches::uniform(&g, 0.1).unwrap();
    for kind in ENGINES {
        let rows = all_rows(kind, &g, &p);
        let n = rows.len() as f64;
        let ends: f64 = rows.iter().map(|r| r.environment + r.back).sum::<f64>() / n;
        let lost: f64 = rows.iter().map(|r| r.lost.abs()).sum::<f64>() / n;
        println!("{kind:?}: on average {ends:.1e} to environment and backs, {lost:.1e} lost");
        for row in &rows {
            assert!((row.total() - 1.0).abs() < 1e-9, "{kind:?}: {}", row.total());
        }
        let most = match kind {
            Kind::Hemicube(_) | Kind::Rays => 0.0,
            Kind::Exact => 5e-4,
            // One ray a pair tells all or nothing.
            Kind::Classical => 0.02,
        };
        assert!(ends <= 1e-5 && lost <= most, "{kind:?}: {ends} {lost}");
    }
}

#[test]
fn rows_do_not_depend_on_the_unit_of_length() {
    let scene = builtin::build("cornell-box").unwrap();
    let rows = |scale: f64, kind: Kind| {
        let mut g = scene.geometry.clone();
        g.vertices.iter_mut().for_each(|v| *v *= scale);
        let p = Patches::uniform(&g, 0.5 * scale * scale).unwrap();
        let rows = all_rows(kind, &g, &p);
        (p, rows)
    };
    for kind in ENGINES {
        let (p, metres) = rows(1.0, kind);
        for scale in [1e-3, 1e3] {
            let (_, scaled) = rows(scale, kind);
            assert_eq!(metres.len(), scaled.len());
            let variations = metres.iter().zip(&scaled).map(|(a, b)| total_variation(&p, a, b));
            let worst = variations.fold(0.0, f64::max);
            println!("{kind:?} scaled by {scale}: total variation <= {worst:.1e}");
            assert!(worst <= 2e-3, "{kind:?} {scale}: {worst}");
        }
    }
}
