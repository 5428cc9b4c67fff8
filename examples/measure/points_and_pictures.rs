//! Errors of irradiance at points where it is hard to find, and of pictures, against paths.
//!
//! `cargo run --release --example points_and_pictures -- SCENE [--each N] [--least N] [--rays N]
//! [--shadow N] [--error PERCENT] [--exact PERCENT] [--size WxH] [--worst N] [--no-points]
//! [--no-picture] [--difference FILE.png] [--truth FILE.png] [--obj FILE.obj]`
//!
//! SCENE is a built-in scene, a model, or `furnished[:DETAIL]`, a room of about 8,000 triangles
//! (`--obj` also writes it). Points are up to N (60) of each kind and at least 300 in all, as
//! `tests/common/hard.rs` places them; they are measured as `hemicube probe` does, and pictures
//! (160x120) are made as `hemicube render` does. What paths find is kept below the target folder;
//! it is known to `--exact` (.15 % of points, four times that for blocks of 8 x 8 pixels).
//!
//! Errors are of luminance, in % of the mean (blocks where emitters are seen: of the mean of those,
//! as edges of emitters are an error of another kind); seconds are of the processor, all cores together.

#![allow(clippy::print_stdout, clippy::expect_used, reason = "an example")]

#[path = "../../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::path::{Path, PathBuf};

use common::furnished::{as_obj, furnished};
use common::hard::Kind;
use common::known::{self, Known};
use common::paths::Block;
use hemicube::engines::{EngineOptions, RaysOptions};
use hemicube::export::write_png;
use hemicube::gather::{Estimate, GatherOptions, Place, Probe};
use hemicube::patches::Patches;
use hemicube::progress::Silent;
use hemicube::render::{Picture, PictureOptions, Renderer};
use hemicube::scene::{Camera, ImportOptions, Rgb, Scene, builtin, load, luminance};
use hemicube::solution::{LightOptions, MANY_SIDES};

/// Pixels along a side of a block.
const BLOCK: usize = 8;

type Outcome<T> = Result<T, Box<dyn Error>>;

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
        let known = known::points_kept(&scene, (each, least), exact, &kept("points"));
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
        let known = known::picture_kept(&scene, camera, size, BLOCK, 4.0 * exact, &kept("picture"));
        let (picture, seconds) = pictured(&scene, camera, size, error)?;
        let of_picture = blocks(&picture, size);
        say_picture(&known, &of_picture, size, seconds);
        let key = 0.3 / mean(&known);
        if let Some(path) = of("--truth") {
            let show = |b: &Block| (b.reflected + b.emitted) * key;
            write_png(Path::new(path), &shown(known.iter().map(show), size))?;
        }
        if let Some(path) = of("--difference") {
            // Mid-grey is no difference; 5 % of the mean is all there is to see.
            let off = known.iter().zip(&of_picture).map(|(k, b)| *b - k.reflected - k.emitted);
            let show = |d: Rgb| Rgb::splat(0.2) + d * (0.2 / (0.05 * mean(&known)));
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

/// What `hemicube probe` finds, and what that takes.
fn measured(
    scene: &Scene,
    known: &[Known],
    error: Option<f64>,
    options: GatherOptions,
) -> Outcome<(Vec<Estimate>, [f64; 2])> {
    let probes: Vec<Probe> =
        known.iter().map(|k| Probe { point: k.placed.point, normal: k.placed.normal }).collect();
    let start = processor_seconds();
    let small = scene.geometry.len() as u64 <= MANY_SIDES / 2 && error.is_none();
    let light = LightOptions {
        patch_size: small.then(|| Patches::area_adding(&scene.geometry, 40_000)),
        engine: EngineOptions::Rays(RaysOptions { samples: 512, seed: 0 }),
        error,
        memory: 8 << 30,
        ..LightOptions::default()
    };
    let lit = scene.light(&light, &Silent)?;
    let between = processor_seconds();
    let found = lit.probe(&probes, options, &Silent)?;
    Ok((found, [between - start, processor_seconds() - between]))
}

/// What `hemicube render` shows, as radiance, and what that takes.
fn pictured(
    scene: &Scene,
    camera: &Camera,
    (width, height): (usize, usize),
    error: Option<f64>,
) -> Outcome<(Picture, [f64; 2])> {
    let start = processor_seconds();
    let light = LightOptions { error, memory: 8 << 30, ..LightOptions::default() };
    let lit = scene.light(&light, &Silent)?;
    let between = processor_seconds();
    let options = PictureOptions { width, height, ..PictureOptions::default() };
    let field = lit.field();
    let renderer = Renderer::new(scene, &field);
    let radiance = |s: &hemicube::render::Sight| s.radiance.to_array().map(|x| x as f32);
    let picture = renderer.render(camera, &options, radiance, &Silent)?;
    Ok((picture, [between - start, processor_seconds() - between]))
}

/// Seconds of all processors that this program has used.
fn processor_seconds() -> f64 {
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in parentheses, may have spaces.
    let rest = text.rsplit(')').next().unwrap_or_default();
    let ticks = rest.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / TICKS
}

fn say_points(known: &[Known], found: &[Estimate], seconds: [f64; 2], worst: usize) {
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
        let free: Vec<_> = of.iter().filter(|(_, e)| e.place == Place::Free).collect();
        if free.is_empty() {
            return;
        }
        let n = free.len() as f64;
        let off: Vec<f64> = free.iter().map(|(k, e)| off(k, e) / mean).collect();
        let rms = (off.iter().map(|o| o * o).sum::<f64>() / n).sqrt();
        let worst = off.iter().fold(0.0_f64, |w, o| w.max(o.abs()));
        let bias = off.iter().sum::<f64>() / n;
        let within = free.iter().filter(|(k, e)| within(k, e)).count() as f64 / n;
        let own = free.iter().map(|(k, _)| (luminance(k.error) / mean).powi(2)).sum::<f64>() / n;
        println!(
            "{name:10} {:6} {:9} {:8.2} {:8.2} {:+8.2} {:9.1} {:13.2}",
            of.len(),
            of.len() - free.len(),
            100.0 * rms,
            100.0 * worst,
            100.0 * bias,
            100.0 * within,
            100.0 * own.sqrt()
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
            luminance(k.error)
        );
    }
}

