//! Decodes image files: PNG and JPEG, and with the feature `textures` those that the crate `image`
//! reads. Colour profiles are ignored, as glTF asks: texels are sRGB.

use std::io::Cursor;

use zune_jpeg::zune_core::{
    bytestream::ZCursor, colorspace::ColorSpace as JpegSpace, options::DecoderOptions,
};

use super::shrink::{Image, Shrink};

/// Longest side of an image, its most texels, and most bytes that it may take at once while it is
/// decoded: a file of a few kilobytes can claim to hold gigabytes.
const MAX_SIDE: u32 = 32_768;
const MAX_TEXELS: u64 = 1 << 28;
const MAX_BYTES: usize = 1 << 29;

/// Decodes a file called `name`, or says why not.
pub(super) fn decode(encoded: &[u8], name: &str) -> Result<Image, String> {
    let image = if encoded.starts_with(b"\x89PNG\r\n\x1a\n") {
        from_png(encoded)
    } else if encoded.starts_with(b"\xff\xd8\xff") {
        from_jpeg(encoded)
    } else {
        from_other(encoded, name)
    }?;
    if image.texels.is_empty() { Err("it has no pixels".into()) } else { Ok(image) }
}

fn from_png(encoded: &[u8]) -> Result<Image, String> {
    let text = |e: png::DecodingError| e.to_string();
    let limits = png::Limits { bytes: MAX_BYTES };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(encoded), limits);
    let (width, height) = decoder.read_header_info().map_err(text)?.size();
    check_sides(width, height)?;
    // To 8 or 16 bits a channel, without palette.
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(text)?;
    // The decoder counts on what it does not check.
    let is_palette = |p: &[u8]| p.len().is_multiple_of(3) && p.len() <= 3 * 256;
    if !reader.info().palette.as_deref().is_none_or(is_palette) {
        return Err("its palette is no list of colours".into());
    }
    let (colour, depth) = reader.output_color_type();
    let mut shrink = Shrink::new(width, height, colour.samples());
    let mut take = |row: &[u8]| match depth {
        png::BitDepth::Sixteen => shrink.take(&rounded(row)),
        _ => shrink.take(row),
    };
    if reader.info().interlaced {
        let mut samples = samples(reader.output_buffer_size())?;
        let frame = reader.next_frame(&mut samples).map_err(text)?;
        samples.chunks_exact(frame.line_size).for_each(take);
    } else {
        while let Some(row) = reader.next_row().map_err(text)? {
            take(row.data());
        }
    }
    Ok(shrink.finish())
}

/// Samples of 16 bits as ones of 8.
fn rounded(samples: &[u8]) -> Vec<u8> {
    let rounded = |s: &[u8; 2]| ((u32::from(u16::from_be_bytes(*s)) + 128) / 257) as u8;
    samples.as_chunks().0.iter().map(rounded).collect()
}

fn from_jpeg(encoded: &[u8]) -> Result<Image, String> {
    let text = |e: zune_jpeg::errors::DecodeErrors| e.to_string().trim_end().to_owned();
    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(encoded), options);
    decoder.decode_headers().map_err(text)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    let (width, height) = (width as u32, height as u32);
    check_sides(width, height)?;
    let grey = decoder.input_colorspace() == Some(JpegSpace::Luma);
    let space = if grey { JpegSpace::Luma } else { JpegSpace::RGB };
    decoder.set_options(options.jpeg_set_out_colorspace(space));
    let mut samples = samples(decoder.output_buffer_size())?;
    decoder.decode_into(&mut samples).map_err(text)?;
    Ok(shrunk(width, height, space.num_components(), &samples))
}

