//! Short texts in pictures, in letters of 8 x 8 points.

use font8x8::UnicodeFonts;

use crate::render::Picture;

/// Points of a letter across and down.
const LETTER: usize = 8;

/// Width of a text in pixels, its letters `scale` times as large.
pub(super) fn width(text: &str, scale: usize) -> usize {
    text.chars().count() * LETTER * scale
}

/// Height of letters in pixels.
pub(super) fn height(scale: usize) -> usize {
    LETTER * scale
}

/// Writes a text with its upper left corner there, what is outside of the picture left out.
pub(super) fn write(
    picture: &mut Picture,
    text: &str,
    [left, top]: [i64; 2],
    scale: usize,
    colour: [f32; 3],
) {
    for (number, letter) in text.chars().enumerate() {
        let rows = glyph(letter);
        for (y, row) in rows.iter().enumerate() {
            for x in (0..LETTER).filter(|x| row >> x & 1 == 1) {
                for (i, j) in (0..scale).flat_map(|j| (0..scale).map(move |i| (i, j))) {
                    let px = left + ((number * LETTER + x) * scale + i) as i64;
                    let py = top + (y * scale + j) as i64;
                    put(picture, [px, py], colour);
                }
            }
        }
    }
}

/// Paints a pixel if there is one.
pub(super) fn put(picture: &mut Picture, [x, y]: [i64; 2], colour: [f32; 3]) {
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
    if x < picture.width && y < picture.height {
        picture.pixels[y * picture.width + x] = colour;
    }
}

fn glyph(letter: char) -> [u8; LETTER] {
    let latin = || font8x8::LATIN_FONTS.get(letter);
    font8x8::BASIC_FONTS.get(letter).or_else(latin).unwrap_or_default()
}