fn off(k: &Known, e: &Estimate) -> f64 {
    luminance(e.irradiance) - luminance(k.irradiance)
}

/// Whether the truth lies within what is stated, as far as paths know the truth.
fn within(k: &Known, e: &Estimate) -> bool {
    off(k, e).abs() <= luminance(e.error).hypot(1.96 * luminance(k.error))
}

/// Mean of what is reflected.
fn mean(known: &[Block]) -> f64 {
    known.iter().map(|b| luminance(b.reflected)).sum::<f64>() / known.len() as f64
}

/// Means over blocks of a picture.
fn blocks(picture: &Picture, (width, height): (usize, usize)) -> Vec<Rgb> {
    let columns = width.div_ceil(BLOCK);
    let mut sums = vec![(Rgb::ZERO, 0.0); columns * height.div_ceil(BLOCK)];
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let (sum, count) = &mut sums[i / width / BLOCK * columns + i % width / BLOCK];
        *sum += Rgb::from_array(pixel.map(f64::from));
        *count += 1.0;
    }
    sums.into_iter().map(|(sum, count)| sum / count).collect()
}

fn say_picture(known: &[Block], found: &[Rgb], (width, height): (usize, usize), seconds: [f64; 2]) {
    let mean_of_all = mean(known);
    println!(
        "picture {width}x{height}: mean {mean_of_all:.4}; light {:.2} s, picture {:.2} s",
        seconds[0], seconds[1]
    );
    println!("           blocks    RMS %  median %  worst %  at pixel   paths' RMS %");
    let columns = width.div_ceil(BLOCK);
    for (name, emitters) in [("reflecting", false), ("emitting", true)] {
        let all = |k: &Block| luminance(k.reflected + k.emitted);
        let of: Vec<(usize, &Block)> = known.iter().enumerate().collect();
        let is = |(_, k): &(usize, &Block)| (k.emitted != Rgb::ZERO) == emitters;
        let of: Vec<(usize, &Block)> = of.into_iter().filter(is).collect();
        let mean = match emitters {
            true => of.iter().map(|(_, k)| all(k)).sum::<f64>() / of.len() as f64,
            false => mean_of_all,
        };
        let mut off: Vec<(f64, usize)> =
            of.iter().map(|&(i, k)| ((luminance(found[i]) - all(k)) / mean, i)).collect();
        let own: f64 = of.iter().map(|(_, k)| (luminance(k.error) / mean).powi(2)).sum();
        if off.is_empty() {
            continue;
        }
        let n = off.len() as f64;
        let rms = (off.iter().map(|o| o.0 * o.0).sum::<f64>() / n).sqrt();
        off.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let (worst, at) = off[off.len() - 1];
        println!(
            "{name:10} {:6} {:8.2} {:9.2} {:+8.2}  {:4},{:<4} {:13.2}",
            off.len(),
            100.0 * rms,
            100.0 * off[off.len() / 2].0.abs(),
            100.0 * worst,
            at % columns * BLOCK,
            at / columns * BLOCK,
            100.0 * (own / n).sqrt()
        );
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
