//! Baked light against random paths, at walls between rooms, at seams, and through a file.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::collections::HashMap;
use std::path::Path;

use common::baked::{baked, place, positions, weighted};
use common::known::{mean, points_kept};
use common::scenes::grey;
use glam::{DVec2, DVec3};
use hemicube::bake::{Bake, Facet};
use hemicube::export::{BakeMode, write_glb};
use hemicube::scene::{ImportOptions, Scene, SceneBuilder, Sides, builtin, load, luminance};

/// A point within a facet.
const MIDDLE: DVec3 = DVec3::splat(1.0 / 3.0);

#[test]
fn texels_are_as_right_as_points() {
    let scene = builtin::build("cornell-box").unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/known/cornell-box-points.txt");
    let known = points_kept(&scene, (60, 300), 0.0025, &file, false);
    let mean = mean(&known);
    baked(&scene, Some(0.02), true, |bake| {
        let facets = bake.facets();
        let mut off: Vec<f64> = known
            .iter()
            .filter_map(|k| {
                let at = place(&scene, &facets, k.placed.point, k.placed.normal)?;
                Some((luminance(bake.at(at)[0]) - luminance(k.irradiance)).abs() / mean)
            })
            .collect();
        off.sort_by(f64::total_cmp);
        let n = off.len();
        let rms = (off.iter().map(|o| o * o).sum::<f64>() / n as f64).sqrt();
        println!("{n} points: RMS {rms:.4}, 95 % {:.4}, worst {:.4}", off[n * 19 / 20], off[n - 1]);
        assert!(n >= 290, "{n} found");
        // Many lie within millimetres of a contact, and a texel is 20 mm wide.
        assert!(rms < RMS && off[n - 1] < WORST, "{rms} {}", off[n - 1]);
        Ok(())
    })
    .unwrap();
}

const RMS: f64 = 0.015;
const WORST: f64 = 0.07;

