//! What the front door finds at points and shows in pictures, judged by what paths know.

use std::error::Error;

use hemicube::gather::{Estimate, GatherOptions, Gatherer, Place, Probe};
use hemicube::patches::Patches;
use hemicube::progress::Silent;
use hemicube::render::{Picture, PictureOptions, Renderer, Sight};
use hemicube::scene::{Camera, Rgb, Scene, luminance};
use hemicube::solution::LightOptions;
use hemicube::visibility::Bvh;

use super::known::{Known, mean};
use super::paths::Block;

/// Pixels along a side of a block.
pub const BLOCK: usize = 8;

pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// Seconds of the processor, all cores together: for the light, and for points or picture.
pub type Seconds = [f64; 2];

/// What `hemicube probe` finds, and what that takes.
pub fn measured(
    scene: &Scene,
    known: &[Known],
    error: Option<f64>,
    options: GatherOptions,
) -> Outcome<(Vec<Estimate>, Seconds)> {
    let probe = |k: &Known| Probe { point: k.placed.point, normal: k.placed.normal };
    let probes: Vec<Probe> = known.iter().map(probe).collect();
    let start = processor_seconds();
    let small = scene.geometry.len() <= 50_000 && error.is_none();
    let light = LightOptions {
        patch_size: small.then(|| Patches::area_adding(&scene.geometry, 30_000)),
        error,
        memory: 8 << 30,
        ..LightOptions::default()
    };
    let lit = scene.light(&light, &Silent)?;
    let between = processor_seconds();
    let found = lit.probe(&probes, GatherOptions { error, ..options }, &Silent)?;
    Ok((found, [between - start, processor_seconds() - between]))
}

/// What `hemicube render` shows, as radiance, and what that takes.
pub fn pictured(
    scene: &Scene,
    camera: &Camera,
    (width, height): (usize, usize),
    error: Option<f64>,
) -> Outcome<(Picture, Seconds)> {
    let start = processor_seconds();
    let light = LightOptions { error, memory: 8 << 30, ..LightOptions::default() };
    let lit = scene.light(&light, &Silent)?;
    let between = processor_seconds();
    let options = PictureOptions { width, height, ..PictureOptions::default() };
    let field = lit.field();
    let bvh = Bvh::new(&scene.geometry);
    let options_of_light = GatherOptions { error, ..GatherOptions::of_pictures(0) };
    let gatherer = Gatherer::new(scene, &lit.solution, &field, &bvh, options_of_light);
    let renderer = Renderer::gathering(scene, &field, &gatherer);
    let radiance = |s: &Sight| s.radiance.to_array().map(|x| x as f32);
    let picture = renderer.render(camera, &options, radiance, &Silent)?;
    Ok((picture, [between - start, processor_seconds() - between]))
}

/// Seconds of all processors that this program has used.
pub fn processor_seconds() -> f64 {
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in parentheses, may have spaces.
    let rest = text.rsplit(')').next().unwrap_or_default();
    let ticks = rest.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / TICKS
}

/// Errors of luminance, as shares of the mean.
#[derive(Debug, Clone, Copy, Default)]
pub struct Figures {
    pub count: usize,
    /// How many of them are free places; the figures are of these.
    pub free: usize,
    pub rms: f64,
    pub worst: f64,
    pub bias: f64,
    /// Share of those that lie within the stated error.
    pub within: f64,
    /// RMS of the standard errors of paths.
    pub own: f64,
}

impl Figures {
    /// Of some points, as shares of `mean`.
    pub fn of(points: &[(&Known, &Estimate)], mean: f64) -> Self {
        let free = points.iter().filter(|(_, e)| e.place == Place::Free);
        let mut f = Self { count: points.len(), ..Self::default() };
        for &(k, e) in free {
            let off = off(k, e) / mean;
            f.free += 1;
            f.rms += off * off;
            f.worst = f.worst.max(off.abs());
            f.bias += off;
            f.within += f64::from(u8::from(within(k, e)));
            f.own += (k.error / mean).powi(2);
        }
        let n = f.free.max(1) as f64;
        let [rms, own] = [f.rms, f.own].map(|squares| (squares / n).sqrt());
        Self { rms, own, bias: f.bias / n, within: f.within / n, ..f }
    }

    /// Of all points, as shares of their mean.
    pub fn of_all(known: &[Known], found: &[Estimate]) -> Self {
        Self::of(&known.iter().zip(found).collect::<Vec<_>>(), mean(known))
    }
}

/// How far the luminance found is from the known.
pub fn off(k: &Known, e: &Estimate) -> f64 {
    luminance(e.irradiance) - luminance(k.irradiance)
}

/// Whether the truth lies within what is stated, as far as paths know the truth.
fn within(k: &Known, e: &Estimate) -> bool {
    off(k, e).abs() <= luminance(e.error).hypot(1.96 * k.error)
}

/// Errors of blocks of a picture, as shares of the mean of all that is reflected or, where emitters
/// are seen, of the mean of those blocks.
#[derive(Debug, Clone, Copy, Default)]
pub struct BlockFigures {
    pub count: usize,
    pub rms: f64,
    pub median: f64,
    pub worst: f64,
    /// Which block is worst.
    pub at: usize,
    /// RMS of the standard errors of paths.
    pub own: f64,
}

impl BlockFigures {
    /// Of the blocks where emitters are seen, or of the others.
    pub fn of(known: &[Block], found: &[Rgb], emitters: bool) -> Self {
        let all = |k: &Block| luminance(k.reflected + k.emitted);
        let is = |(_, k): &(usize, &Block)| (k.emitted != Rgb::ZERO) == emitters;
        let of: Vec<(usize, &Block)> = known.iter().enumerate().filter(is).collect();
        let count = of.len();
        let mean = match emitters {
            true => of.iter().map(|(_, k)| all(k)).sum::<f64>() / count as f64,
            false => mean_reflected(known),
        };
        let error = |&(i, k): &(usize, &Block)| ((luminance(found[i]) - all(k)) / mean, i);
        let mut off: Vec<(f64, usize)> = of.iter().map(error).collect();
        off.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let Some(&(worst, at)) = off.last() else { return Self::default() };
        let rms = |squares: f64| (squares / count as f64).sqrt();
        Self {
            count,
            rms: rms(off.iter().map(|o| o.0 * o.0).sum()),
            median: off[count / 2].0.abs(),
            worst,
            at,
            own: rms(of.iter().map(|(_, k)| (luminance(k.error) / mean).powi(2)).sum()),
        }
    }
}

/// Mean luminance of what is reflected.
pub fn mean_reflected(known: &[Block]) -> f64 {
    known.iter().map(|b| luminance(b.reflected)).sum::<f64>() / known.len() as f64
}

/// Means over blocks of a picture.
pub fn blocks(picture: &Picture) -> Vec<Rgb> {
    let (width, columns) = (picture.width, picture.width.div_ceil(BLOCK));
    let mut sums = vec![(Rgb::ZERO, 0.0); columns * picture.height.div_ceil(BLOCK)];
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let (sum, count) = &mut sums[i / width / BLOCK * columns + i % width / BLOCK];
        *sum += Rgb::from_array(pixel.map(f64::from));
        *count += 1.0;
    }
    sums.into_iter().map(|(sum, count)| sum / count).collect()
}
