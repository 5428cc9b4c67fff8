//! Outlines of what is opaque: marching squares (W.E. Lorensen & H.E. Cline 1987, "Marching
//! Cubes", in the plane), with fewer points than there are texels.

use glam::DVec2;

/// A closed line with what is opaque on its left, where x points right and y up.
pub type Outline = Vec<DVec2>;

/// A line may leave its points so far aside, in texels: the steps of a slope that is not smoothed
/// are one line.
const ASIDE: f64 = 0.75;

/// A piece of a line that is aside by more than this on average gets a corner in its middle, so
/// that the area stays what it was.
const ASIDE_ON_AVERAGE: f64 = 0.15;

/// Outlines of the region where a height, known at the nodes of a grid and bilinear between, is
/// not negative. They close along the grid's border, and pass through the same points of it as
/// those of the grid beyond.
pub fn outlines(xs: &[f64], ys: &[f64], height: impl Fn(usize, usize) -> f64) -> Vec<Outline> {
    let grid = Grid::new(xs, ys, height);
    let next = grid.steps();
    let mut seen = vec![false; next.len()];
    let mut found = Vec::new();
    for start in (0..next.len()).filter(|&e| next[e] != NONE) {
        let mut line = Vec::new();
        let mut at = start;
        while !std::mem::replace(&mut seen[at], true) {
            line.push(grid.crossing(at));
            at = next[at];
        }
        found.extend(simplified(line));
    }
    found
}

/// No step.
const NONE: usize = usize::MAX;

/// A grid in a ring of nodes that lie on its border and far below.
struct Grid<'a> {
    xs: &'a [f64],
    ys: &'a [f64],
    width: usize,
    heights: Vec<f64>,
}

/// A point of an outline, and whether it has to stay.
type Point = (DVec2, bool);

impl<'a> Grid<'a> {
    fn new(xs: &'a [f64], ys: &'a [f64], height: impl Fn(usize, usize) -> f64) -> Self {
        let width = xs.len() + 2;
        let mut heights = vec![f64::NEG_INFINITY; width * (ys.len() + 2)];
        for y in 0..ys.len() {
            for x in 0..xs.len() {
                heights[(y + 1) * width + x + 1] = height(x, y);
            }
        }
        Self { xs, ys, width, heights }
    }

    /// For each edge of the grid that an outline crosses, the one that it crosses next. The edge
    /// from node `i` to the right is `2 i`, the one upwards `2 i + 1`.
    fn steps(&self) -> Vec<usize> {
        let w = self.width;
        let mut next = vec![NONE; 2 * self.heights.len()];
        for y in 0..=self.ys.len() {
            for i in y * w..(y + 1) * w - 1 {
                let heights = [i, i + 1, i + w + 1, i + w].map(|node| self.heights[node]);
                let edges = [2 * i, 2 * (i + 1) + 1, 2 * (i + w), 2 * i + 1];
                let inside = |k: usize| heights[k % 4] >= 0.0;
                // Where two corners that face each other are inside, the centre joins or parts.
                let way = if heights.iter().sum::<f64>() >= 0.0 { 1 } else { 3 };
                for k in (0..4).filter(|&k| inside(k) && !inside(k + 1)) {
                    let mut other = (k + way) % 4;
                    while inside(other) || !inside(other + 1) {
                        other = (other + way) % 4;
                    }
                    next[edges[k]] = edges[other];
                }
            }
        }
        next
    }

    /// Where an outline crosses an edge; it has to stay if the grid beyond crosses there too.
    fn crossing(&self, edge: usize) -> Point {
        let (from, upwards) = (edge / 2, edge % 2 == 1);
        let to = from + if upwards { self.width } else { 1 };
        let (from, to) = if self.heights[from] >= 0.0 { (from, to) } else { (to, from) };
        let [(a, a_ends), (b, b_ends)] = [from, to].map(|node| self.place(node));
        let (over, under) = (self.heights[from], self.heights[to]);
        let at = a + (b - a) * (over / (over - under));
        let real = under > f64::NEG_INFINITY;
        let along = if upwards { a_ends[0] && b_ends[0] } else { a_ends[1] && b_ends[1] };
        (at, if real { along } else { a_ends == [true; 2] })
    }

    /// Where a node is, and whether that is at an end of the grid, along x and y.
    fn place(&self, node: usize) -> (DVec2, [bool; 2]) {
        let along = |at: &[f64], k: usize| {
            let k = k.saturating_sub(1).min(at.len() - 1);
            (at[k], k == 0 || k == at.len() - 1)
        };
        let (x, x_ends) = along(self.xs, node % self.width);
        let (y, y_ends) = along(self.ys, node / self.width);
        (DVec2::new(x, y), [x_ends, y_ends])
    }
}

