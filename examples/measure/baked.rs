//! Baked models and what their surfaces should show.
//!
//! `readers FOLDER` bakes some scenes in each mode, and writes beside each NAME.glb as
//! NAME.points.json what points of it show: `tests/readers` compares other programs with that.
//!
//! `points SCENE TEXEL POINTS.csv` prints the irradiance that an atlas of texels of TEXEL metres
//! has at points (x,y,z,nx,ny,nz), for comparison with what is known of them.

#![allow(clippy::print_stdout, reason = "it prints what it found")]
#![allow(clippy::unwrap_used, reason = "what it shares with tests fails by panicking")]

#[path = "../../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::fs;
use std::path::Path;

use common::baked::{baked, place, point, weighted};
use glam::DVec3;
use hemicube::bake::Facet;
use hemicube::export::{BakeMode, write_glb};
use hemicube::scene::{ImportOptions, Rgb, Scene, builtin, load};
use serde_json::json;

/// Points of each file.
const POINTS: usize = 120;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["readers", folder] => readers(Path::new(folder)),
        ["points", scene, texel, table] => points(&scene_of(scene)?, texel.parse()?, table),
        _ => Err("usage: baked readers FOLDER | points SCENE TEXEL POINTS.csv".into()),
    }
}

fn scene_of(name: &str) -> Result<Scene, Box<dyn Error>> {
    Ok(match builtin::build(name) {
        Some(scene) => scene,
        None => load(Path::new(name), &ImportOptions::default())?,
    })
}

fn readers(folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    for name in ["cornell-box", "room"] {
        readers_of(&scene_of(name)?, name, folder)?;
    }
    // A glTF file as it comes in, with nodes and materials of its own.
    let again = folder.join("room-lightmap.glb");
    readers_of(&load(&again, &ImportOptions::default())?, "again", folder)
}

fn readers_of(scene: &Scene, name: &str, folder: &Path) -> Result<(), Box<dyn Error>> {
    let modes = [
        ("unlit", BakeMode::Unlit),
        ("vertex", BakeMode::Vertex),
        ("lightmap", BakeMode::Lightmap { keeps_lamps: true }),
    ];
    for (mode_name, mode) in modes {
        let lamps = mode != (BakeMode::Lightmap { keeps_lamps: true });
        baked(scene, None, lamps, |bake| {
            let file = folder.join(format!("{name}-{mode_name}.glb"));
            let written = write_glb(&file, scene, bake, mode)?;
            let facets = match mode {
                BakeMode::Vertex => bake.refined(),
                _ => bake.facets(),
            };
            let points: Vec<_> = spread(scene, &facets)
                .map(|(facet, l)| {
                    let atlas = weighted(facet.atlas, l);
                    let at = point(facet, l);
                    let rho = scene.optics.reflectance[facet.triangle.index()];
                    let radiance = match mode {
                        BakeMode::Unlit => bake.at(atlas)[1],
                        BakeMode::Vertex => {
                            let of = |k: usize| DVec3::from(facet.radiance[k].map(f64::from));
                            of(0) * l.x + of(1) * l.y + of(2) * l.z
                        }
                        BakeMode::Lightmap { .. } => rho * bake.at(atlas)[0] / std::f64::consts::PI,
                    };
                    json!({
                        "position": at.position(&scene.geometry).to_array(),
                        "normal": scene.geometry.normal(at.triangle, at.side).to_array(),
                        "radiance": radiance.to_array(),
                    })
                })
                .collect();
            let scale = if mode == BakeMode::Vertex { 1.0 / written.scale } else { 1.0 };
            let table = json!({
                "mode": mode_name, "scale": scale, "near": 1e-4, "points": points
            });
            fs::write(file.with_extension("points.json"), serde_json::to_vec_pretty(&table)?)?;
            Ok(())
        })?;
    }
    Ok(())
}

/// Points on surfaces that emit nothing, spread evenly over their area.
fn spread<'a>(scene: &'a Scene, facets: &'a [Facet]) -> impl Iterator<Item = (&'a Facet, DVec3)> {
    let own: Vec<&Facet> =
        facets.iter().filter(|f| scene.optics.emission(f.triangle, f.side) == Rgb::ZERO).collect();
    let mut sums = vec![0.0];
    for f in &own {
        let [a, b, c] = f.corners;
        let area = scene.geometry.area(f.triangle) * (b - a).perp_dot(c - a).abs();
        sums.push(sums[sums.len() - 1] + area);
    }
    (0..POINTS).map(move |i| {
        /// Steps of a sequence that is spread evenly over a square (Roberts 2018).
        const STEP: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
        let target = (i as f64 + 0.5) / POINTS as f64 * sums[own.len()];
        let k = sums.partition_point(|s| *s <= target).clamp(1, own.len()) - 1;
        let [u, v] = STEP.map(|s| (s * (i + 1) as f64).fract());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        (own[k], DVec3::new(1.0 - u - v, u, v))
    })
}

fn points(scene: &Scene, texel: f64, table: &str) -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(table)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let columns = ["x", "y", "z", "nx", "ny", "nz"].map(|n| header.iter().position(|h| *h == n));
    println!("x,y,z,E_r,E_g,E_b");
    baked(scene, Some(texel), true, |bake| {
        let facets = bake.facets();
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let value = |c: usize| -> Option<f64> { cells.get(columns[c]?)?.parse().ok() };
            let vector = |c: usize| Some(DVec3::new(value(c)?, value(c + 1)?, value(c + 2)?));
            let Some((p, n)) = vector(0).zip(vector(3)) else { continue };
            let [e, _] = match place(scene, &facets, p, n) {
                Some(atlas) => bake.at(atlas),
                None => [Rgb::NAN; 2],
            };
            println!("{},{},{},{},{},{}", p.x, p.y, p.z, e.x, e.y, e.z);
        }
        Ok(())
    })
}
