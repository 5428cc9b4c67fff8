//! Errors of irradiance at points where it is hard to find, and of pictures, against paths.
//!
//! `cargo run --release --example points_and_pictures -- SCENE [--each N] [--least N] [--rays N]
//! [--shadow N] [--error PERCENT] [--exact PERCENT] [--size WxH] [--worst N] [--no-points]
//! [--no-picture] [--difference FILE.png] [--truth FILE.png] [--picture FILE.png] [--obj FILE.obj]`
//!
//! SCENE is a built-in scene, a model, or `furnished[:DETAIL]`, a room of about 8,000 triangles
//! (`--obj` also writes it). Points are up to N (60) of each kind and at least 300 in all, as
//! `tests/common/hard.rs` places them; they are measured as `hemicube probe` does, and pictures
//! (160x120) are made as `hemicube render` does. What paths find is kept below the target folder;
//! it is known to `--exact` (.15 % of points, four times that for blocks of 8 x 8 pixels).
//!
//! Errors are of luminance, in % of the mean (blocks where emitters are seen: of the mean of those,
//! as edges of emitters are an error of another kind); seconds are of the processor, all cores
//! together.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

#[path = "../../tests/common/mod.rs"]
mod common;

use std::path::{Path, PathBuf};

use common::furnished::{as_obj, furnished};
use common::hard::Kind;
use common::judge::{
    BLOCK, BlockFigures, Figures, Outcome, Seconds, blocks, mean_reflected, measured, off, pictured,
};
use common::known::{self, Known};
use common::paths::Block;
use hemicube::export::write_png;
use hemicube::gather::{Estimate, GatherOptions, Place};
use hemicube::render::Picture;
use hemicube::scene::{ImportOptions, Rgb, Scene, builtin, load, luminance};
use hemicube::tone::Tone;

fn main() -> Outcome<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let of = |flag: &str| args.iter().position(|a| a == flag).and_then(|i| args.get(i + 1));
    let has = |flag: &str| args.iter().any(|a| a == flag);
    let number = |flag: &str, usual: f64| of(flag).map_or(Ok(usual), |a| a.parse());
    let name = args.first().ok_or("which scene?")?;
    let scene = scene_of(name)?;
    if let Some(path) = of("--obj").map(PathBuf::from) {
        let materials = path.with_extension("mtl");
        let file = materials.file_name().and_then(|f| f.to_str()).ok_or("a file without a name")?;
        let (obj, mtl) = as_obj(&scene, file);
        std::fs::write(&path, obj)?;
        std::fs::write(&materials, mtl)?;
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let kept = |what: &str| {
        let name = name.replace(['/', ':'], "_");
        Path::new(&target).join(format!("paths/{name}-{what}.txt"))
    };
    println!("{name}: {} triangles", scene.geometry.len());
    let error = of("--error").map(|e| e.parse::<f64>()).transpose()?.map(|e| e / 100.0);
    let exact = number("--exact", 0.15)? / 100.0;
    if !has("--no-points") {
        let (each, least) = (number("--each", 60.0)? as usize, number("--least", 300.0)? as usize);
        let known = known::points_kept(&scene, (each, least), exact, &kept("points"), true);
        let usual = GatherOptions::default();
        let options = GatherOptions {
            samples: number("--rays", usual.samples as f64)? as usize,
            shadow: number("--shadow", usual.shadow as f64)? as usize,
            ..usual
        };
        let (found, seconds) = measured(&scene, &known, error, options)?;
        say_points(&known, &found, seconds, number("--worst", 5.0)? as usize);
    }
    if !has("--no-picture") {
        let size = of("--size").map_or("160x120", String::as_str);
        let (width, height) = size.split_once('x').ok_or("--size WxH")?;
        let size = (width.parse()?, height.parse()?);
        let camera = &hemicube::View::of(&scene)?.camera;
        let known =
            known::picture_kept(&scene, camera, size, BLOCK, 4.0 * exact, &kept("picture"), true);
        let (picture, seconds) = pictured(&scene, camera, size, error)?;
        let of_picture = blocks(&picture);
        say_picture(&known, &of_picture, size, seconds);
        let key = 0.3 / mean_reflected(&known);
        if let Some(path) = of("--picture") {
            let show = |p: &[f32; 3]| {
                let radiance = Rgb::from_array(p.map(f64::from));
                Tone::Agx.map(radiance * (0.18 / mean_reflected(&known)))
            };
            let pixels = picture.pixels.iter().map(show).collect();
            write_png(Path::new(path), &Picture { pixels, ..picture.clone() })?;
        }
        if let Some(path) = of("--truth") {
            let show = |b: &Block| (b.reflected + b.emitted) * key;
            write_png(Path::new(path), &shown(known.iter().map(show), size))?;
        }
        if let Some(path) = of("--difference") {
            // Mid-grey is no difference; 5 % of the mean is all there is to see.
            let off = known.iter().zip(&of_picture).map(|(k, b)| *b - k.reflected - k.emitted);
            let show = |d: Rgb| Rgb::splat(0.2) + d * (0.2 / (0.05 * mean_reflected(&known)));
            write_png(Path::new(path), &shown(off.map(show), size))?;
        }
    }
    Ok(())
}