#[cfg(feature = "textures")]
fn from_other(encoded: &[u8], name: &str) -> Result<Image, String> {
    use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

    let mut reader =
        ImageReader::new(Cursor::new(encoded)).with_guessed_format().map_err(|e| e.to_string())?;
    // TGA has no magic number: the name is all there is to go by.
    if reader.format().is_none()
        && let Ok(format) = ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    let text = |e: image::ImageError| e.to_string();
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_BYTES as u64);
    reader.limits(limits.clone());
    let mut decoder = reader.into_decoder().map_err(text)?;
    let (width, height) = decoder.dimensions();
    check_sides(width, height)?;
    // What the file holds, and a copy of it in 8 bits.
    let bytes = decoder.total_bytes().max(4 * u64::from(width) * u64::from(height));
    check_bytes(usize::try_from(bytes).ok())?;
    decoder.set_limits(limits).map_err(text)?;
    let image = DynamicImage::from_decoder(decoder).map_err(text)?.into_rgba8();
    Ok(shrunk(width, height, 4, image.as_raw()))
}

#[cfg(not(feature = "textures"))]
fn from_other(_: &[u8], _: &str) -> Result<Image, String> {
    Err("it is neither PNG nor JPEG; BMP, GIF, TGA, TIFF and WebP are read when built with \
         `--features textures`"
        .into())
}

fn check_sides(width: u32, height: u32) -> Result<(), String> {
    if width.max(height) > MAX_SIDE {
        return Err(format!("{width} x {height} pixels; a side has at most {MAX_SIDE}"));
    }
    if u64::from(width) * u64::from(height) > MAX_TEXELS {
        return Err(format!("{width} x {height} pixels are more than {MAX_TEXELS}"));
    }
    Ok(())
}

fn check_bytes(bytes: Option<usize>) -> Result<usize, String> {
    let fits = bytes.filter(|&bytes| bytes <= MAX_BYTES);
    fits.ok_or_else(|| format!("it takes more than {} MiB to decode", MAX_BYTES >> 20))
}

/// Room for samples of that many bytes.
fn samples(bytes: Option<usize>) -> Result<Vec<u8>, String> {
    Ok(vec![0; check_bytes(bytes)?])
}

