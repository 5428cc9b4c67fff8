//! Physics with a known answer: every engine and every solver must reach it.
//!
//! Each engine states how near it comes. `hemicube` and `classical` both stand at the centre of the
//! patch, so sums over many patches carry a bias that depends on the scene; rows of a hemicube
//! sum to exactly one. `rays` begin all over the patch: noise instead of bias, and rows sum to one.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use hemicube::direct;
use hemicube::engines::{Classical, Draw, Engine, Hemicube, HemicubeOptions, Rays, RaysOptions};
use hemicube::form_factors::kernel::point_to_polygon;
use hemicube::form_factors::{FormFactors, Row};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::builtin::{self, FURNACE_REFLECTANCE, Mesh, closed_room};
use hemicube::scene::{Geometry, Material, Rgb, Scene, SceneBuilder, Sides, Surface};
use hemicube::solve::{EnergyBalance, Method, SolveOptions, System, solve};
use hemicube::visibility::Bvh;

/// An engine of its own options.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Hemicube(Draw),
    Classical,
    Rays,
}

const ENGINES: [Kind; 4] =
    [Kind::Hemicube(Draw::Sources), Kind::Hemicube(Draw::Patches), Kind::Classical, Kind::Rays];

/// Those that look from the centre of a patch.
const CENTRED: [Kind; 3] = [ENGINES[0], ENGINES[1], ENGINES[2]];

const METHODS: [Method; 4] =
    [Method::GaussSeidel, Method::Jacobi, Method::Shooting, Method::Direct];

fn engine<'a>(kind: Kind, g: &'a Geometry, p: &'a Patches) -> Box<dyn Engine + 'a> {
    match kind {
        Kind::Hemicube(draw) => {
            let options = HemicubeOptions { draw, ..HemicubeOptions::default() };
            Box::new(Hemicube::new(g, p, options).unwrap())
        }
        Kind::Classical => Box::new(Classical::new(g, p)),
        // Kept until the tests end: the engine borrows it.
        Kind::Rays => {
            let bvh = Box::leak(Box::new(Bvh::new(g)));
            Box::new(Rays::new(g, p, bvh, RaysOptions::default()))
        }
    }
}

fn rows_of(kind: Kind, g: &Geometry, p: &Patches, ids: &[PatchId]) -> Vec<Row> {
    let mut rows = vec![Row::default(); ids.len()];
    engine(kind, g, p).fill(ids, &mut rows).unwrap();
    rows
}

fn all_rows(kind: Kind, g: &Geometry, p: &Patches) -> Vec<Row> {
    rows_of(kind, g, p, &p.ids().collect::<Vec<_>>())
}

/// A scene with all its rows, ready to be solved.
struct Case {
    scene: Scene,
    patches: Patches,
    factors: FormFactors,
    emission: Vec<Rgb>,
    rho: Vec<Rgb>,
    direct: Vec<Rgb>,
    areas: Vec<f64>,
}

impl Case {
    fn new(scene: Scene, patch_size: f64, kind: Kind) -> Self {
        let g = &scene.geometry;
        let patches = Patches::uniform(g, patch_size).unwrap();
        let ids: Vec<PatchId> = patches.ids().collect();
        let mut factors = FormFactors::new(ids.len(), 1 << 30);
        engine(kind, g, &patches).make(&ids, &mut factors, &Silent).unwrap();
        let emission = direct::emission(&scene.optics, &patches);
        let rho = direct::reflectance(&scene.optics, &patches);
        let direct = direct::through_rows(&factors, &emission, scene.sky);
        let areas = ids.iter().map(|&i| patches.area(i)).collect();
        Self { scene, patches, factors, emission, rho, direct, areas }
    }

    fn system(&self) -> System<'_> {
        System { factors: &self.factors, rho: &self.rho, direct: &self.direct, areas: &self.areas }
    }

    fn solve(&self, method: Method) -> Vec<Rgb> {
        let options = SolveOptions { method, tolerance: 1e-9, ..SolveOptions::default() };
        solve(&self.system(), &options, &Silent).unwrap().0
    }

    fn balance(&self, h: &[Rgb]) -> EnergyBalance {
        EnergyBalance::of(&self.system(), &self.emission, self.scene.sky, None, h)
    }
}

