//! Shadow rays of pairs that matter little: one or a few each. Those of the pairs of a row share
//! packets of 16.
//!
//! The errors of single rays in different pairs are independent: over a row they average out. How
//! many rays a pair gets follows from its factor and the error asked for. The first few tell
//! whether the pair and its neighbours in the hierarchy are in doubt; only then the others are
//! traced.
//!
//! Points of the pairs of one row are stratified among each other: pair c has the c-th point of
//! Kronecker's four-dimensional sequence, shifted at random for each row, and further rays of the
//! same pair add Sobol's points to that.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use std::ops::Range;

use super::model::Model;
use super::pair::Visible;
use super::pieces::PieceId;
use super::places::Place;
use super::samples::{pair_seed, square_error, unseen};
use super::triangles::Triangles;
use crate::engines::sampling::{Random, on_triangle};
use crate::simd::{LANES, multiversion};
use crate::visibility::{Lanes, NOTHING, Packet};

/// Packets made and traced at a time.
const PACKETS: usize = 32;

/// The first rays are one in this many of those of a pair in doubt. The fewer they are, the more
/// often a group seems clear although one of its pairs is hidden, as at the foot of a blocker.
const PILOT: u32 = 3;

/// Pairs with at least so many rays fill packets of their own.
const SOME: u32 = 3 * LANES as u32;

/// Powers of the inverse of the root of x⁵ = x + 1, in units of 2⁻³²: the step of the sequence in
/// each dimension (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
const STEPS: [u32; 4] = [0xdb4f_0b91, 0xbbe0_5633, 0xa0f2_ec75, 0x89e1_8285];

const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_9;

/// A pair of a row whose visible fraction is sampled.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledPair {
    /// The second patch.
    pub column: Place,
    /// S in m² with nothing in the way.
    pub exchange: f64,
    /// Rays that it gets if it is in doubt.
    pub rays: u32,
    /// The kernel along its even and odd rays, and along those of them that nothing blocks.
    all: [f32; 2],
    clear: [f32; 2],
}

impl SampledPair {
    pub fn new(column: Place, exchange: f64, rays: u32) -> Self {
        Self { column, exchange, rays: in_packets(rays), all: [0.0; 2], clear: [0.0; 2] }
    }

    /// The visible fraction, and the square of its error if there are rays to tell.
    fn visible(&self) -> (f64, Option<f64>) {
        let (all, clear) = (self.all.map(f64::from), self.clear.map(f64::from));
        let sum = all[0] + all[1];
        let fraction = if sum > 0.0 { (clear[0] + clear[1]) / sum } else { 1.0 };
        (fraction, square_error(all, clear))
    }

    /// How many rays it has at least.
    fn traced(&self) -> f64 {
        f64::from(in_packets(self.rays.div_ceil(PILOT)))
    }

    fn sees(&self) -> bool {
        self.clear[0] + self.clear[1] > 0.0
    }

    fn is_blocked(&self) -> bool {
        self.clear[0] < self.all[0] || self.clear[1] < self.all[1]
    }
}

/// Many rays fill packets of their own.
fn in_packets(rays: u32) -> u32 {
    if rays < SOME { rays } else { rays.next_multiple_of(LANES as u32) }
}

/// Whether two pairs of a row are of one group: they are in doubt together, and packets hold rays
/// of one group alone, so that its results do not depend on what else is asked.
fn together(a: &SampledPair, b: &SampledPair) -> bool {
    a.column.group().contains(b.column)
}

/// Rays of the pairs of a row; reused.
#[derive(Debug, Default)]
pub(super) struct ShadowRays {
    pub pairs: Vec<SampledPair>,
    /// For each ray the pair (an index in `pairs`) and its number among those of the pair.
    rays: Vec<(u32, u32)>,
    /// The rays of each packet.
    runs: Vec<Range<usize>>,
    packets: Vec<Packet>,
    weights: Vec<Lanes>,
    blocked: Vec<u16>,
    /// Whether the two halves of the rays of a pair are of different packets: those of one begin on
    /// the same piece.
    by_packets: bool,
    /// Rays traced so far.
    pub count: u64,
}

/// Where the rays of a packet begin and end.
struct Ends {
    /// The piece that they begin on.
    from: PieceId,
    /// The second patch of each.
    column: [u32; LANES],
    /// The piece of it that it goes to.
    to: [PieceId; LANES],
    /// What is added to the pair's point.
    sample: [Lanes; 4],
}

