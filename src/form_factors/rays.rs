//! Sampled rows: rays from all over a patch, so that a row is a mean over it and not the view from
//! its centre.
//!
//! A form factor is the mean of what a patch's points see, weighted by the cosine: rays that begin
//! anywhere on the patch, uniformly in area, and go anywhere with a density proportional to the
//! cosine, all have the same weight (Malley's method: a uniform disk lifted to the hemisphere). A row
//! is a list of what they hit.
//!
//! Points of the area and directions come from a Sobol' sequence in four dimensions, scrambled
//! as Owen (1995) does, which fills them evenly: the error falls nearly as 1/N instead of 1/√N. The
//! sequence is made once, in two halves that know nothing of each other, and sorted so that
//! neighbours in it go nearly alike; each patch shifts it on the torus (Cranley & Patterson 1976) by
//! numbers of its own.

use std::sync::{Mutex, PoisonError};

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::lookup::{Lookups, environment, index_in_grid};
use super::rows::{Engine, EngineError, Row, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;
use crate::visibility::{Bvh, Frame, Hits, LANES, NOTHING, Packet, multiversion};

/// How rows are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RaysOptions {
    /// Rays a row, 32 to [`MOST_SAMPLES`], rounded up to a multiple of 32. Powers of two fill best.
    /// Default 1,024.
    pub samples: usize,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

/// Most rays a row.
pub const MOST_SAMPLES: usize = 1 << 16;

impl Default for RaysOptions {
    fn default() -> Self {
        Self { samples: 1024, seed: 0 }
    }
}

/// The engine of sampled rows.
pub struct Rays<'a> {
    geometry: &'a Geometry,
    patches: &'a Patches,
    bvh: &'a Bvh,
    lookups: Lookups<'a>,
    halves: [Vec<Block>; 2],
    seed: u32,
    scratch: Mutex<Vec<Scratch>>,
}

/// Samples of rays before they are shifted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    /// Where on the patch, in the unit square.
    area: [[f32; LANES]; 2],
    /// Square of the sine from the normal.
    slope: [f32; LANES],
    /// Cosine and sine about the normal.
    turn: [[f32; LANES]; 2],
}

#[derive(Default)]
struct Scratch {
    packets: Vec<Packet>,
    hits: Vec<Hits>,
    /// Where each ray ends: a patch, or a place behind the patches.
    places: Vec<u32>,
}

/// What one row adds to its samples: everything uniform in 0..1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shift {
    area: [f32; 2],
    slope: f32,
    /// Cosine and sine of the turn about the normal.
    turn: [f32; 2],
}

impl<'a> Rays<'a> {
    /// An engine for these patches; `bvh` is of the same geometry.
    #[must_use]
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        options: RaysOptions,
    ) -> Self {
        let rays = options.samples.clamp(32, MOST_SAMPLES).next_multiple_of(2 * LANES);
        let halves = [0, 1].map(|half| blocks(rays / 2, 2 * options.seed + half));
        let lookups = Lookups::new(bvh.ids(), patches);
        let scratch = Mutex::new(Vec::new());
        Self { geometry, patches, bvh, lookups, halves, seed: options.seed, scratch }
    }

    /// Rays a row.
    #[must_use]
    pub fn samples(&self) -> usize {
        2 * LANES * self.halves[0].len()
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        let mut scratch = self.locked().pop().unwrap_or_default();
        make_row(self, id, &mut scratch, row);
        self.locked().push(scratch);
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Vec<Scratch>> {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A ray from a cut patch or a cluster, one by one: it begins where the patch is.
    fn place_one(&self, id: PatchId, area: DVec2, local: Vec3) -> (Vec3, Vec3, Option<u32>) {
        let p = self.patches.sample_own(id, area);
        let frame =
            Frame::on_surface(p.position(self.geometry), self.geometry.normal(p.triangle, p.side));
        let [t, u, n] = frame.axes.map(|a| a.as_vec3());
        let direction = t * local.x + u * local.y + n * local.z;
        (self.bvh.local(frame.origin), direction, self.bvh.solid(p.triangle))
    }
}

impl Engine for Rays<'_> {
    fn name(&self) -> &'static str {
        "rays"
    }

    fn bytes(&self, rows: usize) -> u64 {
        let threads = rows.min(rayon::current_num_threads()) as u64;
        let packets = 2 * self.halves[0].len() * (size_of::<Packet>() + size_of::<Hits>());
        threads * packets as u64 + self.bvh.bytes()
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        let me = &*self;
        rows.par_iter().zip(out).for_each(|(&id, row)| me.row(id, row));
        Ok(())
    }
}

