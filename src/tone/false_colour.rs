//! False colour: a map of illuminance with a legend, and lines of equal illuminance with numbers.
//!
//! The colours are those of viridis (Smith & van der Walt 2015), which is uniform in what people
//! perceive, and rises in lightness: a print in grey still tells more from less.

use std::collections::HashSet;

use super::glyphs;
use crate::render::Picture;
use crate::scene::Rgb;
use crate::scene::texture::linear_from_srgb;
use crate::units::significant;

/// How a map of illuminance is coloured.
#[derive(Debug, Clone, PartialEq)]
pub struct FalseColour {
    /// The illuminances of the darkest and the brightest colour; `None`: from 0 to beyond all but
    /// the brightest 1 % of what is seen.
    pub range: Option<[f64; 2]>,
    /// The unit that numbers have: `lx` or `W/m²`.
    pub unit: String,
}

impl Default for FalseColour {
    fn default() -> Self {
        Self { range: None, unit: "lx".into() }
    }
}

/// Illuminance of each pixel, row by row; NaN where there is none to show.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// lx or W/m².
    pub values: Vec<f32>,
}

/// Viridis at equal steps, sRGB.
const VIRIDIS: [[u8; 3]; 17] = [
    [68, 1, 84],
    [72, 24, 106],
    [71, 45, 123],
    [66, 64, 134],
    [59, 82, 139],
    [51, 99, 141],
    [44, 114, 142],
    [38, 130, 142],
    [33, 145, 140],
    [31, 160, 136],
    [40, 174, 128],
    [63, 188, 115],
    [94, 201, 98],
    [132, 212, 75],
    [173, 220, 48],
    [216, 226, 25],
    [253, 231, 37],
];

/// Where there is nothing to measure.
const NOTHING: [f32; 3] = [0.03; 3];
const INK: [f32; 3] = [1.0; 3];
const PAPER: [f32; 3] = [0.0; 3];

/// Least pixels of a line of equal illuminance that has a number, and between numbers.
const LONG: usize = 60;
const APART: f64 = 45.0;

impl FalseColour {
    /// The range that a map is shown in.
    #[must_use]
    pub fn range_of(&self, map: &Map) -> [f64; 2] {
        if let Some(range) = self.range {
            return range;
        }
        let mut all: Vec<f32> = map.values.iter().copied().filter(|v| v.is_finite()).collect();
        if all.is_empty() {
            return [0.0, 1.0];
        }
        all.sort_unstable_by(f32::total_cmp);
        let most = f64::from(all[(all.len() - 1) * 99 / 100]);
        // Up to the next round number.
        let step = step(most.max(f64::MIN_POSITIVE));
        [0.0, (most / step).ceil().max(1.0) * step]
    }

    /// The illuminances that lines are drawn for and that the legend names: round numbers.
    #[must_use]
    pub fn levels([low, high]: [f64; 2]) -> Vec<f64> {
        let step = step(high - low);
        let first = (low / step).ceil() as i64;
        (first..).map(|i| i as f64 * step).take_while(|l| *l <= high + 1e-9 * step).collect()
    }

    /// The colour of an illuminance, as linear light.
    #[must_use]
    pub fn colour([low, high]: [f64; 2], value: f64) -> [f32; 3] {
        if !value.is_finite() {
            return NOTHING;
        }
        let t = ((value - low) / (high - low)).clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
        let k = (t as usize).min(VIRIDIS.len() - 2);
        let f = t - k as f64;
        let of = |k: usize| Rgb::from(VIRIDIS[k].map(f64::from)) / 255.0;
        linear_from_srgb(of(k).lerp(of(k + 1), f)).as_vec3().to_array()
    }

    /// The map with its lines, their numbers and a legend beside it, as linear light.
    #[must_use]
    pub fn picture(&self, map: &Map) -> Picture {
        let range = self.range_of(map);
        let levels = Self::levels(range);
        let scale = (map.height / 400).clamp(1, 4);
        let legend = 14 * glyphs::width("0", scale);
        let (width, height) = (map.width + legend, map.height);
        let mut picture = Picture { width, height, pixels: vec![PAPER; width * height] };
        for y in 0..height {
            for x in 0..map.width {
                let value = f64::from(map.values[y * map.width + x]);
                picture.pixels[y * width + x] = Self::colour(range, value);
            }
        }
        let mut numbers = Vec::new();
        for &level in levels.iter().filter(|l| **l > range[0]) {
            for line in lines_of(map, level) {
                for &(x, y) in &line {
                    for i in 0..scale as i64 {
                        glyphs::put(&mut picture, [x as i64 + i, y as i64], INK);
                    }
                }
                numbers.push((line, significant(level)));
            }
        }
        // Long lines have the first choice of a place.
        numbers.sort_by_key(|(line, _)| std::cmp::Reverse(line.len()));
        write_numbers(&mut picture, &numbers, scale, map.width);
        self.legend(&mut picture, (range, &levels), map.width, scale);
        picture
    }

    fn legend(
        &self,
        picture: &mut Picture,
        (range, levels): ([f64; 2], &[f64]),
        left: usize,
        scale: usize,
    ) {
        let letter = glyphs::height(scale) as i64;
        let left = left as i64;
        let (top, bottom) = (3 * letter, picture.height as i64 - 2 * letter);
        glyphs::write(picture, &self.unit, [left + letter, letter], scale, INK);
        let tall = (bottom - top).max(1) as f64;
        for y in top..bottom {
            let t = 1.0 - (y - top) as f64 / tall;
            let colour = Self::colour(range, range[0] + t * (range[1] - range[0]));
            (letter..3 * letter).for_each(|x| glyphs::put(picture, [left + x, y], colour));
        }
        for level in levels {
            let y = bottom - ((level - range[0]) / (range[1] - range[0]) * tall) as i64;
            (3 * letter..7 * letter / 2).for_each(|x| glyphs::put(picture, [left + x, y], INK));
            let at = [left + 4 * letter, y - letter / 2];
            glyphs::write(picture, &significant(*level), at, scale, INK);
        }
    }
}

