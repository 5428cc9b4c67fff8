//! Sampled rows: rays from all over a patch, so that a row is a mean over it and not the view from
//! its centre.
//!
//! A form factor is the mean of what a patch's points see, weighted by the cosine: rays that begin
//! anywhere on the patch, uniformly in area, and go anywhere with a density proportional to the
//! cosine, all have the same weight. A row is a list of what they hit, in two halves that know
//! nothing of each other (`sampling.rs` says which rays they are).
//!
//! Patches that lie close together and face the same way share packets: their rays in one direction
//! pass the same boxes. Where normals spread, as on a finely curved surface, a packet has the rays
//! of one patch in neighbouring directions instead.

use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::engine::{Engine, EngineError};
use super::lookup::{Lookups, environment, index_in_grid};
use super::sampling::{Random, Starts, Table, aim};
use crate::form_factors::{Row, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;
use crate::simd::{LANES, multiversion};
use crate::visibility::{Bvh, Frame, Hits, NOTHING, Packet, ROUNDING};

/// How rows are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RaysOptions {
    /// Rays a row, 32 to [`MOST_SAMPLES`], rounded up to a power of two. Default 256.
    pub samples: usize,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

/// Most rays a row.
pub const MOST_SAMPLES: usize = 1 << 16;

impl Default for RaysOptions {
    fn default() -> Self {
        Self { samples: 256, seed: 0 }
    }
}

/// The engine of sampled rows.
pub struct Rays<'a> {
    geometry: &'a Geometry,
    patches: &'a Patches,
    bvh: &'a Bvh,
    lookups: Lookups<'a>,
    /// For 1, 2, 4, ... patches that share packets: the rays of both halves.
    tables: Vec<[Table; 2]>,
    seed: u32,
    traced: Mutex<Vec<Box<Traced>>>,
}

/// Patches share packets whose centres are at most this share of the angle of a packet's rays times
/// the scene's radius apart, and whose normals differ by at most this share of that angle: as
/// measured in flat rooms and on curved meshes.
const APART: f64 = 0.35;
const TURNED: f64 = 0.5;

/// Rays traced before a caller is heard: a fraction of a second on most models.
const RAYS_BEFORE_A_STOP: usize = 1 << 18;

/// Packets that are traced at a time.
const PACKETS: usize = 32;

/// Packets, and where their rays end: a patch, or a place behind the patches.
struct Traced {
    starts: Starts,
    packets: [Packet; PACKETS],
    hits: [Hits; PACKETS],
    places: [[u32; LANES]; PACKETS],
}

