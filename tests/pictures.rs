//! Pictures as `hemicube render` makes them, against pictures by random paths, block by block; and
//! whether they are as smooth as what they show.
//!
//! What paths see is kept in `tests/known`; after a change of a scene `HEMICUBE_BLESS=1 cargo test
//! --release --test pictures` finds it anew.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::path::Path;

use common::judge::{BLOCK, BlockFigures, blocks, mean_reflected, pictured};
use common::known::picture_kept;
use common::paths::{Face, Paths};
use hemicube::render::Picture;
use hemicube::scene::{Camera, Rgb, Scene, builtin, luminance};
use hemicube::visibility::Bvh;

const SIZE: (usize, usize) = (160, 120);

/// To which share of the mean blocks are known.
const KNOWN: f64 = 0.006;

/// Largest RMS and worst error of blocks, as shares of the mean: in rooms, and in a hall whose
/// lamps make the ceiling above them ten times as bright as the mean, and whose coarse bodies are
/// shaded smoothly.
const IN_ROOMS: [f64; 2] = [0.01, 0.05];
const IN_THE_HALL: [f64; 2] = [0.025, 0.2];

/// A pixel may differ from the median of its neighbours by this share of that, or of a tenth of the
/// mean; more must be so.
const SPOT: f64 = 0.08;

/// Most pixels of which paths are asked, and of them most that may be otherwise.
const ASKED: usize = 200;
const ODD: usize = 8;

/// No pixel may be off by this share of what is around it.
const DOT: f64 = 0.3;

/// RMS and largest second difference along rows and columns of a plain wall, as a share of what is
/// seen there.
const ROUGH: f64 = 0.01;
const ROUGHEST: f64 = 0.08;

/// Pixels from the border of a wall at which it is plain.
const MARGIN: usize = 6;

struct Shot {
    scene: Scene,
    camera: Camera,
    picture: Picture,
}

impl Shot {
    fn of(name: &str) -> Self {
        let scene = builtin::build(name).unwrap();
        let camera = scene.cameras[0].clone();
        let (picture, seconds) = pictured(&scene, &camera, SIZE, None).unwrap();
        println!("{name}: {seconds:?} s");
        Self { scene, camera, picture }
    }

    fn luminance(&self, i: usize) -> f64 {
        luminance(Rgb::from_array(self.picture.pixels[i].map(f64::from)))
    }

    /// Pixels around one that show the same face, itself left out.
    fn around<'a>(
        &self,
        faces: &'a [Option<Face>],
        i: usize,
        reach: usize,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let (x, y) = (i % SIZE.0, i / SIZE.0);
        let near = move |at: usize, all: usize| at.saturating_sub(reach)..(at + reach + 1).min(all);
        near(y, SIZE.1)
            .flat_map(move |y| near(x, SIZE.0).map(move |x| y * SIZE.0 + x))
            .filter(move |&j| j != i && same(faces[i], faces[j]))
    }
}

fn same(a: Option<Face>, b: Option<Face>) -> bool {
    a.zip(b).is_some_and(|(a, b)| a.surface == b.surface && a.normal.dot(b.normal) > 0.999)
}

/// Blocks of a picture are what paths see.
fn judge(name: &str, [rms, worst]: [f64; 2]) {
    let shot = Shot::of(name);
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/known/{name}-picture.txt"));
    let bless = std::env::var_os("HEMICUBE_BLESS").is_some();
    let known = picture_kept(&shot.scene, &shot.camera, SIZE, BLOCK, KNOWN, &file, bless);
    let found = blocks(&shot.picture);
    let figures = BlockFigures::of(&known, &found, false);
    println!("{name}: {figures:?}, emitters {:?}", BlockFigures::of(&known, &found, true));
    assert!(figures.rms <= rms && figures.worst.abs() <= worst, "{name}: {figures:?}");
    assert!(mean_reflected(&known) > 0.0);
}

