//! PNG pictures, 8 bits a channel, sRGB.

use std::path::Path;

use super::ExportError;
use super::target::write_whole;
use crate::render::Picture;
use crate::tone::srgb;

/// Writes a picture of linear display light (0..1) as sRGB PNG.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    let encoded = encode_picture(picture)
        .map_err(|message| ExportError::Encode { path: path.to_path_buf(), message })?;
    write_whole(path, &encoded)
}

/// The bytes of a file with a picture of linear display light (0..1) as sRGB PNG.
///
/// # Errors
/// If the picture has no pixels, or more than the format can say.
pub fn encode_picture(picture: &Picture) -> Result<Vec<u8>, String> {
    let bytes: Vec<u8> = picture.pixels.iter().flatten().map(|&c| srgb(c)).collect();
    encode_png([picture.width, picture.height], &bytes).map_err(|e| e.to_string())
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