/// The patch that rays begin on, and where its sequence begins.
struct Start {
    row: Place,
    seed: u32,
    shift: [u32; 4],
}

impl Start {
    fn new(row: Place, seed: u32) -> Self {
        let shift = Random::new(u64::from(seed) << 32 ^ u64::from(row.0))
            .numbers()
            .map(|x: f64| (x * 4_294_967_296.0) as u32);
        Self { row, seed, shift }
    }
}

impl ShadowRays {
    /// Traces rays from the patch at `row` to the second patches of `pairs`.
    pub fn trace(&mut self, model: &Model<'_>, row: Place, seed: u32) {
        let start = Start::new(row, seed);
        self.by_packets = !model.is_simple(row);
        for doubtful in [false, true] {
            self.choose(doubtful);
            self.cast(model, &start);
        }
    }

    /// Chooses the first rays of all pairs, or the others of those in doubt.
    fn choose(&mut self, doubtful: bool) {
        self.rays.clear();
        self.runs.clear();
        let mut k = 0;
        for near in self.pairs.chunk_by(together) {
            let from = self.rays.len();
            let any = |sees: fn(&SampledPair) -> bool| near.iter().any(sees);
            if !doubtful || any(SampledPair::sees) && any(SampledPair::is_blocked) {
                for (l, pair) in (k..).zip(near) {
                    let pilot = in_packets(pair.rays.div_ceil(PILOT));
                    let numbers = if doubtful { pilot..pair.rays } else { 0..pilot };
                    self.rays.extend(numbers.map(|n| (l, n)));
                }
            }
            k += near.len() as u32;
            let to = self.rays.len();
            self.runs.extend((from..to).step_by(LANES).map(|f| f..to.min(f + LANES)));
        }
    }

    /// Each pair with its visible fraction. The error of pairs with one ray is how much their group
    /// differs; where all rays of a group agree, one more might not.
    pub fn visible(&self) -> impl Iterator<Item = (&SampledPair, Visible)> {
        self.pairs.chunk_by(together).flat_map(|near| {
            let mean = near.iter().map(|a| a.visible().0).sum::<f64>() / near.len() as f64;
            let rays: f64 = near.iter().map(SampledPair::traced).sum();
            let agree = mean <= 0.0 || mean >= 1.0;
            near.iter().map(move |a| {
                let (fraction, error) = a.visible();
                // Rays of the group tell how likely it is, but not for which of its pairs.
                let least = if agree { unseen(rays) * rays / a.traced() } else { 0.0 };
                let square_error = error.unwrap_or(mean * (1.0 - mean)).max(least);
                (a, Visible { fraction, square_error })
            })
        })
    }

    fn cast(&mut self, model: &Model<'_>, start: &Start) {
        self.count += self.rays.len() as u64;
        for runs in self.runs.chunks(PACKETS) {
            let packets = runs.len();
            self.packets.resize(packets, Packet::EMPTY);
            self.weights.resize(packets, [0.0; LANES]);
            self.blocked.resize(packets, 0);
            for ((run, packet), weights) in
                runs.iter().zip(&mut self.packets).zip(&mut self.weights)
            {
                let ends = ends(&self.pairs, &self.rays[run.clone()], model, start);
                packet.own = [model.piece(ends.from).own.unwrap_or(NOTHING); LANES];
                aim(&model.shapes, start, &ends, packet, weights);
            }
            model.bvh.blocked(&self.packets, &mut self.blocked);
            for ((run, weights), &blocked) in runs.iter().zip(&self.weights).zip(&self.blocked) {
                for (l, &(k, n)) in self.rays[run.clone()].iter().enumerate() {
                    let pair = &mut self.pairs[k as usize];
                    let by_packets = self.by_packets && pair.rays >= SOME;
                    let half = if by_packets { n as usize / LANES } else { n as usize } & 1;
                    pair.all[half] += weights[l];
                    pair.clear[half] += if blocked >> l & 1 == 0 { weights[l] } else { 0.0 };
                }
            }
        }
    }
}