/// A line of fewer points; `None` if nothing is left of it.
fn simplified(mut line: Vec<Point>) -> Option<Outline> {
    line.dedup_by(|b, a| {
        let same = a.0 == b.0;
        a.1 |= same && b.1;
        same
    });
    while line.len() > 1 && line.first().map(|p| p.0) == line.last().map(|p| p.0) {
        let stays = line.pop().is_some_and(|p| p.1);
        line[0].1 |= stays;
    }
    if line.len() < 3 {
        return None;
    }
    if let Some(first) = line.iter().position(|p| p.1) {
        line.rotate_left(first);
    }
    line.push(line[0]);
    let mut kept = vec![0];
    let mut from = 0;
    for to in 1..line.len() {
        if line[to].1 || to == line.len() - 1 {
            keep(&line, from, to, &mut kept);
            from = to;
        }
    }
    let areas = areas(&line);
    let mut left = Outline::new();
    for ends in kept.windows(2) {
        let [(a, _), (b, _)] = [line[ends[0]], line[ends[1]]];
        let o = line[0].0;
        let area = 0.5 * (areas[ends[1]] - areas[ends[0]] + (b - o).perp_dot(a - o));
        let aside = area / (b - a).length();
        left.push(a);
        if aside.is_finite() && aside.abs() > ASIDE_ON_AVERAGE {
            left.push(0.5 * (a + b) - 2.0 * aside * (b - a).normalize_or_zero().perp());
        }
    }
    (left.len() >= 3).then_some(left)
}

/// Twice the area that the line sweeps about its first point, up to each.
fn areas(line: &[Point]) -> Vec<f64> {
    let o = line[0].0;
    let mut sum = 0.0;
    let swept = line.windows(2).map(|w| {
        sum += (w[0].0 - o).perp_dot(w[1].0 - o);
        sum
    });
    std::iter::once(0.0).chain(swept).collect()
}

/// Appends the points between two that the line needs (U. Ramer 1972, "An iterative procedure for
/// the polygonal approximation of plane curves"), and the second of the two.
fn keep(line: &[Point], from: usize, to: usize, kept: &mut Vec<usize>) {
    let mut open = vec![(from, to)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (line[from].0, line[to].0);
        let length = (b - a).length();
        let aside = |p: DVec2| match length > 0.0 {
            true => (b - a).perp_dot(p - a).abs() / length,
            false => (p - a).length(),
        };
        let between = (from + 1..to).map(|k| (aside(line[k].0), k));
        match between.reduce(|a, b| if b.0 > a.0 { b } else { a }) {
            Some((most, at)) if most > ASIDE => open.extend([(at, to), (from, at)]),
            _ => kept.push(to),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(n: usize) -> Vec<f64> {
        (0..n).map(|i| i as f64).collect()
    }

    fn area(line: &[DVec2]) -> f64 {
        let closed = line.iter().zip(line.iter().cycle().skip(1));
        0.5 * closed.map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
    }

    #[test]
    fn what_fills_the_grid_is_a_rectangle_and_nothing_is_nothing() {
        let all = outlines(&nodes(5), &nodes(9), |_, _| 0.0);
        assert_eq!(all.len(), 1);
        assert_eq!((all[0].len(), area(&all[0])), (4, 32.0));
        assert!(outlines(&nodes(5), &nodes(9), |_, _| -0.1).is_empty());
    }

    #[test]
    fn a_ring_has_two_outlines_of_few_points() {
        let n = nodes(101);
        let disc =
            |r: f64, x: usize, y: usize| r - DVec2::new(x as f64 - 50.0, y as f64 - 50.0).length();
        let ring = outlines(&n, &n, |x, y| disc(40.0, x, y).min(-disc(20.0, x, y)));
        let [outer, hole] = &ring[..] else { panic!("{} outlines", ring.len()) };
        let exact = |r: f64| std::f64::consts::PI * r * r;
        assert!((area(outer) / exact(40.0) - 1.0).abs() < 0.01, "{}", area(outer));
        assert!((area(hole) / -exact(20.0) - 1.0).abs() < 0.01, "{}", area(hole));
        assert!(outer.len() < 80, "{}", outer.len());
    }

    #[test]
    fn the_steps_of_a_slope_are_one_line() {
        let n = nodes(61);
        let slope = outlines(&n, &n, |x, y| if 3 * y > x + 60 { -1.0 } else { 1.0 });
        assert!(slope[0].len() <= 6, "{:?}", slope[0]);
    }

    #[test]
    fn corners_that_face_each_other_are_joined_through_a_high_centre() {
        let cross = |high: f64| {
            let at = [[1.0, -high], [-high, 1.0]];
            outlines(&nodes(2), &nodes(2), move |x, y| at[y][x]).len()
        };
        assert_eq!((cross(0.5), cross(2.0)), (1, 2));
    }

    #[test]
    fn grids_side_by_side_share_the_points_of_their_border() {
        let value = |x: usize, y: usize| ((x * 7 + y * 13) % 5) as f64 - 1.9;
        let (n, right) = (nodes(9), nodes(17)[8..].to_vec());
        let on = |lines: Vec<Outline>| {
            let mut ys: Vec<u64> =
                lines.concat().iter().filter(|p| p.x == 8.0).map(|p| p.y.to_bits()).collect();
            ys.sort_unstable();
            ys.dedup();
            ys
        };
        let left = on(outlines(&n, &n, value));
        assert!(left.len() > 4);
        assert_eq!(left, on(outlines(&right, &n, |x, y| value(x + 8, y))));
    }
}
