//! The item buffer: under each pixel, which item is nearest.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::NOTHING;
use super::occluders::Frame;
use crate::simd::LANES;

/// A rectangle of pixels on a plane at distance 1 before the pinhole.
///
/// A pixel looks along `x right + y up + forward`, where `right`, `up`, `forward` are axes of the
/// frame as `turn` has them for one of the hemicube's faces.
#[derive(Debug, Clone)]
pub struct Face {
    /// x of each pixel's centre, padded to a multiple of [`LANES`].
    x: Vec<f32>,
    /// y of each row of pixels.
    y: Vec<f32>,
    width: usize,
    /// Pixels per unit of x and y.
    density: [f32; 2],
}

impl Face {
    /// `width` × `height` pixels that cover `x` and `y` (from, to).
    #[must_use]
    pub fn new(x: [f64; 2], y: [f64; 2], width: usize, height: usize) -> Self {
        let centres = |[from, to]: [f64; 2], n: usize, padded: usize| -> Vec<f32> {
            let step = (to - from) / n as f64;
            (0..padded).map(|i| (from + (i as f64 + 0.5) * step) as f32).collect()
        };
        let stride = width.next_multiple_of(LANES);
        Self {
            x: centres(x, width, stride),
            y: centres(y, height, height),
            width,
            density: [
                (width as f64 / (x[1] - x[0])) as f32,
                (height as f64 / (y[1] - y[0])) as f32,
            ],
        }
    }

    /// The five faces of a hemicube of `resolution` × `resolution` pixels on top (even): top, then
    /// the upper halves of +x, -x, +y, -y.
    #[must_use]
    pub fn hemicube(resolution: usize) -> [Self; 5] {
        let top = Self::new([-1.0, 1.0], [-1.0, 1.0], resolution, resolution);
        let side = Self::new([-1.0, 1.0], [0.0, 1.0], resolution, resolution / 2);
        [top, side.clone(), side.clone(), side.clone(), side]
    }

    /// Pixels a row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows of pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.y.len()
    }

    /// Pixels from one row to the next in an [`ItemBuffer`].
    #[must_use]
    pub fn stride(&self) -> usize {
        self.x.len()
    }

    /// x of the pixel centres, padded to the stride.
    pub(crate) fn x(&self) -> &[f32] {
        &self.x
    }

    /// y of each row's pixel centres.
    pub(crate) fn y(&self) -> &[f32] {
        &self.y
    }

    /// Pixels (x from, x to, y from, y to; ends exclusive) outside of which a triangle of the frame
    /// is not seen; `None` if it is seen nowhere.
    #[inline(always)]
    pub(crate) fn bounds<const F: usize>(&self, corners: &[Vec3; 3]) -> Option<[usize; 4]> {
        let c = [turn::<F>(corners[0]), turn::<F>(corners[1]), turn::<F>(corners[2])];
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let mut before = 0;
        for v in &c {
            if v[2] > 0.0 {
                before += 1;
                let inverse = 1.0 / v[2];
                for a in 0..2 {
                    let p = v[a] * inverse;
                    lo[a] = lo[a].min(p);
                    hi[a] = hi[a].max(p);
                }
            }
        }
        if before == 0 {
            return None;
        }
        if before < 3 {
            // An edge that crosses the pinhole's plane runs to infinity in the picture, towards
            // the sign that its coordinates have where it crosses.
            for (p, q) in [(c[0], c[1]), (c[1], c[2]), (c[2], c[0])] {
                if (p[2] > 0.0) != (q[2] > 0.0) {
                    for a in 0..2 {
                        let crossing = p[a] * (q[2] - p[2]) - p[2] * (q[a] - p[a]);
                        let crossing = crossing * (q[2] - p[2]).signum();
                        let noise = 1e-5 * (p[a].abs() + q[a].abs()) * (p[2].abs() + q[2].abs());
                        if crossing >= -noise {
                            hi[a] = f32::INFINITY;
                        }
                        if crossing <= noise {
                            lo[a] = f32::NEG_INFINITY;
                        }
                    }
                }
            }
        }
        /// Pixels by which single precision may err at the finest resolution.
        const SLACK: f32 = 0.01;
        let mut pixels = [0; 4];
        for (a, (origin, n)) in
            [(self.x[0], self.width), (self.y[0], self.y.len())].into_iter().enumerate()
        {
            let from = ((lo[a] - origin) * self.density[a] - SLACK).ceil();
            let to = ((hi[a] - origin) * self.density[a] + SLACK).floor();
            let from = from.max(0.0);
            let to = to.min((n - 1) as f32);
            if from.is_nan() || to.is_nan() || from > to {
                return None;
            }
            pixels[2 * a] = from as usize;
            pixels[2 * a + 1] = to as usize + 1;
        }
        Some(pixels)
    }
}

