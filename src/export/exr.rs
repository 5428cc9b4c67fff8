//! OpenEXR pictures of linear light, as floats.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{
    Encoding, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, WritableImage,
};

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
    // In order, or threads would decide what stands where in the file.
    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::default() };
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        encoding,
        SpecificChannels::rgb(at),
    );
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut encoded)
        .map_err(|e| ExportError::Encode { path: path.to_path_buf(), message: e.to_string() })?;
    write_whole(path, encoded.get_ref())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_pixels_make_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        let pixels: Vec<[f32; 3]> = (0..600 * 500).map(|i| [i as f32, 0.5, 1e-9]).collect();
        let bytes = |name: &str| {
            let path = folder.path().join(name);
            write_exr(&path, [600, 500], &pixels).unwrap();
            std::fs::read(path).unwrap()
        };
        let first = bytes("0.exr");
        assert!((1..6).all(|k| bytes(&format!("{k}.exr")) == first));
    }
}
