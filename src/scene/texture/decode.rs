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
