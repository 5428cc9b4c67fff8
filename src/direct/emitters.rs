//! Direct light from emitting surfaces, apart from the rest: Lambert's formula times the visible
//! share, averaged over the receiver.
//!
//! Which emitters are treated so is fixed for each receiver before anything is sampled, by
//! [`Emitters::is_apart`]: all but those that are too near or too large, which its rays find well
//! enough. The same rule tells which hits of its rays carry emission, so that no emitter counts
//! twice and none is left out. With D(i) the emitters set apart for receiver i,
//!
//! ```text
//! H_i = H_direct(D(i)) + Σ_j F_ij (B_j - [j ∈ D(i)] E_j)
//! ```
//!
//! The unoccluded irradiance of each group of emitters is a sum over all its triangles: by Lambert's
//! formula where a triangle is near, by its centre where it is far. Of that sum the visible share
//! arrives, a ratio of two sums over the same pairs of points: each weighted by the kernel
//! K = cos θ cos θ' / (π r²), blocked pairs left out above and counted below. Pairs are drawn in
//! proportion to what each triangle would send (Shirley, Wang & Zimmerman 1996, "Monte Carlo
//! techniques for direct lighting calculations"), so that thousands of emitting triangles cost no more
//! than a few; where the first pairs neither all see each other nor all do not, more are drawn.

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use crate::form_factors::kernel::point_to_polygon;
use crate::patches::{PatchId, Patches, SurfacePoint, side_index};
use crate::scene::{Geometry, Optics, Rgb, Side, TriangleId, luminance};
use crate::visibility::{Bvh, LANES, NOTHING, Packet, multiversion};

/// How direct light is set apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ApartOptions {
    /// Which emitters are. Default: those neither too near nor too large.
    pub which: Apart,
    /// Shadow rays from a receiver to a group of emitters that it sees in part, 16 to
    /// [`MOST_SHADOW`]. Default 64.
    pub shadow: usize,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

impl Default for ApartOptions {
    fn default() -> Self {
        Self { which: Apart::default(), shadow: 64, seed: 0 }
    }
}

/// Which emitters are set apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Apart {
    /// Those neither too near nor too large.
    #[default]
    Suitable,
    /// All.
    All,
    /// None: rays find them.
    None,
}

/// A receiver nearer than this many times its own size to an emitter leaves it to the rays.
const NEAREST: f32 = 4.0;

/// So does one that sees the emitter, head on, under a larger form factor.
const LARGEST: f32 = 0.15;

/// The same of a point, for which Lambert's formula is exact: it leaves to the rays those emitters
/// of which they find much.
const LARGEST_OF_POINT: f32 = 1.0;

/// A triangle whose distance is below this many times the root of its area counts as near.
const NEAR: f32 = 10.0;

/// Groups of emitters whose visible shares are told apart.
const MOST_GROUPS: usize = 64;

/// Pairs drawn at first: half of them from each of two independent sequences.
const PAIRS: usize = LANES;

/// Most shadow rays a group of emitters and receiver.
pub const MOST_SHADOW: usize = 4096;

/// Emitting sides of a scene.
pub struct Emitters<'a> {
    geometry: &'a Geometry,
    bvh: &'a Bvh,
    options: ApartOptions,
    sources: Vec<Source>,
    lanes: Lanes,
    /// Consecutive sources whose visible share is found together.
    groups: Vec<Range<usize>>,
    /// Centre and radius of each group.
    reaches: Vec<(DVec3, f64)>,
    /// The source of each side, or [`NOTHING`].
    source_of: Vec<u32>,
    /// Points in the unit squares of receiver and emitter, for each of two sequences.
    pairs: [Vec<[f32; 4]>; 2],
}

/// One emitting side.
#[derive(Debug, Clone, Copy)]
struct Source {
    triangle: TriangleId,
    side: Side,
    radiance: Rgb,
    corners: [DVec3; 3],
    normal: DVec3,
    area: f64,
}

/// What a first look at all sources needs, in coordinates of the hierarchy.
#[derive(Debug, Clone, Default)]
struct Lanes {
    centre: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    radiance: [Vec<f32>; 3],
    area: Vec<f32>,
    /// Of the farthest corner from the centre.
    radius: Vec<f32>,
    luminance: Vec<f32>,
    /// What sets a source apart: of the patch that it belongs to, if that is a cluster, else its own.
    units: Units,
}

