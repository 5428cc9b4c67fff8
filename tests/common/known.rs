//! What paths find, kept in a file: it takes long to find, and is needed again and again.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use hemicube::scene::{Camera, Rgb, Scene, luminance};
use hemicube::visibility::Bvh;
use rayon::prelude::*;

use super::hard::{Kind, Placed, places};
use super::paths::{Block, Paths};

/// Most paths a point, and a block of a picture.
const MOST: u32 = 1 << 24;

/// A point and its irradiance, known with a standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    pub placed: Placed,
    pub irradiance: Rgb,
    pub error: Rgb,
}

/// Points are known to this fraction of themselves, or of the mean of all where that is more.
pub fn points(scene: &Scene, places: &[Placed], share: f64) -> Vec<Known> {
    let bvh = Bvh::new(&scene.geometry);
    let paths = Paths::led(scene, &bvh);
    let all = |error: f64, share: f64, most: u32| -> Vec<Known> {
        places
            .par_iter()
            .map(|&placed| {
                let Placed { point, normal, .. } = placed;
                let (irradiance, error) = paths.irradiance(point, normal, (error, share), most);
                Known { placed, irradiance, error }
            })
            .collect()
    };
    let rough = all(0.0, 0.05, 1 << 14);
    all(share * mean(&rough), share, MOST)
}

/// Mean luminance.
pub fn mean(known: &[Known]) -> f64 {
    known.iter().map(|k| luminance(k.irradiance)).sum::<f64>() / known.len() as f64
}

/// Up to `each` points of each kind and `least` in all, from the file or, if that is not of this
/// scene and these numbers, found and written there.
pub fn points_kept(
    scene: &Scene,
    (each, least): (usize, usize),
    share: f64,
    file: &Path,
) -> Vec<Known> {
    let head = format!("points {} {each} {least} {share}", fingerprint(scene));
    kept(file, &head, point_of, point_text, || {
        let bvh = Bvh::new(&scene.geometry);
        points(scene, &places(scene, &bvh, each, least), share)
    })
}

/// The blocks of a picture, known to this fraction of the mean of what is reflected.
pub fn picture_kept(
    scene: &Scene,
    camera: &Camera,
    (width, height): (usize, usize),
    block: usize,
    share: f64,
    file: &Path,
) -> Vec<Block> {
    let Camera { eye, forward, up, vfov, .. } = camera;
    let view = format!("{eye} {forward} {up} {vfov} {width} {height} {block}").replace(' ', "");
    let head = format!("picture {} {view} {share}", fingerprint(scene));
    kept(file, &head, block_of, block_text, || {
        let bvh = Bvh::new(&scene.geometry);
        let paths = Paths::led(scene, &bvh);
        let seen = |error, most| paths.picture(camera, (width, height), block, error, most);
        let rough = seen(f64::INFINITY, 1);
        let mean = rough.iter().map(|b| luminance(b.reflected)).sum::<f64>() / rough.len() as f64;
        seen(share * mean, MOST)
    })
}

/// The lines of a file below its head, or what is made and written there.
fn kept<T>(
    file: &Path,
    head: &str,
    read: impl Fn(&[f64]) -> Option<T>,
    write: impl Fn(&T) -> Vec<f64>,
    make: impl FnOnce() -> Vec<T>,
) -> Vec<T> {
    if let Ok(text) = std::fs::read_to_string(file)
        && let Some(rest) = text.strip_prefix(head)
    {
        let number = |cell: &str| cell.parse().ok();
        let line = |line: &str| read(&line.split(' ').map(number).collect::<Option<Vec<_>>>()?);
        if let Some(all) = rest.trim().lines().map(line).collect() {
            return all;
        }
    }
    let all = make();
    let mut text = format!("{head}\n");
    for one in &all {
        let cells: Vec<String> = write(one).iter().map(|&x| short(x)).collect();
        let _ = writeln!(text, "{}", cells.join(" "));
    }
    if let Some(folder) = file.parent() {
        let _ = std::fs::create_dir_all(folder);
    }
    std::fs::write(file, text).expect("what is known can be kept");
    all
}

/// Seven digits, without zeros at the end.
fn short(x: f64) -> String {
    let text = format!("{x:.6e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    if power == "0" { digits.to_owned() } else { format!("{digits}e{power}") }
}

fn point_text(k: &Known) -> Vec<f64> {
    let Placed { kind, point, normal } = k.placed;
    let mut cells = vec![f64::from(kind as u8)];
    for v in [point, normal, k.irradiance, k.error] {
        cells.extend(v.to_array());
    }
    cells
}

fn point_of(cells: &[f64]) -> Option<Known> {
    let [kind, rest @ ..] = cells else { return None };
    let kind = *Kind::ALL.get(*kind as usize)?;
    let [point, normal, irradiance, error] = vectors(rest)?;
    let normal = normal.normalize();
    Some(Known { placed: Placed { kind, point, normal }, irradiance, error })
}

fn block_text(b: &Block) -> Vec<f64> {
    [b.reflected, b.error, b.emitted].iter().flat_map(|v| v.to_array()).collect()
}

fn block_of(cells: &[f64]) -> Option<Block> {
    let [reflected, error, emitted] = vectors(cells)?;
    Some(Block { reflected, error, emitted })
}

fn vectors<const N: usize>(cells: &[f64]) -> Option<[DVec3; N]> {
    let vectors: Vec<DVec3> = cells.chunks_exact(3).map(DVec3::from_slice).collect();
    vectors.try_into().ok()
}

/// Of all that light depends on.
fn fingerprint(scene: &Scene) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(&scene.geometry.fingerprint());
    for t in scene.geometry.ids() {
        let optics = &scene.optics;
        let both = optics.material(t).emits_both;
        let numbers = [optics.reflectance[t.index()], optics.emission[t.index()]];
        for x in numbers.iter().flat_map(|v| v.to_array()) {
            hash.update(&x.to_bits().to_le_bytes());
        }
        hash.update(&[u8::from(both)]);
    }
    hash.update(format!("{:?} {:?} {}", scene.lamps, scene.sky, scene.up).as_bytes());
    hash.finalize().to_hex()[..16].to_owned()
}