/// A scene of meshes; each is one surface of reflectance .5, the first glows.
fn scene_of(meshes: &[&Mesh], sides: Sides) -> Scene {
    let mut b = SceneBuilder::new("test");
    for (k, mesh) in meshes.iter().enumerate() {
        let radiance = if k == 0 { Rgb::new(1.0, 2.0, 3.0) } else { Rgb::ZERO };
        let material = b.material(Material { radiance, ..Material::default() });
        let surface = b.surface(Surface { name: format!("mesh {k}"), node: 0, primitive: 0 });
        let vertices: Vec<u32> = mesh.vertices.iter().map(|&v| b.vertex(v)).collect();
        for t in &mesh.triangles {
            b.triangle(t.map(|v| vertices[v as usize]), None, surface, material, sides);
        }
    }
    b.finish()
}

fn quad(corners: [DVec3; 4]) -> Mesh {
    Mesh::from_quads(corners.to_vec(), &[[0, 1, 2, 3]])
}

/// Which mesh of [`scene_of`] a patch belongs to.
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

/// Half the sum of absolute differences.
fn total_variation(p: &Patches, a: &Row, b: &Row) -> f64 {
    p.ids().map(|j| (a.factor_to(j) - b.factor_to(j)).abs()).sum::<f64>() / 2.0
}

#[test]
fn furnace_has_its_radiosity_everywhere() {
    for kind in ENGINES {
        let case = Case::new(builtin::build("furnace").unwrap(), 0.02, kind);
        // Classical rows of a convex room are exact but for single precision.
        let tolerance = if kind == Kind::Classical { 1e-5 } else { 1e-6 };
        for method in METHODS {
            let h = case.solve(method);
            for (i, h) in h.iter().enumerate() {
                let b = case.emission[i] + case.rho[i] * *h;
                let exact = case.emission[i] / (Rgb::ONE - FURNACE_REFLECTANCE);
                let error = (b / exact - Rgb::ONE).abs().max_element();
                assert!(error <= tolerance, "{kind:?} {method:?}: patch {i}: {b} {exact}");
            }
        }
    }
}

#[test]
fn elimination_equals_iteration() {
    for kind in ENGINES {
        let case = Case::new(builtin::build("cornell-box").unwrap(), 0.7, kind);
        let exact = case.solve(Method::Direct);
        assert!(case.system().residual(&exact, 1e-13) < 1e-13);
        let scale = exact.iter().map(|h| h.max_element()).fold(0.0, f64::max);
        for method in METHODS {
            let h = case.solve(method);
            let worst = exact.iter().zip(&h).map(|(a, b)| (*a - *b).abs().max_element());
            let worst = worst.fold(0.0, f64::max) / scale;
            assert!(worst < 1e-6, "{kind:?} {method:?}: {worst:e}");
        }
    }
}

#[test]
fn a_closed_room_with_uneven_emission_receives_what_is_known() {
    let radiance = [0.0, 0.0, 1.0, 20.0, 0.0, 3.0].map(Rgb::splat);
    let rho = Rgb::new(0.3, 0.5, 0.8);
    for kind in ENGINES {
        let scene = || closed_room("uneven", dvec3(4.0, 2.5, 3.0), rho, radiance);
        let mut errors = Vec::new();
        for size in [0.5, 0.1] {
            let case = Case::new(scene(), size, kind);
            let flux: Rgb = case.emission.iter().zip(&case.areas).map(|(e, a)| *e * *a).sum();
            for method in METHODS {
                let h = case.solve(method);
                let arriving: Rgb = h.iter().zip(&case.areas).map(|(h, a)| *h * *a).sum();
                let error = arriving / (flux / (Rgb::ONE - rho)) - Rgb::ONE;
                if method == Method::GaussSeidel {
                    errors.push(error.abs().max_element());
                }
                let balance = case.balance(&h);
                let sink = Rgb::from(balance.absorbed)
                    + Rgb::from(balance.absorbed_by_backs)
                    + Rgb::from(balance.escaped);
                let lost = sink / Rgb::from(balance.emitted) - Rgb::ONE;
                // Nothing escapes: arriving too little is the same as absorbing too little.
                assert!((lost - error).abs().max_element() < 1e-5, "{kind:?}: {lost} {error}");
                assert!(error.abs().max_element() < 0.03, "{kind:?} {method:?}: {error}");
            }
        }
        println!(
            "{kind:?}: relative error of the sum of A H at patch sizes .5 and .1: {errors:.4?}"
        );
        // Noise does not fall with the patch size, but there is no bias either.
        let falls = errors[1] < 0.6 * errors[0];
        assert!(
            falls || kind == Kind::Rays && errors[0].max(errors[1]) < 2e-3,
            "{kind:?}: {errors:?}"
        );
    }
}

