//! Pictures whose light is gathered pixel by pixel.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::camera::{check, frame_of};
use super::known::PixelErrors;
use super::picture::{Picture, PictureOptions, RenderError};
use super::raster::{BAND, Gathered, Lit, Raster};
use super::renderer::{Renderer, Sight, draw};
use super::spots::{Light, Sample, Seen};
use crate::patches::SurfacePoint;
use crate::progress::Progress;
use crate::scene::{Camera, Scene, Side, TriangleId, luminance};
use crate::visibility::{Face, ItemBuffer, NOTHING, View};

/// A pixel: what its samples were mapped to, and how well its luminance is known.
#[derive(Debug, Clone, Copy, Default)]
struct Shown {
    value: [f32; 3],
    luminance: f32,
    /// Half-widths of 95 % intervals: all, and what is the solution's.
    error: [f32; 2],
}

impl Shown {
    fn of(sight: &Sight, light: &Light, value: [f32; 3]) -> Self {
        /// Half the width of the 95 % interval of a normal distribution.
        const NORMAL: f64 = 1.96;
        let seen = luminance(sight.radiance);
        let per_light = if sight.reflects { seen / luminance(light.irradiance) } else { 0.0 };
        let per_light = if per_light.is_finite() { per_light } else { 0.0 };
        let error = light.variance.map(|v| (NORMAL * v.sqrt() * per_light) as f32);
        Self { value, luminance: seen as f32, error }
    }

    /// Takes in a sample of that share.
    fn add(&mut self, sample: &Self, share: f32) {
        for (sum, value) in self.value.iter_mut().zip(sample.value) {
            *sum += value * share;
        }
        self.luminance += sample.luminance * share;
        for (sum, error) in self.error.iter_mut().zip(sample.error) {
            *sum += error * share;
        }
    }
}

/// A camera, a size, and what is seen of the scene.
struct Eye {
    view: View,
    half: f64,
    /// Pixels across and down, and samples along a side of each.
    size: [usize; 3],
    /// Width of a pixel at a distance of 1 in the middle of the picture.
    pixel: f64,
    camera: Camera,
}

impl Eye {
    /// The face of some rows of pixels.
    fn face(&self, from: usize, rows: usize) -> Face {
        let [w, h, n] = self.size;
        let aspect = w as f64 / h as f64;
        let y = |row: usize| self.half * (2.0 * row as f64 / h as f64 - 1.0);
        Face::new(
            [-self.half * aspect, self.half * aspect],
            [y(from), y(from + rows)],
            w * n,
            rows * n,
        )
    }
}

/// A raster of pixels.
struct Sighted<'a> {
    renderer: &'a Renderer<'a>,
    gathered: &'a Gathered<'a>,
    eye: &'a Eye,
}

impl Raster for Sighted<'_> {
    fn size(&self) -> [usize; 3] {
        self.eye.size
    }

    /// Only what may be lit.
    fn seen(&self, band: &Range<usize>, buffer: &mut ItemBuffer) -> Vec<Seen> {
        let [w, _, n] = self.eye.size;
        let face = self.eye.face(band.start, band.len());
        draw(&self.renderer.occluders, &self.eye.view, &face, buffer);
        let mut samples = self.renderer.samples(&self.eye.view, &face, buffer);
        let geometry = self.gathered.geometry();
        let mut at = |x, y| samples.point(x, y).filter(|p| geometry.exchanges(p.triangle, p.side));
        let sample = |p| Sample::new(self.renderer.scene, &self.gathered.normals, p);
        // Samples of a pixel on one triangle share a normal.
        let on = |last: &mut Option<Sample>, p: SurfacePoint| {
            let own = last.filter(|l| (l.at.triangle, l.at.side) == (p.triangle, p.side));
            let here = own.map_or_else(|| sample(p), |l| l.moved(self.renderer.scene, p));
            *last = Some(here);
            here
        };
        let pixels = (0..band.len()).flat_map(|y| (0..w).map(move |x| (x * n, y * n)));
        let mut seen = Vec::with_capacity(band.len() * w);
        for (x, y) in pixels {
            seen.push(if samples_alike(&face, buffer, (x, y), n).is_some() {
                match at(x + n / 2, y + n / 2) {
                    Some(p) => {
                        let place = |x, y| at(x, y).map(|p| p.position(geometry));
                        Seen::One(sample(p), corners(place, (x, y), n, p.position(geometry)))
                    }
                    None => Seen::Nothing,
                }
            } else {
                let each = |y| (0..n).map(move |i| (x + i, y));
                let mut last = None;
                let mut all = Vec::with_capacity(n * n);
                all.extend((y..y + n).flat_map(each).map(|(x, y)| {
                    let p = at(x, y)?;
                    Some(on(&mut last, p))
                }));
                Seen::Each(all)
            });
        }
        seen
    }

    fn width(&self, s: &Sample) -> f64 {
        let eye = &self.eye.camera;
        (s.position - eye.eye).dot(eye.forward.normalize_or_zero()).abs() * self.eye.pixel
    }

    fn facing(&self, s: &Sample) -> f64 {
        s.face.dot((self.eye.camera.eye - s.position).normalize_or_zero()).abs()
    }
}