/// Centre, normal (zero if it is not flat), radius and area of emitters that are set apart as one.
#[derive(Debug, Clone, Default)]
struct Units {
    centre: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    radius: Vec<f32>,
    area: Vec<f32>,
}

/// Where direct light is wanted: all over a patch, or at a point.
#[derive(Debug, Clone)]
pub struct Receiver {
    /// Points that the unoccluded irradiance is averaged over, and their normals.
    points: Vec<(DVec3, DVec3)>,
    /// Centre and mean normal.
    middle: (DVec3, DVec3),
    centre: Vec3,
    normal: Vec3,
    /// Sine of the largest angle between its normals.
    bend: f32,
    /// Farthest point from the centre, and the root of the area.
    radius: f32,
    size: f32,
    /// Emitters seen under a larger form factor, head on, are left to the rays.
    largest: f32,
    /// Tells receivers apart.
    seed: u64,
}

/// A point of a receiver, its normal, and the solid triangle that it lies on.
pub type ReceiverPoint = (DVec3, DVec3, Option<u32>);

/// Direct irradiance of a receiver, W/m² or lx.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DirectLight {
    /// The best estimate.
    pub irradiance: Rgb,
    /// What each of two independent halves of the shadow rays alone would give.
    pub halves: [Rgb; 2],
}

impl From<Rgb> for DirectLight {
    /// Light that is known without shadow rays.
    fn from(irradiance: Rgb) -> Self {
        Self { irradiance, halves: [irradiance; 2] }
    }
}

impl std::ops::AddAssign<Rgb> for DirectLight {
    /// Adds light that is known without shadow rays.
    fn add_assign(&mut self, more: Rgb) {
        self.irradiance += more;
        self.halves.iter_mut().for_each(|h| *h += more);
    }
}

/// Room for one receiver's work; reused.
#[derive(Debug, Default)]
pub struct Room {
    weights: Vec<f32>,
    /// Sums of each 16 weights of a group.
    blocks: Vec<f32>,
    packets: Vec<Packet>,
    kernels: Vec<Rgb>,
    blocked: Vec<u16>,
}

/// Sums of kernels over pairs: those that see each other, and all.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    kept: Rgb,
    all: Rgb,
}

impl Seen {
    fn and(self, other: Self) -> Self {
        Self { kept: self.kept + other.kept, all: self.all + other.all }
    }

    fn share(&self) -> Rgb {
        (self.kept / self.all.max(Rgb::splat(f64::MIN_POSITIVE))).min(Rgb::ONE)
    }
}

impl<'a> Emitters<'a> {
    /// The emitting sides of `geometry`. Emitters are set apart patch by patch of `patches` where those
    /// join several triangles, so that those who know only the patch agree.
    #[must_use]
    pub fn new(
        geometry: &'a Geometry,
        optics: &Optics,
        patches: &Patches,
        bvh: &'a Bvh,
        options: ApartOptions,
    ) -> Self {
        let mut sources: Vec<Source> = geometry
            .ids()
            .flat_map(|t| Side::BOTH.map(|s| (t, s)))
            .filter(|&(t, s)| geometry.exchanges(t, s))
            .map(|(triangle, side)| Source {
                triangle,
                side,
                radiance: optics.emission(triangle, side) / PI,
                corners: geometry.corners(triangle),
                normal: geometry.normal(triangle, side),
                area: geometry.area(triangle),
            })
            .filter(|s| s.radiance.max_element() > 0.0)
            .collect();
        let groups = grouped(geometry, &mut sources);
        let mut source_of = vec![NOTHING; 2 * geometry.len()];
        let mut lanes = Lanes::default();
        for (k, s) in sources.iter().enumerate() {
            source_of[side_index(s.triangle, s.side)] = k as u32;
            lanes.push(bvh, s, &unit_of(geometry, patches, s));
        }
        let reaches = groups
            .iter()
            .map(|g| {
                let corners = sources[g.clone()].iter().flat_map(|s| s.corners);
                sphere(&corners.collect::<Vec<_>>())
            })
            .collect();
        let pairs = [0, 1].map(|half| {
            let sequence = 0x5eed_0000 ^ (2 * options.seed + half);
            (0..MOST_SHADOW as u32 / 2).map(|i| sobol_burley::sample_4d(i, 0, sequence)).collect()
        });
        Self { geometry, bvh, options, sources, lanes, groups, reaches, source_of, pairs }
    }

