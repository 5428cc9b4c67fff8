//! What a camera sees of a lit scene, sample by sample.

use std::f64::consts::PI;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use super::camera::{check, frame_of};
use super::known::PixelErrors;
use super::picture::{Picture, PictureOptions, RenderError};
use super::raster::Gathered;

use crate::gather::{Gatherer, Surfaces};
use crate::patches::SurfacePoint;
use crate::progress::{Cancelled, Progress, Silent};
use crate::reconstruct::Field;
use crate::scene::{Camera, Rgb, Scene, Side, luminance};
use crate::simd::multiversion;
use crate::visibility::{Edges, Face, ItemBuffer, NOTHING, Occluders, View};

/// What the camera sees along one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Radiance, W/(m² sr) or cd/m².
    pub radiance: Rgb,
    /// Irradiance of the surface seen; zero where none is.
    pub irradiance: Rgb,
    /// Whether a surface that exchanges light is seen, and emits none itself.
    pub reflects: bool,
    /// What is seen.
    pub seen: Seen,
}

/// What a ray of the camera meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// A side that exchanges light.
    Surface,
    /// A back that does not reflect, and is black.
    Back,
    /// What was added for the picture, and is not of the model.
    Stage,
    /// Emptiness.
    Nothing,
}

/// Shares of the model in a picture, 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// Sides that exchange light.
    pub surface: f64,
    /// Those of them that send out any.
    pub lit: f64,
    /// Backs that do not reflect.
    pub back: f64,
}

impl Sight {
    /// Black emptiness.
    pub(super) const DARK: Self =
        Self { radiance: Rgb::ZERO, irradiance: Rgb::ZERO, reflects: false, seen: Seen::Nothing };
}

/// A lit scene, ready to be looked at.
pub struct Renderer<'a> {
    pub(super) scene: &'a Scene,
    field: &'a Field<'a>,
    pub(super) occluders: Occluders,
    light: Light<'a>,
}

/// Whose light a picture shows.
enum Light<'a> {
    /// The field's: a draft. What surfaces reflect is known here.
    Field(Surfaces),
    Gathered(Box<Gathered<'a>>),
}

/// Rows of pixels that are drawn at once.
const BAND: usize = 8;

impl<'a> Renderer<'a> {
    /// Decodes the textures and collects what can be seen. Light is that of the field: a draft.
    #[must_use]
    pub fn new(scene: &'a Scene, field: &'a Field<'a>) -> Self {
        Self::by(scene, field, Light::Field(Surfaces::new(scene)))
    }

    /// The light of each pixel is gathered: direct light at the pixel itself, and what other
    /// surfaces reflect from where it lands.
    #[must_use]
    pub fn gathering(scene: &'a Scene, field: &'a Field<'a>, gatherer: &'a Gatherer<'a>) -> Self {
        let gathered = Gathered::new(scene, field, gatherer);
        Self::by(scene, field, Light::Gathered(Box::new(gathered)))
    }

    fn by(scene: &'a Scene, field: &'a Field<'a>, light: Light<'a>) -> Self {
        Self { scene, field, occluders: Occluders::new(&scene.geometry), light }
    }

