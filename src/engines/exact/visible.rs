//! The visible share of a pair, weighted by the kernel:
//!
//! ```text
//! v = ∫∫ K V dA dA / ∫∫ K dA dA
//! ```
//!
//! Where no two blockers overlap, as seen from 16 points of one polygon, the share of the other that
//! is hidden from each has a closed form ([`cover`]); where these differ, more points are asked.
//! Otherwise shadow rays are traced between
//! stratified pairs of points, each weighted by its K; the more of them, the more the pair matters.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::blockers::{Blocker, NONE};
use super::cover::{Drawn, Hidden, MOST, Target, aim, cover};
use super::model::{Model, Piece};
use super::points::{Area, point_by_angle};
use super::samples::{MOST_RAYS, square_error};
use super::unoccluded::Polygon;
use crate::engines::sampling::Random;
use crate::visibility::{LANES, Packet};

/// A pair with more blockers is left to rays.
const MANY: usize = 24;

/// If it is open which share of a pair's weight overlapping blockers hide, beyond this, the far
/// triangle is split, and at last rays tell.
const OVERLAP: f64 = 0.02;

/// A triangle is small against its distance from another below this ratio of its longest edge to
/// it: the kernel is then nearly linear over it.
const SMALL: f64 = 0.4;

/// So often a triangle is split at most to be small.
const SPLITS: u32 = 2;

/// Points that differ by more than this in what they see, times their weight and the effort, are
/// replaced by those of the triangle's quarters; so often at most, and the far triangle so often.
const SPREAD: f64 = 0.2;
const FINER: u32 = 6;
const CLEARER: u32 = 4;

/// Shadow rays of a pair of the mean factor that is all in doubt, and of any pair.
const RAYS: f64 = 192.0;
const LEAST_RAYS: usize = 16;

/// Work on a pair; reused.
pub(super) struct Room {
    cuts: Vec<Cut>,
    target: Target,
    drawn: Drawn,
    clipped: [Vec<DVec3>; 2],
    polygon: Vec<Vec3>,
    packets: Vec<Packet>,
    weights: Vec<f64>,
    blocked: Vec<u16>,
    /// Shadow rays traced so far.
    pub rays: u64,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            cuts: Vec::new(),
            target: Target::EMPTY,
            drawn: Drawn::EMPTY,
            clipped: Default::default(),
            polygon: Vec::new(),
            packets: Vec::new(),
            weights: Vec::new(),
            blocked: Vec::new(),
            rays: 0,
        }
    }
}

/// The part of a blocker that lies in front of both polygons.
#[derive(Debug, Clone)]
struct Cut {
    corners: [DVec3; MOST],
    len: usize,
    normal: DVec3,
    /// Blockers of one group never overlap.
    group: u32,
    /// Whether only what enters by the front counts.
    one_sided: bool,
    /// How much it has been found to hide.
    hides: f64,
}

/// What hides a pair, and how sure that is.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// Weight of all lanes.
    all: f64,
    /// Of it what is hidden, if overlapping blockers do so independently of each other.
    hidden: f64,
    /// Range of it, if not.
    least: f64,
    most: f64,
    /// Sum of the squares of hidden shares.
    squares: f64,
    /// Points that looked. They are spread evenly: their mean errs by about half of what they differ
    /// by, over their number.
    points: u32,
}

impl Seen {
    fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.hidden += other.hidden;
        self.least += other.least;
        self.most += other.most;
        self.squares += other.squares;
        self.points += other.points;
    }

    /// How much is open about the hidden share.
    fn gap(&self) -> f64 {
        (self.most - self.least) / self.all.max(f64::MIN_POSITIVE)
    }

    /// Standard deviation of the hidden share from point to point.
    fn spread(&self) -> f64 {
        let mean = self.hidden / self.all.max(f64::MIN_POSITIVE);
        (self.squares / self.all.max(f64::MIN_POSITIVE) - mean * mean).max(0.0).sqrt()
    }
}

impl Cut {
    /// Distance of a point from the nearest corner or middle of an edge.
    fn distance(&self, p: DVec3) -> f64 {
        let corners = &self.corners[..self.len];
        let edges = (0..self.len).map(|k| 0.5 * (corners[k] + corners[(k + 1) % self.len]));
        let points = corners.iter().copied().chain(edges);
        points.map(|c| c.distance_squared(p)).fold(f64::INFINITY, f64::min).sqrt()
    }
}

