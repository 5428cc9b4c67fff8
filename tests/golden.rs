//! Small pictures compared with those in `tests/golden`: shading, textures, camera, tone and
//! export.
//!
//! Physics is tested elsewhere; a change of the picture that is meant is blessed by
//! `HEMICUBE_BLESS=1 cargo test --release --test golden`, after a look at what it writes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use std::fmt::Display;
use std::fs;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use glam::DVec3;
use hemicube::engines::EngineOptions;
use hemicube::engines::HemicubeOptions;
use hemicube::export::write_png;
use hemicube::progress::Silent;
use hemicube::render::{PictureOptions, Renderer};
use hemicube::scene::{Camera, ImportOptions, Scene, builtin, load};
use hemicube::solution::{LightOptions, light};
use hemicube::tone::{KEY, Tone};

/// Largest mean absolute difference of a channel, of 255: the last bit may differ between kinds of
/// processors, and a pixel at an edge by more.
const MEAN: f64 = 1.0;

/// Largest mean absolute difference over any block of [`BLOCK`] × [`BLOCK`] pixels, of 255: a fault
/// in one place is not hidden by the rest.
const WORST: f64 = 8.0;

/// Pixels along a side of a block.
const BLOCK: usize = 8;

#[derive(Clone, Copy)]
struct View {
    size: (usize, usize),
    patch_size: f64,
    tone: Tone,
}

fn paint(scene: &Scene, view: View, to: &Path) {
    let options = LightOptions {
        patch_size: Some(view.patch_size),
        engine: EngineOptions::Hemicube(HemicubeOptions {
            resolution: 64,
            ..HemicubeOptions::default()
        }),
        ..LightOptions::default()
    };
    let solution = light(scene, &options, &Silent).unwrap();
    let field = solution.field(scene);
    let renderer = Renderer::new(scene, &field);
    let (width, height) = view.size;
    let options = PictureOptions { width, height, ..PictureOptions::default() };
    let camera = &scene.cameras[0];
    let exposure = renderer.auto_exposure(camera, width as f64 / height as f64, KEY).unwrap();
    let picture = renderer
        .render(camera, &options, |sight| view.tone.map(sight.radiance * exposure), &Silent)
        .unwrap();
    write_png(to, &picture).unwrap();
}

fn check(name: &str, scene: &Scene, view: View) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"));
    if std::env::var_os("HEMICUBE_BLESS").is_some() {
        paint(scene, view, &golden);
        return;
    }
    let actual = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.actual.png"));
    paint(scene, view, &actual);
    match difference(&golden, &actual) {
        Ok((mean, worst)) if mean <= MEAN && worst <= WORST => fs::remove_file(&actual).unwrap(),
        Ok((mean, worst)) => panic!(
            "{name}: differs by {mean:.2}/255 on average, by {worst:.2}/255 in the worst block; \
             look at {}",
            actual.display()
        ),
        Err(problem) => panic!("{name}: {problem}; look at {}", actual.display()),
    }
}

/// An RGB image of 8 bits a channel.
struct Image {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    fn new(width: usize, height: usize, colour: impl Fn(usize, usize) -> [u8; 3]) -> Self {
        let pixels = (0..width * height).map(|i| colour(i % width, i / width)).collect();
        Self { width, pixels }
    }

    fn read(path: &Path) -> Result<Self, String> {
        let problem = |e: &dyn Display| format!("{}: {e}", path.display());
        let file = fs::File::open(path).map_err(|e| problem(&e))?;
        let decoder = png::Decoder::new(BufReader::new(file));
        let mut reader = decoder.read_info().map_err(|e| problem(&e))?;
        if reader.output_color_type() != (png::ColorType::Rgb, png::BitDepth::Eight) {
            return Err(problem(&"not RGB of 8 bits a channel"));
        }
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).map_err(|e| problem(&e))?;
        Ok(Self { width: reader.info().width as usize, pixels: bytes.as_chunks().0.to_vec() })
    }

    fn write(&self, path: &Path) {
        let (width, height) = (self.width as u32, (self.pixels.len() / self.width) as u32);
        let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width, height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(self.pixels.as_flattened()).unwrap();
    }
}

