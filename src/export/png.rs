//! PNG pictures, 8 bits a channel, sRGB.

use std::path::Path;

use super::ExportError;
use super::target::write_whole;
use crate::render::Picture;
use crate::tone::srgb;

/// Writes a picture of linear display light (0..1) as sRGB PNG.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    let bytes: Vec<u8> = picture.pixels.iter().flatten().map(|&c| srgb(c)).collect();
    let encoded = encode_png([picture.width, picture.height], &bytes)
        .map_err(|e| ExportError::Encode { path: path.to_path_buf(), message: e.to_string() })?;
    write_whole(path, &encoded)
}

/// Rows of pixels of three bytes each, encoded.
pub(in crate::export) fn encode_png(
    [width, height]: [usize; 2],
    bytes: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut encoded = Vec::new();
    let mut encoder = png::Encoder::new(&mut encoded, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(bytes))?;
    Ok(encoded)
}
