//! Decodes image files: PNG and JPEG, and with the feature `textures` those that the crate `image`
//! reads. Colour profiles are ignored, as glTF asks: texels are sRGB.

use std::io::Cursor;

use zune_jpeg::zune_core::{
    bytestream::ZCursor, colorspace::ColorSpace as JpegSpace, options::DecoderOptions,
};

/// Longest side of an image in texels, and most bytes that decoding may take: a file of a few
/// kilobytes can claim to hold gigabytes.
const MAX_SIDE: u32 = 32_768;
const MAX_BYTES: usize = 1 << 30;

/// A decoded image.
pub(super) struct Image {
    pub width: u32,
    pub height: u32,
    /// sRGB and straight alpha, row by row from the top.
    pub texels: Vec<[u8; 4]>,
}

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
    let mut samples = samples(reader.output_buffer_size())?;
    reader.next_frame(&mut samples).map_err(text)?;
    let (colour, depth) = reader.output_color_type();
    if depth == png::BitDepth::Sixteen {
        let rounded = |s: &[u8; 2]| ((u32::from(u16::from_be_bytes(*s)) + 128) / 257) as u8;
        samples = samples.as_chunks().0.iter().map(rounded).collect();
    }
    Ok(Image { width, height, texels: texels(&samples, colour.samples()) })
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
    Ok(Image { width, height, texels: texels(&samples, space.num_components()) })
}

#[cfg(feature = "textures")]
fn from_other(encoded: &[u8], name: &str) -> Result<Image, String> {
    use image::{ImageFormat, ImageReader, Limits};

    let mut reader =
        ImageReader::new(Cursor::new(encoded)).with_guessed_format().map_err(|e| e.to_string())?;
    // TGA has no magic number: the name is all there is to go by.
    if reader.format().is_none()
        && let Ok(format) = ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES as u64);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    let (width, height) = image.dimensions();
    Ok(Image { width, height, texels: image.as_raw().as_chunks().0.to_vec() })
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
    if size_of::<[u8; 4]>() as u64 * u64::from(width) * u64::from(height) > MAX_BYTES as u64 {
        return Err(format!("{width} x {height} pixels take more than {MAX_BYTES} bytes"));
    }
    Ok(())
}

/// Room for samples of that many bytes.
fn samples(bytes: Option<usize>) -> Result<Vec<u8>, String> {
    match bytes {
        Some(bytes) if bytes <= MAX_BYTES => Ok(vec![0; bytes]),
        _ => Err(format!("it takes more than {MAX_BYTES} bytes to decode")),
    }
}

/// Texels of 8-bit samples: grey, grey and alpha, RGB, or RGB and alpha.
fn texels(samples: &[u8], channels: usize) -> Vec<[u8; 4]> {
    let texel = |s: &[u8]| match *s {
        [grey] => [grey, grey, grey, u8::MAX],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, u8::MAX],
        [r, g, b, alpha, ..] => [r, g, b, alpha],
        [] => [0; 4],
    };
    samples.chunks_exact(channels).map(texel).collect()
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
