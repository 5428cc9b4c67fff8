//! Clips the ears of a polygon in a plane.
//!
//! Only corners that turn the other way can lie in an ear, and a grid finds those that are near.
//! What a polygon may cost is bounded: one that crosses itself may have no ears at all.

use glam::DVec2;

/// A corner whose sine is below this is straight: its ear would be degenerate.
pub const STRAIGHT: f64 = 1e-9;

/// Looks at corners and cells of the grid that each corner may cost, times log2 of how many there
/// are: far more than simple polygons take.
const LOOKS: usize = 64;

/// Sine of the turn at `b`, positive to the left; 0 where an edge has no length.
pub fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (d, e) = (b - a, c - b);
    let lengths = d.length() * e.length();
    if lengths > 0.0 { d.perp_dot(e) / lengths } else { 0.0 }
}

/// Corner indices of `n - 2` triangles, and whether they tile the polygon: what is left when the
/// looks are used up is a fan.
pub fn clip_ears(points: &[DVec2]) -> (Vec<[usize; 3]>, bool) {
    let mut ring = Ring::new(points);
    let mut triangles = Vec::with_capacity(points.len() - 2);
    let mut at = 0;
    for left in (4..=points.len()).rev() {
        // Strict ears first; then ears that other corners touch (holes joined by a bridge); then
        // anything, as a polygon that crosses itself may have none.
        let found = ring.find(at, left, true).or_else(|| ring.find(at, left, false));
        if ring.looks == 0 {
            let rest = ring.rest(at, left);
            triangles.extend(rest.windows(2).skip(1).map(|w| [rest[0], w[0], w[1]]));
            return (triangles, false);
        }
        let ear = found.unwrap_or(at);
        triangles.push(ring.ear(ear));
        at = ring.clip(ear);
    }
    triangles.push(ring.ear(ring.after[at]));
    (triangles, true)
}

/// The corners that are left, each with its neighbours.
struct Ring<'a> {
    points: &'a [DVec2],
    before: Vec<usize>,
    after: Vec<usize>,
    /// Whether a corner is left and does not turn left: it may lie in an ear.
    reflex: Vec<bool>,
    /// All that are so, and some that are no longer.
    blockers: Vec<usize>,
    grid: Grid,
    /// Corners clipped since the blockers were sifted.
    clips: usize,
    /// Looks that may still be taken.
    looks: usize,
}

impl<'a> Ring<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let n = points.len();
        let mut ring = Self {
            points,
            before: (0..n).map(|i| (i + n - 1) % n).collect(),
            after: (0..n).map(|i| (i + 1) % n).collect(),
            reflex: Vec::new(),
            blockers: Vec::new(),
            grid: Grid::new(points),
            clips: 0,
            looks: LOOKS * n * (n.ilog2() as usize + 1),
        };
        ring.reflex = (0..n).map(|i| ring.is_reflex(i)).collect();
        ring.blockers = (0..n).filter(|&i| ring.reflex[i]).collect();
        ring
    }

    fn ear(&self, i: usize) -> [usize; 3] {
        [self.before[i], i, self.after[i]]
    }

    fn is_reflex(&self, i: usize) -> bool {
        let [a, b, c] = self.ear(i).map(|i| self.points[i]);
        turn(a, b, c) <= STRAIGHT
    }

    /// The first ear of `left` corners from `at` on.
    fn find(&mut self, at: usize, left: usize, strict: bool) -> Option<usize> {
        let mut i = at;
        for _ in 0..left {
            if self.is_ear(i, strict) {
                return Some(i);
            }
            i = self.after[i];
        }
        None
    }

    fn is_ear(&mut self, i: usize, strict: bool) -> bool {
        self.looks = self.looks.saturating_sub(1);
        let ear = self.ear(i);
        let [a, b, c] = ear.map(|i| self.points[i]);
        if self.reflex[i] || (c - a).length_squared() == 0.0 || self.looks == 0 {
            return false;
        }
        let limit = if strict { -STRAIGHT } else { STRAIGHT };
        let Self { points, reflex, blockers, grid, looks, .. } = self;
        let mut none_in = |near: &[usize]| {
            *looks = looks.saturating_sub(1 + near.len());
            near.iter().all(|&i| {
                let p = points[i];
                if !reflex[i] || ear.contains(&i) || p == a || p == b || p == c {
                    return true;
                }
                [turn(a, b, p), turn(b, c, p), turn(c, a, p)].iter().any(|&t| t < limit)
            })
        };
        let cells = grid.cells_about([a, b, c]);
        if cells.len() < blockers.len() {
            cells.all(|cell| none_in(cell))
        } else {
            none_in(blockers)
        }
    }

    /// Takes a corner out; yields the one after it.
    fn clip(&mut self, i: usize) -> usize {
        let [a, _, c] = self.ear(i);
        (self.after[a], self.before[c], self.reflex[i]) = (c, a, false);
        for i in [a, c] {
            let is_reflex = self.is_reflex(i);
            if is_reflex && !self.reflex[i] {
                self.blockers.push(i);
            }
            self.reflex[i] = is_reflex;
        }
        self.clips += 1;
        // Now and then, so that it costs no more than the clips themselves.
        if 2 * self.clips > self.blockers.len() {
            self.clips = 0;
            self.blockers.retain(|&i| self.reflex[i]);
        }
        c
    }

    fn rest(&self, at: usize, left: usize) -> Vec<usize> {
        std::iter::successors(Some(at), |&i| Some(self.after[i])).take(left).collect()
    }
}

