//! An image taken row by row, of which no more texels are kept than light can use.

use super::srgb::{LINEAR_FROM_SRGB, srgb_from_linear};

/// Most texels that are kept: 4096 x 4096. Larger images become means of boxes, in linear light.
const MOST_TEXELS: u64 = 1 << 24;

/// A decoded image.
pub struct Image {
    pub width: u32,
    pub height: u32,
    /// sRGB and straight alpha, row by row from the top.
    pub texels: Vec<[u8; 4]>,
}

/// Takes the rows of an image, from the top.
pub struct Shrink {
    /// Width and height of the file.
    from: [u32; 2],
    channels: usize,
    /// Rows so far.
    taken: u32,
    kept: Image,
    /// Of the row of boxes that is open: sums of linear red, green and blue and of alpha, and how
    /// many texels they are of.
    sums: Vec<([f64; 4], u32)>,
}

impl Shrink {
    /// For an image of 8-bit samples: grey, grey and alpha, RGB, or RGB and alpha.
    pub fn new(width: u32, height: u32, channels: usize) -> Self {
        let factor = (1..)
            .find(|&f| u64::from(width.div_ceil(f)) * u64::from(height.div_ceil(f)) <= MOST_TEXELS);
        let factor = factor.unwrap_or(1);
        let kept = Image {
            width: width.div_ceil(factor),
            height: height.div_ceil(factor),
            texels: Vec::new(),
        };
        let boxes = if factor == 1 { 0 } else { kept.width as usize };
        let sums = vec![([0.0; 4], 0); boxes];
        Self { from: [width, height], channels, taken: 0, kept, sums }
    }

    /// Takes the next row.
    pub fn take(&mut self, samples: &[u8]) {
        let texels = samples.chunks_exact(self.channels).map(texel);
        if self.sums.is_empty() {
            self.kept.texels.extend(texels);
        } else {
            // Boxes are spread evenly, so that coordinates still mean the same places.
            let (width, boxes) = (u64::from(self.from[0]), u64::from(self.kept.width));
            for (x, texel) in (0_u64..).zip(texels) {
                let (sum, count) = &mut self.sums[(x * boxes / width) as usize];
                for (s, c) in sum.iter_mut().zip(texel).take(3) {
                    *s += LINEAR_FROM_SRGB[usize::from(c)];
                }
                sum[3] += f64::from(texel[3]);
                *count += 1;
            }
        }
        self.taken += 1;
        let row = |y: u32| u64::from(y) * u64::from(self.kept.height) / u64::from(self.from[1]);
        if row(self.taken) > row(self.taken - 1) {
            self.close_row();
        }
    }

    fn close_row(&mut self) {
        for (sum, count) in &mut self.sums {
            let [r, g, b, alpha] = sum.map(|s| s / f64::from((*count).max(1)));
            let [r, g, b] = [r, g, b].map(srgb_from_linear);
            self.kept.texels.push([r, g, b, alpha.round() as u8]);
            (*sum, *count) = ([0.0; 4], 0);
        }
    }

    /// The image that was kept.
    pub fn finish(self) -> Image {
        self.kept
    }
}

fn texel(samples: &[u8]) -> [u8; 4] {
    match *samples {
        [grey] => [grey, grey, grey, u8::MAX],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, u8::MAX],
        [r, g, b, alpha, ..] => [r, g, b, alpha],
        [] => [0; 4],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_become_means_in_linear_light() {
        // Columns of black and white in the left half, grey in the right one.
        let (width, height) = (8192, 4096);
        let mut shrink = Shrink::new(width, height, 1);
        let row: Vec<u8> =
            (0..width).map(|x| if x >= width / 2 { 100 } else { 255 * (x % 2) as u8 }).collect();
        (0..height).for_each(|_| shrink.take(&row));
        let image = shrink.finish();
        assert_eq!((image.width, image.height), (4096, 2048));
        assert_eq!(image.texels.len(), 4096 * 2048);
        // Half of white is 188 in sRGB.
        assert_eq!(image.texels[4096 * 7], [188, 188, 188, 255]);
        assert_eq!(image.texels[4096 * 9 - 1], [100, 100, 100, 255]);
    }

    #[test]
    fn boxes_that_do_not_divide_the_image_cover_all_of_it() {
        let mut shrink = Shrink::new(5001, 5003, 2);
        (0..5003).for_each(|_| shrink.take(&[7, 9].repeat(5001)));
        let image = shrink.finish();
        assert_eq!((image.width, image.height), (2501, 2502));
        assert_eq!(image.texels.len(), 2501 * 2502);
        assert!(image.texels.iter().all(|t| *t == [7, 7, 7, 9]));
    }

    #[test]
    fn small_images_stay_as_they_are() {
        let mut shrink = Shrink::new(2, 1, 4);
        shrink.take(&[1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(shrink.finish().texels, [[1, 2, 3, 4], [5, 6, 7, 8]]);
    }
}
