//! Textures stay encoded until they are needed: one is decoded at a time.
//!
//! A triangle's mean is the area average over its own footprint in the texture, in linear light,
//! so that an atlas does not turn grey and a tiled floor keeps its colour.

mod alphas;
mod decode;
mod shrink;
mod srgb;
mod wrap;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Rgb;
use super::footprint;
pub(super) use alphas::Alphas;
use decode::decode;
use shrink::Image;
use srgb::LINEAR_FROM_SRGB;

pub(crate) use srgb::linear_from_srgb;
pub use wrap::Wrap;
use wrap::wrapped;

/// An image file's bytes, and how coordinates fall on it.
#[derive(Debug, Clone)]
pub struct Texture {
    /// What messages call it: a file name, or the place in the model.
    pub name: String,
    /// PNG, JPEG, ... as in the file.
    pub encoded: Arc<[u8]>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Whether v = 0 is the bottom row (OBJ) rather than the top row (glTF).
    pub v_up: bool,
    /// Whether an image without alpha is one of opacity, white for opaque (MTL `map_d`).
    pub opacity: bool,
}

/// Why an image could not be decoded.
#[derive(Debug, thiserror::Error)]
#[error("{name} does not decode: {problem}")]
pub struct TextureError {
    /// The texture's name.
    pub name: String,
    /// What the decoder said.
    pub problem: String,
}

/// A decoded texture, evaluated in linear light.
#[derive(Debug, Clone)]
pub struct TextureSampler {
    width: u32,
    height: u32,
    /// sRGB and straight alpha, as stored in the file.
    texels: Vec<[u8; 4]>,
    wrap: [Wrap; 2],
    v_up: bool,
}

/// Footprints below one texel and not longer than this many are read at their centroid.
const TINY_FOOTPRINT: f64 = 2.0;

/// Points that stand for a footprint too large to be covered texel by texel. Their error is a
/// fraction of a per cent of the texture's contrast.
const FEWEST_POINTS: usize = 4096;

/// Texels that all footprints on one texture may cost together before large ones are sampled: some
/// seconds of work.
const TEXEL_BUDGET: f64 = (1_u64 << 28) as f64;

/// Coordinates beyond this many texels say no place: their fraction is lost to rounding.
const MOST_TEXELS_AWAY: f64 = (1_u64 << 40) as f64;

impl Texture {
    /// Decodes the image.
    ///
    /// # Errors
    /// If the bytes are no image, or a larger one than is read.
    pub fn decode(&self) -> Result<TextureSampler, TextureError> {
        let Image { width, height, mut texels } = decode(&self.encoded, &self.name)
            .map_err(|problem| TextureError { name: self.name.clone(), problem })?;
        if self.opacity && texels.iter().all(|t| t[3] == u8::MAX) {
            texels.iter_mut().for_each(|t| t[3] = t[1]);
        }
        Ok(TextureSampler { width, height, texels, wrap: self.wrap, v_up: self.v_up })
    }
}

impl TextureSampler {
    /// The colour at a texture coordinate in linear light, 0..1, bilinearly interpolated.
    #[must_use]
    pub fn sample(&self, uv: DVec2) -> Rgb {
        self.bilinear(self.texel_from_uv(uv)).0
    }

    /// Alpha at a texture coordinate, 0..1, bilinearly interpolated; 1 for images without alpha.
    #[must_use]
    pub fn alpha(&self, uv: DVec2) -> f64 {
        self.bilinear(self.texel_from_uv(uv)).1
    }

    /// Area average in linear light over a triangle of texture coordinates.
    #[must_use]
    pub fn mean(&self, uv: [DVec2; 3]) -> Rgb {
        self.mean_within(uv, None, f64::INFINITY).0
    }

    /// As [`mean`](Self::mean), with mean alpha (against `cutoff`, if any: the share of the area at
    /// or above it). A footprint of more than `most_texels` is sampled.
    pub(super) fn mean_within(
        &self,
        uv: [DVec2; 3],
        cutoff: Option<f64>,
        most_texels: f64,
    ) -> (Rgb, f64) {
        let corners = uv.map(|t| self.texel_from_uv(t));
        let size = footprint::size(corners);
        let coverage = |alpha: f64| match cutoff {
            Some(cutoff) => f64::from(u8::from(alpha >= cutoff)),
            None => alpha,
        };
        let mut sum = DVec3::ZERO;
        let mut sum_alpha = 0.0;
        let mut weight = 0.0;
        let mut add = |(rgb, alpha): (Rgb, f64), w: f64| {
            sum += rgb * w;
            sum_alpha += coverage(alpha) * w;
            weight += w;
        };
        if size.area < 1.0 && size.longest <= TINY_FOOTPRINT {
            add(self.bilinear((corners[0] + corners[1] + corners[2]) / 3.0), 1.0);
        } else if size.area < 1.0 || size.texels > most_texels.min(TEXEL_BUDGET) {
            let points = (most_texels.min(TEXEL_BUDGET) as usize).min(FEWEST_POINTS);
            for p in footprint::spread(corners, points) {
                add(self.bilinear(p), 1.0);
            }
        } else {
            footprint::cover(corners, |x, y, area| add(self.texel(x, y), area));
        }
        (sum / weight, sum_alpha / weight)
    }