impl Default for Traced {
    fn default() -> Self {
        Self {
            starts: Starts::NONE,
            packets: [Packet::EMPTY; PACKETS],
            hits: [Hits::NONE; PACKETS],
            places: [[0; LANES]; PACKETS],
        }
    }
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
        let rays = options.samples.clamp(32, MOST_SAMPLES).next_power_of_two();
        let tables = (0..=LANES.ilog2())
            .map(|bits| [0, 1].map(|half| Table::new(rays / 2, 2 * options.seed + half, 1 << bits)))
            .collect();
        let lookups = Lookups::new(bvh.ids(), patches);
        let traced = Mutex::new(Vec::new());
        Self { geometry, patches, bvh, lookups, tables, seed: options.seed, traced }
    }

    /// Rays a row.
    #[must_use]
    pub fn samples(&self) -> usize {
        2 * self.tables[0][0].points()
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        self.together(&[id], std::slice::from_mut(row));
    }

    /// Makes the rows of some patches.
    fn together(&self, ids: &[PatchId], rows: &mut [Row]) {
        let mut traced = self.locked().pop().unwrap_or_default();
        self.halve(ids, rows, &mut traced);
        self.locked().push(traced);
    }

    /// Halves a list of patches until those of each part can share packets.
    fn halve(&self, ids: &[PatchId], rows: &mut [Row], traced: &mut Traced) {
        let half = ids.len().next_power_of_two() / 2;
        if half == 0 || (ids.len() == 2 * half && self.are_alike(ids)) {
            return make_rows(self, ids, traced, rows);
        }
        let (first, second) = rows.split_at_mut(half);
        self.halve(&ids[..half], first, traced);
        self.halve(&ids[half..], second, traced);
    }

    /// Whether rays of patches in one direction part less than those of one patch in a packet.
    fn are_alike(&self, ids: &[PatchId]) -> bool {
        let view = |id: PatchId| {
            let p = self.patches.center(id);
            (p.position(self.geometry), self.geometry.normal(p.triangle, p.side))
        };
        let packets = self.tables[0][0].packets().len() as f64;
        // Directions of a packet lie in an equal share of the hemisphere, as the cosine weighs it.
        let angle = (PI / packets).sqrt();
        let (place, normal) = view(ids[0]);
        let (reach, turn) = (APART * angle * self.bvh.scale(), (TURNED * angle).cos());
        ids.iter().all(|&id| {
            let (p, n) = view(id);
            p.distance(place) <= reach && n.dot(normal) >= turn
        })
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Vec<Box<Traced>>> {
        self.traced.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives rays of lanes another start where they begin beneath something that lies on their
    /// patch, which they meet at once: a row is the mean over what is not covered.
    fn uncover(
        &self,
        lanes: &[(usize, PatchId)],
        (starts, points): (&Starts, &[[u32; LANES]; 4]),
        packet: &mut Packet,
        hits: &mut Hits,
    ) {
        /// Two surfaces are one where they are no farther apart, in radii of the scene.
        const APART: f32 = 4.0 * ROUNDING as f32;
        /// Patches that are covered almost everywhere stay so.
        const TRIES: u64 = 4;
        for k in 0..TRIES {
            let mut again = false;
            for &(lane, id) in lanes {
                // Rays along the surface come later to what lies on it.
                if hits.distance[lane] > 0.1 || !self.patches.has_contact(id) {
                    continue;
                }
                let (area, local) = starts.point(points, lane);
                if hits.distance[lane] * local.z < APART {
                    let [a, b] = area.map(|x| u64::from(x.to_bits()));
                    let [u, v] = Random::new(a << 32 ^ b ^ u64::from(id.0) << 8 ^ k).numbers();
                    let (from, to, own) = self.place_one(id, DVec2::new(u, v), local);
                    packet.set(lane, from, to, f32::INFINITY, own);
                    again = true;
                }
            }
            if !again {
                return;
            }
            self.bvh.closest(std::slice::from_ref(packet), std::slice::from_mut(hits));
        }
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
        threads * size_of::<Traced>() as u64 + self.bvh.bytes()
    }

    fn rows_before_a_stop(&self) -> usize {
        let group = LANES * rayon::current_num_threads();
        (RAYS_BEFORE_A_STOP / self.samples()).next_multiple_of(group).max(group)
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        let me = &*self;
        let groups = rows.par_chunks(LANES).zip(out.par_chunks_mut(LANES));
        groups.for_each(|(ids, rows)| me.together(ids, rows));
        Ok(())
    }
}

/// Makes the rows of patches that share packets; as many as a power of two.
fn make_rows(engine: &Rays<'_>, ids: &[PatchId], traced: &mut Traced, rows: &mut [Row]) {
    let (patches, geometry, bvh) = (engine.patches, engine.geometry, engine.bvh);
    let rays = engine.samples();
    let escape = environment(patches.len());
    traced.starts = Starts::NONE;
    // Sets whose rays begin where the patch is, and not all over its cell.
    let mut one_by_one = Vec::new();
    let halves = &engine.tables[ids.len().ilog2() as usize % engine.tables.len()];
    let lanes = |set| halves[0].lanes(set);
    for (set, (&id, row)) in ids.iter().zip(rows.iter_mut()).enumerate() {
        let cell = patches.cell(id);
        let frame = Frame::on_surface(
            patches.center(id).position(geometry),
            geometry.normal(cell.triangle, cell.side),
        );
        let [a, b, c] = cell.corners(geometry);
        let edges = [b - a, c - a].map(|e| (e / bvh.scale()).as_vec3());
        let own = bvh.solid(cell.triangle).unwrap_or(NOTHING);
        let axes = frame.axes.map(|a| a.as_vec3());
        for lane in lanes(set) {
            traced.starts.set(lane, [bvh.local(a), edges[0], edges[1]], axes, own);
        }
        if patches.is_cluster(id) || patches.is_fragmented(id) {
            one_by_one.extend(lanes(set).map(|lane| (lane, id)));
        }
        row.columns.clear();
        row.columns.reserve(rays);
        (row.environment, row.back, row.lost) = (0.0, 0.0, 0.0);
    }
    let share = 1.0 / rays as f64;
    for (half, table) in halves.iter().enumerate() {
        for (set, id) in ids.iter().enumerate() {
            let seed = engine.seed.wrapping_mul(2).wrapping_add(half as u32);
            let mask = table.mask(u64::from(id.0) << 32 | u64::from(seed));
            lanes(set).for_each(|lane| traced.starts.set_mask(lane, mask));
        }
        for points in table.packets().chunks(PACKETS) {
            let packets = &mut traced.packets[..points.len()];
            aim(points, &traced.starts, packets);
            for &(lane, id) in &one_by_one {
                for (points, packet) in points.iter().zip(packets.iter_mut()) {
                    let (area, local) = traced.starts.point(points, lane);
                    let area = DVec2::from_array(area.map(f64::from));
                    let (from, to, own) = engine.place_one(id, area, local);
                    packet.set(lane, from, to, f32::INFINITY, own);
                }
            }
            let hits = &mut traced.hits[..points.len()];
            bvh.closest(packets, hits);
            for (k, points) in points.iter().enumerate() {
                engine.uncover(
                    &one_by_one,
                    (&traced.starts, points),
                    &mut packets[k],
                    &mut hits[k],
                );
            }
            let places = &mut traced.places[..points.len()];
            find(&engine.lookups, hits, places);
            for (set, row) in rows.iter_mut().enumerate() {
                let (mut escaped, mut behind) = (0_u32, 0_u32);
                for &place in places.iter().flat_map(|places| &places[lanes(set)]) {
                    if place < escape {
                        row.columns.push(PatchId(place));
                    } else if place == escape {
                        escaped += 1;
                    } else {
                        behind += 1;
                    }
                }
                row.environment += share * f64::from(escaped);
                row.back += share * f64::from(behind);
            }
        }
        for row in rows.iter_mut().filter(|_| half == 0) {
            row.half = row.columns.len();
        }
    }
    for row in rows {
        row.weights = Weights::Equal { entries: row.columns.len(), rays: rays as u32 };
    }
}

multiversion! {
    fn find(lookups: &Lookups<'_>, hits: &[Hits], places: &mut [[u32; LANES]]) = find_kernel
}

/// Where rays end: patches, then what escapes, then backs.
#[inline(always)]
fn find_kernel(lookups: &Lookups<'_>, hits: &[Hits], places: &mut [[u32; LANES]]) {
    let finest = lookups.finest;
    for (hits, places) in hits.iter().zip(places) {
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
            if cut && strips[l] > 0.0 && finest.is_crossed(PatchId(places[l])) {
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