    /// Number of emitting sides.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether nothing emits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// A patch as receiver.
    #[must_use]
    pub fn patch(&self, patches: &Patches, id: PatchId) -> Receiver {
        let g = self.geometry;
        let cell = patches.cell(id);
        let points: Vec<(DVec3, DVec3)> = receiving_points(patches, id)
            .iter()
            .map(|p| (p.position(g), g.normal(p.triangle, p.side)))
            .collect();
        let centre = points.iter().map(|p| p.0).sum::<DVec3>() / points.len() as f64;
        let corners = patches.pieces(id).flat_map(|c| c.corners(g));
        let radius = corners.map(|c| (c - centre).length()).fold(0.0, f64::max);
        /// Sine of twice the largest angle of a cluster's normals from their mean.
        const BEND: f32 = 0.5;
        let scale = self.bvh.scale();
        let normal = points.iter().map(|p| p.1).sum::<DVec3>().normalize_or_zero();
        Receiver {
            points,
            middle: (centre, normal),
            centre: self.bvh.local(centre),
            normal: g.normal(cell.triangle, cell.side).as_vec3(),
            bend: if patches.is_cluster(id) { BEND } else { 0.0 },
            radius: (radius / scale) as f32,
            size: (patches.area(id).sqrt() / scale) as f32,
            largest: LARGEST,
            seed: u64::from(id.0),
        }
    }

    /// A point as receiver; `seed` tells points apart.
    #[must_use]
    pub fn point(&self, at: DVec3, normal: DVec3, seed: u64) -> Receiver {
        Receiver {
            points: vec![(at, normal)],
            middle: (at, normal),
            centre: self.bvh.local(at),
            normal: normal.as_vec3(),
            bend: 0.0,
            radius: 0.0,
            size: 0.0,
            largest: LARGEST_OF_POINT,
            seed: seed ^ 1 << 63,
        }
    }

    /// Whether the emitter that a side is or belongs to is set apart for a receiver, so that its rays
    /// must not count its emission; `false` for sides that emit nothing.
    #[must_use]
    pub fn is_apart(&self, receiver: &Receiver, side: usize) -> bool {
        let source = self.source_of[side];
        source != NOTHING && self.set_apart(receiver, source as usize)
    }

    fn set_apart(&self, r: &Receiver, k: usize) -> bool {
        match self.options.which {
            Apart::All => true,
            Apart::None => false,
            Apart::Suitable => {
                let Units { centre: [x, y, z], normal: [nx, ny, nz], radius, area } =
                    &self.lanes.units;
                let (centre, normal) = ([x[k], y[k], z[k]], [nx[k], ny[k], nz[k]]);
                suitable(r, centre, normal, radius[k], area[k])
            }
        }
    }

    /// Direct irradiance from the emitters set apart for a receiver. `sample` gives a point of it from
    /// one in the unit square.
    pub fn light(
        &self,
        receiver: &Receiver,
        sample: impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) -> DirectLight {
        let mut total = DirectLight::default();
        self.each_group(receiver, room, |number, unoccluded, room| {
            let mut seen = [[Seen::default(); 2]];
            self.visible(receiver, number, &sample, room, PAIRS, &mut seen);
            let [[a, b]] = seen;
            total.irradiance += unoccluded * a.and(b).share();
            for (half, seen) in total.halves.iter_mut().zip([a, b]) {
                *half += unoccluded * seen.share();
            }
        });
        total
    }

    /// The same as 2 `N` independent sequences of shadow rays give it: by all of them together, and by
    /// each pair alone.
    pub fn light_replicated<const N: usize>(
        &self,
        receiver: &Receiver,
        sample: impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) -> (Rgb, [[Rgb; 2]; N]) {
        let mut total = (Rgb::ZERO, [[Rgb::ZERO; 2]; N]);
        /// Share of the shadow rays that the first look takes: what it misses is an error unknown.
        const LOOK: usize = 8;
        let look = (self.options.shadow / LOOK).clamp(PAIRS, MOST_SHADOW);
        self.each_group(receiver, room, |number, unoccluded, room| {
            let mut seen = [[Seen::default(); 2]; N];
            self.visible(receiver, number, &sample, room, look, &mut seen);
            let all = seen.iter().flatten().fold(Seen::default(), |all, s| all.and(*s));
            total.0 += unoccluded * all.share();
            for (one, seen) in total.1.iter_mut().flatten().zip(seen.iter().flatten()) {
                *one += unoccluded * seen.share();
            }
        });
        total
    }

