//! What points of one polygon do not see of the other, blocker by blocker in closed form
//! (`occluded`).
//!
//! The points are the centroids of the 16 sub-triangles of a triangle. Where they see differently,
//! they give way to those of the triangle's quarters; where blockers overlap, the other triangle is
//! split.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::clip::ClippedBlocker;
use super::occluded::{Occluded, Projected, Target, aim, occlude};
use super::pair::Pair;
use super::polygon::{Polygon, longest_edge};
use crate::simd::LANES;

/// The greatest uncertainty about the fraction of a pair's weight that overlapping blockers hide.
/// Above it, the far triangle is split, and at last rays tell.
pub(super) const OVERLAP: f64 = 0.02;

/// A triangle is small against its distance from another below this ratio of its longest edge to
/// it: the kernel is then nearly linear over it.
const SMALL: f64 = 0.4;

/// How often a triangle is split at most to be small.
const SPLITS: u32 = 2;

/// Points that differ by more than this in what they see, times their weight and the effort, are
/// replaced by those of the triangle's quarters.
const SPREAD: f64 = 0.2;

/// How often at most that happens, and how often the far triangle is split.
const FINER: u32 = 6;
const CLEARER: u32 = 4;

/// A target as points see it, and a blocker projected on it; reused.
pub(super) struct ViewBuffers {
    target: Target,
    projected: Projected,
    polygon: Vec<Vec3>,
}

impl Default for ViewBuffers {
    fn default() -> Self {
        Self { target: Target::EMPTY, projected: Projected::EMPTY, polygon: Vec::new() }
    }
}

/// What is hidden of a pair, and how sure that is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hidden {
    /// Weight of all points.
    pub all: f64,
    /// Of it what is hidden, if overlapping blockers do so independently of each other.
    pub hidden: f64,
    /// Range of it, if not.
    pub least: f64,
    pub most: f64,
    /// Sum of the squares of hidden fractions.
    squares: f64,
    /// Number of points. They are spread evenly: their mean errs by about half of their standard
    /// deviation, over their number.
    pub points: u32,
}

impl Hidden {
    fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.hidden += other.hidden;
        self.least += other.least;
        self.most += other.most;
        self.squares += other.squares;
        self.points += other.points;
    }

    /// How uncertain the hidden fraction is.
    pub fn gap(&self) -> f64 {
        (self.most - self.least) / self.all.max(f64::MIN_POSITIVE)
    }

    /// Standard deviation of the hidden fraction from point to point.
    pub fn spread(&self) -> f64 {
        let mean = self.hidden / self.all.max(f64::MIN_POSITIVE);
        (self.squares / self.all.max(f64::MIN_POSITIVE) - mean * mean).max(0.0).sqrt()
    }
}