/// Corners by where they lie.
struct Grid {
    low: DVec2,
    /// Cells a unit of length.
    scale: DVec2,
    side: usize,
    cells: Vec<Vec<usize>>,
}

impl Grid {
    /// Most cells along a side.
    const MOST: usize = 512;

    fn new(points: &[DVec2]) -> Self {
        let low = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let side = (points.len().isqrt()).clamp(1, Self::MOST);
        let extent = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        let scale = DVec2::splat(side as f64) / extent;
        let mut grid = Self { low, scale, side, cells: vec![Vec::new(); side * side] };
        for (i, &p) in points.iter().enumerate() {
            let [x, y] = grid.cell(p);
            grid.cells[y * side + x].push(i);
        }
        grid
    }

    fn cell(&self, p: DVec2) -> [usize; 2] {
        // What is no number, or too large, lies in the first or the last cell.
        let at = (p - self.low) * self.scale;
        [at.x, at.y].map(|x| (x as usize).min(self.side - 1))
    }

    /// The cells that a triangle touches.
    fn cells_about(&self, corners: [DVec2; 3]) -> Cells<'_> {
        let [a, b, c] = corners;
        let [low, high] = [self.cell(a.min(b).min(c)), self.cell(a.max(b).max(c))];
        let corners = corners.map(|p| (p - self.low) * self.scale);
        Cells { grid: self, low, high, corners }
    }
}

/// The cells of a triangle: those of its box that it touches.
struct Cells<'a> {
    grid: &'a Grid,
    low: [usize; 2],
    high: [usize; 2],
    /// In cells.
    corners: [DVec2; 3],
}

/// Rounding of coordinates in cells.
const ROUNDING: f64 = 1e-6;

impl Cells<'_> {
    /// About how many there are: a spike has few of its box.
    fn len(&self) -> usize {
        let [a, b, c] = self.corners;
        let area = 0.5 * (b - a).perp_dot(c - a).abs();
        area as usize + (self.high[0] - self.low[0] + 1) + (self.high[1] - self.low[1] + 1)
    }

    /// Whether `each` holds for what lies in each of them.
    fn all(&self, mut each: impl FnMut(&[usize]) -> bool) -> bool {
        let grid = self.grid;
        let mut row = |y: usize| {
            let [from, to] = self.columns(y);
            (from..=to).all(|x| each(&grid.cells[y * grid.side + x]))
        };
        (self.low[1]..=self.high[1]).all(&mut row)
    }

    /// The first and the last column that the triangle touches in a row.
    fn columns(&self, y: usize) -> [usize; 2] {
        let (below, above) = (y as f64 - ROUNDING, y as f64 + 1.0 + ROUNDING);
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..3 {
            let (p, q) = (self.corners[k], self.corners[(k + 1) % 3]);
            let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
            if p.y > above || q.y < below {
                continue;
            }
            // What of the edge lies in the row.
            let at =
                |y: f64| if q.y > p.y { p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y) } else { q.x };
            let ends = [
                if p.y < below { at(below) } else { p.x },
                if q.y > above { at(above) } else { q.x },
            ];
            (left, right) = (left.min(ends[0].min(ends[1])), right.max(ends[0].max(ends[1])));
        }
        let [from, to] = [left - ROUNDING, right + ROUNDING].map(|x| x as usize);
        // What is no number has all of the box.
        let whole = left.is_nan() || right.is_nan() || left > right;
        let from = if whole { self.low[0] } else { from.clamp(self.low[0], self.high[0]) };
        [from, if whole { self.high[0] } else { to.clamp(from, self.high[0]) }]
    }
}
