//! What points of one polygon do not see of the other, blocker by blocker in closed form
//! (`occluded`).
//!
//! The points are the centroids of the 16 sub-triangles of a triangle; four of them are those of
//! its quarters, and by how much their mean differs tells how good the mean of all is. Where it is
//! not good enough, they give way to the points of the quarters. Where the points agree that nearly
//! all is hidden, or hardly anything, the corners of the sub-triangles are asked as well: what is
//! seen past a corner of a body is often seen from the tip of a triangle alone.
//!
//! What blockers of one sheet hide adds up. Where several sheets hide something from a point, they
//! may overlap: if that matters, all blockers are subtracted from what it sees (`union`).

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::blockers::Blockers;
use super::clip::ClippedBlocker;
use super::fractions::{Fractions, NODE_WEIGHTS, NODES, OF_QUARTERS, POINTS, uncertainty};
use super::occluded::{Occluded, Projected, Target, aim, occlude};
use super::pair::Pair;
use super::polygon::{Polygon, longest_edge};
use super::sheets::{MAY_WIND, sort_into_sheets};
use super::union::{self, Parts};
use crate::simd::LANES;

/// A triangle is small against its distance from another below this ratio of its longest edge to
/// it: the kernel is then nearly linear over it.
const SMALL: f64 = 0.4;

/// How often a triangle is split at most to be small.
const SPLITS: u32 = 2;

/// How often at most points give way to those of quarters.
const FINER: u32 = 6;

/// The error of 16 points over the difference between them and four of them.
const BY_DIFFERENCE: f64 = 0.5;

/// The least error of 16 points over their standard deviation: four may agree with them by chance.
const BY_SPREAD: f64 = 0.01;

/// Fractions that are nothing in single precision.
const NOISE: f64 = 2e-6;

/// Points agree if no more than this is hidden on the average, or seen: what one of them might.
const NEARLY_NONE: f64 = 1.0 / 16.0;

/// Points that agree may miss half of what the corner of a sub-triangle sees, or does not see.
const MISSED: f64 = 1.0 / 96.0;

/// The square of what they may miss at most of a pair, however much it may err by.
const CLEARLY: f64 = 9e-4;

/// The part of the nodes in the mean of both rules: what is quadratic is integrated exactly.
const OF_NODES: f64 = 0.25;

/// The error of that mean over the difference between them.
const BY_NODES: f64 = 0.25;

/// A closed surface is entered as often as it is left: what its fronts and its backs hide may
/// differ by this for rounding.
const AGREE: f32 = 1e-3;

/// The part of the error allowed that not knowing what overlaps may make.
const BY_OVERLAP: f64 = 0.7;

/// A point is sure enough if its own range is less than this part of that.
const NEARLY: f64 = 0.3;

/// The width of a range that is as uncertain as numbers of this standard deviation, of which a
/// dozen average out.
const ALIKE: f32 = 1.0;

/// The least standard deviation that four numbers are trusted to tell, in 0..1.
const FEW: f32 = 0.2;

/// A target as points see it, and a blocker projected on it; reused.
pub(super) struct ViewBuffers {
    target: Target,
    projected: Projected,
    polygon: Vec<Vec3>,
    parts: Parts,
}

impl Default for ViewBuffers {
    fn default() -> Self {
        Self {
            target: Target::EMPTY,
            projected: Projected::EMPTY,
            polygon: Vec::new(),
            parts: Parts::default(),
        }
    }
}

/// What is hidden of a pair.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hidden {
    /// Weight of all points.
    pub all: f64,
    /// Weight of what is hidden.
    pub hidden: f64,
    /// The square of the error of that.
    pub square_error: f64,
}

impl Hidden {
    fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.hidden += other.hidden;
        self.square_error += other.square_error;
    }

    /// Whether the points agree that nearly all is hidden, or hardly anything, and what they may
    /// have missed is more than an error of such a square.
    fn may_miss(&self, allowed: f64) -> bool {
        let agree = self.hidden.min(self.all - self.hidden) <= NEARLY_NONE * self.all;
        agree && (MISSED * self.all).powi(2) > allowed
    }

    /// Takes in what is hidden from the nodes between the points.
    fn correct(&mut self, nodes: &Self) {
        let apart = self.all * nodes.hidden / nodes.all.max(f64::MIN_POSITIVE) - self.hidden;
        if apart.abs() > NOISE * self.all {
            self.hidden += OF_NODES * apart;
            self.square_error += (BY_NODES * apart).powi(2);
        }
    }
}