/// Rows of more blocks than this are worth asking where the triangle begins and ends on them.
const WIDE: usize = 2;

/// Runs a body with each of the five faces as its constant.
macro_rules! each_face {
    ($f:ident => $body:expr) => {{
        {
            const $f: usize = 0;
            $body
        }
        {
            const $f: usize = 1;
            $body
        }
        {
            const $f: usize = 2;
            $body
        }
        {
            const $f: usize = 3;
            $body
        }
        {
            const $f: usize = 4;
            $body
        }
    }};
}
pub(crate) use each_face;

/// A vector of the frame as (right, up, forward) of face `F` of the hemicube: 0 the top, which is
/// also a camera's picture, then +x, -x, +y, -y. All are right-handed.
#[inline(always)]
pub(crate) fn turn<const F: usize>(v: Vec3) -> [f32; 3] {
    match F {
        0 => [v.x, v.y, v.z],
        1 => [v.y, v.z, v.x],
        2 => [-v.y, v.z, -v.x],
        3 => [-v.x, v.z, v.y],
        _ => [v.x, v.z, -v.y],
    }
}

/// The vector of the frame that [`turn`] turns into `v`.
pub(crate) fn back<const F: usize>([x, y, z]: [f32; 3]) -> Vec3 {
    match F {
        0 => Vec3::new(x, y, z),
        1 => Vec3::new(z, x, y),
        2 => Vec3::new(-z, -x, y),
        3 => Vec3::new(-x, z, y),
        _ => Vec3::new(x, -z, y),
    }
}

/// Fraction of their distance by which backs that do not reflect are taken to be farther. At the
/// silhouette of a closed body a front and a back meet in an edge, equally near there, and one of
/// them is seen so nearly edge on that its distance is uncertain by 1e-4 and more: rounding must
/// not show the back, which is hidden.
const SILHOUETTE: f32 = 1e-3;

/// Edge functions of a triangle in the frame of a pinhole at the origin.
///
/// Along a direction d that meets the triangle, `edge[k]·d` is proportional to the barycentric
/// coordinate of corner k, all three not negative; `nearness·d` is the inverse of the distance in
/// units of d.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Edges {
    pub(crate) edge: [Vec3; 3],
    pub(crate) nearness: Vec3,
    /// Whether the pinhole looks at the back.
    pub(crate) back: bool,
}

impl Edges {
    /// `None` for a triangle seen exactly edge on.
    #[inline(always)]
    #[must_use]
    pub fn new([a, b, c]: [Vec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let distance = normal.dot(a);
        if distance == 0.0 || !distance.is_finite() {
            return None;
        }
        // A front, counter-clockwise, has its normal towards the pinhole: negative distance.
        let sign = 1.0_f32.copysign(distance);
        Some(Self {
            edge: [b.cross(c) * sign, c.cross(a) * sign, a.cross(b) * sign],
            nearness: normal / distance,
            back: distance > 0.0,
        })
    }

    /// The same, taken to be farther by [`SILHOUETTE`].
    #[inline(always)]
    pub(crate) fn receded(self) -> Self {
        Self { nearness: self.nearness * (1.0 - SILHOUETTE), ..self }
    }

    /// The edge functions on face `F`.
    #[inline(always)]
    pub(crate) fn turned<const F: usize>(&self) -> [[f32; 3]; 3] {
        [turn::<F>(self.edge[0]), turn::<F>(self.edge[1]), turn::<F>(self.edge[2])]
    }
}

/// The cell of a source triangle's grid that a patch is, for drawing it alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchArea {
    /// Number of strips along each barycentric coordinate.
    pub strips: f32,
    /// Strip of each barycentric coordinate.
    pub strip: [f32; 3],
    /// Whether it is upside down: bounded by the upper ends of its strips rather than the lower.
    pub inverted: bool,
}

