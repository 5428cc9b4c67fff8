//! Light of a source over the atlas, small enough for a page.
//!
//! Steps of light are seen as shares of it, so each channel is stored as its logarithm, in
//! [`STEPS`] to an octave: 0 for none, and else 1 + `STEPS` × (log2 (value / peak) + `OCTAVES`).
//! Red and blue are told by their difference to green, and all by that to the texel on their left,
//! or above the first; signs go to the lowest bit, and low and high bytes apart. What is left is
//! mostly zeros, and deflate does the rest.

use std::io::{self, Seek, Write};

use crate::export::members::{Members, Packing};

/// Codes to an octave: light is within .27 % of what they say.
pub const STEPS: u16 = 128;

/// Octaves below the brightest texel that are told from darkness.
pub const OCTAVES: u16 = 40;

/// Writes the light of one source (W/m² or lx a texel) as `NAME_low` and `NAME_high`, and returns
/// what its largest code stands for.
pub fn write<W: Write + Seek>(
    to: &mut Members<'_, W>,
    name: &str,
    [width, height]: [usize; 2],
    light: &[[f32; 3]],
    packing: Packing,
) -> io::Result<f64> {
    let peak = f64::from(light.iter().flatten().copied().fold(0.0, f32::max));
    let codes: Vec<[u16; 3]> = light
        .iter()
        .map(|v| {
            let [r, g, b] = v.map(|c| code(f64::from(c), peak));
            [g, r.wrapping_sub(g), b.wrapping_sub(g)]
        })
        .collect();
    let differences: Vec<u16> = (0..3)
        .flat_map(|channel| {
            let codes = &codes;
            (0..width * height).map(move |i| {
                let before = match i {
                    0 => 0,
                    _ if i % width == 0 => codes[i - width][channel],
                    _ => codes[i - 1][channel],
                };
                zigzag(codes[i][channel].wrapping_sub(before))
            })
        })
        .collect();
    for (part, shift) in [("low", 0), ("high", 8)] {
        let bytes = differences.iter().map(|d| (d >> shift) as u8);
        let shape = [3, height, width];
        to.array(&format!("{name}_{part}"), &shape, packing, bytes)?;
    }
    Ok(peak)
}

fn code(value: f64, peak: f64) -> u16 {
    let octaves = (value / peak).log2() + f64::from(OCTAVES);
    // Darkness is minus infinity, or not a number where all is dark.
    if octaves >= 0.0 { 1 + (octaves * f64::from(STEPS)).round() as u16 } else { 0 }
}

/// A difference with its sign in the lowest bit.
fn zigzag(difference: u16) -> u16 {
    let signed = difference.cast_signed();
    ((signed << 1) ^ (signed >> 15)).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_within_half_a_step() {
        let peak = 8.0;
        for value in [8.0, 7.9, 1.0, 3e-5, 8.0 * 0.5_f64.powi(39)] {
            let octaves = f64::from(code(value, peak) - 1) / f64::from(STEPS) - f64::from(OCTAVES);
            let ratio = peak * octaves.exp2() / value;
            assert!((ratio - 1.0).abs() < 0.0028, "{value}: {ratio}");
        }
        assert_eq!([0.0, 1e-13].map(|v| code(v, peak)), [0, 0]);
        assert_eq!(code(0.0, 0.0), 0);
    }

    #[test]
    fn small_differences_of_either_sign_have_no_high_byte() {
        let of = [0_i16, -1, 1, -2, 127, -128].map(|d| zigzag(d.cast_unsigned()));
        assert_eq!(of, [0, 1, 2, 3, 254, 255]);
    }
}