/// Points of a triangle: the centroids of its 16 sub-triangles.
const POINTS: [[f64; 3]; LANES] = {
    let mut points = [[0.0; 3]; LANES];
    let (mut i, mut k) = (0, 0);
    while i < 4 {
        let mut j = 0;
        while j < 4 - i {
            let (x, y) = (i as f64, j as f64);
            let (u, v) = ((x + 1.0 / 3.0) / 4.0, (y + 1.0 / 3.0) / 4.0);
            points[k] = [1.0 - u - v, u, v];
            k += 1;
            if j < 3 - i {
                let (u, v) = ((x + 2.0 / 3.0) / 4.0, (y + 2.0 / 3.0) / 4.0);
                points[k] = [1.0 - u - v, u, v];
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    points
};

/// What is hidden of a pair by blockers. The points lie on the polygon that is farther from what
/// hides the other: its shadow moves least. Where they see very differently, more points are taken.
pub(super) fn hidden(
    pair: &Pair<'_>,
    blockers: &mut [ClippedBlocker],
    buffers: &mut ViewBuffers,
) -> Hidden {
    let [a, b] = pair.polygons.each_ref().map(Polygon::centre);
    let sides = |blockers: &[ClippedBlocker], weight: &dyn Fn(&ClippedBlocker) -> f64| {
        let nearer = |c: &ClippedBlocker| weight(c) * (c.distance(b) - c.distance(a));
        if blockers.iter().map(nearer).sum::<f64>() <= 0.0 { (0, 1) } else { (1, 0) }
    };
    let guess = sides(blockers, &|_| 1.0);
    let hidden = View { pair, sides: guess, blockers, buffers }.all(0);
    let best = if hidden.hidden > 0.0 { sides(blockers, &|c| c.hides) } else { guess };
    let clear = hidden.gap() <= OVERLAP && pair.effort * hidden.spread() <= SPREAD;
    match best == guess && clear {
        true => hidden,
        false => View { pair, sides: best, blockers, buffers }.all(FINER),
    }
}

/// One polygon of a pair seen from points of the other.
struct View<'a> {
    pair: &'a Pair<'a>,
    /// Which polygon the points lie on, and which they look at.
    sides: (usize, usize),
    blockers: &'a mut [ClippedBlocker],
    buffers: &'a mut ViewBuffers,
}

impl View<'_> {
    /// What is hidden, where that differs split up to `finer` times.
    fn all(&mut self, finer: u32) -> Hidden {
        let (pair, (from, to)) = (self.pair, self.sides);
        let mut hidden = Hidden::default();
        for x in pair.polygons[from].fan() {
            for y in pair.polygons[to].fan() {
                self.look(x, y, (SPLITS, finer), &mut hidden);
            }
        }
        hidden
    }

    /// Adds what is hidden of `y` from points of `x`. First `x` is split until it is small. Then it
    /// is split where its points see differently, and `y` where blockers overlap, both by their
    /// weight in the whole pair.
    fn look(
        &mut self,
        x: [DVec3; 3],
        y: [DVec3; 3],
        (splits, finer): (u32, u32),
        hidden: &mut Hidden,
    ) {
        let small = SMALL * middle(x).distance(middle(y));
        if splits > 0 && longest_edge(x) > 2.0 * small {
            for x in quarters(x) {
                self.look(x, y, (splits - 1, finer), hidden);
            }
            return;
        }
        self.buffers.target.closely = longest_edge(y) > small;
        let local = self.of_points(x, y);
        let weight = local.all / (PI * self.pair.exchange);
        if finer > 0 && self.pair.effort * weight * local.spread() > SPREAD {
            for x in quarters(x) {
                self.look(x, y, (0, finer - 1), hidden);
            }
        } else if finer > FINER - CLEARER && weight * local.gap() > OVERLAP {
            for y in quarters(y) {
                self.look(x, y, (0, finer - 1), hidden);
            }
        } else {
            hidden.add(&local);
        }
    }

    /// What is hidden of `y` from 16 points of `x`.
    fn of_points(&mut self, x: [DVec3; 3], y: [DVec3; 3]) -> Hidden {
        let ViewBuffers { target, projected, polygon } = &mut *self.buffers;
        let (from, to) = self.sides;
        let origin = middle(y);
        target.corners = y.map(|c| (c - origin).as_vec3());
        let x = x.map(|c| (c - origin).as_vec3());
        for (l, p) in POINTS.iter().enumerate() {
            let at = x[0] * p[0] as f32 + x[1] * p[1] as f32 + x[2] * p[2] as f32;
            for axis in 0..3 {
                target.from[axis][l] = at[axis];
            }
        }
        let [near, far] = [from, to].map(|k| self.pair.polygons[k].normal.as_vec3());
        aim(target, near, far);
        let (mut clear, mut most, mut sum) = ([1.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
        let area = area_of(x);
        for group in self.blockers.chunk_by_mut(|a, b| a.group == b.group) {
            let mut occluded = Occluded([0.0; LANES]);
            let mut before = 0.0_f32;
            for blocker in group {
                polygon.clear();
                polygon.extend(blocker.corners().iter().map(|&c| (c - origin).as_vec3()));
                let sense = match (blocker.one_sided, from) {
                    (false, _) => 0.0,
                    (true, 0) => 1.0,
                    (true, _) => -1.0,
                };
                let normal = blocker.normal.as_vec3();
                occlude(target, polygon, normal, sense, projected, &mut occluded);
                let after: f32 = occluded.0.iter().zip(&target.weight).map(|(h, w)| h * w).sum();
                blocker.hides += f64::from(after - before) * area;
                before = after;
            }
            for l in 0..LANES {
                let h = occluded.0[l].min(1.0);
                clear[l] *= 1.0 - h;
                most[l] = most[l].max(h);
                sum[l] += h;
            }
        }
        let mut hidden = Hidden { points: LANES as u32, ..Hidden::default() };
        for l in 0..LANES {
            let weight = f64::from(target.weight[l]) * area;
            hidden.all += weight;
            let fraction = f64::from(1.0 - clear[l]);
            hidden.hidden += weight * fraction;
            hidden.squares += weight * fraction * fraction;
            hidden.least += weight * f64::from(most[l]);
            hidden.most += weight * f64::from(sum[l].min(1.0));
        }
        hidden
    }
}

fn middle(t: [DVec3; 3]) -> DVec3 {
    (t[0] + t[1] + t[2]) / 3.0
}

fn area_of([a, b, c]: [Vec3; 3]) -> f64 {
    f64::from(0.5 * (b - a).cross(c - a).length())
}

fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
}