    /// Alpha alone.
    pub(super) fn alphas(&self) -> Alphas {
        Alphas {
            width: self.width as usize,
            height: self.height as usize,
            wrap: self.wrap,
            values: self.texels.iter().map(|t| f32::from(t[3]) / 255.0).collect(),
        }
    }

    /// How many texels one of these footprints may visit so that all together stay affordable.
    pub(super) fn texel_share(&self, footprints: impl Iterator<Item = [DVec2; 3]>) -> f64 {
        let (mut total, mut count) = (0.0_f64, 0_u32);
        for uv in footprints {
            total += footprint::size(uv.map(|t| self.texel_from_uv(t))).texels;
            count += 1;
        }
        if total <= TEXEL_BUDGET {
            f64::INFINITY
        } else {
            (TEXEL_BUDGET / f64::from(count)).max(FEWEST_POINTS as f64)
        }
    }

    /// Position in texels, from the corner of the stored image's first texel.
    pub(super) fn texel_from_uv(&self, uv: DVec2) -> DVec2 {
        let v = if self.v_up { 1.0 - uv.y } else { uv.y };
        let at = DVec2::new(uv.x * f64::from(self.width), v * f64::from(self.height));
        // Not a number fails too.
        if at.abs().max_element() <= MOST_TEXELS_AWAY && !at.is_nan() { at } else { DVec2::ZERO }
    }

    fn bilinear(&self, at: DVec2) -> (Rgb, f64) {
        let at = at - 0.5;
        let (floor, f) = (at.floor(), at - at.floor());
        let (x, y) = (floor.x as i64, floor.y as i64);
        let mix = |a: (Rgb, f64), b: (Rgb, f64), t: f64| {
            (a.0 * (1.0 - t) + b.0 * t, a.1 * (1.0 - t) + b.1 * t)
        };
        let (x1, y1) = (x.saturating_add(1), y.saturating_add(1));
        let upper = mix(self.texel(x, y), self.texel(x1, y), f.x);
        let lower = mix(self.texel(x, y1), self.texel(x1, y1), f.x);
        mix(upper, lower, f.y)
    }

    fn texel(&self, x: i64, y: i64) -> (Rgb, f64) {
        let x = wrapped(x, self.width, self.wrap[0]);
        let y = wrapped(y, self.height, self.wrap[1]);
        let [r, g, b, a] = self.texels[y * self.width as usize + x];
        let linear = |c: u8| LINEAR_FROM_SRGB[usize::from(c)];
        (DVec3::new(linear(r), linear(g), linear(b)), f64::from(a) / 255.0)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A PNG with the given texels, row by row.
    pub fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Arc<[u8]> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
        out.into()
    }

    const BLACK: [u8; 4] = [0, 0, 0, 255];
    const WHITE: [u8; 4] = [255, 255, 255, 255];
    const RED: [u8; 4] = [255, 0, 0, 255];

    fn sampler(width: u32, texels: &[[u8; 4]], wrap: Wrap, v_up: bool) -> TextureSampler {
        let encoded = png(width, texels.len() as u32 / width, texels);
        Texture { name: "t".into(), encoded, wrap: [wrap; 2], v_up, opacity: false }
            .decode()
            .unwrap()
    }

    fn uv(corners: [[f64; 2]; 3]) -> [DVec2; 3] {
        corners.map(DVec2::from)
    }

    fn close(a: Rgb, b: [f64; 3], tolerance: f64) {
        assert!((a - Rgb::from(b)).abs().max_element() <= tolerance, "{a} is not {b:?}");
    }

    #[test]
    fn srgb_becomes_linear() {
        let s = sampler(1, &[[188, 188, 188, 255]], Wrap::Repeat, false);
        close(s.sample(DVec2::splat(0.3)), [0.502_886; 3], 1e-5);
    }

