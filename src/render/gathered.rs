//! Pictures whose light is gathered pixel by pixel.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::camera::{check, frame_of};
use super::picture::{Picture, PictureOptions, RenderError};
use super::renderer::{Renderer, Sight, draw};
use super::smooth::smooth;
use super::spots::{Gathering, LOOKS, NONE, Sample, Spots, WIDEST};
use crate::engines::sampling::Table;
use crate::gather::Gatherer;
use crate::patches::SurfacePoint;
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::Normals;
use crate::scene::{Camera, Rgb, Scene};
use crate::visibility::{Face, ItemBuffer, View};

/// Rows of pixels that are drawn at once, and pixels that are gathered together: squares of that.
const BAND: usize = 8;

/// Most pixels whose spots are held at a time.
const HELD: usize = 1 << 20;

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
        gatherer: (&Gatherer<'_>, &Normals),
        camera: &Camera,
        options: &PictureOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<Picture, RenderError> {
        let (w, h, n) = (options.width, options.height, options.samples.clamp(1, 15));
        check(camera, w, h)?;
        let mut view = View::default();
        self.occluders.look(&frame_of(camera)?, &mut view);
        let half = (0.5 * camera.vfov).tan();
        let pixel = 2.0 * half / h as f64;
        let eye = Eye { view, half, size: [w, h, n], pixel, camera: camera.clone() };
        let tables = LOOKS.map(|rays| gatherer.0.table(rays));
        let mut pixels = vec![[0.0; 3]; w * h];
        let margin = WIDEST as usize;
        let slab = (HELD / w).saturating_sub(2 * margin).max(margin).next_multiple_of(BAND);
        for from in (0..h).step_by(slab) {
            let rows = from..(from + slab).min(h);
            // Spots around are of use too.
            let low = (rows.start.saturating_sub(margin) / BAND) * BAND;
            let high = (rows.end + margin).min(h);
            let counts = |y: usize| rows.contains(&y);
            let mut spots = self.spots(gatherer, &eye, low..high, &tables, counts, progress)?;
            let reflected = smooth(&mut spots, w);
            let light: Vec<Rgb> =
                spots.spots.iter().zip(reflected).map(|(s, r)| s.direct + r).collect();
            let first = (rows.start - low) * w;
            self.show(&eye, rows, (&spots, first, &light), &mut pixels, &map);
        }
        Ok(Picture { width: w, height: h, pixels })
    }

    /// The spots of some rows of pixels, and what light they find.
    fn spots(
        &self,
        gatherer: (&Gatherer<'_>, &Normals),
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
        gatherer: (&Gatherer<'_>, &Normals),
        eye: &Eye,
        band: std::ops::Range<usize>,
        tables: &[Table],
        buffer: &mut ItemBuffer,
    ) -> Spots {
        let [w, _, n] = eye.size;
        let rows = band.len();
        let samples = self.samples(eye, gatherer.1, &band, buffer);
        let mut gathering = Gathering::new(gatherer.0, tables);
        // Square by square, so that rays that go together begin together.
        let mut counts = vec![0_u32; rows * w];
        let mut of_sample = vec![NONE; rows * w * n * n];
        let mut squares = Vec::new();
        for left in (0..w).step_by(BAND) {
            let mut spots = Vec::new();
            for y in 0..rows {
                for x in left..(left + BAND).min(w) {
                    let pixel = y * w + x;
                    let own = &samples[pixel * n * n..][..n * n];
                    let before = spots.len();
                    gathering.pixel(
                        own,
                        (eye.camera.eye, |s| eye.width(s)),
                        ((band.start + y) * w + x) as u64,
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
    fn samples(
        &self,
        eye: &Eye,
        normals: &Normals,
        band: &std::ops::Range<usize>,
        buffer: &mut ItemBuffer,
    ) -> Vec<Option<Sample>> {
        let [w, _, n] = eye.size;
        let face = eye.face(band.start, band.len());
        draw(&self.occluders, &eye.view, &face, buffer);
        let mut samples = vec![None; band.len() * w * n * n];
        for row in 0..band.len() * n {
            self.each_point(&eye.view, &face, buffer, row, |x, point| {
                let lit = |p: &SurfacePoint| self.scene.geometry.exchanges(p.triangle, p.side);
                if let Some(p) = point.filter(lit) {
                    let pixel = row / n * w + x / n;
                    samples[pixel * n * n + row % n * n + x % n] =
                        Some(Sample::new(self.scene, normals, p));
                }
            });
        }
        samples
    }

    /// Shows rows of pixels: `light` is the irradiance of each of the spots, `first` the pixel
    /// among them that the rows begin with.
    fn show(
        &self,
        eye: &Eye,
        rows: std::ops::Range<usize>,
        (spots, first, light): (&Spots, usize, &[Rgb]),
        pixels: &mut [[f32; 3]],
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
                for row in 0..pixels.len() / w * n {
                    self.each_point(&eye.view, &face, buffer, row, |x, point| {
                        let pixel = first + (band * BAND + row / n) * w + x / n;
                        let k = spots.of_sample[pixel * all + row % n * n + x % n];
                        let light = match k {
                            NONE => Rgb::ZERO,
                            k => light[spots.first[pixel] as usize + usize::from(k)],
                        };
                        let sight = match point {
                            Some(p) => self.sight(p, light),
                            None => Sight { radiance: scene.sky, ..Sight::DARK },
                        };
                        let value = map(&sight);
                        for c in 0..3 {
                            pixels[row / n * w + x / n][c] += value[c] / all as f32;
                        }
                    });
                }
            },
        );
    }
}