/// `rays` samples of a sequence of their own, in the order of their directions.
pub(crate) fn blocks(rays: usize, seed: u32) -> Vec<Block> {
    let mut samples: Vec<[f32; 4]> =
        (0..rays as u32).map(|i| sobol_burley::sample_4d(i, 0, seed)).collect();
    let code = |s: &[f32; 4]| morton(s[2]) | morton(s[3]) << 1;
    samples.sort_by_key(code);
    samples
        .chunks_exact(LANES)
        .map(|samples| {
            let lanes = |of: &dyn Fn(&[f32; 4]) -> f32| std::array::from_fn(|l| of(&samples[l]));
            let angle = |s: &[f32; 4]| std::f32::consts::TAU * s[3];
            Block {
                area: [lanes(&|s| s[0]), lanes(&|s| s[1])],
                slope: lanes(&|s| s[2]),
                turn: [lanes(&|s| angle(s).cos()), lanes(&|s| angle(s).sin())],
            }
        })
        .collect()
}

/// The bits of a number of 0..1, one place apart.
fn morton(x: f32) -> u32 {
    let mut x = (x * 65_536.0) as u32 & 0xffff;
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        x = (x | x << shift) & mask;
    }
    x
}

/// The shift of one set of rays; other seeds give others.
pub(crate) fn shift(seed: u64) -> Shift {
    // SplitMix64 (Steele, Lea & Flood 2014).
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1_u32 << 24) as f32
    };
    let (area, slope, angle) = ([next(), next()], next(), std::f32::consts::TAU * next());
    Shift { area, slope, turn: [angle.cos(), angle.sin()] }
}

multiversion! {
    pub(crate) fn aim(
        blocks: &[Block],
        shift: Shift,
        origin: [Vec3; 3],
        axes: [Vec3; 3],
        own: u32,
        packets: &mut [Packet],
    ) = aim_kernel
}

/// `x` less 1 where it is 1 or more, for x of 0..2.
#[inline(always)]
fn wrap(x: f32) -> f32 {
    if x >= 1.0 { x - 1.0 } else { x }
}

/// Rays from the triangle `origin` (a corner and two edges) into the hemisphere about the third of
/// `axes`.
#[inline(always)]
fn aim_kernel(
    blocks: &[Block],
    shift: Shift,
    [corner, b, c]: [Vec3; 3],
    [t, u, n]: [Vec3; 3],
    own: u32,
    packets: &mut [Packet],
) {
    for (block, packet) in blocks.iter().zip(packets) {
        let (mut p, mut q) = ([0.0; LANES], [0.0; LANES]);
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            (p[l], q[l]) = on_triangle(
                wrap(block.area[0][l] + shift.area[0]),
                wrap(block.area[1][l] + shift.area[1]),
            );
            [x[l], y[l], z[l]] = direction(block, shift, l);
        }
        for axis in 0..3 {
            let (from, to) = (&mut packet.origin[axis], &mut packet.direction[axis]);
            for l in 0..LANES {
                from[l] = corner[axis] + b[axis] * p[l] + c[axis] * q[l];
                to[l] = t[axis] * x[l] + u[axis] * y[l] + n[axis] * z[l];
            }
        }
        packet.far = [f32::INFINITY; LANES];
        packet.own = [own; LANES];
    }
}

/// Barycentric coordinates of two corners, uniform over the triangle (Heitz 2019, "A low-distortion
/// map between triangle and square").
#[inline(always)]
fn on_triangle(u: f32, v: f32) -> (f32, f32) {
    let (half_u, half_v) = (0.5 * u, 0.5 * v);
    if v > u { (half_u, v - half_u) } else { (u - half_v, half_v) }
}

/// Direction of one ray about the third axis, with a density proportional to the cosine.
#[inline(always)]
fn direction(block: &Block, shift: Shift, l: usize) -> [f32; 3] {
    let sin2 = wrap(block.slope[l] + shift.slope);
    let sin = sin2.sqrt();
    let [c, s] = [block.turn[0][l], block.turn[1][l]];
    let x = c * shift.turn[0] - s * shift.turn[1];
    let y = s * shift.turn[0] + c * shift.turn[1];
    [sin * x, sin * y, (1.0 - sin2).max(1e-7).sqrt()]
}