impl Renderer<'_> {
    pub(super) fn gathered(
        &self,
        gathered: &Gathered<'_>,
        camera: &Camera,
        options: &PictureOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<(Picture, PixelErrors), RenderError> {
        let (w, h, n) = (options.width, options.height, options.samples.clamp(1, 15));
        check(camera, w, h)?;
        let mut view = View::default();
        self.occluders.look(&frame_of(camera)?, &mut view);
        let half = (0.5 * camera.vfov).tan();
        let pixel = 2.0 * half / h as f64;
        let eye = Eye { view, half, size: [w, h, n], pixel, camera: camera.clone() };
        let mut pixels = vec![Shown::default(); w * h];
        let sighted = Sighted { renderer: self, gathered, eye: &eye };
        gathered.light(&sighted, progress, |rows, lit| {
            self.show(&eye, rows, lit, &mut pixels, &map);
        })?;
        let errors = |of: fn(&Shown) -> [f32; 2]| {
            let share = |p: &Shown| {
                let [error, light] = of(p);
                if light > 0.0 { error / light } else { 0.0 }
            };
            pixels.iter().map(share).collect()
        };
        let errors = PixelErrors {
            width: w,
            height: h,
            relative: errors(|p| [p.error[0], p.luminance]),
            of_solution: errors(|p| [p.error[1], p.luminance]),
        };
        let pixels = pixels.into_iter().map(|p| p.value).collect();
        Ok((Picture { width: w, height: h, pixels }, errors))
    }

    /// Shows rows of pixels.
    fn show(
        &self,
        eye: &Eye,
        rows: Range<usize>,
        lit: &Lit<'_>,
        pixels: &mut [Shown],
        map: &(impl Fn(&Sight) -> [f32; 3] + Sync),
    ) {
        let [w, _, n] = eye.size;
        let scene: &Scene = self.scene;
        let all = n * n;
        pixels[rows.start * w..rows.end * w].par_chunks_mut(w * BAND).enumerate().for_each_init(
            ItemBuffer::default,
            |buffer, (band, pixels)| {
                let from = rows.start + band * BAND;
                let face = eye.face(from, pixels.len() / w);
                draw(&self.occluders, &eye.view, &face, buffer);
                let mut samples = self.samples(&eye.view, &face, buffer);
                for (at, value) in pixels.iter_mut().enumerate() {
                    let (x, y) = (at % w * n, at / w * n);
                    // The last one of plain material: many samples of a pixel show the same.
                    let mut last: Option<((Looks, u8), Shown)> = None;
                    let mut shown = |i: usize, j: usize| {
                        let (k, light) = lit.of(band * BAND * w + at, j * n + i);
                        let looks = self.looks(samples.item(x + i, y + j)).map(|looks| (looks, k));
                        if let Some((last, shown)) = last
                            && looks == Some(last)
                        {
                            return shown;
                        }
                        let light = light.copied().unwrap_or_default();
                        let sight = match samples.point(x + i, y + j) {
                            Some(p) => self.sight(p, light.irradiance),
                            None => Sight { radiance: scene.sky, ..Sight::DARK },
                        };
                        let shown = Shown::of(&sight, &light, map(&sight));
                        last = looks.map(|looks| (looks, shown));
                        shown
                    };
                    let item = samples_alike(&face, buffer, (x, y), n);
                    if item.is_some_and(|item| self.looks(item).is_some()) {
                        *value = shown(n / 2, n / 2);
                        continue;
                    }
                    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
                        value.add(&shown(i, j), 1.0 / all as f32);
                    }
                }
            },
        );
    }

    /// How an item looks, if all its points reflect and emit the same.
    fn looks(&self, item: u32) -> Option<Looks> {
        if item == NOTHING {
            return Some(Looks::default());
        }
        let triangle = self.occluders.ids()[item as usize / 2];
        let side = if item & 1 == 1 { Side::Back } else { Side::Front };
        let optics = &self.scene.optics;
        let material = optics.material(triangle);
        let is_plain =
            material.reflectance_texture.is_none() && material.radiance_texture.is_none();
        is_plain.then(|| Looks {
            material: Some(optics.material_of[triangle.index()]),
            tinted: (!optics.tint.is_empty()).then_some(triangle),
            is_front: side == Side::Front,
            exchanges: self.scene.geometry.exchanges(triangle, side),
            is_staged: self.scene.geometry.is_whole(triangle),
        })
    }
}

/// What a sample's look depends on, but for its light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Looks {
    material: Option<u32>,
    /// The triangle, where each has a colour of its own.
    tinted: Option<TriangleId>,
    is_front: bool,
    exchanges: bool,
    is_staged: bool,
}

/// What all samples of the pixel at `x`, `y` see, if it is the same.
fn samples_alike(
    face: &Face,
    buffer: &ItemBuffer,
    (x, y): (usize, usize),
    n: usize,
) -> Option<u32> {
    let row = |j: usize| &buffer.items()[(y + j) * face.stride() + x..][..n];
    let item = row(0)[0];
    (0..n).all(|j| row(j).iter().all(|i| *i == item)).then_some(item)
}

/// Places (m) at the corners of the pixel whose samples begin at `x`, `y`.
fn corners(
    mut place: impl FnMut(usize, usize) -> Option<DVec3>,
    (x, y): (usize, usize),
    n: usize,
    middle: DVec3,
) -> [DVec3; 4] {
    let outer = [(0, 0), (1, 0), (0, 1), (1, 1)]
        .map(|(i, j)| place(x + i * (n - 1), y + j * (n - 1)).unwrap_or(middle));
    // Samples lie within the pixel, at the middles of its parts.
    let centre = outer.iter().sum::<DVec3>() / 4.0;
    let wider = if n > 1 { n as f64 / (n - 1) as f64 } else { 1.0 };
    outer.map(|p| centre + (p - centre) * wider)
}
