//! Alpha alone, at full size or averaged.

use super::wrap::Wrap;

/// Alpha of each texel, 0..1, or means of several.
#[derive(Debug, Clone)]
pub struct Alphas {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Wrapping along x and y.
    pub wrap: [Wrap; 2],
    /// Row by row from the top.
    pub values: Vec<f32>,
}

impl Alphas {
    /// Alpha of a texel.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Number of neighbours of which one reaches `cutoff` and the other does not.
    pub fn edges(&self, cutoff: f32) -> usize {
        let parted = |a: &f32, b: &f32| (*a >= cutoff) != (*b >= cutoff);
        let rows = self.values.chunks_exact(self.width);
        let across = |row: &[f32]| row.windows(2).filter(|w| parted(&w[0], &w[1])).count();
        let below = self.values.iter().zip(self.values.iter().skip(self.width));
        rows.map(across).sum::<usize>() + below.filter(|(a, b)| parted(a, b)).count()
    }

    /// Share of the texels that reach `cutoff`, 0..1.
    pub fn share(&self, cutoff: f32) -> f64 {
        let reach = self.values.iter().filter(|&&a| a >= cutoff).count();
        reach as f64 / self.values.len() as f64
    }

    /// The cutoff that about this share of the texels reaches: coarse masks let through as much
    /// light as fine ones (I. Castaño 2010, "Computing Alpha Mipmaps").
    pub fn cutoff_of(&self, share: f64) -> f32 {
        let mut values = self.values.clone();
        let rank = ((1.0 - share) * values.len() as f64).round() as usize;
        let rank = rank.min(values.len() - 1);
        *values.select_nth_unstable_by(rank, f32::total_cmp).1
    }

    /// Means of two by two texels, fewer at the right and the lower end.
    pub fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mean = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            0.25 * (self.at(x, y) + self.at(right, y) + self.at(x, below) + self.at(right, below))
        };
        Self { width, height, wrap: self.wrap, values: (0..width * height).map(mean).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_alphas_keep_the_share_that_is_opaque() {
        let value = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let mut alphas = Alphas {
            width: 65,
            height: 33,
            wrap: [Wrap::Repeat; 2],
            values: (0..65 * 33).map(value).collect(),
        };
        let share = alphas.share(0.8);
        for size in [(33, 17), (17, 9), (9, 5)] {
            alphas = alphas.coarser();
            assert_eq!((alphas.width, alphas.height), size);
            let one = 1.0 / alphas.values.len() as f64;
            assert!((alphas.share(alphas.cutoff_of(share)) - share).abs() <= one);
        }
    }
}
