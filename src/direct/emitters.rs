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

mod lanes;
mod pairs;
mod sources;
mod tree;

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use crate::form_factors::kernel::point_to_polygon;
use crate::patches::{PatchId, Patches, SurfacePoint, side_index};
use crate::scene::{Geometry, Optics, Rgb, Side, luminance};
use crate::simd::LANES;
use crate::visibility::{Bvh, NOTHING};
use lanes::{add_far, weigh};
pub use pairs::{MOST_SHADOW, Room};
use pairs::{PAIRS, Seen, point_on};
use sources::{Source, grouped, sphere, unit_of};
use tree::{Cut, Tree};

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

/// A receiver that sees an emitter, head on, under a larger form factor leaves it to the rays.
const LARGEST: f32 = 0.15;

/// The same of a point, for which Lambert's formula is exact: it leaves to the rays those emitters
/// of which they find much.
const LARGEST_OF_POINT: f32 = 0.3;

/// Emitting sides of a scene.
pub struct Emitters<'a> {
    geometry: &'a Geometry,
    bvh: &'a Bvh,
    options: ApartOptions,
    sources: Vec<Source>,
    tree: Tree,
    /// Consecutive sources whose visible share is found together.
    groups: Vec<Range<usize>>,
    /// Centre and radius of each group.
    reaches: Vec<(DVec3, f64)>,
    /// The source of each side, or [`NOTHING`].
    source_of: Vec<u32>,
    /// Points in the unit squares of receiver and emitter, for each of two sequences.
    pairs: [Vec<[f32; 4]>; 2],
    /// What all sides would receive on average if all flux arrived at once, W/m² or lx.
    typical: f64,
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

/// A group of emitters as a receiver sees it: its number, and its blocks in a cut.
type Group<'a> = (usize, Range<usize>, &'a Cut);

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