    /// The light that it gathers; a draft gathers none.
    pub(crate) fn gathered_light(&self) -> Option<&Gathered<'a>> {
        match &self.light {
            Light::Field(_) => None,
            Light::Gathered(gathered) => Some(gathered),
        }
    }

    /// The same without what lamps without extent send straight.
    #[must_use]
    pub fn without_lamps(mut self) -> Self {
        if let Light::Gathered(gathered) = &mut self.light {
            gathered.lamps = false;
        }
        self
    }

    fn surfaces(&self) -> &Surfaces {
        match &self.light {
            Light::Field(surfaces) => surfaces,
            Light::Gathered(gathered) => gathered.gatherer.surfaces(),
        }
    }

    /// The picture, each sample mapped by `map` before the samples of a pixel are averaged (a tone
    /// map keeps the edges of emitters smooth that way). Advances `progress` by one a row of
    /// pixels.
    pub fn render(
        &self,
        camera: &Camera,
        options: &PictureOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<Picture, RenderError> {
        Ok(self.render_known(camera, options, map, progress)?.0)
    }

    /// The same, and how well each pixel is known, unless it is a draft.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_known(
        &self,
        camera: &Camera,
        options: &PictureOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<(Picture, Option<PixelErrors>), RenderError> {
        match &self.light {
            Light::Field(_) => Ok((self.drafted(camera, options, map, progress)?, None)),
            Light::Gathered(gathered) => {
                let (picture, errors) = self.gathered(gathered, camera, options, map, progress)?;
                Ok((picture, Some(errors)))
            }
        }
    }

    /// The picture by the field's light alone.
    fn drafted(
        &self,
        camera: &Camera,
        options: &PictureOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<Picture, RenderError> {
        let (w, h, n) = (options.width, options.height, options.samples.max(1));
        check(camera, w, h)?;
        let frame = frame_of(camera)?;
        let mut view = View::default();
        self.occluders.look(&frame, &mut view);
        let half = [0.5 * camera.vfov].map(f64::tan)[0];
        let aspect = w as f64 / h as f64;
        let spare = Mutex::new(Vec::new());
        let cancelled = AtomicBool::new(false);
        let mut pixels = vec![[0.0; 3]; w * h];
        pixels.par_chunks_mut(w * BAND).enumerate().for_each(|(band, pixels)| {
            if cancelled.load(Ordering::Relaxed) {
                return;
            }
            let rows = pixels.len() / w;
            let y = |row: usize| half * (2.0 * row as f64 / h as f64 - 1.0);
            let face = Face::new(
                [-half * aspect, half * aspect],
                [y(band * BAND), y(band * BAND + rows)],
                w * n,
                rows * n,
            );
            let mut buffer: ItemBuffer =
                spare.lock().ok().and_then(|mut s| s.pop()).unwrap_or_default();
            draw(&self.occluders, &view, &face, &mut buffer);
            for (row, pixels) in pixels.chunks_mut(w).enumerate() {
                for sub in 0..n {
                    self.shade_row(&view, &face, &buffer, row * n + sub, |x, sight| {
                        let value = map(sight);
                        for c in 0..3 {
                            pixels[x / n][c] += value[c] / (n * n) as f32;
                        }
                    });
                }
            }
            if let Ok(mut spare) = spare.lock() {
                spare.push(buffer);
            }
            if progress.advance(rows as u64).is_err() {
                cancelled.store(true, Ordering::Relaxed);
            }
        });
        if cancelled.into_inner() {
            return Err(Cancelled.into());
        }
        Ok(Picture { width: w, height: h, pixels })
    }

    fn shade_row(
        &self,
        view: &View,
        face: &Face,
        buffer: &ItemBuffer,
        row: usize,
        mut sample: impl FnMut(usize, &Sight),
    ) {
        let mut samples = self.samples(view, face, buffer);
        for x in 0..face.width() {
            match samples.point(x, row) {
                Some(p) => sample(x, &self.sight(p, self.field.at(p))),
                None => sample(x, &Sight { radiance: self.scene.sky, ..Sight::DARK }),
            }
        }
    }

    /// What samples of a drawn face meet.
    pub(super) fn samples<'b>(
        &'b self,
        view: &'b View,
        face: &'b Face,
        buffer: &'b ItemBuffer,
    ) -> Samples<'b> {
        Samples { occluders: &self.occluders, view, face, buffer, last: None }
    }

    /// What a sample shows whose surface receives an irradiance (W/m² or lx).
    pub(crate) fn sight(&self, p: SurfacePoint, irradiance: Rgb) -> Sight {
        let geometry = &self.scene.geometry;
        let staged = |seen| if geometry.is_whole(p.triangle) { Seen::Stage } else { seen };
        if !geometry.exchanges(p.triangle, p.side) {
            return Sight { seen: staged(Seen::Back), ..Sight::DARK };
        }
        let emitted = self.surfaces().emitted(self.scene, p);
        let rho = self.surfaces().reflectance(self.scene, p);
        Sight {
            radiance: emitted + rho * irradiance / PI,
            irradiance,
            reflects: emitted == Rgb::ZERO,
            seen: staged(Seen::Surface),
        }
    }

    /// The exposure (factor on radiance) that brings the mean of the logarithm of the luminance of
    /// the lit surfaces in view, emitters apart, to `key`; 1 if nothing lit is in view.
    pub fn auto_exposure(
        &self,
        camera: &Camera,
        aspect: f64,
        key: f64,
    ) -> Result<f64, RenderError> {
        let luminance = |s: &Sight| if s.reflects { luminance(s.radiance) as f32 } else { 0.0 };
        let seen = self.glance(camera, aspect, |s| [luminance(s), 0.0, 0.0])?;
        let mut lit: Vec<f64> = seen.iter().map(|p| f64::from(p[0])).filter(|&l| l > 0.0).collect();
        if lit.is_empty() {
            return Ok(1.0);
        }
        lit.sort_unstable_by(f64::total_cmp);
        // Deep shadows would drag a mean of logarithms down.
        let floor = lit[lit.len() / 2] / 64.0;
        let mean = lit.iter().map(|l| l.max(floor).ln()).sum::<f64>() / lit.len() as f64;
        Ok(key / mean.exp())
    }

    /// What of the model is in view, and how much of it is lit.
    pub fn shares(&self, camera: &Camera, aspect: f64) -> Result<Shares, RenderError> {
        let is = |holds: bool| f32::from(u8::from(holds));
        let seen = self.glance(camera, aspect, |s| {
            let lit = s.seen == Seen::Surface && s.radiance.max_element() > 0.0;
            [is(s.seen == Seen::Surface), is(lit), is(s.seen == Seen::Back)]
        })?;
        let [surface, lit, back] = [0, 1, 2]
            .map(|c| seen.iter().map(|p| f64::from(p[c])).sum::<f64>() / seen.len() as f64);
        Ok(Shares { surface, lit, back })
    }

    /// A small picture with one sample a pixel.
    fn glance(
        &self,
        camera: &Camera,
        aspect: f64,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
    ) -> Result<Vec<[f32; 3]>, RenderError> {
        let height = 120;
        let width = ((height as f64 * aspect) as usize).clamp(1, 1000);
        let options = PictureOptions { width, height, samples: 1 };
        Ok(self.drafted(camera, &options, map, &Silent)?.pixels)
    }
}

