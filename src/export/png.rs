//! PNG pictures, 8 bits a channel, sRGB.

use std::io::Cursor;
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{ExportError, write_whole};
use crate::render::Picture;
use crate::tone::srgb;

/// Writes a picture of linear display light (0..1) as sRGB PNG.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    let bytes: Vec<u8> = picture.pixels.iter().flatten().map(|&c| srgb(c)).collect();
    let mut encoded = Cursor::new(Vec::new());
    PngEncoder::new(&mut encoded)
        .write_image(&bytes, picture.width as u32, picture.height as u32, ExtendedColorType::Rgb8)
        .map_err(|e| ExportError::Encode { path: path.to_path_buf(), message: e.to_string() })?;
    write_whole(path, encoded.get_ref())
}
