//! The visible fraction of one pair by shadow rays between stratified points of both polygons, each
//! weighted by its kernel; the more of them, the more the pair matters.

use super::model::Model;
use super::pair::{Pair, Part, Visible};
use super::points::{Area, point_by_angle};
use super::polygon::longest_edge;
use super::samples::{MOST_RAYS, square_error, unseen};
use crate::engines::sampling::Random;
use crate::simd::LANES;
use crate::visibility::Packet;

/// The error of this many stratified rays over the root of how much of a pair is seen and hidden:
/// (STRATIFIED / rays)^FALL.
const STRATIFIED: f64 = 0.5;
const FALL: f64 = 0.63;

/// The error of this many rays that all agree is this over their number.
const UNANIMOUS: f64 = 0.5;

/// The first rays of a pair, which tell how many it takes.
const LEAST_RAYS: usize = 64;

/// The first of few rays are one in this many.
const PILOT: usize = 3;

/// Keep their random numbers apart from each other and from those of single parts.
const FIRST: u64 = 0xb5ad_4ece_da1c_e2a9;
const SECOND: u64 = 0x5851_f42d_4c95_7f2d;

/// Rays of a pair; reused.
#[derive(Default)]
pub(super) struct RayBuffers {
    packets: Vec<Packet>,
    weights: Vec<f64>,
    blocked: Vec<u16>,
    /// Rays traced so far.
    pub count: u64,
}

/// Traces shadow rays, until the error is as small as it should be.
pub(super) fn visible_by_rays(
    pair: &Pair<'_>,
    model: &Model<'_>,
    buffers: &mut RayBuffers,
) -> Visible {
    let most = (STRATIFIED / pair.tolerance.max(1e-6)).powf(1.0 / FALL);
    let most = (most as usize).clamp(LANES, MOST_RAYS) / LANES * LANES;
    let mut rays = most.min(LEAST_RAYS);
    loop {
        let [(a, p), (b, q)] = trace(pair, model, rays, buffers);
        if a + b <= 0.0 {
            return Visible::ALL;
        }
        let fraction = (p + q) / (a + b);
        // Where all rays agree, one more might not.
        let unseen = UNANIMOUS / rays as f64;
        let unanimous = fraction <= 0.0 || fraction >= 1.0;
        if rays >= most || unanimous && unseen <= pair.tolerance {
            let by_halves = square_error([a, b], [p, q]).unwrap_or(1.0);
            let least = if unanimous { unseen * unseen } else { 0.0 };
            return Visible { fraction, square_error: by_halves.max(least) };
        }
        rays = (4 * rays).min(most);
    }
}

/// The visible fraction of a pair of such parts by about `rays` rays, shared out among them by what
/// they exchange; by a third of them if these all agree.
pub(super) fn visible_by_few_rays<'a>(
    parts: &[Part],
    pair: impl Fn(&Part) -> Pair<'a>,
    model: &Model<'_>,
    rays: u32,
    buffers: &mut RayBuffers,
) -> Visible {
    let packets = (rays as usize).div_ceil(LANES);
    let first = packets.div_ceil(PILOT);
    let mut halves = Halves::default();
    for (seed, packets) in [(FIRST, first), (SECOND, packets - first)] {
        share(parts, packets, seed, &pair, model, buffers, &mut halves);
        if halves.agree() {
            break;
        }
    }
    halves.visible()
}

/// What two halves of the rays of a pair found.
#[derive(Default)]
struct Halves {
    all: [f64; 2],
    clear: [f64; 2],
    packets: usize,
}

impl Halves {
    /// Takes in what so many packets found of one part: the kernel of their even and odd rays, and
    /// of those of them that nothing blocks.
    fn add(&mut self, packets: usize, [(a, p), (b, q)]: [(f64, f64); 2]) {
        let (weight, mean) = (packets as f64, (p + q) / (a + b));
        if packets == 1 {
            // Packets of different parts differ by more than rays of one.
            let half = self.packets & 1;
            self.all[half] += weight;
            self.clear[half] += weight * mean;
        } else {
            for (half, (all, clear)) in [(a, p), (b, q)].into_iter().enumerate() {
                self.all[half] += 0.5 * weight;
                self.clear[half] += 0.5 * weight * if all > 0.0 { clear / all } else { mean };
            }
        }
        self.packets += packets;
    }

    fn fraction(&self) -> f64 {
        ((self.clear[0] + self.clear[1]) / (self.all[0] + self.all[1])).clamp(0.0, 1.0)
    }

    fn agree(&self) -> bool {
        self.packets > 0 && (self.fraction() <= 0.0 || self.fraction() >= 1.0)
    }

    fn visible(&self) -> Visible {
        if self.packets == 0 {
            return Visible::ALL;
        }
        let fraction = self.fraction();
        let by_halves = square_error(self.all, self.clear);
        let least = if self.agree() { unseen((self.packets * LANES) as f64) } else { 0.0 };
        let square_error = by_halves.unwrap_or(fraction * (1.0 - fraction)).max(least);
        Visible { fraction, square_error }
    }
}

/// Shares so many packets out among parts, and traces them.
fn share<'a>(
    parts: &[Part],
    packets: usize,
    seed: u64,
    pair: impl Fn(&Part) -> Pair<'a>,
    model: &Model<'_>,
    buffers: &mut RayBuffers,
    halves: &mut Halves,
) {
    let (Some(first), true) = (parts.first(), packets > 0) else { return };
    let all: f64 = parts.iter().map(|part| part.exchange).sum();
    let step = all / packets as f64;
    let [start] = Random::new(pair(first).seed ^ seed).numbers::<1>();
    let mut left = start * step;
    for part in parts {
        left -= part.exchange;
        let here = (-left / step).ceil().max(0.0);
        left += here * step;
        let here = here as usize;
        if here > 0 {
            let mut pair = pair(part);
            pair.seed ^= seed;
            let found = trace(&pair, model, (here * LANES).min(MOST_RAYS), buffers);
            if found[0].0 + found[1].0 > 0.0 {
                halves.add(here, found);
            }
        }
    }
}

/// The kernel between `count` pairs of points, of all and of those that see each other: that of
/// the even ones, and of the odd ones.
pub(super) fn trace(
    pair: &Pair<'_>,
    model: &Model<'_>,
    count: usize,
    buffers: &mut RayBuffers,
) -> [(f64, f64); 2] {
    let RayBuffers { packets, weights, blocked, .. } = buffers;
    packets.clear();
    packets.resize(count / LANES, Packet::EMPTY);
    weights.clear();
    weights.resize(count, 0.0);
    let shift: [f64; 4] = Random::new(pair.seed).numbers();
    // Rays begin on the smaller one, from where the other appears much alike.
    let from = usize::from(pair.polygons[0].area() > pair.polygons[1].area());
    let (p, q, own) = (&pair.polygons[from], &pair.polygons[1 - from], pair.pieces[from].own);
    let touches = p.centre().distance(q.centre()) < q.fan().map(longest_edge).fold(0.0, f64::max);
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
    buffers.count += count as u64;
    let mut halves = [(0.0, 0.0); 2];
    for (k, &weight) in buffers.weights.iter().enumerate() {
        let (all, clear) = &mut halves[k & 1];
        *all += weight;
        *clear += if buffers.blocked[k / LANES] >> (k % LANES) & 1 == 0 { weight } else { 0.0 };
    }
    halves
}