    /// Calls `found` for each group that would light the receiver if nothing stood between: its number
    /// and the irradiance unoccluded.
    fn each_group(
        &self,
        receiver: &Receiver,
        room: &mut Room,
        mut found: impl FnMut(usize, Rgb, &mut Room),
    ) {
        if self.is_empty() || self.options.which == Apart::None {
            return;
        }
        room.weights.resize(self.sources.len(), 0.0);
        let all = self.options.which == Apart::All;
        weigh(&self.lanes, receiver, all, &mut room.weights);
        for (number, group) in self.groups.iter().enumerate() {
            add_blocks(&room.weights[group.clone()], &mut room.blocks);
            if room.blocks.iter().all(|b| *b <= 0.0) {
                continue;
            }
            let unoccluded = self.unoccluded(receiver, number, &room.weights);
            if unoccluded != Rgb::ZERO {
                found(number, unoccluded, room);
            }
        }
    }

    /// The same for a patch.
    pub fn light_patch(
        &self,
        receiver: &Receiver,
        patches: &Patches,
        id: PatchId,
        room: &mut Room,
    ) -> DirectLight {
        let g = self.geometry;
        if patches.is_cluster(id) || patches.is_parted(id) {
            let sample = |u| {
                let p = patches.sample_own(id, u);
                (p.position(g), g.normal(p.triangle, p.side), self.bvh.solid(p.triangle))
            };
            return self.light(receiver, sample, room);
        }
        let cell = patches.cell(id);
        let corners = cell.corners(g);
        let (normal, own) = (g.normal(cell.triangle, cell.side), self.bvh.solid(cell.triangle));
        self.light(receiver, |u| (on_triangle(corners, u.x, u.y), normal, own), room)
    }

    /// Mean irradiance over the receiver from a group, as if nothing stood between.
    fn unoccluded(&self, receiver: &Receiver, number: usize, weights: &[f32]) -> Rgb {
        /// Radii of a receiver beyond which its centre stands for all of it.
        const FAR: f64 = 24.0;
        let group = self.groups[number].clone();
        let (centre, reach) = self.reaches[number];
        let away = (centre - receiver.middle.0).length() - reach;
        let radius = f64::from(receiver.radius) * self.bvh.scale();
        let middle = [receiver.middle];
        let points = if away > FAR * radius { &middle } else { &receiver.points[..] };
        let mut sum = Rgb::ZERO;
        for (at, normal) in points {
            let (mut far, mut some_near) = ([0.0; 3], false);
            let local = self.bvh.local(*at);
            let up = normal.as_vec3();
            add_far(&self.lanes, group.clone(), weights, local, up, &mut far, &mut some_near);
            sum += Rgb::from_array(far.map(f64::from));
            if !some_near {
                continue;
            }
            for k in group.clone().filter(|&k| weights[k] > 0.0 && self.lanes.is_near(k, local)) {
                let s = &self.sources[k];
                if s.normal.dot(*at - s.corners[0]) > 0.0 {
                    sum += s.radiance * (PI * point_to_polygon(*at, *normal, &s.corners));
                }
            }
        }
        sum / points.len() as f64
    }

