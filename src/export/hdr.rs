//! Radiance pictures (`.hdr`, RGBE): linear light, three mantissas and a shared exponent (Ward
//! 1991, "Real pixels").

use std::fmt::Write;
use std::path::Path;

use super::ExportError;
use super::target::write_whole;
use crate::render::Picture;

/// Writes rows of pixels, from the top, as they are.
///
/// # Errors
/// If the file cannot be written.
pub fn write_hdr(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    let mut head = String::from("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n");
    // Writing into memory does not fail.
    let _ = writeln!(head, "-Y {} +X {}", picture.height, picture.width);
    let mut bytes = head.into_bytes();
    bytes.extend(picture.pixels.iter().flat_map(|p| rgbe(*p)));
    write_whole(path, &bytes)
}

fn rgbe(pixel: [f32; 3]) -> [u8; 4] {
    let most = pixel.into_iter().fold(0.0_f32, f32::max);
    if !(most > 1e-32 && most.is_finite()) {
        return [0; 4];
    }
    // most = m 2^e with m from 1/2 to below 1.
    let exponent = most.log2().floor() as i32 + 1;
    let scale = f64::from(-exponent).exp2() * 256.0;
    let [r, g, b] = pixel.map(|c| (f64::from(c.max(0.0)) * scale).min(255.0) as u8);
    [r, g, b, (exponent + 128).clamp(0, 255) as u8]
}

#[cfg(test)]
mod tests {
    use super::rgbe;

    #[test]
    fn values_come_back_within_a_hundredth() {
        for v in [1e-6_f32, 0.3, 0.5, 1.0, 255.9, 12_345.6] {
            let [r, _, _, e] = rgbe([v, v / 3.0, 0.0]);
            let back = (f64::from(r) + 0.5) / 256.0 * (f64::from(e) - 128.0).exp2();
            assert!((back / f64::from(v) - 1.0).abs() < 0.01, "{v}: {back}");
        }
        assert_eq!(rgbe([0.0; 3]), [0; 4]);
        assert_eq!(rgbe([f32::NAN, 0.0, 0.0]), [0; 4]);
    }
}