    #[test]
    fn mean_is_the_exact_share_of_each_texel() {
        // Left half black, right half white; the triangle's right edge is the texture's.
        let s = sampler(2, &[BLACK, WHITE, BLACK, WHITE], Wrap::Repeat, false);
        let half = uv([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        close(s.mean(half), [0.75; 3], 1e-12);
        let mirrored = uv([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]]);
        close(s.mean(mirrored), [0.75; 3], 1e-12);
    }

    #[test]
    fn mean_over_repeats_is_that_of_the_texture() {
        let s = sampler(2, &[BLACK, WHITE, RED, BLACK], Wrap::Repeat, false);
        let expected = [0.5, 0.25, 0.25];
        close(s.mean(uv([[0.0, 0.0], [64.0, 0.0], [0.0, 64.0]])), expected, 0.02);
        let huge = uv([[0.0, 0.0], [9e5, 0.0], [0.0, 9e5]]);
        close(s.mean(huge), expected, 0.02);
        close(s.mean_within(huge, None, 1000.0).0, expected, 0.05);
    }

    #[test]
    fn tiny_footprints_are_read_at_their_centroid() {
        let s = sampler(2, &[BLACK, WHITE, BLACK, WHITE], Wrap::Repeat, false);
        close(s.mean([DVec2::new(0.75, 0.5); 3]), [1.0; 3], 1e-12);
        close(s.mean([DVec2::new(0.5, 0.5); 3]), [0.5; 3], 1e-12);
    }

    #[test]
    fn a_line_across_the_texture_averages_along_it() {
        let s = sampler(2, &[BLACK, WHITE], Wrap::Repeat, false);
        close(s.mean(uv([[0.0, 0.5], [8.0, 0.5], [4.0, 0.5]])), [0.5; 3], 0.02);
    }

    #[test]
    fn wraps_and_orientation() {
        let texels = [RED, BLACK, WHITE, BLACK];
        let at = |wrap, v_up, u, v| sampler(2, &texels, wrap, v_up).sample(DVec2::new(u, v));
        close(at(Wrap::Repeat, false, 0.25, 0.25), [1.0, 0.0, 0.0], 1e-12);
        close(at(Wrap::Repeat, true, 0.25, 0.25), [1.0; 3], 1e-12);
        close(at(Wrap::Repeat, false, 3.25, -0.75), [1.0, 0.0, 0.0], 1e-12);
        close(at(Wrap::Mirror, false, 1.75, 0.25), [1.0, 0.0, 0.0], 1e-12);
        close(at(Wrap::Clamp, false, -5.0, -7.0), [1.0, 0.0, 0.0], 1e-12);
    }

    /// Footprints of a texel across cost as much as many texels within wide ones.
    #[test]
    fn long_thin_footprints_are_not_covered_one_by_one() {
        let s = sampler(1, &[[255; 4]], Wrap::Repeat, false);
        let thin = uv([[0.0, 0.0], [1.0, 0.0], [0.0, 1e6]]);
        assert!(s.texel_share([thin; 4].into_iter()).is_infinite());
        assert!(s.texel_share([thin; 16].into_iter()) < footprint::size(thin).texels);
    }

    #[test]
    fn nothing_finite_is_needed() {
        let s = sampler(2, &[RED, BLACK, WHITE, BLACK], Wrap::Repeat, false);
        for x in [f64::NAN, f64::INFINITY, -1e300, 1e300, 1e18] {
            assert!(s.sample(DVec2::new(x, 0.5)).is_finite());
            assert!(s.mean(uv([[x, 0.0], [0.0, x], [1.0, 1.0]])).is_finite());
        }
        // Finite, until they are multiplied by the texture's size, and with one another.
        for x in [1e15, 1e100, 1e160, f64::MAX] {
            for (a, b) in [(x, x), (x, -x), (-x, 1.0)] {
                let mean = s.mean(uv([[0.0, 0.0], [1.0, a], [b, 1.0]]));
                assert!(mean.min_element() >= 0.0 && mean.max_element() <= 1.0, "{x}: {mean}");
            }
        }
    }

    #[test]
    fn noise_and_bombs_are_errors() {
        let texture = |encoded: Vec<u8>| Texture {
            name: "t.png".into(),
            encoded: encoded.into(),
            wrap: [Wrap::Repeat; 2],
            v_up: false,
            opacity: false,
        };
        let noise = (0..9999_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        assert!(texture(noise).decode().unwrap_err().to_string().contains("t.png"));
        assert!(texture(vec![]).decode().is_err());
        // A header that claims 2^31 by 2^31 pixels.
        let mut bomb = png(1, 1, &[RED]).to_vec();
        bomb[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(texture(bomb).decode().is_err());
    }
}