/// Two rooms in one shell: the left one has a lamp, and a wall of that thickness (m) stands between
/// them on a floor that runs through.
fn two_rooms(thickness: f64) -> Scene {
    let mut b = SceneBuilder::new("two rooms");
    let (wall, lamp) = (b.material(grey(0.6, 0.0)), b.material(grey(0.0, 10.0)));
    let solid = |low: DVec3, high: DVec3, inwards: bool| {
        let corner = |i: usize| {
            let pick = |k: usize| if i >> k & 1 == 1 { high[k] } else { low[k] };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        let quads =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        let turn = |t: [u32; 3]| if inwards { [t[0], t[2], t[1]] } else { t };
        ((0..8).map(corner).collect::<Vec<_>>(), triangles.map(turn).collect::<Vec<_>>())
    };
    let (v, t) = solid(DVec3::ZERO, DVec3::new(6.0, 2.5, 3.0), true);
    b.mesh("shell", &v, &t, wall, Sides::Two);
    let (low, high) = (DVec3::new(2.9, -0.1, -0.1), DVec3::new(2.9 + thickness, 2.6, 3.1));
    if thickness > 0.0 {
        let (v, t) = solid(low, high, false);
        b.mesh("wall", &v, &t, wall, Sides::Two);
    } else {
        let at = |y: f64, z: f64| DVec3::new(2.9, y, z);
        let v = [at(-0.1, -0.1), at(2.6, -0.1), at(2.6, 3.1), at(-0.1, 3.1)];
        b.mesh("wall", &v, &[[0, 1, 2], [0, 2, 3]], wall, Sides::Two);
    }
    let at = |x: f64, z: f64| DVec3::new(x, 2.49, z);
    let v = [at(1.0, 1.0), at(2.0, 1.0), at(2.0, 2.0), at(1.0, 2.0)];
    b.mesh("lamp", &v, &[[0, 1, 2], [0, 2, 3]], lamp, Sides::One);
    b.finish()
}

#[test]
fn no_light_passes_a_wall_that_stands_on_a_floor() {
    for thickness in [0.0, 0.1] {
        let scene = two_rooms(thickness);
        baked(&scene, Some(0.05), true, |bake| {
            let (mut lit, mut dark) = (0.0_f64, 0.0_f64);
            for facets in [bake.facets(), bake.refined()] {
                for f in &facets {
                    let corners = positions(&scene, f);
                    let middle = corners.iter().sum::<DVec3>() / 3.0;
                    let normal = scene.geometry.normal(f.triangle, f.side);
                    let inside = middle.cmpgt(DVec3::ZERO).all()
                        || (middle + normal * 1e-3).cmpgt(DVec3::ZERO).all();
                    let beyond = middle + normal * 1e-3;
                    if inside && beyond.x > 2.9 + thickness && beyond.y < 2.5 && beyond.z < 3.0 {
                        for l in [MIDDLE, DVec3::X, DVec3::Y, DVec3::Z] {
                            let [e, shown] = bake.at(weighted(f.atlas, l));
                            dark = dark.max(e.max_element()).max(shown.max_element());
                        }
                        let most = f.radiance.iter().flatten().fold(0.0_f32, |m, c| m.max(*c));
                        dark = dark.max(f64::from(most));
                    } else {
                        lit = lit.max(luminance(bake.at(weighted(f.atlas, MIDDLE))[0]));
                    }
                }
            }
            assert!(lit > 1.0, "{lit}");
            assert_eq!(dark, 0.0, "behind a wall of {thickness} m");
            Ok(())
        })
        .unwrap();
    }
}

#[test]
fn both_sides_of_a_seam_hold_the_same_light() {
    let scene = common::furnished::furnished(2);
    baked(&scene, Some(0.01), true, |bake| {
        let facets = bake.facets();
        // By their middles: edges where charts meet smoothly.
        let mut edges: HashMap<[i64; 3], Vec<(&Facet, usize)>> = HashMap::new();
        for f in &facets {
            let p = positions(&scene, f);
            for k in 0..3 {
                let key = ((p[k] + p[(k + 1) % 3]) * 0.5 * 1e7).round().to_array();
                edges.entry(key.map(|c| c as i64)).or_default().push((f, k));
            }
        }
        let normal = |f: &Facet| scene.geometry.normal(f.triangle, f.side);
        let (mut squares, mut worst, mut count, mut sum) = (0.0, 0.0_f64, 0.0, 0.0);
        for pair in edges.values() {
            let [(a, i), (b, j)] = pair[..] else { continue };
            let ball = |f: &Facet| {
                let surface = scene.geometry.surface_of[f.triangle.index()] as usize;
                scene.geometry.surfaces[surface].name.contains("ball")
            };
            if a.chart == b.chart || normal(a).dot(normal(b)) < 0.9 || !ball(a) {
                continue;
            }
            let middle = |f: &Facet, k: usize| f.atlas[k].midpoint(f.atlas[(k + 1) % 3]);
            let light = |at: DVec2| luminance(bake.at(at)[0]);
            let (x, y) = (light(middle(a, i)), light(middle(b, j)));
            squares += (x - y) * (x - y);
            worst = worst.max((x - y).abs());
            sum += (x + y) / 2.0;
            count += 1.0;
        }
        let (mean, rms) = (sum / count, (squares / count).sqrt());
        println!("{count} edges: RMS {:.4}, worst {:.4} of the mean", rms / mean, worst / mean);
        assert!(count > 20.0, "{count} edges");
        assert!(rms < 0.012 * mean, "{rms} of {mean}");
        Ok(())
    })
    .unwrap();
}

#[test]
fn a_model_comes_back_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = builtin::build("cornell-box").unwrap();
    let modes = [
        ("unlit.glb", BakeMode::Unlit),
        ("vertex.glb", BakeMode::Vertex),
        ("lightmap.glb", BakeMode::Lightmap { keeps_lamps: true }),
    ];
    for (name, mode) in modes {
        let file = folder.path().join(name);
        baked(&scene, Some(0.2), true, |bake| Ok(write_glb(&file, &scene, bake, mode)?)).unwrap();
        let read = load(&file, &ImportOptions::default()).unwrap();
        let area = |s: &Scene| s.geometry.ids().map(|t| s.geometry.area(t)).sum::<f64>();
        assert!((area(&read) / area(&scene) - 1.0).abs() < 1e-5, "{name}");
        assert_eq!(read.cameras.len(), scene.cameras.len());
        let names = |s: &Scene| {
            let mut names: Vec<String> =
                s.geometry.surfaces.iter().map(|s| s.name.clone()).collect();
            names.sort();
            names.dedup();
            names
        };
        assert_eq!(names(&read), names(&scene), "{name}");
        // Twice over: a baked model is a model.
        let again = folder.path().join("again.glb");
        if name == "lightmap.glb" {
            baked(&read, Some(0.2), true, |b| Ok(write_glb(&again, &read, b, mode)?)).unwrap();
            let again = load(&again, &ImportOptions::default()).unwrap();
            assert!((area(&again) / area(&scene) - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn what_programs_keep_beside_materials_may_be_anything() {
    let folder = tempfile::tempdir().unwrap();
    let (file, baked_file) = (folder.path().join("m.gltf"), folder.path().join("baked.glb"));
    // A triangle of 1 m that shines, and reads a list for a material as one that says nothing.
    for material in [r#"{"emissiveFactor":[1,1,1],"extras":[]}"#, "[]"] {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},
            "material":0}}]}}],"materials":[{material}],"accessors":[{{"bufferView":0,
            "componentType":5126,"count":3,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,
            "byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"data:;base64,{}"}}]}}"#,
            "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
        );
        std::fs::write(&file, text).unwrap();
        let scene = load(&file, &ImportOptions::default()).unwrap();
        for mode in [BakeMode::Vertex, BakeMode::Lightmap { keeps_lamps: true }] {
            let write = |bake: &Bake<'_>| Ok(write_glb(&baked_file, &scene, bake, mode)?);
            baked(&scene, Some(0.5), true, write).unwrap();
            let read = load(&baked_file, &ImportOptions::default()).unwrap();
            assert_eq!(read.optics.materials.len(), 1);
        }
    }
}