/// Where points lie on a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// In the middle of the 16 sub-triangles.
    Centroids,
    /// At their corners.
    Nodes,
}

/// What is hidden of a pair by blockers. The points lie on the polygon that is farther from what
/// hides the other: its shadow moves least.
pub(super) fn hidden(
    pair: &Pair<'_>,
    blockers: &mut [ClippedBlocker],
    (all, touching): (&Blockers, f64),
    buffers: &mut ViewBuffers,
) -> Hidden {
    let [a, b] = pair.polygons.each_ref().map(Polygon::centre);
    let sides = |blockers: &[ClippedBlocker], weight: &dyn Fn(&ClippedBlocker) -> f64| {
        let nearer = |c: &ClippedBlocker| weight(c) * (c.distance(b) - c.distance(a));
        if blockers.iter().map(nearer).sum::<f64>() <= 0.0 { (0, 1) } else { (1, 0) }
    };
    let mut look = |sides: (usize, usize), blockers: &mut [ClippedBlocker], finer: u32| {
        sort_into_sheets(blockers, &pair.polygons[sides.0], all, touching);
        View { pair, sides, blockers, buffers: &mut *buffers, work: 0 }.all(finer)
    };
    let guess = sides(blockers, &|_| 1.0);
    let first = look(guess, blockers, 0);
    let best = if first.hidden > 0.0 { sides(blockers, &|c| c.hides) } else { guess };
    match first.square_error <= (pair.tolerance * first.all).powi(2) {
        true => first,
        false => look(best, blockers, FINER),
    }
}

/// One polygon of a pair seen from points of the other.
struct View<'a> {
    pair: &'a Pair<'a>,
    /// Which polygon the points lie on, and which they look at.
    sides: (usize, usize),
    /// By surfaces and sheets.
    blockers: &'a mut [ClippedBlocker],
    buffers: &'a mut ViewBuffers,
    /// What was done so far.
    work: usize,
}