/// Mean absolute difference of the channels, and that of the worst block.
fn difference(expected: &Path, actual: &Path) -> Result<(f64, f64), String> {
    let (expected, actual) = (Image::read(expected)?, Image::read(actual)?);
    let size = |image: &Image| (image.width, image.pixels.len());
    if size(&expected) != size(&actual) {
        return Err(String::from("the sizes differ"));
    }
    let width = expected.width;
    let across = width.div_ceil(BLOCK);
    let down = (expected.pixels.len() / width).div_ceil(BLOCK);
    let mut blocks = vec![(0.0, 0.0); across * down];
    for (i, (a, b)) in expected.pixels.iter().zip(&actual.pixels).enumerate() {
        let (x, y) = (i % width, i / width);
        let block = &mut blocks[y / BLOCK * across + x / BLOCK];
        for (a, b) in a.iter().zip(b) {
            block.0 += f64::from(a.abs_diff(*b));
            block.1 += 1.0;
        }
    }
    let worst = blocks.iter().map(|b| b.0 / b.1).fold(0.0, f64::max);
    let (sum, count) = blocks.iter().fold((0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.1));
    Ok((sum / count, worst))
}

#[test]
fn cornell_box() {
    let scene = builtin::build("cornell-box").unwrap();
    check("cornell-box", &scene, View { size: (96, 96), patch_size: 0.25, tone: Tone::Agx });
}

#[test]
fn room() {
    let scene = builtin::build("room").unwrap();
    check("room", &scene, View { size: (128, 96), patch_size: 0.1, tone: Tone::Agx });
}

/// A floor with a texture of four by four tiles of two colours, and an upright lamp behind it that
/// lights it from the side.
#[test]
fn textured_floor() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "floor.obj",
        "mtllib floor.mtl
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1
v -1 .3 -1\nv 1 .3 -1\nv 1 .9 -1\nv -1 .9 -1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl floor\nf 4/1 3/2 2/3 1/4
usemtl lamp\nf 5 6 7 8
",
    );
    write("floor.mtl", "newmtl floor\nKd 1 1 1\nmap_Kd tiles.png\nnewmtl lamp\nKe 3 3 2.4\n");
    let tiles = Image::new(64, 64, |x, y| {
        if (x / 16 + y / 16) % 2 == 0 { [210, 180, 120] } else { [40, 70, 140] }
    });
    tiles.write(&folder.path().join("tiles.png"));
    let mut scene = load(&folder.path().join("floor.obj"), &ImportOptions::default()).unwrap();
    let eye = DVec3::new(1.6, 1.5, 2.6);
    scene.cameras.push(Camera {
        name: String::from("test"),
        eye,
        forward: (DVec3::new(0.0, 0.2, -0.2) - eye).normalize(),
        up: DVec3::Y,
        vfov: 40_f64.to_radians(),
        aspect: None,
    });
    check("textured-floor", &scene, View { size: (96, 72), patch_size: 0.02, tone: Tone::Linear });
}

#[test]
fn a_difference_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let save = |name: &str, dot: u8| {
        let path = folder.path().join(name);
        let is_dot = |x, y| (60..62).contains(&x) && (60..62).contains(&y);
        Image::new(64, 64, |x, y| if is_dot(x, y) { [dot; 3] } else { [100; 3] }).write(&path);
        path
    };
    let (plain, dotted) = (save("plain.png", 100), save("dotted.png", 250));
    assert_eq!(difference(&plain, &plain).unwrap(), (0.0, 0.0));
    let (mean, worst) = difference(&plain, &dotted).unwrap();
    assert!(mean < MEAN && worst > WORST, "{mean} {worst}");
}