    /// Adds up pairs of points on the receiver and on a group of emitters, for each half of each set of
    /// pairs that is asked for. All sets decide together whether they need more than the first `look`.
    fn visible(
        &self,
        receiver: &Receiver,
        number: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
        look: usize,
        seen: &mut [[Seen; 2]],
    ) {
        let (mut drawn, mut blocked) = (0, 0);
        let more = self.options.shadow.min(MOST_SHADOW).next_multiple_of(PAIRS);
        // The first pairs tell whether more are worth their while.
        for (round, count) in [(0, look.next_multiple_of(PAIRS)), (1, more)] {
            for (k, halves) in seen.iter_mut().enumerate() {
                let seed = receiver.seed ^ (k as u64) << 48;
                self.draw(seed, (number, round), count, sample, room);
                let kernels = room.kernels.iter().enumerate();
                for (lane, kernel) in kernels.filter(|k| *k.1 != Rgb::ZERO) {
                    let half = &mut halves[lane % 2];
                    half.all += *kernel;
                    drawn += 1;
                    if room.blocked[lane / LANES] >> (lane % LANES) & 1 == 0 {
                        half.kept += *kernel;
                    } else {
                        blocked += 1;
                    }
                }
            }
            if round == 0 && (blocked == 0 || blocked == drawn) {
                // What is hidden in part is seldom hidden in the middle alone.
                let (outer, hidden) = self.between_corners(number, sample, room);
                if blocked == 0 && hidden == 0 || blocked > 0 && hidden == outer {
                    break;
                }
            }
        }
    }

    /// How many segments there are between four outer points of the receiver and of a group that face
    /// each other, and how many of them are blocked.
    fn between_corners(
        &self,
        number: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) -> (u32, u32) {
        /// Corners of the unit square, drawn in a little.
        const OUTER: [DVec2; 4] = [
            DVec2::new(0.03, 0.03),
            DVec2::new(0.97, 0.03),
            DVec2::new(0.03, 0.97),
            DVec2::new(0.97, 0.97),
        ];
        /// Corners of four triangles spread over a group: for two halves of a rectangle, all of its.
        const CORNERS: [usize; 4] = [0, 1, 1, 2];
        /// Share of the way from a corner to the middle of its triangle.
        const INSET: f64 = 0.05;
        let group = self.groups[number].clone();
        let mut packet = Packet::EMPTY;
        let mut aimed = 0_u32;
        for (i, u) in OUTER.into_iter().enumerate() {
            let (from, normal, own) = sample(u);
            for (j, corner) in CORNERS.into_iter().enumerate() {
                let k = group.start + (2 * j + 1) * group.len() / 8;
                let corners = self.sources[k].corners;
                let to = corners[corner].lerp(corners.iter().sum::<DVec3>() / 3.0, INSET);
                if room.weights[k] > 0.0 && self.kernel(k, from, normal, to) > 0.0 {
                    let start = self.bvh.local(from);
                    packet.set(4 * i + j, start, self.bvh.local(to) - start, 1.0, own);
                    aimed |= 1 << (4 * i + j);
                }
            }
        }
        let mut hidden = [0];
        self.bvh.blocked(&[packet], &mut hidden);
        (aimed.count_ones(), (u32::from(hidden[0]) & aimed).count_ones())
    }

    /// Draws `count` pairs and traces the segments between them; even lanes are of the first half.
    fn draw(
        &self,
        seed: u64,
        (number, round): (usize, u64),
        count: usize,
        sample: &impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) {
        let group = self.groups[number].clone();
        room.packets.clear();
        room.packets.resize(count / LANES, Packet::EMPTY);
        room.kernels.clear();
        room.kernels.resize(count, Rgb::ZERO);
        let each = count / 2;
        let sum: f64 = room.blocks.iter().map(|b| f64::from(*b)).sum();
        for half in 0..2 {
            let seed = seed << 8 ^ (number as u64) << 2 ^ round << 1 ^ half as u64;
            let [s0, s1, s2, s3, s4] = shifts(seed);
            let (mut block, mut below) = (0, 0.0);
            for (i, pair) in self.pairs[half][..each].iter().enumerate() {
                // One in each of so many equal parts of the sum, in order.
                let target = (i as f64 + s0) / each as f64 * sum;
                while block + 1 < room.blocks.len()
                    && below + f64::from(room.blocks[block]) <= target
                {
                    below += f64::from(room.blocks[block]);
                    block += 1;
                }
                let mut k = group.start + block * LANES;
                let end = group.end.min(k + LANES);
                let mut rest = target - below;
                while k + 1 < end && f64::from(room.weights[k]) <= rest {
                    rest -= f64::from(room.weights[k]);
                    k += 1;
                }
                let weight = f64::from(room.weights[k]);
                let wrapped = |p: f32, s: f64| {
                    let x = f64::from(p) + s;
                    if x < 1.0 { x } else { x - 1.0 }
                };
                let (from, normal, own) =
                    sample(DVec2::new(wrapped(pair[0], s1), wrapped(pair[1], s2)));
                let to = self.on_source(k, wrapped(pair[2], s3), wrapped(pair[3], s4));
                let kernel = self.kernel(k, from, normal, to);
                if kernel <= 0.0 || weight <= 0.0 {
                    continue;
                }
                let lane = 2 * i + half;
                let start = self.bvh.local(from);
                let way = self.bvh.local(to) - start;
                room.packets[lane / LANES].set(lane % LANES, start, way, 1.0, own);
                room.kernels[lane] = self.sources[k].radiance * (kernel / weight);
            }
        }
        room.blocked.clear();
        room.blocked.resize(count / LANES, 0);
        self.bvh.blocked(&room.packets, &mut room.blocked);
    }