impl View<'_> {
    /// What is hidden, where that is not sure split up to `finer` times.
    fn all(&mut self, finer: u32) -> Hidden {
        let (pair, (from, to)) = (self.pair, self.sides);
        let mut hidden = Hidden::default();
        let (xs, ys) = (pair.polygons[from].fan(), pair.polygons[to].fan());
        let both = xs.flat_map(|x| ys.clone().map(move |y| (x, y)));
        let mut left = both.clone().count();
        for (x, y) in both {
            let limit = self.work + pair.work.saturating_sub(self.work) / left;
            self.look(x, y, (SPLITS, finer), limit, &mut hidden);
            left -= 1;
        }
        hidden
    }

    /// Adds what is hidden of `y` from points of `x`, which is split until it is small, and then
    /// until the error is as small as it should be or the work is up to the limit.
    fn look(
        &mut self,
        x: [DVec3; 3],
        y: [DVec3; 3],
        (splits, finer): (u32, u32),
        limit: usize,
        hidden: &mut Hidden,
    ) {
        let small = SMALL * middle(x).distance(middle(y));
        if splits > 0 && longest_edge(x) > 2.0 * small {
            self.look_at_quarters(x, y, (splits - 1, finer), limit, hidden);
            return;
        }
        self.buffers.target.closely = longest_edge(y) > small;
        let mut local = self.of_points(x, y, Rule::Centroids);
        // Errors of parts are independent of each other: their squares add up.
        let all = PI * self.pair.exchange;
        let allowed = self.pair.tolerance.powi(2) * all * local.all;
        let last = finer == 0 || local.square_error <= allowed;
        if last && local.may_miss(allowed.min(CLEARLY * all * local.all)) {
            local.correct(&self.of_points(x, y, Rule::Nodes));
        }
        if finer > 0 && local.square_error > allowed && self.work < limit {
            self.look_at_quarters(x, y, (0, finer - 1), limit, hidden);
        } else {
            hidden.add(&local);
        }
    }

    fn look_at_quarters(
        &mut self,
        x: [DVec3; 3],
        y: [DVec3; 3],
        depth: (u32, u32),
        limit: usize,
        hidden: &mut Hidden,
    ) {
        for (x, left) in quarters(x).into_iter().zip([4, 3, 2, 1]) {
            let limit = self.work + limit.saturating_sub(self.work) / left;
            self.look(x, y, depth, limit, hidden);
        }
    }

    /// What is hidden of `y` from 16 points of `x`.
    fn of_points(&mut self, x: [DVec3; 3], y: [DVec3; 3], rule: Rule) -> Hidden {
        let origin = middle(y);
        let target = &mut self.buffers.target;
        target.corners = y.map(|c| (c - origin).as_vec3());
        let (points, shares) = match rule {
            Rule::Centroids => (&POINTS, &[1.0; LANES]),
            Rule::Nodes => (&NODES, &NODE_WEIGHTS),
        };
        let points = points.map(|p| x[0] * p[0] + x[1] * p[1] + x[2] * p[2]);
        for (l, p) in points.iter().enumerate() {
            for axis in 0..3 {
                target.from[axis][l] = (p[axis] - origin[axis]) as f32;
            }
        }
        let (from, to) = self.sides;
        let [near, far] = [from, to].map(|k| self.pair.polygons[k].normal);
        aim(target, near.as_vec3(), far.as_vec3());
        let area = super::polygon::area(x);
        let mut found = self.fractions(origin, area);
        let weight = &self.buffers.target.weight;
        let weights = std::array::from_fn(|l| f64::from(weight[l]) * area * shares[l]);
        let all: f64 = weights.iter().sum();
        let allowed = BY_OVERLAP * self.pair.tolerance * (PI * self.pair.exchange * all).sqrt();
        if self.overlaps_itself((&points, near), y, &found) {
            // Then what a sheet hides is less than its polygons do one by one.
            found.least = [0.0; LANES];
        }
        if uncertainty(&found, &weights) > allowed {
            self.subtract((&points, near), y, (&weights, allowed), &mut found);
        }
        let fractions: [f64; LANES] = std::array::from_fn(|l| f64::from(found.likely[l]));
        let hidden: f64 = fractions.iter().zip(&weights).map(|(f, w)| f * w).sum();
        let coarse: [f64; 2] = OF_QUARTERS
            .iter()
            .fold([0.0; 2], |[h, w], &l| [h + fractions[l] * weights[l], w + weights[l]]);
        let mean = hidden / all.max(f64::MIN_POSITIVE);
        let coarse = coarse[0] / coarse[1].max(f64::MIN_POSITIVE);
        let squares: f64 = fractions.iter().zip(&weights).map(|(f, w)| f * f * w).sum();
        let variance = (squares / all.max(f64::MIN_POSITIVE) - mean * mean).max(0.0);
        let by_points =
            (BY_DIFFERENCE * (mean - coarse)).powi(2).max(BY_SPREAD * BY_SPREAD * variance);
        let by_overlap = uncertainty(&found, &weights).powi(2);
        Hidden { all, hidden, square_error: by_points * all * all + by_overlap }
    }

    /// What blockers hide, sheet by sheet.
    fn fractions(&mut self, origin: DVec3, area: f64) -> Fractions {
        self.work += self.blockers.len();
        let ViewBuffers { target, projected, polygon, .. } = &mut *self.buffers;
        let mut found = Fractions { least: [0.0; LANES], most: [0.0; LANES], likely: [0.0; LANES] };
        let mut clear = [1.0_f32; LANES];
        for surface in self.blockers.chunk_by_mut(|a, b| a.surface == b.surface) {
            let closed = surface.iter().all(|c| c.closed);
            let (mut fronts, mut backs, mut most) =
                ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
            for sheet in surface.chunk_by_mut(|a, b| a.sheet == b.sheet) {
                let mut occluded = Occluded::NOTHING;
                let mut before = [0.0_f32; LANES];
                for blocker in sheet {
                    polygon.clear();
                    polygon.extend(blocker.corners().iter().map(|&c| (c - origin).as_vec3()));
                    let normal = blocker.normal.as_vec3();
                    occlude(target, polygon, normal, projected, &mut occluded);
                    blocker.seen = 0;
                    for l in 0..LANES {
                        let after = occluded.by_fronts[l] + occluded.by_backs[l];
                        let more = after - before[l];
                        blocker.seen |= u16::from(more > 0.0) << l;
                        blocker.hides += f64::from(more * target.weight[l]) * area;
                        before[l] = after;
                    }
                }
                for l in 0..LANES {
                    let (front, back) =
                        (occluded.by_fronts[l].min(1.0), occluded.by_backs[l].min(1.0));
                    fronts[l] += front;
                    backs[l] += back;
                    most[l] = most[l].max(front).max(back);
                }
            }
            for l in 0..LANES {
                let balanced = closed && (fronts[l] - backs[l]).abs() <= AGREE;
                let sum = if balanced { fronts[l].max(backs[l]) } else { fronts[l] + backs[l] };
                found.least[l] = found.least[l].max(most[l]);
                found.most[l] += sum;
                clear[l] *= 1.0 - 0.5 * (most[l] + sum.min(1.0));
            }
        }
        for l in 0..LANES {
            found.most[l] = found.most[l].min(1.0).max(found.least[l]);
            found.likely[l] = (1.0 - clear[l]).clamp(found.least[l], found.most[l]);
        }
        found
    }

    /// Whether a sheet overlaps itself, as far as one point tells.
    fn overlaps_itself(
        &mut self,
        points: (&[DVec3; LANES], DVec3),
        y: [DVec3; 3],
        found: &Fractions,
    ) -> bool {
        let mut sheets = self.blockers.chunk_by(|a, b| a.sheet == b.sheet);
        if sheets.all(|sheet| sheet.len() < MAY_WIND) {
            return false;
        }
        let partly = |l: usize| found.most[l] * (1.0 - found.most[l]);
        let Some(l) = (0..LANES).max_by(|&k, &l| partly(k).total_cmp(&partly(l))) else {
            return false;
        };
        let slack = AGREE + found.most[l] - found.least[l];
        let hidden = self.subtracted(points, l, y);
        hidden.is_some_and(|hidden| (hidden - found.likely[l]).abs() > slack)
    }

    /// Finds what is hidden from the points where that is too uncertain, by subtraction.
    fn subtract(
        &mut self,
        points: (&[DVec3; LANES], DVec3),
        y: [DVec3; 3],
        (weights, allowed): (&[f64; LANES], f64),
        found: &mut Fractions,
    ) {
        let all: f64 = weights.iter().sum();
        let slack = ((NEARLY * allowed / all.max(f64::MIN_POSITIVE)) as f32).max(AGREE);
        self.blockers.sort_by(|a, b| b.hides.total_cmp(&a.hides).then(a.id.cmp(&b.id)));
        let unsure = |found: &Fractions, l: usize| found.most[l] - found.least[l] > slack;
        // Where it lies between the least and the most, as four points tell.
        let (mut sum, mut squares, mut count) = (0.0_f32, 0.0_f32, 0.0_f32);
        for l in OF_QUARTERS {
            if unsure(found, l)
                && let Some(hidden) = self.subtracted(points, l, y)
            {
                let way = (hidden - found.least[l]) / (found.most[l] - found.least[l]);
                let way = way.clamp(0.0, 1.0);
                (sum, squares, count) = (sum + way, squares + way * way, count + 1.0);
                found.set(l, hidden, 0.0);
            }
        }
        if count > 2.0 {
            let mean = sum / count;
            let deviation =
                ((squares / count - mean * mean).max(0.0) * count / (count - 1.0)).sqrt();
            let mut likely = found.clone();
            for l in (0..LANES).filter(|&l| unsure(found, l)) {
                let width = found.most[l] - found.least[l];
                likely.set(l, found.least[l] + mean * width, ALIKE * deviation.max(FEW) * width);
            }
            if uncertainty(&likely, weights) <= allowed {
                *found = likely;
            }
        }
        for l in 0..LANES {
            if unsure(found, l)
                && self.work < self.pair.work
                && let Some(hidden) = self.subtracted(points, l, y)
            {
                found.set(l, hidden, 0.0);
            }
        }
        self.blockers.sort_unstable_by_key(|c| (c.surface, c.sheet, c.id));
    }

    /// What is hidden from one of the points.
    fn subtracted(
        &mut self,
        (points, normal): (&[DVec3; LANES], DVec3),
        l: usize,
        y: [DVec3; 3],
    ) -> Option<f32> {
        let seen = || self.blockers.iter().filter(|c| c.seen >> l & 1 == 1);
        let count = seen().count();
        self.work += count * count / 2;
        let polygons = seen().map(ClippedBlocker::corners);
        let parts = &mut self.buffers.parts;
        union::hidden((points[l], normal), y, polygons, parts).map(|hidden| hidden as f32)
    }
}

fn middle(t: [DVec3; 3]) -> DVec3 {
    (t[0] + t[1] + t[2]) / 3.0
}

fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
}
