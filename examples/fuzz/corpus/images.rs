//! Pictures as textures have them.

use std::error::Error;

use hemicube::Picture;
use hemicube::export::write_jpeg;
use png::{BitDepth, ColorType};

use super::{Input, Sound};

/// Pictures of each form of PNG, and JPEG.
pub fn images() -> Sound {
    const FORMS: &[(ColorType, BitDepth, usize)] = &[
        (ColorType::Rgba, BitDepth::Eight, 32),
        (ColorType::Rgb, BitDepth::Eight, 24),
        (ColorType::Grayscale, BitDepth::One, 1),
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen, 32),
        (ColorType::Rgb, BitDepth::Sixteen, 48),
        (ColorType::Indexed, BitDepth::Four, 4),
    ];
    let mut found = Vec::new();
    for &(colour, depth, bits) in FORMS {
        found.push(Input::new("map.png", png(colour, depth, bits)?));
    }
    found.push(Input::new("map.jpg", jpeg()?));
    Ok(found)
}

/// Eight pixels across and down, half of them clear where they may be.
pub fn masked() -> Result<Vec<u8>, Box<dyn Error>> {
    png(ColorType::Rgba, BitDepth::Eight, 32)
}

fn png(colour: ColorType, depth: BitDepth, bits: usize) -> Result<Vec<u8>, Box<dyn Error>> {
    const SIDE: usize = 8;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIDE as u32, SIDE as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == ColorType::Indexed {
        encoder.set_palette((0..48).collect::<Vec<u8>>());
        encoder.set_trns(vec![0, 255, 128]);
    }
    let mut writer = encoder.write_header()?;
    let row = (SIDE * bits).div_ceil(8);
    let pixels: Vec<u8> =
        (0..SIDE * row).map(|i| if i % row < row / 2 { 0 } else { 217 }).collect();
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

pub fn jpeg() -> Result<Vec<u8>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("map.jpg");
    let pixels = (0..16 * 16).map(|i| [i as f32 / 256.0, 0.5, 0.1]).collect();
    write_jpeg(&path, &Picture { width: 16, height: 16, pixels })?;
    Ok(std::fs::read(path)?)
}