/// What is kept of an image of that many samples a texel.
fn shrunk(width: u32, height: u32, channels: usize, samples: &[u8]) -> Image {
    let mut shrink = Shrink::new(width, height, channels);
    let rows = samples.chunks_exact((width as usize * channels).max(1));
    rows.take(height as usize).for_each(|row| shrink.take(row));
    shrink.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::prelude::{BASE64_STANDARD, Engine as _};
    use png::{BitDepth, ColorType};

    /// The texels of a PNG of one row of two pixels.
    fn texels_of(colour: ColorType, depth: BitDepth, row: &[u8]) -> Vec<[u8; 4]> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == ColorType::Indexed {
            encoder.set_palette(&[10, 20, 30, 40, 50, 60]);
            encoder.set_trns(&[7]);
        }
        encoder.write_header().unwrap().write_image_data(row).unwrap();
        decode(&file, "t").unwrap().texels
    }

    #[test]
    fn png_of_every_kind() {
        use {BitDepth::*, ColorType::*};
        assert_eq!(texels_of(Grayscale, One, &[0x40]), [[0, 0, 0, 255], [255; 4]]);
        assert_eq!(texels_of(GrayscaleAlpha, Eight, &[1, 2, 3, 4]), [[1, 1, 1, 2], [3, 3, 3, 4]]);
        assert_eq!(texels_of(Rgb, Eight, &[1, 2, 3, 4, 5, 6]), [[1, 2, 3, 255], [4, 5, 6, 255]]);
        assert_eq!(texels_of(Indexed, Four, &[0x01]), [[10, 20, 30, 7], [40, 50, 60, 255]]);
        // 16 bits are rounded: 255 * 384 / 65535 = 1.49, 255 * 386 / 65535 = 1.502.
        assert_eq!(
            texels_of(Grayscale, Sixteen, &[1, 128, 1, 130]),
            [[1, 1, 1, 255], [2, 2, 2, 255]]
        );
    }

    #[test]
    fn a_palette_that_is_no_list_of_colours_is_refused() {
        for colours in [3 * 2, 1, 3 * 2 - 1, 3 * 300] {
            let mut file = Vec::new();
            let mut encoder = png::Encoder::new(&mut file, 2, 1);
            encoder.set_color(ColorType::Indexed);
            encoder.set_palette(vec![9; colours]);
            encoder.write_header().unwrap().write_image_data(&[0, 1]).unwrap();
            let found = decode(&file, "t");
            assert_eq!(found.is_ok(), colours == 6, "{colours}");
        }
    }

    #[test]
    fn more_texels_than_are_read_are_refused_by_the_header() {
        let claims = |width: u32, height: u32| {
            let mut file = Vec::new();
            let encoder = png::Encoder::new(&mut file, width, height);
            drop(encoder.write_header().unwrap());
            decode(&file, "t").err().unwrap()
        };
        assert!(claims(32_768, 32_768).contains("32768 x 32768 pixels are more than"));
        assert!(claims(65_536, 1).contains("a side has at most"));
    }

    #[test]
    fn jpeg_of_every_kind() {
        // Of 2 x 1 pixels of one colour: grey, YCbCr, CMYK.
        let files = [
            (
                "/9j/2wBDAAMCAgMCAgMDAwMEAwMEBQgFBQQEBQoHBwYIDAoMDAsKCwsNDhIQDQ4RDgsLEBYQERMUFRUV\
                 DA8XGBYUGBIUFRT/wAALCAABAAIBAREA/8QAFAABAAAAAAAAAAAAAAAAAAAACP/EABQQAQAAAAAAAAAA\
                 AAAAAAAAAAD/2gAIAQEAAD8AYD//2Q==",
                [200, 200, 200, 255],
            ),
            (
                "/9j/2wBDAAMCAgMCAgMDAwMEAwMEBQgFBQQEBQoHBwYIDAoMDAsKCwsNDhIQDQ4RDgsLEBYQERMUFRUV\
                 DA8XGBYUGBIUFRT/2wBDAQMEBAUEBQkFBQkUDQsNFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQU\
                 FBQUFBQUFBQUFBQUFBQUFBQUFBT/wAARCAABAAIDAREAAhEBAxEB/8QAFAABAAAAAAAAAAAAAAAAAAAA\
                 BP/EABQQAQAAAAAAAAAAAAAAAAAAAAD/xAAVAQEBAAAAAAAAAAAAAAAAAAAHCP/EABQRAQAAAAAAAAAA\
                 AAAAAAAAAAD/2gAMAwEAAhEDEQA/ACA9SD//2Q==",
                [200, 100, 50, 255],
            ),
            (
                "/9j/7gAOQWRvYmUAZAAAAAAA/9sAQwADAgIDAgIDAwMDBAMDBAUIBQUEBAUKBwcGCAwKDAwLCgsLDQ4S\
                 EA0OEQ4LCxAWEBETFBUVFQwPFxgWFBgSFBUU/8AAFAgAAQACBEMRAE0RAFkRAEsRAP/EABYAAQEBAAAA\
                 AAAAAAAAAAAAAAkFCP/EABQQAQAAAAAAAAAAAAAAAAAAAAD/2gAOBEMATQBZAEsAAD8AR1TY8IG//9k=",
                [207, 119, 49, 255],
            ),
        ];
        for (file, expected) in files {
            let image = decode(&BASE64_STANDARD.decode(file).unwrap(), "t").unwrap();
            assert_eq!((image.width, image.height), (2, 1));
            for (c, e) in image.texels.as_flattened().iter().zip(expected.iter().cycle()) {
                assert!(c.abs_diff(*e) <= 2, "{:?} is not {expected:?}", image.texels);
            }
        }
    }

    #[test]
    fn other_formats_are_read_or_named() {
        // A bitmap of one red pixel.
        let mut bmp =
            b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\x18\0".to_vec();
        bmp.resize(54, 0);
        bmp.extend([0, 0, 255, 0]);
        let image = decode(&bmp, "t.bmp");
        if cfg!(feature = "textures") {
            assert_eq!(image.unwrap().texels, [[255, 0, 0, 255]]);
        } else {
            assert!(image.err().unwrap().contains("--features textures"));
        }
    }
}
