//! The sRGB transfer function, IEC 61966-2-1.

use std::sync::LazyLock;

use crate::scene::Rgb;

/// Linear light of all 8-bit values, 0..1.
pub static LINEAR_FROM_SRGB: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|c| linear(c as f64 / 255.0)));

fn linear(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Linear light of a colour of 0..1 a channel; what is beyond, or no number, is brought back.
pub fn linear_from_srgb(colour: Rgb) -> Rgb {
    Rgb::from(colour.to_array().map(|c| linear(c.max(0.0).clamp(0.0, 1.0))))
}

/// The 8-bit value nearest to linear light of 0..1.
pub fn srgb_from_linear(linear: f64) -> u8 {
    let c =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * c).round() as u8
}
