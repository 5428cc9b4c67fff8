//! How well the light in a picture is known, pixel by pixel.

use super::picture::Picture;

/// Half-widths of 95 % intervals of the luminance of each pixel, as shares of it; rows from top to
/// bottom.
///
/// They are estimates: what rays scatter, what shadow rays may have missed of half-shadows, and
/// what the solution does not know. What no ray found is in none of them.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelErrors {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// 0 where nothing is reflected.
    pub relative: Vec<f32>,
    /// Of that, what more rays in the picture cannot mend, as the solution does not know it.
    pub of_solution: Vec<f32>,
}

impl PixelErrors {
    /// The error that this share (0..1) of the pixels stays below, and the same of what is the
    /// solution's.
    #[must_use]
    pub fn below(&self, share: f64) -> [f64; 2] {
        [&self.relative, &self.of_solution].map(|errors| {
            let mut lit: Vec<f32> =
                self.relative.iter().zip(errors).filter(|p| *p.0 > 0.0).map(|p| *p.1).collect();
            if lit.is_empty() {
                return 0.0;
            }
            let at = ((lit.len() - 1) as f64 * share.clamp(0.0, 1.0)) as usize;
            f64::from(*lit.select_nth_unstable_by(at, f32::total_cmp).1)
        })
    }

    /// As linear display light: from black (known exactly) by way of red and yellow to white
    /// (`full` or more, a share).
    #[must_use]
    pub fn picture(&self, full: f64) -> Picture {
        let colour = |e: &f32| {
            let t = 3.0 * (f64::from(*e) / full).clamp(0.0, 1.0);
            [t, t - 1.0, t - 2.0].map(|c| c.clamp(0.0, 1.0) as f32)
        };
        let pixels = self.relative.iter().map(colour).collect();
        Picture { width: self.width, height: self.height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_most_pixels_leaves_dark_ones_out() {
        let relative = vec![0.0, 0.01, 0.02, 0.03, 0.04, 0.05];
        let of_solution = relative.iter().map(|e| 0.5 * e).collect();
        let errors = PixelErrors { width: 3, height: 2, relative, of_solution };
        let [all, of_solution] = errors.below(0.75);
        assert!((all - 0.04).abs() < 1e-6 && (of_solution - 0.02).abs() < 1e-6);
        let dark = PixelErrors { relative: vec![0.0; 6], ..errors };
        assert_eq!(dark.below(0.8), [0.0; 2]);
    }

    #[test]
    fn a_map_goes_from_black_to_white() {
        let relative = vec![0.0, 0.05, 0.1, 0.2];
        let errors = PixelErrors { width: 4, height: 1, of_solution: relative.clone(), relative };
        let pixels = errors.picture(0.1).pixels;
        assert_eq!(pixels[0], [0.0; 3]);
        assert_eq!(pixels[1], [1.0, 0.5, 0.0]);
        assert_eq!([pixels[2], pixels[3]], [[1.0; 3]; 2]);
    }
}