/// Nearest item and its nearness under each pixel of a face.
#[derive(Debug, Clone, Default)]
pub struct ItemBuffer {
    items: Vec<u32>,
    nearness: Vec<f32>,
}

impl ItemBuffer {
    /// Empties the buffer and gives it the size of `face`.
    pub fn clear(&mut self, face: &Face) {
        let n = face.stride() * face.height();
        self.items.clear();
        self.items.resize(n, NOTHING);
        self.nearness.clear();
        self.nearness.resize(n, 0.0);
    }

    /// The items, row by row, [`Face::stride`] apart.
    #[must_use]
    pub fn items(&self) -> &[u32] {
        &self.items
    }

    /// Calls `visit` with the direction (to the plane at distance 1, in world axes), the item and
    /// the distance of each pixel of face `F`.
    pub(crate) fn glimpses<const F: usize>(
        &self,
        face: &Face,
        frame: &Frame,
        mut visit: impl FnMut(DVec3, u32, f64),
    ) {
        for (row, &y) in face.y.iter().enumerate() {
            for (column, &x) in face.x[..face.width].iter().enumerate() {
                let at = row * face.stride() + column;
                let local = back::<F>([x, y, 1.0]).as_dvec3();
                let [t, u, n] = frame.axes;
                let direction = t * local.x + u * local.y + n * local.z;
                let distance = direction.length() / f64::from(self.nearness[at]);
                visit(direction, self.items[at], distance);
            }
        }
    }

    /// Draws a whole source triangle on face `F` within `bounds`. Where two items are equally near,
    /// the first stays.
    #[inline(always)]
    pub(crate) fn draw<const F: usize>(
        &mut self,
        face: &Face,
        bounds: [usize; 4],
        edges: &Edges,
        item: u32,
    ) {
        self.scan::<F>(face, bounds, edges, item, |f0, f1, f2| {
            (f0 >= 0.0) & (f1 >= 0.0) & (f2 >= 0.0)
        });
    }

    /// Draws one patch of a source triangle whose edges are given, within the patch's `bounds`. Its
    /// edges are evaluated from those of the source triangle, so that patches which share one,
    /// within a source triangle or across its edge, leave no pixel between them.
    #[inline(always)]
    pub(crate) fn draw_patch<const F: usize>(
        &mut self,
        face: &Face,
        bounds: [usize; 4],
        edges: &Edges,
        area: &PatchArea,
        item: u32,
    ) {
        let (n, [i, j, k]) = (area.strips, area.strip);
        if area.inverted {
            let (i, j, k) = (i + 1.0, j + 1.0, k + 1.0);
            self.scan::<F>(face, bounds, edges, item, |f0, f1, f2| {
                let s = f0 + f1 + f2;
                (i * s >= n * f0) & (j * s >= n * f1) & (k * s >= n * f2) & (s > 0.0)
            });
        } else {
            self.scan::<F>(face, bounds, edges, item, |f0, f1, f2| {
                let s = f0 + f1 + f2;
                (n * f0 >= i * s) & (n * f1 >= j * s) & (n * f2 >= k * s) & (s > 0.0)
            });
        }
    }