/// Where the rays of a packet begin and end.
fn ends(pairs: &[SampledPair], rays: &[(u32, u32)], model: &Model<'_>, start: &Start) -> Ends {
    // In patches of several pieces, each ray ends on a piece of its own; those of a packet begin on
    // the same one. Both follow the golden section, which spreads them evenly.
    let piece = |patch: Place, (k, n): (u32, u32), end: usize| {
        if model.is_simple(patch) {
            return model.piece_at(patch, 0.0);
        }
        let pair = pair_seed(start.seed, [start.row, pairs[k as usize].column]);
        let shift = Random::new(pair).numbers::<2>()[end];
        let number = if end == 0 { n / LANES as u32 } else { n };
        model.piece_at(patch, (shift + GOLDEN_SECTION * f64::from(number)).fract())
    };
    let mut ends = Ends {
        from: piece(start.row, rays[0], 0),
        column: [NOTHING; LANES],
        to: [PieceId(0); LANES],
        sample: [[0.0; LANES]; 4],
    };
    for (l, &(k, n)) in rays.iter().enumerate() {
        let column = pairs[k as usize].column;
        ends.column[l] = column.0;
        ends.to[l] = piece(column, (k, n), 1);
        let sample = &model.samples[n as usize % model.samples.len()];
        for d in 0..4 {
            ends.sample[d][l] = sample[d];
        }
    }
    ends
}

multiversion! {
    /// Makes rays from `start` to points of other patches, and the kernel along each, up to a
    /// factor of the pair.
    fn aim(
        shapes: &Triangles,
        start: &Start,
        ends: &Ends,
        packet: &mut Packet,
        weights: &mut Lanes,
    ) = aim_kernel
}

#[inline(always)]
fn aim_kernel(
    shapes: &Triangles,
    start: &Start,
    ends: &Ends,
    packet: &mut Packet,
    weights: &mut Lanes,
) {
    let mut to = [[[0.0; LANES]; 3]; 5];
    for l in 0..LANES {
        let at = ends.to[l].0 as usize;
        for axis in 0..3 {
            to[0][axis][l] = number(&shapes.corners[axis], at);
            to[1][axis][l] = number(&shapes.corners[3 + axis], at);
            to[2][axis][l] = number(&shapes.corners[6 + axis], at);
            to[3][axis][l] = number(&shapes.normal[axis], at);
            to[4][axis][l] = number(&shapes.centre[axis], at);
        }
    }
    let [a, b, c, n, m] = &to;
    let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (a, b, c);
    let ([nx, ny, nz], [mx, my, mz]) = (n, m);
    let from = ends.from.0 as usize;
    let [fx, fy, fz] = [0, 1, 2].map(|k| number(&shapes.corners[k], from));
    let [gx, gy, gz] = [3, 4, 5].map(|k| number(&shapes.corners[k], from));
    let [hx, hy, hz] = [6, 7, 8].map(|k| number(&shapes.corners[k], from));
    let [ux, uy, uz] = [0, 1, 2].map(|k| number(&shapes.normal[k], from));
    let [ox, oy, oz] = [0, 1, 2].map(|k| number(&shapes.centre[k], from));
    let [s0, s1, s2, s3] = &ends.sample;
    let Packet { origin: [px, py, pz], direction: [dx, dy, dz], far, .. } = packet;
    for l in 0..LANES {
        let column = ends.column[l];
        let u0 = turned(s0[l], start.shift[0], STEPS[0], column);
        let u1 = turned(s1[l], start.shift[1], STEPS[1], column);
        let u2 = turned(s2[l], start.shift[2], STEPS[2], column);
        let u3 = turned(s3[l], start.shift[3], STEPS[3], column);
        let (s, t) = on_triangle(u0, u1);
        let r = 1.0 - s - t;
        // Heights over the other's plane; a point behind it moves towards its triangle's highest
        // corner until it is in front of it.
        let e0 = nx[l] * (fx - mx[l]) + ny[l] * (fy - my[l]) + nz[l] * (fz - mz[l]);
        let e1 = nx[l] * (gx - mx[l]) + ny[l] * (gy - my[l]) + nz[l] * (gz - mz[l]);
        let e2 = nx[l] * (hx - mx[l]) + ny[l] * (hy - my[l]) + nz[l] * (hz - mz[l]);
        let (r, s, t) = lifted(e0, e1, e2, r, s, t);
        let height = r * e0 + s * e1 + t * e2;
        let (x, y, z) =
            (r * fx + s * gx + t * hx, r * fy + s * gy + t * hy, r * fz + s * gz + t * hz);
        let (s, t) = on_triangle(u2, u3);
        let r = 1.0 - s - t;
        let e0 = ux * (ax[l] - ox) + uy * (ay[l] - oy) + uz * (az[l] - oz);
        let e1 = ux * (bx[l] - ox) + uy * (by[l] - oy) + uz * (bz[l] - oz);
        let e2 = ux * (cx[l] - ox) + uy * (cy[l] - oy) + uz * (cz[l] - oz);
        let (r, s, t) = lifted(e0, e1, e2, r, s, t);
        let other = r * e0 + s * e1 + t * e2;
        let wx = r * ax[l] + s * bx[l] + t * cx[l] - x;
        let wy = r * ay[l] + s * by[l] + t * cy[l] - y;
        let wz = r * az[l] + s * bz[l] + t * cz[l] - z;
        let r2 = wx * wx + wy * wy + wz * wz;
        let traced = (column != NOTHING) & (r2 > 0.0) & (height > 0.0) & (other > 0.0);
        weights[l] = if traced { height * other / (r2 * r2) } else { 0.0 };
        far[l] = if traced { 1.0 } else { 0.0 };
        (px[l], py[l], pz[l]) = (x, y, z);
        (dx[l], dy[l], dz[l]) = (wx, wy, wz);
    }
}

