//! Picture pairs: uniform and adaptive, their difference, and the adaptive mesh.

use hemicube::export::write_png;
use hemicube::patches::Patches;
use hemicube::progress::{Cancelled, Progress};
use hemicube::reconstruct::Field;
use hemicube::render::{Picture, PictureOptions, RenderError, Renderer};
use hemicube::scene::{Camera, Material, Rgb, Scene, SceneBuilder, Sides, Surface};
use hemicube::solution::Solution;
use hemicube::tone::{KEY, Tone};

use super::Folder;
use super::conditions::Conditions;
use super::published::TOLERANCE;
use crate::failure::Failure;
use crate::terminal::{Bar, print};

/// By how much differences are amplified.
const AMPLIFIED: f32 = 10.0;

/// Samples along each side of a pixel of the mesh picture: edges are thin.
const MESH_SAMPLES: usize = 4;

/// A scene seen by its camera, lit by the uniform solution.
pub struct Views<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    options: PictureOptions,
    exposure: f64,
    uniform: Picture,
}

impl<'a> Views<'a> {
    /// The picture that others are compared with; its exposure serves them all.
    pub fn new(
        scene: &'a Scene,
        uniform: &Solution,
        conditions: &Conditions,
        bar: &Bar,
    ) -> Result<Self, Failure> {
        let Some(camera) = scene.cameras.first() else {
            return Err(Failure::Failed(format!("{}: no camera", scene.name)));
        };
        let (width, height) = conditions.picture;
        let options = PictureOptions { width, height, ..PictureOptions::default() };
        let field = uniform.field(scene);
        let renderer = Renderer::new(scene, &field);
        let aspect = width as f64 / height as f64;
        let exposure = renderer.auto_exposure(camera, aspect, KEY).map_err(failure)?;
        let uniform = exposed(&renderer, camera, &options, exposure, bar)?;
        Ok(Self { scene, camera, options, exposure, uniform })
    }

    /// Writes the pictures of scene `number`.
    pub fn write(
        &self,
        number: usize,
        adaptive: &Solution,
        folder: &Folder<'_>,
        bar: &Bar,
    ) -> Result<(), Failure> {
        let field = adaptive.field(self.scene);
        let renderer = Renderer::new(self.scene, &field);
        let picture = exposed(&renderer, self.camera, &self.options, self.exposure, bar)?;
        let mesh = self.mesh(&adaptive.patches, &picture, bar)?;
        let difference = difference(&self.uniform, &picture);
        let named = [&self.uniform, &picture, &difference, &mesh];
        for (kind, picture) in KINDS.iter().zip(named) {
            let path = folder.path.join(file(number, kind));
            write_png(&path, picture).map_err(Failure::failed)?;
            print(&path.display().to_string());
        }
        Ok(())
    }

    /// The picture with the outlines of the patches: every patch glows with a value of its own in
    /// an auxiliary scene, and outlines are where neighbouring samples differ.
    fn mesh(&self, patches: &Patches, picture: &Picture, bar: &Bar) -> Result<Picture, Failure> {
        let glowing = glowing(self.scene, patches);
        let whole = Patches::uniform(&glowing.geometry, f64::INFINITY).map_err(Failure::failed)?;
        let dark = vec![Rgb::ZERO; whole.len()];
        let field = Field::new(&glowing.geometry, &whole, &dark, |_| true);
        let (width, height) = (picture.width, picture.height);
        let n = MESH_SAMPLES;
        let options = PictureOptions { width: width * n, height: height * n, samples: 1 };
        let renderer = Renderer::new(&glowing, &field);
        let value = |r: Rgb| [r.x.round() as f32; 3];
        let items = renderer
            .render(self.camera, &options, |s| value(s.radiance), &Watched(bar))
            .map_err(failure)?;
        let item = |x: usize, y: usize| items.pixels[y * items.width + x][0];
        let mut outlined = picture.clone();
        for (at, pixel) in outlined.pixels.iter_mut().enumerate() {
            let (x0, y0) = (at % width * n, at / width * n);
            let edges = (0..n * n)
                .filter(|k| {
                    let (x, y) = (x0 + k % n, y0 + k / n);
                    let (right, below) = (items.width.min(x + 2) - 1, items.height.min(y + 2) - 1);
                    item(x, y) != item(right, y) || item(x, y) != item(x, below)
                })
                .count();
            let cover = (edges as f32 / n as f32).min(1.0);
            *pixel = pixel.map(|c| c * (1.0 - 0.7 * cover));
        }
        Ok(outlined)
    }
}

/// The scene with one triangle a patch, each of a radiance that no other has.
fn glowing(scene: &Scene, patches: &Patches) -> Scene {
    let mut builder = SceneBuilder::new(scene.name.clone());
    let material = builder.material(Material::default());
    let surface = builder.surface(Surface { name: "patches".into(), node: 0, primitive: 0 });
    for id in patches.ids() {
        let corners = patches.cell(id).corners(&scene.geometry).map(|p| builder.vertex(p));
        builder.triangle(corners, None, surface, material, Sides::One);
    }
    let mut glowing = builder.finish();
    for (k, emission) in glowing.optics.emission.iter_mut().enumerate() {
        *emission = Rgb::splat(std::f64::consts::PI * (k + 1) as f64);
    }
    glowing
}

fn exposed(
    renderer: &Renderer<'_>,
    camera: &Camera,
    options: &PictureOptions,
    exposure: f64,
    bar: &Bar,
) -> Result<Picture, Failure> {
    renderer
        .render(camera, options, |s| Tone::Agx.map(s.radiance * exposure), &Watched(bar))
        .map_err(failure)
}

/// Only listens for cancellation: pictures are no share of the bar.
struct Watched<'a>(&'a Bar);

impl Progress for Watched<'_> {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, _n: u64) -> Result<(), Cancelled> {
        self.0.advance(0)
    }
}

/// Grey where two pictures agree; brighter where the second is, times [`AMPLIFIED`].
fn difference(a: &Picture, b: &Picture) -> Picture {
    let mut difference = a.clone();
    for (p, q) in difference.pixels.iter_mut().zip(&b.pixels) {
        // Middle grey as sRGB shows it.
        const GREY: f32 = 0.214;
        for c in 0..3 {
            p[c] = (GREY + AMPLIFIED * (q[c] - p[c])).clamp(0.0, 1.0);
        }
    }
    difference
}

fn failure(error: RenderError) -> Failure {
    Failure::of(error, Failure::failed)
}

/// The pictures of a scene.
const KINDS: [&str; 4] = ["uniform", "adaptive", "difference", "mesh"];

fn file(number: usize, kind: &str) -> String {
    format!("images/paper-{number}-{kind}.png")
}

/// The pictures of a scene in the document.
pub fn gallery(number: usize) -> String {
    let [uniform, adaptive, difference, mesh] = KINDS.map(|kind| file(number, kind));
    format!(
        "\nScene {number} at a tolerance of {TOLERANCE}:\n\n\
         | uniform | adaptive |\n|---|---|\n\
         | ![uniform]({uniform}) | ![adaptive]({adaptive}) |\n\
         | difference × {AMPLIFIED} (grey: none) | adaptive mesh |\n\
         | ![difference]({difference}) | ![mesh]({mesh}) |\n"
    )
}