/// Makes one row.
fn make_row(engine: &Rays<'_>, id: PatchId, scratch: &mut Scratch, row: &mut Row) {
    let rays = engine.samples();
    scratch.packets.resize(rays / LANES, Packet::EMPTY);
    scratch.hits.resize(rays / LANES, Hits::NONE);
    let cell = engine.patches.cell(id);
    let one_by_one = engine.patches.is_cluster(id) || engine.patches.is_parted(id);
    let frame = Frame::on_surface(
        engine.patches.center(id).position(engine.geometry),
        engine.geometry.normal(cell.triangle, cell.side),
    );
    let axes = frame.axes.map(|a| a.as_vec3());
    let [a, b, c] = cell.corners(engine.geometry);
    let scale = engine.bvh.scale();
    let origin = [engine.bvh.local(a), ((b - a) / scale).as_vec3(), ((c - a) / scale).as_vec3()];
    let own = engine.bvh.solid(cell.triangle).unwrap_or(NOTHING);
    row.columns.clear();
    row.columns.reserve(rays);
    let (mut escaped, mut behind) = (0_u32, 0_u32);
    for (half, blocks) in engine.halves.iter().enumerate() {
        let seed = engine.seed.wrapping_mul(2).wrapping_add(half as u32);
        let shift = shift(u64::from(id.0) << 32 | u64::from(seed));
        let packets = &mut scratch.packets[..blocks.len()];
        if one_by_one {
            for (block, packet) in blocks.iter().zip(packets.iter_mut()) {
                for l in 0..LANES {
                    let area = DVec2::new(
                        wrap(block.area[0][l] + shift.area[0]).into(),
                        wrap(block.area[1][l] + shift.area[1]).into(),
                    );
                    let local = Vec3::from_array(direction(block, shift, l));
                    let (from, to, own) = engine.place_one(id, area, local);
                    packet.set(l, from, to, f32::INFINITY, own);
                }
            }
        } else {
            aim(blocks, shift, origin, axes, own, packets);
        }
        let hits = &mut scratch.hits[..blocks.len()];
        engine.bvh.closest(packets, hits);
        scratch.places.resize(rays / 2, 0);
        find(&engine.lookups, hits, &mut scratch.places);
        let escape = environment(engine.patches.len());
        for &place in &scratch.places {
            if place < escape {
                row.columns.push(place);
            } else if place == escape {
                escaped += 1;
            } else {
                behind += 1;
            }
        }
        if half == 0 {
            row.half = row.columns.len();
        }
    }
    row.weights = Weights::Equal { entries: row.columns.len(), rays: rays as u32 };
    row.environment = f64::from(escaped) / rays as f64;
    row.back = f64::from(behind) / rays as f64;
    row.lost = 0.0;
}

multiversion! {
    fn find(lookups: &Lookups<'_>, hits: &[Hits], places: &mut [u32]) = find_kernel
}

/// Where rays end: patches, then what escapes, then backs.
#[inline(always)]
fn find_kernel(lookups: &Lookups<'_>, hits: &[Hits], places: &mut [u32]) {
    let finest = lookups.finest;
    for (hits, places) in hits.iter().zip(places.as_chunks_mut::<LANES>().0) {
        let (mut first, mut strips) = ([environment(finest.len()); LANES], [0.0; LANES]);
        let mut cut = false;
        for l in 0..LANES {
            if hits.item[l] != NOTHING {
                let lookup = lookups.of(hits.item[l]);
                (first[l], strips[l]) = (lookup.first, lookup.strips);
                cut |= lookup.cut;
            }
        }
        for l in 0..LANES {
            let index = index_in_grid(
                strips[l].max(1.0),
                (1.0 - hits.u[l] - hits.v[l]).max(0.0),
                hits.u[l],
                hits.v[l],
            );
            places[l] = first[l] + if strips[l] > 0.0 { index } else { 0 };
        }
        for l in 0..LANES {
            if cut && strips[l] > 0.0 && finest.is_cut(PatchId(places[l])) {
                let f = [1.0 - hits.u[l] - hits.v[l], hits.u[l], hits.v[l]];
                places[l] = lookups.owner(places[l], f);
            }
        }
        if let Some(patch_of) = &lookups.patch_of {
            for place in places {
                *place = patch_of[*place as usize];
            }
        }
    }
}