    /// A point of a source, uniform in area.
    fn on_source(&self, k: usize, u: f64, v: f64) -> DVec3 {
        on_triangle(self.sources[k].corners, u, v)
    }

    /// Area of a source times the kernel between two points.
    fn kernel(&self, k: usize, from: DVec3, normal: DVec3, to: DVec3) -> f64 {
        let s = &self.sources[k];
        let way = to - from;
        let r2 = way.length_squared();
        let (here, there) = (normal.dot(way), -s.normal.dot(way));
        if here > 0.0 && there > 0.0 && r2 > 0.0 {
            s.area * here * there / (PI * r2 * r2)
        } else {
            0.0
        }
    }
}

impl Lanes {
    fn push(&mut self, bvh: &Bvh, s: &Source, unit: &Unit) {
        let (centre, radius) = sphere(&s.corners);
        let (centre, at, scale) = (bvh.local(centre), bvh.local(unit.centre), bvh.scale());
        for axis in 0..3 {
            self.centre[axis].push(centre[axis]);
            self.normal[axis].push(s.normal[axis] as f32);
            self.units.centre[axis].push(at[axis]);
            self.units.normal[axis].push(unit.normal[axis] as f32);
            self.radiance[axis].push(s.radiance[axis] as f32);
        }
        self.area.push((s.area / (scale * scale)) as f32);
        self.radius.push((radius / scale) as f32);
        self.units.radius.push((unit.radius / scale) as f32);
        self.units.area.push((unit.area / (scale * scale)) as f32);
        self.luminance.push(luminance(s.radiance).max(s.radiance.max_element() * 1e-3) as f32);
    }

    /// Whether a source is so near to a point that its centre cannot stand for it.
    fn is_near(&self, k: usize, at: Vec3) -> bool {
        let d = Vec3::new(self.centre[0][k], self.centre[1][k], self.centre[2][k]) - at;
        d.length_squared() < NEAR * NEAR * self.area[k]
    }
}

/// Whether an emitter is neither too near nor too large for a receiver.
#[inline(always)]
fn suitable(r: &Receiver, centre: [f32; 3], normal: [f32; 3], radius: f32, area: f32) -> bool {
    let d = [centre[0] - r.centre.x, centre[1] - r.centre.y, centre[2] - r.centre.z];
    let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    // The emitter is no nearer than its plane, nor than a ball about it.
    let height = (normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]).abs();
    let clear = r.radius + NEAREST * r.size;
    let beyond = radius + clear;
    ((height > clear) | (d2 > beyond * beyond)) & (area < r.largest * std::f32::consts::PI * d2)
}

multiversion! {
    fn weigh(lanes: &Lanes, receiver: &Receiver, all: bool, weights: &mut [f32]) = weigh_kernel
}

