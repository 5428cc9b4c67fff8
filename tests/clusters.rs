//! Clusters: patches of several source triangles.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::scenes::{grey, scene_of};
use glam::{DVec2, DVec3};
use hemicube::direct::{from_lamps, reflectance};
use hemicube::engines::EngineOptions;
use hemicube::engines::{Draw, Engine, EngineError, Hemicube, HemicubeOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{MAX_ANGLE, MAX_DIAMETER, PatchId, Patches, SurfacePoint};
use hemicube::progress::Silent;
use hemicube::reconstruct::Field;
use hemicube::refine::factor::RefineError;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Geometry, Lamp, Rgb, Scene, Side, Sides, TriangleId, TriangleState};
use hemicube::solution::{Adaptive, Clustering, LightError, LightOptions, light};
use hemicube::visibility::Bvh;

/// Meshes whose triangles share no vertices, each a surface of its own that glows.
fn scene(meshes: &[Mesh], sides: Sides) -> Scene {
    let apart: Vec<Mesh> = meshes
        .iter()
        .map(|mesh| {
            let corners = mesh.triangles.iter().flatten();
            Mesh {
                vertices: corners.map(|&v| mesh.vertices[v as usize]).collect(),
                triangles: (0..mesh.triangles.len() as u32)
                    .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
                    .collect(),
            }
        })
        .collect();
    scene_of(apart.iter().map(|mesh| (mesh, grey(0.5, 1.0))), sides)
}

/// A square of 1 m² in n x n cells.
fn square(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |i: u32| f64::from(i) / f64::from(n);
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        mesh.vertices.push(DVec3::new(at(j), 0.0, -at(i)));
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b] = [i * (n + 1) + j, (i + 1) * (n + 1) + j];
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    mesh
}

fn rooms() -> Geometry {
    let room = Mesh::cuboid(DVec3::splat(3.0), [24; 3]).inverted();
    let sphere = Mesh::geodesic(0.4, 24).at(0.5, 0.7, 0.3);
    let knot = Mesh::torus_knot((2, 3), 0.4, 0.15, 0.08, 300, 24).at(-0.6, 1.4, 0.0);
    scene(&[room, sphere, knot], Sides::Two).geometry
}

fn points(n: u32) -> impl Iterator<Item = DVec2> {
    (0..n).map(move |i| {
        let i = f64::from(i) + 0.5;
        DVec2::new(i / f64::from(n), (i * 0.618_033_988_749_895).fract())
    })
}

#[test]
fn a_cluster_respects_area_label_normals_and_extent() {
    let g = rooms();
    let max_area = 0.02;
    let p = Patches::clustered(&g, max_area, &g.surface_of).unwrap();
    assert!(p.len() < Patches::uniform(&g, max_area).unwrap().len() / 3, "{} patches", p.len());
    for id in p.ids().filter(|&i| p.is_cluster(i)) {
        let cell = p.cell(id);
        let members = p.members(id);
        assert!(members.len() > 1 && members.contains(&cell.triangle));
        assert!(p.area(id) <= max_area * (1.0 + 1e-9));
        let label = |t: TriangleId| g.surface_of[t.index()];
        assert!(members.iter().all(|&t| label(t) == label(cell.triangle)));
        let mean: DVec3 = members.iter().map(|&t| g.normal(t, cell.side) * g.area(t)).sum();
        let mean = mean.normalize();
        let centroid = |t: TriangleId| g.corners(t).iter().sum::<DVec3>() / 3.0;
        let middle = members.iter().map(|&t| centroid(t) * g.area(t)).sum::<DVec3>() / p.area(id);
        for &t in members {
            assert!(g.normal(t, cell.side).dot(mean) >= MAX_ANGLE.cos() - 1e-9);
            let reach = 0.5 * MAX_DIAMETER * max_area.sqrt();
            assert!(centroid(t).distance(middle) <= reach + 1e-9);
        }
        assert_eq!(p.origin(id).triangle, cell.triangle);
    }
}

#[test]
fn areas_look_up_and_samples_agree() {
    let g = rooms();
    let p = Patches::clustered(&g, 0.02, &g.surface_of).unwrap();
    let all: f64 = g.ids().map(|t| 2.0 * g.area(t)).sum();
    assert!((p.ids().map(|i| p.area(i)).sum::<f64>() / all - 1.0).abs() < 1e-12);
    let mut found = vec![0.0; p.len()];
    for t in g.ids() {
        for side in Side::BOTH {
            let at = SurfacePoint { triangle: t, side, uv: DVec2::new(0.2, 0.3) };
            let id = p.at(at).unwrap();
            assert!(p.members(id).contains(&t) && p.cell(id).side == side);
            found[id.index()] += g.area(t);
        }
    }
    for id in p.ids() {
        assert!((found[id.index()] / p.area(id) - 1.0).abs() < 1e-12);
        assert!((p.area_fractions(id).map(|f| f.1).sum::<f64>() - 1.0).abs() < 1e-12);
        for u in points(7).chain([DVec2::ZERO, DVec2::new(1.0 - 1e-16, 0.5)]) {
            assert_eq!(p.at(p.sample(id, u)), Some(id));
        }
    }
}

