//! Several pictures on one sheet, with their names.

use super::glyphs;
use crate::render::Picture;

/// Pixels between pictures.
const GAP: usize = 8;

/// Places pictures in rows of equal cells on a dark sheet, each with its name below.
#[must_use]
pub fn contact_sheet(pictures: &[(String, Picture)]) -> Picture {
    let widest = pictures.iter().map(|p| p.1.width).max().unwrap_or(1);
    let tallest = pictures.iter().map(|p| p.1.height).max().unwrap_or(1);
    let scale = (tallest / 400).clamp(1, 4);
    let (across, name) = (columns(pictures.len()), glyphs::height(scale) + GAP);
    let down = pictures.len().div_ceil(across);
    let (cell_w, cell_h) = (widest + GAP, tallest + name + GAP);
    let (width, height) = (across * cell_w + GAP, down * cell_h + GAP);
    let mut sheet = Picture { width, height, pixels: vec![[0.01; 3]; width * height] };
    for (i, (text, picture)) in pictures.iter().enumerate() {
        let left = GAP + i % across * cell_w;
        let top = GAP + i / across * cell_h;
        for (y, row) in picture.pixels.chunks_exact(picture.width).enumerate() {
            let start = (top + y) * width + left;
            sheet.pixels[start..start + picture.width].copy_from_slice(row);
        }
        let most = widest / glyphs::width("0", scale);
        let text: String = text.chars().take(most).collect();
        let at = [left as i64, (top + picture.height + GAP / 2) as i64];
        glyphs::write(&mut sheet, &text, at, scale, [0.8; 3]);
    }
    sheet
}

/// Pictures in a row.
fn columns(count: usize) -> usize {
    ((count as f64).sqrt().ceil() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_picture_has_its_place() {
        let picture = |v: f32| Picture { width: 40, height: 30, pixels: vec![[v; 3]; 1200] };
        let all: Vec<(String, Picture)> =
            (1..=5).map(|i| (i.to_string(), picture(i as f32))).collect();
        let sheet = contact_sheet(&all);
        for i in 1..=5 {
            let count = sheet.pixels.iter().filter(|p| p[0] == i as f32).count();
            assert_eq!(count, 1200, "picture {i}");
        }
    }
}