#[test]
fn an_open_scene_balances_within_the_engines_error() {
    for kind in [Kind::Hemicube(Draw::Sources), Kind::Classical, Kind::Rays] {
        let case = Case::new(builtin::build("cornell-box").unwrap(), 0.3, kind);
        let balance = case.balance(&case.solve(Method::GaussSeidel));
        println!("{kind:?}: {balance:.4?}");
        assert!(balance.imbalance.abs() < 0.03, "{kind:?}: {}", balance.imbalance);
        if kind == Kind::Classical {
            assert_eq!((balance.escaped, balance.absorbed_by_backs), ([0.0; 3], [0.0; 3]));
        } else {
            assert_eq!(balance.lost, [0.0; 3]);
            assert!(balance.escaped[0] > 0.1 * balance.emitted[0], "the front is open");
        }
    }
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
        (scene_of(&[&floor(), &above], Sides::One), 0.199_824_895_7),
        (scene_of(&[&floor(), &beside], Sides::One), 0.200_043_776_1),
    ]
}

#[test]
fn unit_squares_have_their_analytic_factors() {
    for kind in ENGINES {
        for (scene, exact) in unit_squares() {
            let p = Patches::uniform(&scene.geometry, 0.5 / 256.0).unwrap();
            assert_eq!(p.len(), 2 * 512);
            let mean = mean_factor(&scene.geometry, &p, kind);
            assert!((mean / exact - 1.0).abs() < 5e-3, "{kind:?}: {mean} {exact}");
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

/// Inside a polyhedron every pair is unoccluded: rows must be those of Lambert's formula, whatever
/// the sphere would say.
#[test]
fn inside_a_polyhedral_sphere_rows_are_the_polyhedrons() {
    let sphere = Mesh::geodesic(2.0, 5).inverted();
    let scene = scene_of(&[&sphere], Sides::One);
    let g = &scene.geometry;
    let p = Patches::uniform(g, 1.0).unwrap();
    assert_eq!(p.len(), 500);
    let total: f64 = p.ids().map(|i| p.area(i)).sum();
    for kind in CENTRED {
        let (mut difference, mut sphere) = (0.0_f64, 0.0_f64);
        for (i, row) in p.ids().zip(all_rows(kind, g, &p)) {
            let centre = p.center(i).position(g);
            let normal = g.normal(p.cell(i).triangle, p.cell(i).side);
            let exact = |j| {
                if j == i { 0.0 } else { point_to_polygon(centre, normal, &p.cell(j).corners(g)) }
            };
            let variation: f64 =
                p.ids().map(|j| (row.factor_to(j) - exact(j)).abs()).sum::<f64>() / 2.0;
            let to_sphere: f64 =
                p.ids().map(|j| (row.factor_to(j) - p.area(j) / total).abs()).sum::<f64>() / 2.0;
            (difference, sphere) = (difference.max(variation), sphere.max(to_sphere));
            let sum = row.weights.sum();
            let rounding = if kind == Kind::Classical { 1e-5 } else { 1e-12 };
            assert!((sum - 1.0).abs() < rounding, "{kind:?}: {sum}");
        }
        println!(
            "{kind:?}: worst row against its polyhedron {difference:.5}, a sphere {sphere:.5}"
        );
        // Pixels of a hemicube are as wide as a third of a triangle here.
        let stated = if kind == Kind::Classical { 1e-5 } else { 0.02 };
        assert!(difference < stated, "{kind:?}: {difference}");
        assert!(sphere < 0.1, "{kind:?}: {sphere}");
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
    let scene = scene_of(&[&disc(0.0, true), &disc(1.5, false)], Sides::One);
    let x = 2.0 + 1.5 * 1.5;
    let exact = 0.5 * (x - (x * x - 4.0_f64).sqrt());
    let p = Patches::uniform(&scene.geometry, 0.01).unwrap();
    for kind in ENGINES {
        let mean = mean_factor(&scene.geometry, &p, kind);
        assert!((mean / exact - 1.0).abs() < 5e-3, "{kind:?}: {mean} {exact}");
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

/// A room 3 × 2 × 2.5 m with a ball that floats in it.
fn floating() -> Scene {
    let room = Mesh::cuboid(dvec3(3.0, 2.0, 2.5), [3, 2, 2]).inverted();
    let ball = Mesh::geodesic(0.4, 2).at(0.3, 1.0, 0.1);
    scene_of(&[&room, &ball], Sides::One)
}

#[test]
fn reciprocity_comes_near_and_nearer_with_smaller_patches() {
    let g = floating().geometry;
    for kind in [Kind::Hemicube(Draw::Sources), Kind::Classical] {
        let at = |size: f64| {
            let p = Patches::uniform(&g, size).unwrap();
            (p.len(), reciprocity(&g, &p, kind))
        };
        let (coarse, fine) = (at(0.2), at(0.05));
        println!("{kind:?}: RMS(A_i F_ij - A_j F_ji) / RMS(A_i F_ij): {coarse:.4?} {fine:.4?}");
        assert!(coarse.1 <= 0.25 && fine.1 < coarse.1, "{kind:?}: {coarse:?} {fine:?}");
    }
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
fn closed_scenes_without_contacts_sum_to_exactly_one() {
    let room = Mesh::cuboid(dvec3(3.0, 2.0, 2.5), [3, 2, 2]).inverted();
    let ball = Mesh::geodesic(0.4, 4).at(0.7, 1.2, 0.3);
    let ring = Mesh::torus(0.35, 0.1, 24, 12).tipped().turned(20.0).at(-0.6, 0.7, 0.4);
    let brick = Mesh::cuboid(dvec3(0.5, 0.2, 0.3), [1; 3]).turned(33.0).at(-0.5, 1.4, -0.6);
    let g = scene_of(&[&room, &ball, &ring, &brick], Sides::One).geometry;
    let p = Patches::uniform(&g, 0.02).unwrap();
    for (draw, step) in [(Draw::Sources, 1), (Draw::Patches, 5)] {
        let ids: Vec<PatchId> = p.ids().step_by(step).collect();
        for (i, row) in ids.iter().zip(rows_of(Kind::Hemicube(draw), &g, &p, &ids)) {
            assert_eq!([row.environment, row.back, row.lost], [0.0; 3], "{draw:?} {i:?}");
            assert_eq!(row.weights.sum(), 1.0, "{draw:?} {i:?}");
        }
    }
}

/// Two rooms with one wall between them, all double-sided; the left one is lit.
fn two_rooms() -> Scene {
    let at =
        |x: f64| [dvec3(x, 0.0, 0.0), dvec3(x, 1.0, 0.0), dvec3(x, 1.0, 1.0), dvec3(x, 0.0, 1.0)];
    // The four sides of a box open at both ends.
    let sleeve = |from: f64, to: f64| {
        let vertices = [at(from), at(to)].concat();
        Mesh::from_quads(vertices, &[0, 1, 2, 3].map(|i| [i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4]))
    };
    let (left, wall, right) = (quad(at(0.0)), quad(at(1.0)), quad(at(2.0)));
    scene_of(&[&left, &sleeve(0.0, 1.0), &wall, &sleeve(1.0, 2.0), &right], Sides::Two)
}

#[test]
fn a_thin_wall_leaves_the_dark_room_at_exactly_zero() {
    for kind in ENGINES {
        for size in [0.5, 0.1] {
            let case = Case::new(two_rooms(), size, kind);
            let g = &case.scene.geometry;
            for method in METHODS {
                let h = case.solve(method);
                let (mut dark, mut lit) = (0, 0);
                for id in case.patches.ids() {
                    let cell = case.patches.cell(id);
                    let centre = case.patches.center(id).position(g);
                    let before = centre + 1e-6 * g.normal(cell.triangle, cell.side);
                    let inside =
                        before.cmpgt(DVec3::ZERO).all() && before.y < 1.0 && before.z < 1.0;
                    if inside && before.x > 1.0 && before.x < 2.0 {
                        assert_eq!(h[id.index()], Rgb::ZERO, "{kind:?} {method:?} {size} {centre}");
                        dark += 1;
                    } else if inside && before.x < 1.0 {
                        assert!(h[id.index()].min_element() > 0.0, "{kind:?} {method:?} {centre}");
                        lit += 1;
                    }
                }
                assert_eq!((dark, lit), (case.patches.len() * 6 / 22, case.patches.len() * 6 / 22));
            }
        }
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

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize, kind: Kind| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let case = Case::new(builtin::build("cornell-box").unwrap(), 0.5, kind);
            let solutions = METHODS.map(|m| case.solve(m));
            let rows: Vec<_> = case
                .patches
                .ids()
                .filter_map(|i| Some(case.factors.row(i)?.entries().collect::<Vec<_>>()))
                .collect();
            (rows, solutions)
        })
    };
    for kind in ENGINES {
        let one = run(1, kind);
        for threads in [2, 8] {
            let many = run(threads, kind);
            assert!(one.0 == many.0, "{kind:?}: rows with {threads} threads");
            for ((a, b), method) in one.1.iter().zip(&many.1).zip(METHODS) {
                assert!(a == b, "{kind:?} {method:?}: {threads} threads");
            }
        }
    }
}
