//! From radiance to what a screen can show.

mod false_colour;
mod glyphs;
mod sheet;

use serde::Serialize;

pub use false_colour::{FalseColour, Map};
pub use sheet::contact_sheet;

use crate::scene::Rgb;

/// How radiance becomes display light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// AgX (Sobotka 2022): a film-like curve that lets bright colours pale.
    #[default]
    Agx,
    /// Reinhard et al. (2002), "Photographic tone reproduction for digital images", with a white
    /// point, on luminance.
    Reinhard,
    /// Clipped at white.
    Linear,
}

/// What automatic exposure brings the mean of lit surfaces to, before the tone map.
pub const KEY: f64 = 0.18;

impl Tone {
    /// Display light, linear 0..1, of exposed radiance.
    #[must_use]
    pub fn map(self, exposed: Rgb) -> [f32; 3] {
        let c = exposed.max(Rgb::ZERO);
        let mapped = match self {
            Self::Agx => agx(c),
            Self::Reinhard => reinhard(c),
            Self::Linear => c,
        };
        mapped.clamp(Rgb::ZERO, Rgb::ONE).as_vec3().to_array()
    }
}

/// Luminance that the Reinhard curve maps to white.
const WHITE: f64 = 8.0;

fn reinhard(c: Rgb) -> Rgb {
    let l = crate::scene::luminance(c);
    c * ((1.0 + l / (WHITE * WHITE)) / (1.0 + l))
}

/// The AgX base curve in the polynomial fit of Wrensch (2023), "Minimal AgX implementation".
fn agx(c: Rgb) -> Rgb {
    use glam::DMat3;
    let inset = DMat3::from_cols_array(&[
        0.842_479_062_253_094,
        0.042_328_242_251_012_6,
        0.042_375_654_905_705_1,
        0.078_433_599_999_999_2,
        0.878_468_636_469_772,
        0.078_433_6,
        0.079_223_745_147_764_3,
        0.079_166_127_460_503_6,
        0.879_142_973_793_104,
    ]);
    // The inverse.
    let outset = DMat3::from_cols_array(&[
        1.196_879_005_120_17,
        -0.052_896_851_757_456_2,
        -0.052_971_635_514_443_8,
        -0.098_020_881_140_136_8,
        1.151_903_129_904_17,
        -0.098_043_450_117_124_1,
        -0.099_029_744_079_720_5,
        -0.098_961_176_844_843_3,
        1.151_073_672_641_16,
    ]);
    // Stops about middle grey that the curve covers.
    let (low, high) = (-12.473_93, 4.026_069);
    let v = inset * c;
    let v = Rgb::from_array(v.to_array().map(|x| {
        let x = ((x.max(1e-10).log2() - low) / (high - low)).clamp(0.0, 1.0);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - 0.00232
    }));
    let v = (outset * v).max(Rgb::ZERO);
    Rgb::from_array(v.to_array().map(|x| x.powf(2.2)))
}

/// sRGB code value 0..255 of linear display light 0..1 (IEC 61966-2-1).
#[must_use]
pub fn srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (y * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tone_map_rises_from_black_to_white() {
        for tone in [Tone::Agx, Tone::Reinhard, Tone::Linear] {
            let mut last = -1.0;
            for i in 0..60 {
                let l = if i == 0 { 0.0 } else { 1e-3 * 1.3_f64.powi(i) };
                let [r, g, b] = tone.map(Rgb::splat(l));
                assert!(r >= last - 1e-6, "{tone:?} at {l}");
                assert!((r - g).abs() < 1e-3 && (g - b).abs() < 1e-3, "grey stays grey");
                last = r;
            }
            assert!(tone.map(Rgb::ZERO)[0] < 1e-3);
            assert!(last > 0.95, "{tone:?} {last}");
        }
    }

    #[test]
    fn srgb_known_values() {
        assert_eq!([0.0, 0.214_041_14, 1.0].map(srgb), [0, 128, 255]);
    }
}
