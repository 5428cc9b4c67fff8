//! Seconds of each stage but the rows for a model of about a million triangles.
//!
//! `cargo run --release --example million [-- TRIANGLES [OBJ]]`
//!
//! The model is a closed room with finely divided walls, a sphere and a torus knot; with a second
//! argument it is also written there as Wavefront OBJ, read back and timed.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use hemicube::patches::Patches;
use hemicube::progress::Silent;
use hemicube::reconstruct::Field;
use hemicube::render::{PictureOptions, Renderer};
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{ImportOptions, Material, Rgb, Scene, SceneBuilder, Sides, inspect, load};
use hemicube::staging::{Lens, Model, viewpoint};
use hemicube::visibility::{Bvh, Occluders, uncover};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let triangles =
        arguments.next().map_or(Ok(1_000_000), |n| n.parse::<f64>().map(|n| n as u32))?;
    let obj = arguments.next();
    let scene = timed("scene: build", || room(triangles));
    let g = &scene.geometry;
    println!("{} triangles", g.len());
    timed("scene: fingerprint", || g.fingerprint());
    timed("scene: inspect", || inspect(&scene));
    timed("occluders", || Occluders::new(g));
    timed("viewpoint", || Model::of(&scene).map(|m| viewpoint(&m, m.kind(), &Lens::default())));
    let patches = timed("patches: uniform", || Patches::uniform(g, 0.01))?;
    println!("  {} patches", patches.len());
    stages(&scene, patches)?;
    let label: Vec<u32> = g.surface_of.clone();
    let patches = timed("patches: clustered", || Patches::clustered(g, 0.01, &label))?;
    println!("  {} patches, {} of them clusters", patches.len(), clusters(&patches));
    stages(&scene, patches)?;
    if let Some(path) = obj {
        let path = Path::new(&path);
        std::fs::write(path, wavefront(&scene, path)?)?;
        std::fs::write(path.with_extension("mtl"), materials(&scene)?)?;
        timed("scene: load OBJ", || load(path, &ImportOptions::default()))?;
    }
    Ok(())
}

fn clusters(patches: &Patches) -> usize {
    patches.ids().filter(|&i| patches.is_cluster(i)).count()
}

/// What follows the subdivision.
fn stages(scene: &Scene, patches: Patches) -> Result<(), Box<dyn Error>> {
    let g = &scene.geometry;
    let bvh = timed("hierarchy of boxes", || Bvh::new(g));
    let patches = timed("patches: uncover", || uncover(g, patches, &bvh, &Silent))?;
    let irradiance = vec![Rgb::ONE; patches.len()];
    let field = timed("field", || Field::new(g, &patches, &irradiance, |_| true));
    let renderer = timed("renderer", || Renderer::new(scene, &field));
    let model = Model::of(scene).ok_or("nothing to see")?;
    let camera = viewpoint(&model, model.kind(), &Lens::default()).camera;
    let picture = PictureOptions::default();
    timed("picture", || {
        renderer.render(&camera, &picture, |s| s.radiance.as_vec3().to_array(), &Silent)
    })?;
    Ok(())
}

fn timed<T>(stage: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    println!("{stage:20} {:8.3} s", start.elapsed().as_secs_f64());
    result
}

/// A closed room of 4 x 3 x 4 m with a sphere and a knot, in about so many triangles.
fn room(triangles: u32) -> Scene {
    let part = f64::from(triangles) / 3.0;
    let along = |per_square: f64| (part / per_square).sqrt().round().max(1.0) as u32;
    let walls = Mesh::cuboid(DVec3::new(4.0, 3.0, 4.0), [along(12.0); 3]).inverted();
    let sphere = Mesh::geodesic(0.5, along(20.0)).at(-0.9, 0.6, 0.5);
    let knot =
        Mesh::torus_knot((2, 3), 0.45, 0.2, 0.1, 8 * along(16.0), along(16.0)).at(0.8, 1.0, -0.4);
    let lamp = Mesh::cuboid(DVec3::new(0.8, 0.02, 0.8), [4, 1, 4]).at(0.0, 2.9, 0.0);
    let mut b = SceneBuilder::new("million");
    for (name, rho, radiance, mesh) in [
        ("walls", 0.7, 0.0, walls),
        ("sphere", 0.6, 0.0, sphere),
        ("knot", 0.5, 0.0, knot),
        ("lamp", 0.0, 20.0, lamp),
    ] {
        let material = b.material(Material {
            name: name.into(),
            reflectance: Rgb::splat(rho),
            radiance: Rgb::splat(radiance),
            ..Material::default()
        });
        b.mesh(name, &mesh.vertices, &mesh.triangles, material, Sides::One);
    }
    b.finish()
}

fn wavefront(scene: &Scene, path: &Path) -> Result<String, Box<dyn Error>> {
    let g = &scene.geometry;
    let library = path.with_extension("mtl");
    let library = library.file_name().and_then(|n| n.to_str()).ok_or("no name")?;
    let mut text = format!("mtllib {library}\n");
    for v in &g.vertices {
        writeln!(text, "v {} {} {}", v.x as f32, v.y as f32, v.z as f32)?;
    }
    let mut last = "";
    for (id, t) in g.ids().zip(&g.triangles) {
        let material = scene.optics.material(id).name.as_str();
        if material != last {
            writeln!(text, "usemtl {material}")?;
            last = material;
        }
        writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1)?;
    }
    Ok(text)
}

fn materials(scene: &Scene) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for m in &scene.optics.materials {
        let (rho, radiance) = (m.reflectance, m.radiance);
        writeln!(text, "newmtl {}", m.name)?;
        writeln!(text, "Kd {} {} {}", rho.x, rho.y, rho.z)?;
        writeln!(text, "Ke {} {} {}", radiance.x, radiance.y, radiance.z)?;
    }
    Ok(text)
}
