//! OpenEXR pictures of linear light, as floats.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{Image, SpecificChannels, WritableImage};

use super::ExportError;
use super::target::write_whole;

/// Writes rows of pixels, from the top, as they are: channels R, G and B of 32 bits, compressed
/// without loss.
///
/// # Errors
/// If the file cannot be written.
pub fn write_exr(
    path: &Path,
    [width, height]: [usize; 2],
    pixels: &[[f32; 3]],
) -> Result<(), ExportError> {
    let at = |p: exr::math::Vec2<usize>| {
        let [r, g, b] = pixels.get(p.1 * width + p.0).copied().unwrap_or_default();
        (r, g, b)
    };
    let mut encoded = Cursor::new(Vec::new());
    Image::from_channels((width, height), SpecificChannels::rgb(at))
        .write()
        .to_buffered(&mut encoded)
        .map_err(|e| ExportError::Encode { path: path.to_path_buf(), message: e.to_string() })?;
    write_whole(path, encoded.get_ref())
}