/// About what each source may send to a receiver at most: zero only for those that send nothing or
/// are not set apart.
#[inline(always)]
fn weigh_kernel(lanes: &Lanes, r: &Receiver, all: bool, weights: &mut [f32]) {
    let n = weights.len();
    let [x, y, z] = lanes.centre.each_ref().map(|v| &v[..n]);
    let [nx, ny, nz] = lanes.normal.each_ref().map(|v| &v[..n]);
    let (area, radius, bright) = (&lanes.area[..n], &lanes.radius[..n], &lanes.luminance[..n]);
    let units = &lanes.units;
    let [ux, uy, uz] = units.centre.each_ref().map(|v| &v[..n]);
    let [mx, my, mz] = units.normal.each_ref().map(|v| &v[..n]);
    let (unit_radius, unit_area) = (&units.radius[..n], &units.area[..n]);
    for k in 0..n {
        let (dx, dy, dz) = (x[k] - r.centre.x, y[k] - r.centre.y, z[k] - r.centre.z);
        let reach = r.radius + radius[k];
        let d2 = dx * dx + dy * dy + dz * dz + reach * reach;
        let here = r.normal.x * dx + r.normal.y * dy + r.normal.z * dz + reach + r.bend * d2.sqrt();
        let there = reach - (nx[k] * dx + ny[k] * dy + nz[k] * dz);
        let most = bright[k] * area[k] * (here.max(0.0) * there.max(0.0)) / (d2 * d2);
        let (centre, normal) = ([ux[k], uy[k], uz[k]], [mx[k], my[k], mz[k]]);
        let apart = all | suitable(r, centre, normal, unit_radius[k], unit_area[k]);
        weights[k] = if apart { most } else { 0.0 };
    }
}

multiversion! {
    fn add_blocks(weights: &[f32], blocks: &mut Vec<f32>) = add_blocks_kernel
}

/// Sums of each 16 weights.
#[inline(always)]
fn add_blocks_kernel(weights: &[f32], blocks: &mut Vec<f32>) {
    blocks.clear();
    let (whole, rest) = weights.as_chunks::<LANES>();
    blocks.extend(whole.iter().map(|block| {
        let mut four = [0.0; 4];
        for (k, w) in block.iter().enumerate() {
            four[k % 4] += w;
        }
        (four[0] + four[1]) + (four[2] + four[3])
    }));
    if !rest.is_empty() {
        blocks.push(rest.iter().sum());
    }
}

multiversion! {
    fn add_far(
        lanes: &Lanes,
        group: Range<usize>,
        weights: &[f32],
        at: Vec3,
        normal: Vec3,
        sum: &mut [f32; 3],
        some_near: &mut bool,
    ) = add_far_kernel
}

/// Irradiance at a point from the sources of a group that are far from it, by their centres, and
/// whether some are near.
#[inline(always)]
fn add_far_kernel(
    lanes: &Lanes,
    group: Range<usize>,
    weights: &[f32],
    at: Vec3,
    normal: Vec3,
    sum: &mut [f32; 3],
    some_near: &mut bool,
) {
    let n = group.len();
    let [x, y, z] = lanes.centre.each_ref().map(|v| &v[group.clone()][..n]);
    let [nx, ny, nz] = lanes.normal.each_ref().map(|v| &v[group.clone()][..n]);
    let [red, green, blue] = lanes.radiance.each_ref().map(|v| &v[group.clone()][..n]);
    let (area, weights) = (&lanes.area[group.clone()][..n], &weights[group][..n]);
    let (mut sums, mut near) = ([[0.0_f32; LANES]; 3], [0_u32; LANES]);
    let whole = n / LANES * LANES;
    for block in (0..whole).step_by(LANES) {
        for l in 0..LANES {
            let k = block + l;
            let d = [x[k] - at.x, y[k] - at.y, z[k] - at.z];
            let (factor, is_near) =
                far_factor(d, [nx[k], ny[k], nz[k]], normal, area[k], weights[k]);
            near[l] |= is_near;
            sums[0][l] += factor * red[k];
            sums[1][l] += factor * green[k];
            sums[2][l] += factor * blue[k];
        }
    }
    for k in whole..n {
        let d = [x[k] - at.x, y[k] - at.y, z[k] - at.z];
        let (factor, is_near) = far_factor(d, [nx[k], ny[k], nz[k]], normal, area[k], weights[k]);
        near[0] |= is_near;
        sums[0][0] += factor * red[k];
        sums[1][0] += factor * green[k];
        sums[2][0] += factor * blue[k];
    }
    for (sum, lanes) in sum.iter_mut().zip(sums) {
        *sum = lanes.iter().sum();
    }
    *some_near = near.iter().any(|n| *n != 0);
}