impl<'a> Emitters<'a> {
    /// The emitting sides of `geometry`. Emitters are set apart patch by patch of `patches` where those
    /// join several triangles, so that those who know only the patch agree. To what each side emits comes
    /// what it is thought to reflect: any `reflected` radiosity (W/m² or lm/m²) that those take away again who
    /// find it among what rays meet.
    #[must_use]
    pub fn new(
        geometry: &'a Geometry,
        optics: &Optics,
        patches: &Patches,
        bvh: &'a Bvh,
        options: ApartOptions,
        reflected: impl Fn(usize) -> Rgb,
    ) -> Self {
        let mut sources: Vec<Source> = geometry
            .ids()
            .flat_map(|t| Side::BOTH.map(|s| (t, s)))
            .filter(|&(t, s)| geometry.exchanges(t, s))
            .filter(|&(t, s)| optics.emission(t, s).max_element() > 0.0)
            .map(|(triangle, side)| {
                let emission = optics.emission(triangle, side);
                let exitance = emission + reflected(side_index(triangle, side));
                Source {
                    triangle,
                    side,
                    radiance: exitance / PI,
                    corners: geometry.corners(triangle),
                    normal: geometry.normal(triangle, side),
                    area: geometry.area(triangle),
                }
            })
            .collect();
        let groups = grouped(geometry, &mut sources);
        let unit = |s: &Source| unit_of(geometry, patches, s);
        let tree = Tree::new(bvh, &mut sources, &groups, unit);
        let mut source_of = vec![NOTHING; 2 * geometry.len()];
        for (k, s) in sources.iter().enumerate() {
            source_of[side_index(s.triangle, s.side)] = k as u32;
        }
        let flux: f64 = sources.iter().map(|s| PI * luminance(s.radiance) * s.area).sum();
        let area: f64 = patches.ids().map(|i| patches.area(i)).sum();
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
        let typical = if area > 0.0 { flux / area } else { 0.0 };
        Self { geometry, bvh, options, sources, tree, groups, reaches, source_of, pairs, typical }
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
            Apart::Suitable => self.tree.is_suitable(r, k),
        }
    }

    /// Prepares for receivers that lie together: what follows is fast for any of them, and wrong for
    /// others.
    pub fn look(&self, receivers: &[Receiver], room: &mut Room) {
        if self.options.which == Apart::None {
            return;
        }
        self.tree.cut(receivers, self.options.which == Apart::All, &mut room.cut);
    }

    /// Direct irradiance from the emitters set apart for a receiver, after a [`look`](Self::look).
    /// `sample` gives a point of it from one in the unit square.
    pub fn light(
        &self,
        receiver: &Receiver,
        sample: impl Fn(DVec2) -> ReceiverPoint,
        room: &mut Room,
    ) -> DirectLight {
        let mut total = DirectLight::default();
        self.each_group(receiver, room, |group, unoccluded, room| {
            let mut seen = [[Seen::default(); 2]];
            let most = self.worth(unoccluded);
            self.visible(receiver, group, &sample, room, (PAIRS, most), &mut seen);
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
        self.each_group(receiver, room, |group, unoccluded, room| {
            let mut seen = [[Seen::default(); 2]; N];
            let more = self.options.shadow.min(MOST_SHADOW);
            self.visible(receiver, group, &sample, room, (look, more), &mut seen);
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
        mut found: impl FnMut(&Group<'_>, Rgb, &mut Room),
    ) {
        if self.is_empty() || self.options.which == Apart::None {
            return;
        }
        let cut = std::mem::take(&mut room.cut);
        room.weights.resize(cut.blocks.len(), [0.0; LANES]);
        room.sums.resize(cut.blocks.len(), 0.0);
        weigh(&cut.blocks, receiver, &mut room.weights, &mut room.sums);
        for (number, blocks) in &cut.groups {
            if room.sums[blocks.clone()].iter().all(|sum| *sum <= 0.0) {
                continue;
            }
            let group = (*number, blocks.clone(), &cut);
            let unoccluded = self.unoccluded(receiver, &group, &room.weights);
            if unoccluded != Rgb::ZERO {
                found(&group, unoccluded, room);
            }
        }
        room.cut = cut;
    }

    /// Shadow rays that a group is worth which would send so much: noise in bright places weighs most.
    fn worth(&self, unoccluded: Rgb) -> usize {
        let share = luminance(unoccluded) / self.typical.max(f64::MIN_POSITIVE);
        let wanted = self.options.shadow as f64 * share;
        (wanted as usize).clamp(PAIRS, MOST_SHADOW)
    }

    /// The same as [`light`](Self::light) for a patch.
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
        self.light(receiver, |u| (point_on(corners, u.x, u.y), normal, own), room)
    }

    /// Mean irradiance over the receiver from a group, as if nothing stood between.
    fn unoccluded(
        &self,
        receiver: &Receiver,
        (number, blocks, cut): &Group<'_>,
        weights: &[[f32; LANES]],
    ) -> Rgb {
        /// Radii of a receiver beyond which its centre stands for all of it.
        const FAR: f64 = 24.0;
        let (centre, reach) = self.reaches[*number];
        let away = (centre - receiver.middle.0).length() - reach;
        let radius = f64::from(receiver.radius) * self.bvh.scale();
        let middle = [receiver.middle];
        let points = if away > FAR * radius { &middle } else { &receiver.points[..] };
        let mut sum = Rgb::ZERO;
        for (at, normal) in points {
            let (mut far, mut some_near) = ([0.0; 3], false);
            let (local, up) = (self.bvh.local(*at), normal.as_vec3());
            let (entries, weights) = (&cut.blocks[blocks.clone()], &weights[blocks.clone()]);
            add_far(entries, weights, local, up, &mut far, &mut some_near);
            sum += Rgb::from_array(far.map(f64::from));
            if !some_near {
                continue;
            }
            // Only single sources are near.
            let lanes = (0..entries.len()).flat_map(|b| (0..LANES).map(move |l| (b, l)));
            for (b, l) in lanes.filter(|&(b, l)| weights[b][l] > 0.0) {
                let s = &self.sources[cut.sources[blocks.start + b][l].0 as usize];
                if entries[b].is_near(l, local) && s.normal.dot(*at - s.corners[0]) > 0.0 {
                    sum += s.radiance * (PI * point_to_polygon(*at, *normal, &s.corners));
                }
            }
        }
        sum / points.len() as f64
    }
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