#[test]
fn samples_are_uniform_in_area() {
    let g = scene(&[square(16)], Sides::One).geometry;
    let p = Patches::clustered(&g, 0.1, &[]).unwrap();
    for id in p.ids() {
        let n = 4096;
        let mean = points(n).map(|u| p.sample(id, u).position(&g)).sum::<DVec3>() / f64::from(n);
        let centroid = |t: TriangleId| g.corners(t).iter().sum::<DVec3>() / 3.0;
        let exact: DVec3 = p.area_fractions(id).map(|(t, fraction)| centroid(t) * fraction).sum();
        assert!(mean.distance(exact) < 2e-3, "{mean} {exact}");
    }
}

#[test]
fn a_flat_square_falls_into_compact_patches_of_about_the_area() {
    let g = scene(&[square(64)], Sides::One).geometry;
    for count in [4.0, 9.0, 16.0, 50.0, 200.0] {
        let p = Patches::clustered(&g, 1.0 / count, &[]).unwrap();
        let n = p.len() as f64;
        assert!(n >= count && n <= 1.5 * count, "{n} patches for {count}");
        for id in p.ids() {
            assert!(p.area(id) > 0.3 / count, "{} of {count}", p.area(id));
            let corners = p.pieces(id).flat_map(|c| c.corners(&g));
            let (low, high) =
                corners.map(|c| (c, c)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap();
            let (x, z) = (high.x - low.x, high.z - low.z);
            assert!(x.max(z) <= 3.0 * x.min(z), "{x} x {z}");
            assert!(p.area(id) > 0.5 * x * z, "{} in {x} x {z}", p.area(id));
        }
    }
}

#[test]
fn triangles_larger_than_a_patch_are_split_as_ever() {
    let g = scene(&[square(2), Mesh::geodesic(0.5, 3).at(5.0, 0.0, 0.0)], Sides::One).geometry;
    let (p, q) = (Patches::clustered(&g, 1e-3, &[]).unwrap(), Patches::uniform(&g, 1e-3).unwrap());
    assert!(!p.has_clusters());
    assert!(p.splits() == q.splits() && p.ids().all(|i| p.cell(i) == q.cell(i)));
}

#[test]
fn nothing_is_joined_across_folds_labels_flaws_and_what_stands_on_an_edge() {
    // All faces of a cube, and of a square each half.
    let cube = scene(&[Mesh::cuboid(DVec3::ONE, [4; 3])], Sides::One).geometry;
    assert_eq!(Patches::clustered(&cube, 10.0, &[]).unwrap().len(), 6);
    let mut g = scene(&[square(4)], Sides::One).geometry;
    assert_eq!(Patches::clustered(&g, 10.0, &[]).unwrap().len(), 1);
    let half: Vec<u32> = g.ids().map(|t| u32::from(t.0 >= 16)).collect();
    assert_eq!(Patches::clustered(&g, 10.0, &half).unwrap().len(), 2);
    // A copy and a triangle without area change nothing.
    g.triangles.extend([g.triangles[3], [0, 0, 1]]);
    g.sides.extend([Sides::One; 2]);
    g.state.extend([TriangleState::Solid; 2]);
    g.surface_of.extend([0; 2]);
    g.flag_flaws();
    let p = Patches::clustered(&g, 10.0, &[]).unwrap();
    assert_eq!((p.len(), p.members(PatchId(0)).len()), (1, 32));
    // A wall across the square, of other triangles than its own: along a row of edges, or aside.
    for (x, least, most) in [(0.5, 2, 2), (0.6, 4, 12)] {
        let wall = Mesh::from_quads(
            [(-0.5, 0.0), (1.5, 0.0), (1.5, 1.0), (-0.5, 1.0)]
                .map(|(z, y)| DVec3::new(x, y, -z))
                .to_vec(),
            &[[0, 1, 2, 3]],
        );
        let g = scene(&[square(4), wall], Sides::One).geometry;
        let p = Patches::clustered(&g, 10.0, &g.surface_of).unwrap();
        let floor: Vec<PatchId> = p.ids().filter(|&i| p.cell(i).triangle.0 < 32).collect();
        assert!((least..=most).contains(&floor.len()), "{} about {x}", floor.len());
        for id in floor.into_iter().filter(|&i| p.is_cluster(i)) {
            let right = |t: &TriangleId| g.corners(*t).iter().sum::<DVec3>().x / 3.0 > x;
            let right: Vec<bool> = p.members(id).iter().map(right).collect();
            assert!(right.iter().all(|&r| r == right[0]), "a cluster on both sides of a wall");
        }
    }
}

#[test]
fn rows_of_a_closed_scene_sum_to_exactly_one() {
    let room = Mesh::cuboid(DVec3::splat(2.0), [12; 3]).inverted();
    let ball = Mesh::geodesic(0.4, 10).at(0.1, 0.9, -0.2);
    let g = scene(&[room, ball], Sides::One).geometry;
    let p = Patches::clustered(&g, 0.08, &g.surface_of).unwrap();
    assert!(p.has_clusters());
    let ids: Vec<PatchId> = p.ids().collect();
    let rows = |draw| {
        let options = HemicubeOptions { resolution: 64, draw };
        let mut rows = vec![Row::default(); ids.len()];
        Hemicube::new(&g, &p, options).unwrap().fill(&ids, &mut rows).unwrap();
        rows
    };
    let (sources, patches) = (rows(Draw::Sources), rows(Draw::Patches));
    for (id, row) in p.ids().zip(&sources) {
        assert_eq!(row.weights.sum(), 1.0);
        assert_eq!([row.environment, row.back, row.lost], [0.0; 3]);
        // All clusters here are flat or convex: they do not see themselves.
        assert_eq!(row.factor_to(id), 0.0, "{id:?}");
    }
    for (a, b) in sources.iter().zip(&patches) {
        let difference: f64 =
            p.ids().map(|j| (a.factor_to(j) - b.factor_to(j)).abs()).sum::<f64>() / 2.0;
        assert!(difference <= 1e-4, "{difference}");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let g = rooms();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Patches::clustered(&g, 0.02, &g.surface_of).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.splits(), three.splits());
    assert!(one.ids().all(|i| one.cell(i) == three.cell(i) && one.area(i) == three.area(i)));
    assert!(one.ids().all(|i| one.members(i) == three.members(i)));
}

#[test]
fn a_glowing_closed_room_of_clusters_has_the_exact_answer() {
    let room = Mesh::cuboid(DVec3::splat(2.0), [10; 3]).inverted();
    let ball = Mesh::geodesic(0.4, 8).at(0.1, 0.9, -0.2);
    let mut scene = scene(&[room, ball], Sides::One);
    let rho = Rgb::new(0.3, 0.5, 0.8);
    for i in 0..scene.geometry.len() {
        scene.optics.reflectance[i] = rho;
    }
    let mut options = LightOptions {
        patch_size: Some(0.1),
        cluster: Clustering::On,
        engine: EngineOptions::Hemicube(HemicubeOptions { resolution: 64, draw: Draw::Sources }),
        ..LightOptions::default()
    };
    let solution = light(&scene, &options, &Silent).unwrap();
    assert!(solution.report.clusters > 100);
    let exact = std::f64::consts::PI / (Rgb::ONE - rho);
    let field = solution.field(&scene);
    for t in scene.geometry.ids() {
        let p = SurfacePoint { triangle: t, side: Side::Front, uv: DVec2::new(0.3, 0.3) };
        assert!((field.at(p) / exact - 1.0).abs().max_element() < 1e-5);
    }
    // Neither few triangles nor those who cannot use clusters get them.
    options.cluster = Clustering::Auto;
    assert_eq!(light(&scene, &options, &Silent).unwrap().report.clusters, 0);
    options.cluster = Clustering::On;
    options.engine = EngineOptions::Classical;
    assert!(matches!(
        light(&scene, &options, &Silent),
        Err(LightError::Engine(EngineError::Clusters("classical")))
    ));
    options.adaptive = Some(Adaptive { max_factor: 0.01, min_area: 0.1 });
    options.engine = EngineOptions::Hemicube(HemicubeOptions::default());
    assert!(matches!(
        light(&scene, &options, &Silent),
        Err(LightError::Refine(RefineError::Clusters))
    ));
}

#[test]
fn the_field_of_clusters_follows_a_gradient_within_them() {
    let g = scene(&[square(64)], Sides::One).geometry;
    let p = Patches::clustered(&g, 0.02, &[]).unwrap();
    let value = |x: DVec3| Rgb::splat(5.0 + 3.0 * x.x - 2.0 * x.z);
    let irradiance: Vec<Rgb> = p.ids().map(|i| value(p.center(i).position(&g))).collect();
    let field = Field::new(&g, &p, &irradiance, |_| true);
    for t in g.ids() {
        let at = SurfacePoint { triangle: t, side: Side::Front, uv: DVec2::new(0.3, 0.4) };
        let exact = value(at.position(&g)).x;
        let off = (field.at(at).x - exact).abs();
        assert!(off < 0.08, "{off} at {}", at.position(&g));
    }
}

#[test]
fn a_wall_across_clusters_leaves_the_dark_room_dark() {
    // Along the edges of the floor's triangles; and across them, where the triangles that the wall
    // cuts stay alone and keep one value each, which shines faintly into the dark room.
    for (x, width, leak) in [(0.5, 0.0, 0.0), (0.47, 0.1, 3e-2)] {
        let room = Mesh::cuboid(DVec3::new(3.0, 1.0, 1.0), [30, 10, 10]).inverted();
        let corners = [(0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)];
        let wall = corners.map(|(y, z)| DVec3::new(x, y, z)).to_vec();
        let wall = Mesh::from_quads(wall, &[[0, 1, 2, 3]]);
        let mut scene = scene(&[room, wall], Sides::Two);
        let centroid = |g: &Geometry, t: TriangleId| g.corners(t).iter().sum::<DVec3>() / 3.0;
        for t in scene.geometry.ids() {
            let lamp = centroid(&scene.geometry, t).x < -1.499;
            scene.optics.emission[t.index()] = if lamp { Rgb::ONE } else { Rgb::ZERO };
        }
        let options = LightOptions {
            patch_size: Some(0.03),
            cluster: Clustering::On,
            engine: EngineOptions::Hemicube(HemicubeOptions {
                resolution: 64,
                draw: Draw::Sources,
            }),
            ..LightOptions::default()
        };
        let solution = light(&scene, &options, &Silent).unwrap();
        assert!(solution.report.clusters > 100);
        let field = solution.field(&scene);
        let g = &scene.geometry;
        let (mut dark, mut lit) = (0, 0);
        for t in g.ids() {
            for uv in [[0.1, 0.1], [0.8, 0.1], [0.1, 0.8], [0.3, 0.3]].map(DVec2::from_array) {
                let p = SurfacePoint { triangle: t, side: Side::Front, uv };
                let h = field.at(p).x;
                match p.position(g).x - x {
                    d if d > 1e-6 + width => {
                        assert!(h <= leak, "{h} leaks to {}", p.position(g));
                        dark += 1;
                    }
                    d if d < -1e-6 => {
                        assert!(h > 0.05, "shade leaks to {}: {h}", p.position(g));
                        lit += 1;
                    }
                    _ => {}
                }
            }
        }
        assert!(dark > 1000 && lit > 1000);
    }
}

#[test]
fn lamps_shine_on_the_whole_of_a_cluster() {
    let mut scene = scene(&[square(48)], Sides::One);
    scene.lamps.push(Lamp::Point {
        name: "lamp".into(),
        position: DVec3::new(0.5, 0.5, -0.5),
        intensity: Rgb::ONE,
        x_axis: DVec3::X,
        photometry: None,
    });
    let g = &scene.geometry;
    let bvh = Bvh::new(g);
    let flux = |p: &Patches| {
        let direct = from_lamps(&scene, p, &bvh);
        p.ids().map(|i| direct[i.index()].x * p.area(i)).sum::<f64>()
    };
    let fine = flux(&Patches::uniform(g, 1e-4).unwrap());
    let coarse = flux(&Patches::clustered(g, 0.05, &[]).unwrap());
    assert!((coarse / fine - 1.0).abs() < 0.01, "{coarse} {fine}");
}

#[test]
fn optics_of_a_cluster_are_means_by_area() {
    let mut scene = scene(&[square(16)], Sides::One);
    let g = &scene.geometry;
    for t in g.ids() {
        let rho = g.corners(t)[0].x.min(0.9);
        scene.optics.reflectance[t.index()] = Rgb::splat(rho);
    }
    let p = Patches::clustered(g, 0.1, &[]).unwrap();
    let rho = reflectance(&scene.optics, &p);
    let by_patch: f64 = p.ids().map(|i| rho[i.index()].x * p.area(i)).sum();
    let exact: f64 = g.ids().map(|t| scene.optics.reflectance[t.index()].x * g.area(t)).sum();
    assert!((by_patch / exact - 1.0).abs() < 1e-12);
}