#[inline(always)]
fn number(v: &[f32], at: usize) -> f32 {
    if at < v.len() { v[at] } else { 0.0 }
}

/// A sample shifted by the point of a pair, in 0..1.
#[inline(always)]
fn turned(sample: f32, shift: u32, step: u32, column: u32) -> f32 {
    let at = shift.wrapping_add(step.wrapping_mul(column));
    let u = sample + (at >> 8) as f32 * (1.0 / 16_777_216.0);
    if u < 1.0 { u } else { u - 1.0 }
}

/// Barycentric coordinates of a point, moved towards the highest corner if it is below the plane
/// that the corners have these heights over.
#[inline(always)]
fn lifted(h0: f32, h1: f32, h2: f32, r: f32, s: f32, t: f32) -> (f32, f32, f32) {
    let height = r * h0 + s * h1 + t * h2;
    let high = if h0 > h1 { h0 } else { h1 };
    let high = if high > h2 { high } else { h2 };
    let way = if height < 0.0 { -height / (high - height) } else { 0.0 };
    // To the plane, and a third of what is left.
    let way = if height < 0.0 { way + (1.0 - way) / 3.0 } else { 0.0 };
    let left = 1.0 - way;
    let (r, s, t) = (r * left, s * left, t * left);
    let (first, second) = (high == h0, (high == h1) & (high != h0));
    (
        if first { r + way } else { r },
        if second { s + way } else { s },
        if first | second { t } else { t + way },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::Patches;
    use crate::progress::Silent;
    use crate::scene::builtin;
    use crate::visibility::Bvh;

    #[test]
    fn another_seed_chooses_other_pieces_of_both_patches() {
        let g = builtin::build("paper-1").unwrap().geometry;
        let p = Patches::clustered(&g, 2.0, &[]).unwrap();
        let bvh = Bvh::new(&g);
        let model = Model::new(&g, &p, &bvh, 1e-3, &Silent).unwrap();
        let places = || (0..model.len() as u32).map(Place);
        let [row, column] = [0, 1].map(|k| places().filter(|&at| !model.is_simple(at)).nth(k));
        let [row, column] = [row, column].map(Option::unwrap);
        let pairs = [SampledPair::new(column, 1.0, LANES as u32)];
        let chosen = |seed: u32| -> Vec<[u32; 2]> {
            let rays = (0..LANES as u32).map(|n| [(0, n * LANES as u32)]);
            let ends = rays.map(|ray| ends(&pairs, &ray, &model, &Start::new(row, seed)));
            ends.map(|ends| [ends.from.0, ends.to[0].0]).collect()
        };
        let [first, second] = [0, 1].map(chosen);
        for end in 0..2 {
            assert!(first.iter().zip(&second).any(|(a, b)| a[end] != b[end]));
        }
        assert_eq!(first, chosen(0));
    }
}