/// A pair of pieces in front of each other, and what is known of it.
pub(super) struct Pair<'a> {
    pub pieces: [&'a Piece; 2],
    pub polygons: [Polygon; 2],
    /// Blockers that may lie between; `None` for too many.
    pub blockers: Option<&'a [u32]>,
    /// How much finer than usual the pair is to be sampled.
    pub effort: f64,
    /// S of the pieces with nothing in the way, m².
    pub exchange: f64,
    pub seed: u64,
}

/// Points of a triangle: the centroids of its 16 parts.
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

/// What is seen of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Visible {
    /// Share of the exchange, 0..1.
    pub share: f64,
    /// Square of its error, as far as the points and rays that it comes from tell.
    pub error: f64,
}

impl Visible {
    pub const ALL: Self = Self { share: 1.0, error: 0.0 };
}

impl Pair<'_> {
    /// The visible share.
    pub fn visible(&self, model: &Model<'_>, room: &mut Room) -> Visible {
        room.cuts.clear();
        let Some(blockers) = self.blockers else { return self.by_rays(1.0, model, room) };
        for &b in blockers {
            if let Some(cut) =
                self.cut(&model.blockers.polygons[b as usize], b, model, &mut room.clipped)
            {
                room.cuts.push(cut);
            }
        }
        match room.cuts.len() {
            0 => return Visible::ALL,
            1..=MANY => {}
            _ => return self.by_rays(1.0, model, room),
        }
        room.cuts.sort_by_key(|c| c.group);
        let seen = self.by_cover(room);
        if !seen.all.is_finite() {
            return self.by_rays(1.0, model, room);
        }
        if seen.all <= 0.0 {
            return Visible::ALL;
        }
        if seen.gap() > OVERLAP {
            let (least, most) = (1.0 - seen.most / seen.all, 1.0 - seen.least / seen.all);
            let by_rays = self.by_rays(seen.gap(), model, room);
            let share = by_rays.share.clamp(least.clamp(0.0, 1.0), most.clamp(0.0, 1.0));
            return Visible { share, ..by_rays };
        }
        let share = (1.0 - seen.hidden / seen.all).clamp(0.0, 1.0);
        Visible { share, error: (0.5 * seen.spread() / f64::from(seen.points)).powi(2) }
    }

    /// What of a blocker lies between the polygons, if anything may.
    fn cut(
        &self,
        q: &Blocker,
        number: u32,
        model: &Model<'_>,
        clipped: &mut [Vec<DVec3>; 2],
    ) -> Option<Cut> {
        let touching = model.touching;
        let [a, b] = self.polygons.each_ref().map(|p| {
            p.corners()
                .iter()
                .map(|&c| q.height(c))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        });
        let one_sided = q.body != NONE && !self.pieces[0].inside.contains(&q.body);
        if a.0.min(b.0) >= -touching
            || a.1.max(b.1) <= touching
            || one_sided && (a.1 <= touching || b.0 >= -touching)
        {
            return None;
        }
        let [first, second] = clipped;
        before(&q.corners, &self.polygons[0], touching, first);
        before(first, &self.polygons[1], touching, second);
        if second.len() < 3 || second.len() > MOST {
            return None;
        }
        let mut corners = [DVec3::ZERO; MOST];
        corners[..second.len()].copy_from_slice(second);
        let group = if one_sided { q.body } else { model.blockers.bodies.len() as u32 + number };
        Some(Cut { corners, len: second.len(), normal: q.normal, group, one_sided, hides: 0.0 })
    }

    /// What points of one polygon see of the other. They lie on the one that is farther from what hides
    /// the other: its shadow moves least. Where they see very differently, more of them are asked.
    fn by_cover(&self, room: &mut Room) -> Seen {
        let [a, b] = self.polygons.each_ref().map(Polygon::centre);
        let way = |room: &Room, weight: &dyn Fn(&Cut) -> f64| {
            let nearer = |c: &Cut| weight(c) * (c.distance(b) - c.distance(a));
            if room.cuts.iter().map(nearer).sum::<f64>() <= 0.0 { (0, 1) } else { (1, 0) }
        };
        let guess = way(room, &|_| 1.0);
        let seen = self.view(guess, 0, room);
        let best = if seen.hidden > 0.0 { way(room, &|c| c.hides) } else { guess };
        let clear = seen.gap() <= OVERLAP && self.effort * seen.spread() <= SPREAD;
        match best == guess && clear {
            true => seen,
            false => self.view(best, FINER, room),
        }
    }

    /// What points of polygon `from` see of polygon `to`, where that differs split up to `finer` times.
    fn view(&self, (from, to): (usize, usize), finer: u32, room: &mut Room) -> Seen {
        let mut seen = Seen::default();
        for x in self.polygons[from].fan() {
            for y in self.polygons[to].fan() {
                self.look(x, y, (from, to), (SPLITS, finer), room, &mut seen);
            }
        }
        seen
    }

    /// Adds what points of `x` see of `y`. First `x` is split until it is small. Then it is where its
    /// points see differently, and `y` where blockers overlap, both by their weight in all the pair.
    fn look(
        &self,
        x: [DVec3; 3],
        y: [DVec3; 3],
        (from, to): (usize, usize),
        (splits, finer): (u32, u32),
        room: &mut Room,
        seen: &mut Seen,
    ) {
        let small = SMALL * middle(x).distance(middle(y));
        if splits > 0 && longest(x) > 2.0 * small {
            for x in quarters(x) {
                self.look(x, y, (from, to), (splits - 1, finer), room, seen);
            }
            return;
        }
        room.target.closely = longest(y) > small;
        let local = self.lanes(x, y, (from, to), room);
        let weight = local.all / (PI * self.exchange);
        if finer > 0 && self.effort * weight * local.spread() > SPREAD {
            for x in quarters(x) {
                self.look(x, y, (from, to), (0, finer - 1), room, seen);
            }
        } else if finer > FINER - CLEARER && weight * local.gap() > OVERLAP {
            for y in quarters(y) {
                self.look(x, y, (from, to), (0, finer - 1), room, seen);
            }
        } else {
            seen.add(&local);
        }
    }

    /// What 16 points of `x` see of `y`.
    fn lanes(
        &self,
        x: [DVec3; 3],
        y: [DVec3; 3],
        (from, to): (usize, usize),
        room: &mut Room,
    ) -> Seen {
        let Room { cuts, target, drawn, polygon, .. } = room;
        let origin = middle(y);
        target.corners = y.map(|c| (c - origin).as_vec3());
        let x = x.map(|c| (c - origin).as_vec3());
        for (l, p) in POINTS.iter().enumerate() {
            let at = x[0] * p[0] as f32 + x[1] * p[1] as f32 + x[2] * p[2] as f32;
            for axis in 0..3 {
                target.from[axis][l] = at[axis];
            }
        }
        let [near, far] = [from, to].map(|k| self.polygons[k].normal.as_vec3());
        aim(target, near, far);
        let (mut clear, mut most, mut sum) = ([1.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
        let share = area_of(x);
        for group in cuts.chunk_by_mut(|a, b| a.group == b.group) {
            let mut hidden = Hidden([0.0; LANES]);
            let mut before = 0.0_f32;
            for cut in group {
                polygon.clear();
                polygon.extend(cut.corners[..cut.len].iter().map(|&c| (c - origin).as_vec3()));
                let sense = match (cut.one_sided, from) {
                    (false, _) => 0.0,
                    (true, 0) => 1.0,
                    (true, _) => -1.0,
                };
                cover(target, polygon, cut.normal.as_vec3(), sense, drawn, &mut hidden);
                let after: f32 = hidden.0.iter().zip(&target.weight).map(|(h, w)| h * w).sum();
                cut.hides += f64::from(after - before) * share;
                before = after;
            }
            for l in 0..LANES {
                let h = hidden.0[l].min(1.0);
                clear[l] *= 1.0 - h;
                most[l] = most[l].max(h);
                sum[l] += h;
            }
        }
        let mut seen = Seen { points: LANES as u32, ..Seen::default() };
        for l in 0..LANES {
            let weight = f64::from(target.weight[l]) * share;
            seen.all += weight;
            let hidden = f64::from(1.0 - clear[l]);
            seen.hidden += weight * hidden;
            seen.squares += weight * hidden * hidden;
            seen.least += weight * f64::from(most[l]);
            seen.most += weight * f64::from(sum[l].min(1.0));
        }
        seen
    }

    /// Asks shadow rays; the more, the larger the share of the pair is that is in doubt.
    fn by_rays(&self, doubt: f64, model: &Model<'_>, room: &mut Room) -> Visible {
        let rays = (RAYS * self.effort * doubt) as usize;
        let rays = rays.clamp(LEAST_RAYS, MOST_RAYS) / LANES * LANES;
        let [(a, p), (b, q)] = self.trace(model, rays, room);
        if a + b <= 0.0 {
            return Visible::ALL;
        }
        let error = square_error([a, b], [p, q]).unwrap_or(1.0);
        Visible { share: (p + q) / (a + b), error }
    }

    /// The kernel between `count` pairs of points, of all and of those that see each other: that of
    /// the even ones, and of the odd ones.
    fn trace(&self, model: &Model<'_>, count: usize, room: &mut Room) -> [(f64, f64); 2] {
        let Room { packets, weights, blocked, .. } = room;
        packets.clear();
        packets.resize(count / LANES, Packet::EMPTY);
        weights.clear();
        weights.resize(count, 0.0);
        let shift: [f64; 4] = Random::new(self.seed).numbers();
        // Rays begin on the smaller one, from where the other appears much alike.
        let from = usize::from(self.polygons[0].area() > self.polygons[1].area());
        let (p, q, own) = (&self.polygons[from], &self.polygons[1 - from], self.pieces[from].own);
        let touches = p.centre().distance(q.centre()) < q.fan().map(longest).fold(0.0, f64::max);
        let (from, to) = (Area::new(p), Area::new(q));
        for (k, s) in model.samples[..count].iter().enumerate() {
            let u: [f64; 4] = std::array::from_fn(|d| {
                let x = f64::from(s[d]) + shift[d];
                if x < 1.0 { x } else { x - 1.0 }
            });
            let x = from.point(u[0], u[1]);
            // Either what is left of the kernel over directions spread evenly over the solid angle, or
            // all of it over points spread evenly over the area.
            let by_angle = if touches { point_by_angle(q, x, u[2], u[3]) } else { None };
            let (y, weight) = match by_angle {
                Some((y, angle)) => (y, angle * p.normal.dot((y - x).normalize_or_zero())),
                None => {
                    let y = to.point(u[2], u[3]);
                    let (r, r2) = (y - x, (y - x).length_squared());
                    let cosines = p.normal.dot(r).max(0.0) * (-q.normal.dot(r)).max(0.0);
                    (y, to.area * cosines / (r2 * r2))
                }
            };
            if weight > 0.0 {
                weights[k] = weight;
                let start = model.bvh.local(x);
                let way = model.bvh.local(y) - start;
                packets[k / LANES].set(k % LANES, start, way, 1.0, own);
            }
        }
        blocked.clear();
        blocked.resize(count / LANES, 0);
        model.bvh.blocked(packets, blocked);
        room.rays += count as u64;
        let mut halves = [(0.0, 0.0); 2];
        for (k, &weight) in room.weights.iter().enumerate() {
            let (all, clear) = &mut halves[k & 1];
            *all += weight;
            *clear += if room.blocked[k / LANES] >> (k % LANES) & 1 == 0 { weight } else { 0.0 };
        }
        halves
    }
}

/// The part of a polygon more than `touching` in front of another's plane, or all of it if none of it
/// lies behind.
fn before(corners: &[DVec3], of: &Polygon, touching: f64, part: &mut Vec<DVec3>) {
    part.clear();
    let height = |v: DVec3| of.normal.dot(v - of.corners()[0]);
    if corners.iter().all(|&c| height(c) <= touching) {
        return;
    }
    let Some(&last) = corners.last() else { return };
    let mut from = last;
    for &to in corners {
        let (h0, h1) = (height(from), height(to));
        if (h0 < 0.0) != (h1 < 0.0) {
            part.push(from + (to - from) * (h0 / (h0 - h1)));
        }
        if h1 >= 0.0 {
            part.push(to);
        }
        from = to;
    }
}

fn middle(t: [DVec3; 3]) -> DVec3 {
    (t[0] + t[1] + t[2]) / 3.0
}

fn longest([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

fn area_of([a, b, c]: [Vec3; 3]) -> f64 {
    f64::from(0.5 * (b - a).cross(c - a).length())
}

fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
}
