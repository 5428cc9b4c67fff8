//! The part of a texture that a triangle covers, in texels.
//!
//! Heckbert 1986, "Survey of Texture Mapping": the box-filtered average over the footprint, here
//! with exact coverage instead of a prefiltered approximation, as it is computed once a triangle.

use glam::DVec2;

use super::clip::clip;

/// How large a footprint is, in texels.
pub struct Size {
    /// Area.
    pub area: f64,
    /// Longest edge.
    pub longest: f64,
    /// What it costs to cover it, as many times what a texel within it does.
    pub texels: f64,
}

/// A texel that an edge passes through is cut, which takes so many times as long as one within.
const CUT: f64 = 16.0;

/// The size of a triangle in texel space.
pub fn size([a, b, c]: [DVec2; 3]) -> Size {
    let area = 0.5 * (b - a).perp_dot(c - a).abs();
    let edges = [(b - a).length(), (c - b).length(), (a - c).length()];
    let longest = edges.into_iter().fold(0.0, f64::max);
    Size { area, longest, texels: area + CUT * edges.iter().sum::<f64>() }
}

/// Evenly spread points of a triangle: the R2 sequence (Roberts 2018, "The Unreasonable
/// Effectiveness of Quasirandom Sequences"), folded.
pub fn spread([a, b, c]: [DVec2; 3], count: usize) -> impl Iterator<Item = DVec2> {
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (0..count.max(1)).map(move |i| {
        let p = (0.5 + STEP * i as f64).fract();
        let p = if p.x + p.y > 1.0 { 1.0 - p } else { p };
        a + (b - a) * p.x + (c - a) * p.y
    })
}

/// Calls `visit(x, y, area)` for every texel that the triangle touches, with the area of the
/// texel that it covers.
pub fn cover(corners: [DVec2; 3], mut visit: impl FnMut(i64, i64, f64)) {
    let triangle = Convex::new(&corners);
    let [bottom, top] = triangle.range(1);
    for y in bottom.floor() as i64..top.ceil() as i64 {
        let (y0, y1) = (y as f64, y as f64 + 1.0);
        let row = triangle.cut(1, y0, true).cut(1, y1, false);
        let [left, right] = row.range(0);
        // Texels between these two lie wholly inside, as both their horizontal edges do.
        let inner = match (span(&corners, y0), span(&corners, y1)) {
            (Some(a), Some(b)) => [a[0].max(b[0]), a[1].min(b[1])],
            _ => [f64::INFINITY, f64::NEG_INFINITY],
        };
        for x in left.floor() as i64..right.ceil() as i64 {
            let (x0, x1) = (x as f64, x as f64 + 1.0);
            let area = if inner[0] <= x0 && x1 <= inner[1] {
                1.0
            } else {
                row.cut(0, x0, true).cut(0, x1, false).area()
            };
            if area > 0.0 {
                visit(x, y, area);
            }
        }
    }
}

/// Where the line of constant y crosses a triangle.
fn span(corners: &[DVec2; 3], y: f64) -> Option<[f64; 2]> {
    let mut found: Option<[f64; 2]> = None;
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        if (a.y < y) != (b.y < y) {
            let x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
            let [l, r] = found.unwrap_or([x, x]);
            found = Some([l.min(x), r.max(x)]);
        }
    }
    found
}

/// A convex polygon: a triangle cut by up to four axis-parallel lines.
#[derive(Clone, Copy)]
struct Convex {
    points: [DVec2; 8],
    count: usize,
}

impl Convex {
    fn new(corners: &[DVec2; 3]) -> Self {
        let mut points = [DVec2::ZERO; 8];
        points[..3].copy_from_slice(corners);
        Self { points, count: 3 }
    }

    fn points(&self) -> &[DVec2] {
        &self.points[..self.count]
    }

    fn range(&self, axis: usize) -> [f64; 2] {
        self.points().iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], p| {
            [lo.min(p[axis]), hi.max(p[axis])]
        })
    }

    /// The part at or above (or below) a coordinate.
    fn cut(&self, axis: usize, at: f64, above: bool) -> Self {
        let mut part = Self { points: [DVec2::ZERO; 8], count: 0 };
        let height = |p: DVec2| if above { p[axis] - at } else { at - p[axis] };
        clip(self.points(), height, |p| part.push(p));
        part
    }

    fn push(&mut self, p: DVec2) {
        // Rounding can add no more than the seven corners that geometry allows, plus one.
        if self.count < self.points.len() {
            self.points[self.count] = p;
            self.count += 1;
        }
    }

    fn area(&self) -> f64 {
        let Some(&o) = self.points().first() else { return 0.0 };
        let doubled: f64 = self.points().windows(2).map(|w| (w[0] - o).perp_dot(w[1] - o)).sum();
        0.5 * doubled.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_areas_sum_to_the_triangle() {
        for corners in [
            [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]],
            [[-3.2, 7.1], [12.9, 0.3], [5.5, 20.7]],
            [[0.1, 0.1], [30.0, 0.2], [60.0, 0.15]],
            [[2.0, 2.0], [2.0, 9.0], [3.0, 9.0]],
        ] {
            let corners = corners.map(DVec2::from);
            let (mut sum, mut centre, mut largest) = (0.0, DVec2::ZERO, 0.0_f64);
            cover(corners, |x, y, area| {
                sum += area;
                largest = largest.max(area);
                centre += DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * area;
            });
            let expected = size(corners).area;
            assert!((sum - expected).abs() < 1e-9 * expected.max(1.0), "{sum} {expected}");
            assert!(largest <= 1.0 + 1e-12);
            let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
            assert!((centre / sum - centroid).length() < 0.5);
        }
    }

    #[test]
    fn spread_points_stay_inside_and_centre_on_the_centroid() {
        let corners = [[0.0, 0.0], [4.0, 1.0], [1.0, 5.0]].map(DVec2::from);
        let mean = spread(corners, 4096).sum::<DVec2>() / 4096.0;
        assert!((mean - (corners[0] + corners[1] + corners[2]) / 3.0).length() < 0.01);
        let whole = size(corners).area;
        for p in spread(corners, 100) {
            let [a, b, c] = corners;
            let parts = size([p, b, c]).area + size([a, p, c]).area + size([a, b, p]).area;
            assert!((parts - whole).abs() < 1e-9);
        }
    }
}
