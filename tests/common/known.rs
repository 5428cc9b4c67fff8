//! What paths find, kept in a file: it takes long to find, and is needed again and again.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use hemicube::scene::{Camera, Rgb, Scene, Side, luminance};
use hemicube::visibility::Bvh;
use rayon::prelude::*;

use super::hard::{Kind, Placed, places};
use super::paths::{Block, Paths};

/// Most paths a point, and a block of a picture.
const MOST: u32 = 1 << 22;

/// A point and its irradiance, known with a standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    pub placed: Placed,
    pub irradiance: Rgb,
    /// Of luminance.
    pub error: f64,
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
                Known { placed, irradiance, error: luminance(error) }
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

/// Up to `each` points of each kind and `least` in all, from the file; if that is not of this scene
/// and these numbers, they are found and written there, or that is refused.
pub fn points_kept(
    scene: &Scene,
    (each, least): (usize, usize),
    share: f64,
    file: &Path,
    make: bool,
) -> Vec<Known> {
    let head = format!("points {} {each} {least} {share}", fingerprint(scene));
    kept((file, make), &head, point_of, point_text, || {
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
    make: bool,
) -> Vec<Block> {
    let Camera { eye, forward, up, vfov, .. } = camera;
    let view = format!("{eye:.5}{forward:.5}{up:.5}{vfov:.5}").replace(' ', "");
    let size = format!("{width}x{height}/{block}");
    let head = format!("picture {} {view} {size} {share}", fingerprint(scene));
    kept((file, make), &head, block_of, block_text, || {
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
    (file, make): (&Path, bool),
    head: &str,
    read: impl Fn(&[f64]) -> Option<T>,
    write: impl Fn(&T) -> Vec<String>,
    what: impl FnOnce() -> Vec<T>,
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
    assert!(make, "{}: not of this scene; HEMICUBE_BLESS=1 makes another", file.display());
    let all = what();
    let mut text = format!("{head}\n");
    for one in &all {
        let _ = writeln!(text, "{}", write(one).join(" "));
    }
    if let Some(folder) = file.parent() {
        let _ = std::fs::create_dir_all(folder);
    }
    std::fs::write(file, text).unwrap();
    all
}

/// So many digits behind the first, without zeros at the end.
fn short(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.digits$e}").parse().unwrap_or(x);
    let [plain, scientific] = [format!("{rounded}"), format!("{rounded:e}")];
    if plain.len() <= scientific.len() { plain } else { scientific }
}

fn point_text(k: &Known) -> Vec<String> {
    let Placed { kind, point, normal } = k.placed;
    let mut cells = vec![(kind as u8).to_string()];
    for (v, digits) in [(point, 6), (normal, 6), (k.irradiance, 4)] {
        cells.extend(v.to_array().map(|x| short(x, digits)));
    }
    cells.push(short(k.error, 1));
    cells
}

fn point_of(cells: &[f64]) -> Option<Known> {
    let [kind, rest @ .., error] = cells else { return None };
    let kind = *Kind::ALL.get(*kind as usize)?;
    let [point, normal, irradiance] = vectors(rest)?;
    let placed = Placed { kind, point, normal: normal.normalize() };
    Some(Known { placed, irradiance, error: *error })
}

fn block_text(b: &Block) -> Vec<String> {
    let all = [(b.reflected, 4), (b.error, 1), (b.emitted, 4)];
    all.iter().flat_map(|(v, digits)| v.to_array().map(|x| short(x, *digits))).collect()
}

fn block_of(cells: &[f64]) -> Option<Block> {
    let [reflected, error, emitted] = vectors(cells)?;
    Some(Block { reflected, error, emitted })
}

fn vectors<const N: usize>(cells: &[f64]) -> Option<[DVec3; N]> {
    let vectors: Vec<DVec3> = cells.chunks_exact(3).map(DVec3::from_slice).collect();
    vectors.try_into().ok()
}

/// Of all that light depends on, rounded so that it is the same for all kinds of processors.
fn fingerprint(scene: &Scene) -> String {
    let mut hash = blake3::Hasher::new();
    let (g, optics) = (&scene.geometry, &scene.optics);
    let mut add = |v: DVec3| {
        for x in (v * 1e5).round().to_array() {
            hash.update(&(x as i64).to_le_bytes());
        }
    };
    for t in g.ids() {
        g.corners(t).into_iter().for_each(&mut add);
        add(optics.reflectance[t.index()]);
        for side in Side::BOTH {
            let holds = f64::from(u8::from(g.exchanges(t, side)));
            add(DVec3::splat(holds));
            add(optics.emission(t, side));
        }
    }
    add(scene.sky);
    let lamps = format!("{:?}", scene.lamps);
    hash.update(lamps.as_bytes());
    hash.finalize().to_hex()[..16].to_owned()
}
