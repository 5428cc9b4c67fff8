//! The plan of a work plane: its illuminance in colours, as a picture or as a drawing.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use hemicube::export::{ExportError, PictureFormat, write_whole};
use hemicube::gather::{Estimate, Place};
use hemicube::scene::luminance;
use hemicube::tone::{FalseColour, Map, srgb};
use hemicube::units::significant;

/// Pixels of a plan, or units of a drawing, along its longer side.
const LONG: f64 = 800.0;

/// Cells of a drawing that have their numbers in them, at most.
const NUMBERED: usize = 600;

/// A work plane of cells: its edges, m, and how many cells there are along each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    pub u: DVec3,
    pub v: DVec3,
    pub cells: [usize; 2],
}

/// Whether plans are written under that name.
pub fn is_plan(path: &Path) -> bool {
    is_drawing(path) || PictureFormat::of(path).is_some_and(|f| !f.is_of_radiance())
}

fn is_drawing(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"))
}

impl Plane {
    /// Writes what was found at the cells, along V first: u to the right, v upwards.
    pub fn write(
        &self,
        path: &Path,
        found: &[Estimate],
        colours: &FalseColour,
    ) -> Result<(), ExportError> {
        let value = |e: &Estimate| match e.place {
            Place::Free => luminance(e.irradiance) as f32,
            _ => f32::NAN,
        };
        let values: Vec<f32> = found.iter().map(value).collect();
        if is_drawing(path) {
            return write_whole(path, self.drawing(&values, colours).as_bytes());
        }
        colours.picture(&self.map(&values)).save(path)
    }

    /// Pixels, or units, across and down.
    fn size(&self) -> [f64; 2] {
        let (u, v) = (self.u.length(), self.v.length());
        let scale = LONG / u.max(v);
        [u, v].map(|l| (l * scale).round().max(1.0))
    }

    /// Illuminance between the middles of cells.
    fn map(&self, values: &[f32]) -> Map {
        let [nu, nv] = self.cells;
        let [width, height] = self.size().map(|n| n as usize);
        let at = |i: usize, j: usize| values[i.min(nu - 1) * nv + j.min(nv - 1)];
        let between = |x: f64, n: usize| {
            let x = (x * n as f64 - 0.5).clamp(0.0, n as f64 - 1.0);
            (x as usize, (x - x.floor()) as f32)
        };
        let pixel = |x: usize, y: usize| {
            let (i, s) = between((x as f64 + 0.5) / width as f64, nu);
            let (j, t) = between(1.0 - (y as f64 + 0.5) / height as f64, nv);
            let row = |j: usize| at(i, j) * (1.0 - s) + at(i + 1, j) * s;
            let smooth = row(j) * (1.0 - t) + row(j + 1) * t;
            // Beside what is covered the cell alone counts.
            let nearest = at(i + usize::from(s > 0.5), j + usize::from(t > 0.5));
            if smooth.is_finite() { smooth } else { nearest }
        };
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Map { width, height, values: rows.map(|(x, y)| pixel(x, y)).collect() }
    }

    /// The cells, each with its number, and a legend.
    fn drawing(&self, values: &[f32], colours: &FalseColour) -> String {
        let [nu, nv] = self.cells;
        let [width, height] = self.size();
        let map = Map { width: nu, height: nv, values: values.to_vec() };
        let range = colours.range_of(&map);
        let paint = |value: f64| {
            let [r, g, b] = FalseColour::colour(range, value).map(srgb);
            format!("#{r:02x}{g:02x}{b:02x}")
        };
        let (w, h) = (width / nu as f64, height / nv as f64);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {height:.0}\" \
             font-family=\"sans-serif\" text-anchor=\"middle\">\n",
            width + 120.0
        );
        // Writing into a text does not fail.
        for i in 0..nu {
            for j in 0..nv {
                let value = f64::from(values[i * nv + j]);
                let (x, y) = (i as f64 * w, height - (j + 1) as f64 * h);
                let _ = writeln!(
                    text,
                    "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" \
                     fill=\"{}\"/>",
                    paint(value)
                );
                if nu * nv <= NUMBERED && value.is_finite() {
                    let dark = value < (range[0] + range[1]) / 2.0;
                    let _ = writeln!(
                        text,
                        "<text x=\"{:.2}\" y=\"{:.2}\" font-size=\"{:.1}\" fill=\"{}\">{}</text>",
                        x + 0.5 * w,
                        y + 0.55 * h,
                        0.28 * w.min(h),
                        if dark { "#fff" } else { "#000" },
                        significant(value)
                    );
                }
            }
        }
        let levels = FalseColour::levels(range);
        let step = height / levels.len().max(1) as f64;
        for (k, level) in levels.iter().enumerate() {
            let y = height - (k + 1) as f64 * step;
            let _ = writeln!(
                text,
                "<rect x=\"{:.0}\" y=\"{y:.2}\" width=\"30\" height=\"{step:.2}\" fill=\"{}\"/>\n\
                 <text x=\"{:.0}\" y=\"{:.2}\" font-size=\"14\" text-anchor=\"start\">{} {}</text>",
                width + 16.0,
                paint(*level),
                width + 52.0,
                y + 0.5 * step + 5.0,
                significant(*level),
                colours.unit
            );
        }
        text.push_str("</svg>\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> Plane {
        Plane { u: DVec3::X * 4.0, v: DVec3::Y * 2.0, cells: [4, 2] }
    }

    #[test]
    fn plans_have_u_to_the_right_and_v_upwards() {
        // 10 more along u, 1 more along v.
        let values: Vec<f32> =
            (0..4).flat_map(|i| (0..2).map(move |j| (10 * i + j) as f32)).collect();
        let map = plane().map(&values);
        assert_eq!((map.width, map.height), (800, 400));
        let at = |x: usize, y: usize| map.values[y * 800 + x];
        assert!((at(0, 399) - 0.0).abs() < 1e-5 && (at(799, 0) - 31.0).abs() < 1e-5);
        assert!(at(400, 200) > at(300, 200) && at(400, 100) > at(400, 300));
    }

    #[test]
    fn drawings_have_each_cell_once_and_no_number_where_there_is_none() {
        let mut values = vec![5.0; 8];
        values[3] = f32::NAN;
        let text = plane().drawing(&values, &FalseColour::default());
        assert_eq!(
            text.matches("fill=\"#fff\"").count() + text.matches("fill=\"#000\"").count(),
            7
        );
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n") && !text.contains("NaN"));
    }
}