/// What samples of a drawn face meet.
pub(super) struct Samples<'a> {
    occluders: &'a Occluders,
    view: &'a View,
    face: &'a Face,
    buffer: &'a ItemBuffer,
    /// The item of the last one, and its edges.
    last: Option<(u32, [[f32; 3]; 3])>,
}

impl Samples<'_> {
    /// What was drawn there: [`NOTHING`], or twice the number of the solid triangle, plus one for
    /// its back.
    pub fn item(&self, x: usize, row: usize) -> u32 {
        self.buffer.items()[row * self.face.stride() + x]
    }

    /// Where it meets a surface.
    pub fn point(&mut self, x: usize, row: usize) -> Option<SurfacePoint> {
        let item = self.item(x, row);
        if item == NOTHING {
            return None;
        }
        if self.last.is_none_or(|(i, _)| i != item) {
            let corners = self.occluders.corners_in(self.view, item as usize / 2);
            self.last = Edges::new(corners).map(|e| (item, e.turned::<0>()));
        }
        let (_, e) = self.last?;
        let (px, py) = (self.face.x()[x], self.face.y()[row]);
        let f = e.map(|e| f64::from(e[0] * px + (e[1] * py + e[2])));
        let sum = f[0] + f[1] + f[2];
        let uv = DVec2::new(f[1], f[2]) / sum;
        let side = if item & 1 == 1 { Side::Back } else { Side::Front };
        let triangle = self.occluders.ids()[item as usize / 2];
        Some(SurfacePoint { triangle, side, uv })
    }
}

multiversion! {
    pub(super) fn draw(
        occluders: &Occluders,
        view: &View,
        face: &Face,
        buffer: &mut ItemBuffer,
    ) = draw_kernel
}

/// Draws all source triangles; items are twice the number of the solid triangle, plus one if its
/// back is seen.
#[inline(always)]
fn draw_kernel(occluders: &Occluders, view: &View, face: &Face, buffer: &mut ItemBuffer) {
    buffer.clear(face);
    for i in 0..occluders.len() {
        let corners = occluders.corners_in(view, i);
        if corners.iter().all(|c| c.z <= 0.0) {
            continue;
        }
        if let Some(bounds) = face.bounds::<0>(&corners)
            && let Some(edges) = Edges::new(corners)
        {
            buffer.draw::<0>(face, bounds, &edges, 2 * i as u32 + u32::from(edges.back));
        }
    }
}