/// π times the form factor from a point to a source by its centre, 0 if it is not set apart or near;
/// and 1 if it is near.
#[inline(always)]
fn far_factor(d: [f32; 3], source: [f32; 3], normal: Vec3, area: f32, weight: f32) -> (f32, u32) {
    let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    let here = (normal.x * d[0] + normal.y * d[1] + normal.z * d[2]).max(0.0);
    let there = (-(source[0] * d[0] + source[1] * d[1] + source[2] * d[2])).max(0.0);
    let (counts, far) = (weight > 0.0, d2 >= NEAR * NEAR * area);
    let factor = area * here * there / (d2 * d2);
    (if counts & far { factor } else { 0.0 }, u32::from(counts & !far))
}

/// Points that stand for a patch: the centroids of its four parts, or some of a cluster.
fn receiving_points(patches: &Patches, id: PatchId) -> Vec<SurfacePoint> {
    if patches.is_cluster(id) {
        let spread = [0.125, 0.375, 0.625, 0.875];
        return spread.map(|x| patches.sample(id, DVec2::new(x, (7.0 * x).fract()))).to_vec();
    }
    let third = DVec3::splat(1.0 / 3.0);
    patches.cell(id).children().map(|part| part.point(third)).to_vec()
}

/// Emitters that are set apart as one.
struct Unit {
    centre: DVec3,
    normal: DVec3,
    radius: f64,
    area: f64,
}

/// The patch that a source is known by: its cluster, or itself.
fn unit_of(g: &Geometry, patches: &Patches, s: &Source) -> Unit {
    let cluster = patches.of_side(s.triangle, s.side).next().filter(|&i| patches.is_cluster(i));
    match cluster {
        Some(id) => {
            let members = patches.members(id).iter();
            let (centre, radius) = sphere(&members.flat_map(|&t| g.corners(t)).collect::<Vec<_>>());
            Unit { centre, normal: DVec3::ZERO, radius, area: patches.area(id) }
        }
        None => {
            let (centre, radius) = sphere(&s.corners);
            Unit { centre, normal: s.normal, radius, area: s.area }
        }
    }
}

/// A sphere about points: their mean, and the distance of the farthest.
fn sphere(points: &[DVec3]) -> (DVec3, f64) {
    let centre = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    (centre, points.iter().map(|c| (*c - centre).length()).fold(0.0, f64::max))
}

/// Sorts sources into groups of neighbours: surfaces if they are few, else halves of halves.
fn grouped(g: &Geometry, sources: &mut [Source]) -> Vec<Range<usize>> {
    if sources.is_empty() {
        return Vec::new();
    }
    let surface = |s: &Source| g.surface_of.get(s.triangle.index()).copied().unwrap_or(0);
    sources.sort_by_key(|s| (surface(s), s.triangle, s.side as u8));
    let mut groups: Vec<Range<usize>> = Vec::new();
    for (k, s) in sources.iter().enumerate() {
        match groups.last_mut() {
            Some(last) if surface(&sources[last.start]) == surface(s) => last.end = k + 1,
            _ => groups.push(k..k + 1),
        }
    }
    if groups.len() <= MOST_GROUPS {
        return groups;
    }
    let centre = |s: &Source| s.corners.iter().sum::<DVec3>();
    groups = std::iter::once(0..sources.len()).collect();
    while groups.len() < MOST_GROUPS {
        let largest = (0..groups.len()).max_by_key(|&i| (groups[i].len(), groups.len() - i));
        let Some(at) = largest.filter(|&i| groups[i].len() > 1) else { break };
        let range = groups[at].clone();
        let part = &mut sources[range.clone()];
        let (low, high) = part
            .iter()
            .map(centre)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
        let extent = high - low;
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
        part.sort_by(|a, b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.triangle.cmp(&b.triangle))
        });
        let middle = range.start + range.len() / 2;
        groups[at] = range.start..middle;
        groups.insert(at + 1, middle..range.end);
    }
    groups
}

/// A point of a triangle, uniform in area (Heitz 2019, "A low-distortion map between triangle and
/// square").
fn on_triangle([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    let (p, q) = if v > u { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
    a + (b - a) * p + (c - a) * q
}

/// Five numbers in 0..1 that look random.
fn shifts(seed: u64) -> [f64; 5] {
    // SplitMix64 (Steele, Lea & Flood 2014).
    let mut state = seed.wrapping_mul(0xd134_2543_de82_ef95);
    std::array::from_fn(|_| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    })
}