/// A round number, of which about eight make up a span.
fn step(span: f64) -> f64 {
    let rough = span / 8.0;
    let ten = 10.0_f64.powf(rough.log10().floor());
    let times = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|t| t * ten >= rough);
    times.unwrap_or(10.0) * ten
}

/// The pixels at which illuminance passes a level, and not in a leap as between two surfaces.
fn line_of(map: &Map, level: f64) -> Vec<(usize, usize)> {
    /// Ratio of illuminances that are of one surface.
    const LEAP: f32 = 1.35;
    let at = |x: usize, y: usize| map.values[y * map.width + x];
    let level = level as f32;
    let passes = |a: f32, b: f32| {
        (a < level) != (b < level) && a.max(b) < LEAP * a.min(b) && a.is_finite() && b.is_finite()
    };
    let mut line = Vec::new();
    for y in 0..map.height.saturating_sub(1) {
        for x in 0..map.width.saturating_sub(1) {
            if passes(at(x, y), at(x + 1, y)) || passes(at(x, y), at(x, y + 1)) {
                line.push((x, y));
            }
        }
    }
    line
}

/// The lines of a level, each of pixels that touch; what is as short as a step of stairs is none.
fn lines_of(map: &Map, level: f64) -> Vec<Vec<(usize, usize)>> {
    /// Least pixels of a line.
    const LEAST: usize = 24;
    let mut left: HashSet<(usize, usize)> = line_of(map, level).into_iter().collect();
    let mut starts: Vec<(usize, usize)> = left.iter().copied().collect();
    starts.sort_unstable();
    let mut lines = Vec::new();
    for start in starts {
        if !left.remove(&start) {
            continue;
        }
        let mut line = vec![start];
        let mut next = 0;
        while let Some(&(x, y)) = line.get(next) {
            next += 1;
            for v in y.saturating_sub(1)..=y + 1 {
                for u in x.saturating_sub(1)..=x + 1 {
                    line.extend(left.remove(&(u, v)).then_some((u, v)));
                }
            }
        }
        lines.extend((line.len() >= LEAST).then_some(line));
    }
    lines
}

/// Writes the numbers of lines on them, away from each other.
fn write_numbers(
    picture: &mut Picture,
    lines: &[(Vec<(usize, usize)>, String)],
    scale: usize,
    width: usize,
) {
    let apart = APART * scale as f64;
    let mut placed: Vec<(usize, usize)> = Vec::new();
    for (line, text) in lines.iter().filter(|l| l.0.len() >= LONG) {
        let (w, h) = (glyphs::width(text, scale) as i64, glyphs::height(scale) as i64);
        let fits = |&&(x, y): &&(usize, usize)| {
            let [left, top] = [x as i64 - w / 2, y as i64 - h / 2];
            let far =
                |p: &(usize, usize)| (p.0 as f64 - x as f64).hypot(p.1 as f64 - y as f64) > apart;
            left > 0
                && top > 0
                && left + w < width as i64
                && top + h < picture.height as i64
                && placed.iter().all(far)
        };
        let Some(&(x, y)) = line.iter().skip(line.len() / 3).chain(line).find(fits) else {
            continue;
        };
        placed.push((x, y));
        let [left, top] = [x as i64 - w / 2, y as i64 - h / 2];
        for v in -1..=h {
            for u in -1..=w {
                glyphs::put(picture, [left + u, top + v], PAPER);
            }
        }
        glyphs::write(picture, text, [left, top], scale, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Illuminance that rises from left to right.
    fn ramp() -> Map {
        let values = (0..200).flat_map(|_| (0..400).map(|x| x as f32)).collect();
        Map { width: 400, height: 200, values }
    }

    #[test]
    fn levels_are_round_and_within_the_range() {
        assert_eq!(
            FalseColour::levels([0.0, 400.0]),
            (0..9).map(|i| 50.0 * f64::from(i)).collect::<Vec<_>>()
        );
        let levels = FalseColour::levels([3.0, 17.3]);
        assert!(levels.len() >= 5 && levels.iter().all(|l| (3.0..=17.3).contains(l)), "{levels:?}");
        assert_eq!(FalseColour::default().range_of(&ramp()), [0.0, 400.0]);
    }

    #[test]
    fn lines_stand_where_the_level_is() {
        let line = line_of(&ramp(), 250.0);
        assert_eq!(line.len(), 199);
        assert!(line.iter().all(|(x, _)| *x == 249));
        let mut leap = ramp();
        leap.values.iter_mut().filter(|v| **v >= 200.0).for_each(|v| *v *= 3.0);
        assert!(line_of(&leap, 250.0).is_empty(), "two surfaces");
    }

    #[test]
    fn colours_rise_in_lightness_and_nothing_is_dark() {
        let colour = |v: f64| FalseColour::colour([0.0, 1.0], v);
        let light = |v: f64| {
            let [r, g, b] = colour(v);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..50 {
            assert!(light(f64::from(i) / 50.0) < light(f64::from(i + 1) / 50.0), "{i}");
        }
        assert_eq!(colour(f64::NAN), NOTHING);
        let picture = FalseColour::default().picture(&ramp());
        assert!(picture.width > 400 && picture.pixels.len() == picture.width * picture.height);
        assert!(picture.pixels.contains(&INK));
    }
}