/// Hardly a pixel stands out from its neighbours on the same face, unless it does; none by much.
fn has_no_spots(name: &str) {
    let shot = Shot::of(name);
    let bvh = Bvh::new(&shot.scene.geometry);
    let paths = Paths::led(&shot.scene, &bvh);
    let faces = paths.faces(&shot.camera, SIZE);
    let lit = |i: &usize| faces[*i].is_some();
    let count = (0..faces.len()).filter(lit).count();
    let mean = (0..faces.len()).filter(lit).map(|i| shot.luminance(i)).sum::<f64>() / count as f64;
    let mut spots: Vec<(f64, usize)> = Vec::new();
    for i in (0..faces.len()).filter(lit) {
        let mut near: Vec<f64> = shot.around(&faces, i, 2).map(|j| shot.luminance(j)).collect();
        if near.len() < 12 {
            continue;
        }
        near.sort_by(f64::total_cmp);
        let median = near[near.len() / 2];
        let off = (shot.luminance(i) - median).abs() / median.max(0.1 * mean);
        if off > SPOT {
            spots.push((off, i));
        }
    }
    spots.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("{name}: {} of {count} pixels stand out", spots.len());
    let (mut wrong, mut dots) = (Vec::new(), 0);
    for &(off, i) in spots.iter().take(ASKED) {
        let at = [i % SIZE.0, i / SIZE.0];
        let most = SPOT * shot.luminance(i).max(0.1 * mean);
        let known = paths.pixel(&shot.camera, SIZE, at, 0.2 * most, 1 << 18);
        let seen = luminance(known.reflected + known.emitted);
        let apart = (shot.luminance(i) - seen).abs();
        if apart > most + 3.0 * luminance(known.error) {
            dots += usize::from(apart > DOT / SPOT * most);
            wrong.push(format!("{at:?}: {:.4}, paths {seen:.4}, by {off:.3}", shot.luminance(i)));
        }
    }
    println!("{name}: {} of the {} most are wrong", wrong.len(), spots.len().min(ASKED));
    assert!(dots == 0 && wrong.len() <= ODD, "{name}: {wrong:#?}");
}

/// Second differences on the wall of that name are small.
fn is_smooth(name: &str, wall: &str) {
    let shot = Shot::of(name);
    let bvh = Bvh::new(&shot.scene.geometry);
    let faces = Paths::led(&shot.scene, &bvh).faces(&shot.camera, SIZE);
    let named = |f: &Face| shot.scene.geometry.surfaces[f.surface as usize].name == wall;
    let side = 2 * MARGIN + 1;
    let plain: Vec<bool> = (0..faces.len())
        .map(|i| {
            faces[i].as_ref().is_some_and(named)
                && shot.around(&faces, i, MARGIN).count() == side * side - 1
        })
        .collect();
    let (mut squares, mut most, mut count) = (0.0, (0.0, 0), 0);
    for i in (0..plain.len()).filter(|&i| plain[i]) {
        for step in [1, SIZE.0] {
            let [before, here, after] = [i - step, i, i + step].map(|j| shot.luminance(j));
            let rough = ((before + after - 2.0 * here) / here).abs();
            squares += rough * rough;
            count += 1;
            if rough > most.0 {
                most = (rough, i);
            }
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    let at = [most.1 % SIZE.0, most.1 / SIZE.0];
    println!("{name}, {wall}: {count} differences, RMS {rms:.5}, most {:.4} at {at:?}", most.0);
    assert!(count > 200, "{count}");
    assert!(rms <= ROUGH && most.0 <= ROUGHEST, "{rms} {most:?}");
}

#[test]
fn the_room_is_what_paths_see() {
    judge("room", IN_ROOMS);
}

#[test]
fn the_cornell_box_is_what_paths_see() {
    judge("cornell-box", IN_ROOMS);
}

#[test]
fn the_hall_is_what_paths_see() {
    judge("paper-2", IN_THE_HALL);
}

#[test]
fn no_pixel_of_the_room_stands_out() {
    has_no_spots("room");
}

#[test]
fn no_pixel_of_the_cornell_box_stands_out() {
    has_no_spots("cornell-box");
}

#[test]
fn walls_are_smooth() {
    is_smooth("room", "far wall");
    is_smooth("cornell-box", "back wall");
}
