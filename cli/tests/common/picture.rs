//! Pictures as others see them: decoded again.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A picture of 8 bits a channel, sRGB.
#[derive(Debug)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Decodes a PNG; panics if it is not complete.
    pub fn read(path: &Path) -> Self {
        let file = BufReader::new(File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
        reader.finish().unwrap();
        let pixels = bytes.as_chunks().0.to_vec();
        Self { width: info.width, height: info.height, pixels }
    }

    /// Width and height.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Mean and largest absolute difference of a channel from that of another picture, of 255.
    pub fn difference(&self, other: &Self) -> (f64, u8) {
        assert_eq!(self.size(), other.size());
        let pairs = self.pixels.iter().flatten().zip(other.pixels.iter().flatten());
        let off: Vec<u8> = pairs.map(|(a, b)| a.abs_diff(*b)).collect();
        let sum: f64 = off.iter().map(|&d| f64::from(d)).sum();
        (sum / off.len() as f64, off.into_iter().max().unwrap())
    }

    /// The mean of each channel as linear light, 0..1.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.pixels {
            sum.iter_mut().zip(pixel).for_each(|(sum, &c)| *sum += linear(c));
        }
        sum.map(|s| s / self.pixels.len() as f64)
    }
}

/// Linear light of a channel (IEC 61966-2-1).
fn linear(c: u8) -> f64 {
    let c = f64::from(c) / 255.0;
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