    #[inline(always)]
    fn scan<const F: usize>(
        &mut self,
        face: &Face,
        [x0, x1, y0, y1]: [usize; 4],
        edges: &Edges,
        item: u32,
        inside: impl Fn(f32, f32, f32) -> bool,
    ) {
        let e = edges.turned::<F>();
        let nearness = turn::<F>(edges.nearness);
        let blocks = x0 / LANES..x1.div_ceil(LANES);
        if blocks.len() <= WIDE {
            for (row, &y) in (y0..y1).zip(&face.y[y0..y1]) {
                self.scan_row(face, row, y, blocks.clone(), &e, nearness, item, &inside);
            }
            return;
        }
        let spans = Spans::new(face, &e, [x0, x1]);
        for (first, ys) in (y0..).step_by(LANES).zip(face.y[y0..y1].chunks(LANES)) {
            let (from, to) = spans.at(ys);
            for (k, &y) in ys.iter().enumerate() {
                let blocks = from[k] as usize / LANES..(to[k] as usize).div_ceil(LANES);
                self.scan_row(face, first + k, y, blocks, &e, nearness, item, &inside);
            }
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a loop body with a name")]
    fn scan_row(
        &mut self,
        face: &Face,
        row: usize,
        y: f32,
        blocks: Range<usize>,
        e: &[[f32; 3]; 3],
        nearness: [f32; 3],
        item: u32,
        inside: &impl Fn(f32, f32, f32) -> bool,
    ) {
        let (c0, c1, c2) = (e[0][1] * y + e[0][2], e[1][1] * y + e[1][2], e[2][1] * y + e[2][2]);
        let z = nearness[1] * y + nearness[2];
        let stride = face.stride();
        let xs = &face.x.as_chunks::<LANES>().0[blocks.clone()];
        let at = row * stride + blocks.start * LANES..row * stride + blocks.end * LANES;
        let items = self.items[at.clone()].as_chunks_mut::<LANES>().0;
        let near = self.nearness[at].as_chunks_mut::<LANES>().0;
        for ((xs, items), near) in xs.iter().zip(items).zip(near) {
            for l in 0..LANES {
                let x = xs[l];
                let here = nearness[0] * x + z;
                let seen =
                    inside(e[0][0] * x + c0, e[1][0] * x + c1, e[2][0] * x + c2) & (here > near[l]);
                near[l] = if seen { here } else { near[l] };
                items[l] = if seen { item } else { items[l] };
            }
        }
    }
}

/// Where a triangle begins and ends on rows of pixels: between the zeros of its edge functions,
/// which are straight lines, x = p y + q in pixels.
struct Spans {
    /// p and q of lines to the left; infinitely far where an edge is none.
    low: [[f32; 2]; 3],
    /// The same to the right.
    high: [[f32; 2]; 3],
    bounds: [f32; 2],
}

impl Spans {
    #[inline(always)]
    fn new(face: &Face, edges: &[[f32; 3]; 3], [x0, x1]: [usize; 2]) -> Self {
        /// An edge that is so steep or far away that its rounding amounts to a pixel bounds
        /// nothing.
        const FARTHEST: f32 = 1e6;
        let mut me = Self {
            low: [[0.0, f32::NEG_INFINITY]; 3],
            high: [[0.0, f32::INFINITY]; 3],
            bounds: [x0 as f32, x1 as f32],
        };
        for (k, [a, b, c]) in edges.iter().enumerate() {
            let inverse = -face.density[0] / a;
            let line = [b * inverse, c * inverse - face.x[0] * face.density[0]];
            if line[0].abs() + line[1].abs() < FARTHEST {
                if *a > 0.0 { me.low[k] = line } else { me.high[k] = line }
            }
        }
        me
    }

    /// The first pixel of each row and the one behind the last, and some more.
    #[inline(always)]
    fn at(&self, ys: &[f32]) -> ([u32; LANES], [u32; LANES]) {
        /// Pixels beside a zero that its rounding may hide.
        const SLACK: f32 = 1.5;
        let mut y = [0.0; LANES];
        y[..ys.len()].copy_from_slice(ys);
        let [mut from, mut to] = [[0; LANES]; 2];
        for l in 0..LANES {
            let y = y[l];
            let [a, b, c] = self.low.map(|[p, q]| p * y + q);
            let low = (a.max(b).max(c) - SLACK).max(self.bounds[0]).min(self.bounds[1]);
            let [a, b, c] = self.high.map(|[p, q]| p * y + q);
            let high = (a.min(b).min(c) + (SLACK + 1.0)).min(self.bounds[1]).max(low);
            (from[l], to[l]) = (low as u32, high as u32);
        }
        (from, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_turn_forth_and_back_and_are_right_handed() {
        let v = Vec3::new(1.0, 2.0, 3.0);
        each_face!(F => {
            assert_eq!(back::<F>(turn::<F>(v)), v);
            let axis = |a: [f32; 3]| back::<F>(a);
            let [x, y, z] = [axis([1.0, 0.0, 0.0]), axis([0.0, 1.0, 0.0]), axis([0.0, 0.0, 1.0])];
            assert_eq!(x.cross(y), z);
        });
    }
}
