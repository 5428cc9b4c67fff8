//! Pictures whose light is gathered pixel by pixel.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::camera::{check, frame_of};
use super::known::PixelErrors;
use super::picture::{Picture, PictureOptions, RenderError};
use super::renderer::{Gathered, Renderer, Sight, draw};
use super::smooth::smooth;
use super::spots::{Gathering, Light, NONE, Sample, Seen, Spots, WIDEST, looks};
use crate::engines::sampling::Table;
use crate::patches::SurfacePoint;
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::Normals;
use crate::scene::{Camera, Scene, Side, TriangleId, luminance};
use crate::visibility::{Face, ItemBuffer, NOTHING, View};

/// Rows of pixels that are drawn at once, and pixels that are gathered together: squares of that.
const BAND: usize = 8;

/// Most pixels whose spots are held at a time.
const HELD: usize = 1 << 20;

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

    /// Width of a pixel where a sample is, m.
    fn width(&self, s: &Sample) -> f64 {
        (s.position - self.camera.eye).dot(self.camera.forward.normalize_or_zero()).abs()
            * self.pixel
    }
}

impl Renderer<'_> {
    pub(super) fn gathered(
        &self,
        gatherer: &Gathered<'_>,
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
        let tables: Vec<Table> =
            looks(gatherer.gatherer.noise()).map(|rays| gatherer.gatherer.table(rays)).collect();
        let mut pixels = vec![Shown::default(); w * h];
        let margin = WIDEST as usize;
        let slab = (HELD / w).saturating_sub(2 * margin).max(margin).next_multiple_of(BAND);
        for from in (0..h).step_by(slab) {
            let rows = from..(from + slab).min(h);
            // Spots around are of use too.
            let low = (rows.start.saturating_sub(margin) / BAND) * BAND;
            let high = (rows.end + margin).min(h);
            let counts = |y: usize| rows.contains(&y);
            let mut spots = self.spots(gatherer, &eye, low..high, &tables, counts, progress)?;
            let light = smooth(&mut spots, w);
            let first = (rows.start - low) * w;
            self.show(&eye, rows, (&spots, first, &light), &mut pixels, &map);
        }
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

    /// The spots of some rows of pixels, and what light they find.
    fn spots(
        &self,
        gatherer: &Gathered<'_>,
        eye: &Eye,
        rows: std::ops::Range<usize>,
        tables: &[Table],
        counts: impl Fn(usize) -> bool + Sync,
        progress: &dyn Progress,
    ) -> Result<Spots, Cancelled> {
        let [w, _, n] = eye.size;
        let cancelled = AtomicBool::new(false);
        let bands: Vec<usize> = rows.clone().step_by(BAND).collect();
        let found: Vec<Spots> = bands
            .into_par_iter()
            .map_init(ItemBuffer::default, |buffer, from| {
                if cancelled.load(Ordering::Relaxed) {
                    return Spots::default();
                }
                let band = from..(from + BAND).min(rows.end);
                let spots = self.spots_of_band(gatherer, eye, band.clone(), tables, buffer);
                let done = band.filter(|y| counts(*y)).count();
                if progress.advance(done as u64).is_err() {
                    cancelled.store(true, Ordering::Relaxed);
                }
                spots
            })
            .collect();
        if cancelled.into_inner() {
            return Err(Cancelled);
        }
        let mut all = Spots { first: vec![0], ..Spots::default() };
        all.of_sample.reserve(rows.len() * w * n * n);
        for band in found {
            let before = all.spots.len() as u32;
            all.spots.extend(band.spots);
            all.first.extend(band.first[1..].iter().map(|f| f + before));
            all.of_sample.extend(band.of_sample);
        }
        Ok(all)
    }

    fn spots_of_band(
        &self,
        gatherer: &Gathered<'_>,
        eye: &Eye,
        band: std::ops::Range<usize>,
        tables: &[Table],
        buffer: &mut ItemBuffer,
    ) -> Spots {
        let [w, _, n] = eye.size;
        let rows = band.len();
        let samples = self.samples_of(eye, &gatherer.normals, &band, buffer);
        let mut gathering = Gathering::new(gatherer.gatherer, &gatherer.calm, tables);
        // Square by square, so that rays that go together begin together.
        let mut counts = vec![0_u32; rows * w];
        let mut of_sample = vec![NONE; rows * w * n * n];
        let mut squares = Vec::new();
        for left in (0..w).step_by(BAND) {
            let mut spots = Vec::new();
            for y in 0..rows {
                for x in left..(left + BAND).min(w) {
                    let pixel = y * w + x;
                    let before = spots.len();
                    gathering.pixel(
                        &samples[pixel],
                        (eye.camera.eye, |s| eye.width(s)),
                        (((band.start + y) * w + x) as u64, x % 2 == 0 && y % 2 == 0),
                        &mut of_sample[pixel * n * n..][..n * n],
                        &mut spots,
                    );
                    counts[pixel] = (spots.len() - before) as u32;
                }
            }
            gathering.light(&mut spots);
            squares.push(spots);
        }
        let mut all = Spots { spots: Vec::new(), first: vec![0], of_sample };
        let mut taken = vec![0; squares.len()];
        for (pixel, count) in counts.iter().enumerate() {
            let square = pixel % w / BAND;
            let from = taken[square];
            taken[square] += *count as usize;
            all.spots.extend_from_slice(&squares[square][from..taken[square]]);
            all.first.push(all.spots.len() as u32);
        }
        all
    }

    /// What the samples of a band of pixels meet, pixel by pixel, where that may be lit.
    fn samples_of(
        &self,
        eye: &Eye,
        normals: &Normals,
        band: &std::ops::Range<usize>,
        buffer: &mut ItemBuffer,
    ) -> Vec<Seen> {
        let [w, _, n] = eye.size;
        let face = eye.face(band.start, band.len());
        draw(&self.occluders, &eye.view, &face, buffer);
        let mut samples = self.samples(&eye.view, &face, buffer);
        let geometry = &self.scene.geometry;
        let mut at = |x, y| samples.point(x, y).filter(|p| geometry.exchanges(p.triangle, p.side));
        let sample = |p| Sample::new(self.scene, normals, p);
        // Samples of a pixel on one triangle share a normal.
        let on = |last: &mut Option<Sample>, p: SurfacePoint| {
            let own = last.filter(|l| (l.at.triangle, l.at.side) == (p.triangle, p.side));
            let here = own.map_or_else(|| sample(p), |l| l.moved(self.scene, p));
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

    /// Shows rows of pixels: `light` is what arrives at each of the spots, `first` the pixel among
    /// them that the rows begin with.
    fn show(
        &self,
        eye: &Eye,
        rows: std::ops::Range<usize>,
        (spots, first, light): (&Spots, usize, &[Light]),
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
                    let pixel = first + band * BAND * w + at;
                    let (x, y) = (at % w * n, at / w * n);
                    let of_sample = &spots.of_sample[pixel * all..][..all];
                    // The last one of plain material: many samples of a pixel show the same.
                    let mut last: Option<((Looks, u8), Shown)> = None;
                    let mut shown = |i: usize, j: usize| {
                        let k = of_sample[j * n + i];
                        let looks = self.looks(samples.item(x + i, y + j)).map(|looks| (looks, k));
                        if let Some((last, shown)) = last
                            && looks == Some(last)
                        {
                            return shown;
                        }
                        let light = match k {
                            NONE => Light::default(),
                            k => light[spots.first[pixel] as usize + usize::from(k)],
                        };
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
