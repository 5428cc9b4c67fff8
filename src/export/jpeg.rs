//! JPEG pictures, sRGB.

use std::path::Path;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::ExportError;
use super::target::write_whole;
use crate::render::Picture;
use crate::tone::srgb;

/// Of 100: no artefacts that one sees.
const QUALITY: u8 = 93;

/// Writes a picture of linear display light (0..1).
///
/// # Errors
/// If the file cannot be written.
pub fn write_jpeg(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    let bytes: Vec<u8> = picture.pixels.iter().flatten().map(|&c| srgb(c)).collect();
    let mut encoded = Vec::new();
    let mut encoder = Encoder::new(&mut encoded, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    let size = [picture.width, picture.height].map(|n| u16::try_from(n).unwrap_or(u16::MAX));
    encoder
        .encode(&bytes, size[0], size[1], ColorType::Rgb)
        .map_err(|e| ExportError::Encode { path: path.to_path_buf(), message: e.to_string() })?;
    write_whole(path, &encoded)
}