fn scene_of(name: &str) -> Outcome<Scene> {
    let (stem, detail) = name.split_once(':').unwrap_or((name, "8"));
    if stem == "furnished" {
        return Ok(furnished(detail.parse()?));
    }
    match builtin::build(name) {
        Some(scene) => Ok(scene),
        None => Ok(load(Path::new(name), &ImportOptions::default())?),
    }
}

fn say_points(known: &[Known], found: &[Estimate], seconds: Seconds, worst: usize) {
    let mean = known::mean(known);
    println!(
        "points: mean {mean:.4}; light {:.2} s, points {:.2} s ({:.2} ms each)",
        seconds[0],
        seconds[1],
        1e3 * seconds[1] / known.len() as f64
    );
    println!("           number  left out    RMS %  worst %   bias %  within %  paths' RMS %");
    let all: Vec<(&Known, &Estimate)> = known.iter().zip(found).collect();
    let line = |name: &str, of: &[(&Known, &Estimate)]| {
        let f = Figures::of(of, mean);
        if f.free == 0 {
            return;
        }
        let [rms, worst, bias, within, own] =
            [f.rms, f.worst, f.bias, f.within, f.own].map(|x| 100.0 * x);
        println!(
            "{name:10} {:6} {:9} {rms:8.2} {worst:8.2} {bias:+8.2} {within:9.1} {own:13.2}",
            f.count,
            f.count - f.free
        );
    };
    line("all", &all);
    for kind in Kind::ALL {
        let of: Vec<_> = all.iter().copied().filter(|(k, _)| k.placed.kind == kind).collect();
        line(&kind.to_string(), &of);
    }
    let mut by_error: Vec<_> = all.iter().filter(|(_, e)| e.place == Place::Free).collect();
    by_error.sort_by(|a, b| off(b.0, b.1).abs().total_cmp(&off(a.0, a.1).abs()));
    for (k, e) in by_error.into_iter().take(worst) {
        println!(
            "  {:8} {:.5} facing {:.2}: {:.4} ± {:.4}, paths {:.4} ± {:.4}",
            k.placed.kind,
            k.placed.point,
            k.placed.normal,
            luminance(e.irradiance),
            luminance(e.error),
            luminance(k.irradiance),
            k.error
        );
    }
}

fn say_picture(known: &[Block], found: &[Rgb], (width, height): (usize, usize), seconds: Seconds) {
    println!(
        "picture {width}x{height}: mean {:.4}; light {:.2} s, picture {:.2} s",
        mean_reflected(known),
        seconds[0],
        seconds[1]
    );
    println!("           blocks    RMS %  median %  worst %  at pixel   paths' RMS %");
    let columns = width.div_ceil(BLOCK);
    for (name, emitters) in [("reflecting", false), ("emitting", true)] {
        let f = BlockFigures::of(known, found, emitters);
        if f.count > 0 {
            let [rms, median, worst, own] = [f.rms, f.median, f.worst, f.own].map(|x| 100.0 * x);
            let [x, y] = [f.at % columns * BLOCK, f.at / columns * BLOCK];
            println!(
                "{name:10} {:6} {rms:8.2} {median:9.2} {worst:+8.2}  {x:4},{y:<4} {own:13.2}",
                f.count
            );
        }
    }
}

/// Blocks as a picture.
fn shown(blocks: impl Iterator<Item = Rgb>, (width, height): (usize, usize)) -> Picture {
    let blocks: Vec<Rgb> = blocks.collect();
    let columns = width.div_ceil(BLOCK);
    let pixel = |i: usize| {
        let block = blocks[i / width / BLOCK * columns + i % width / BLOCK];
        block.to_array().map(|x| x.clamp(0.0, 1.0) as f32)
    };
    Picture { width, height, pixels: (0..width * height).map(pixel).collect() }
}
