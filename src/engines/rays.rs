//! Sampled rows: rays from all over a patch, so that a row is a mean over it and not the view from
//! its centre.
//!
//! A form factor is the mean of what a patch's points see, weighted by the cosine: rays that begin
//! anywhere on the patch, uniformly in area, and go anywhere with a density proportional to the
//! cosine, all have the same weight. A row is a list of what they hit, in two halves that know
//! nothing of each other (`sampling.rs` says which rays they are). The rows of some patches are
//! made together: neighbours, as a rule, whose rays in one direction pass the same boxes.

use std::sync::{Mutex, PoisonError};

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::engine::{Engine, EngineError};
use super::lookup::{Lookups, environment, index_in_grid};
use super::sampling::{Starts, Table, aim};
use crate::form_factors::{Row, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;
use crate::simd::{LANES, multiversion};
use crate::visibility::{Bvh, Frame, Hits, NOTHING, Packet};

/// How rows are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RaysOptions {
    /// Rays a row, 32 to [`MOST_SAMPLES`], rounded up to a power of two. Default 1,024.
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
    halves: [Table; 2],
    seed: u32,
    traced: Mutex<Vec<Box<Traced>>>,
}

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
        let sets = sets_together(patches, bvh, rays / 2);
        let halves = [0, 1].map(|half| Table::new(rays / 2, 2 * options.seed + half, sets));
        let lookups = Lookups::new(bvh.ids(), patches);
        let traced = Mutex::new(Vec::new());
        Self { geometry, patches, bvh, lookups, halves, seed: options.seed, traced }
    }

    /// Rays a row.
    #[must_use]
    pub fn samples(&self) -> usize {
        2 * self.halves[0].points()
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        self.together(&[id], std::slice::from_mut(row));
    }

    /// Makes the rows of patches that share packets.
    fn together(&self, ids: &[PatchId], rows: &mut [Row]) {
        let mut traced = self.locked().pop().unwrap_or_default();
        make_rows(self, ids, &mut traced, rows);
        self.locked().push(traced);
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Vec<Box<Traced>>> {
        self.traced.lock().unwrap_or_else(PoisonError::into_inner)
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

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        let me = &*self;
        let sets = self.halves[0].sets();
        let groups = rows.par_chunks(sets).zip(out.par_chunks_mut(sets));
        groups.for_each(|(ids, rows)| me.together(ids, rows));
        Ok(())
    }
}

/// How many patches share packets, so that rays of one begin about as far apart as they end: many
/// if patches are small beside what `rays` from one of them leave between each other.
fn sets_together(patches: &Patches, bvh: &Bvh, rays: usize) -> usize {
    let area: f64 = patches.ids().map(|i| patches.area(i)).sum();
    let apart = bvh.scale() * (LANES as f64 * patches.len() as f64 / (rays as f64 * area)).sqrt();
    // As measured in closed rooms.
    let sets = (0.3 * apart) as usize;
    sets.clamp(1, LANES).next_power_of_two()
}

/// Makes the rows of patches that share packets.
fn make_rows(engine: &Rays<'_>, ids: &[PatchId], traced: &mut Traced, rows: &mut [Row]) {
    let (patches, geometry, bvh) = (engine.patches, engine.geometry, engine.bvh);
    let rays = engine.samples();
    let escape = environment(patches.len());
    traced.starts = Starts::NONE;
    // Sets whose rays begin where the patch is, and not all over its cell.
    let mut one_by_one = Vec::new();
    let lanes = |set| engine.halves[0].lanes(set);
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
    for (half, table) in engine.halves.iter().enumerate() {
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
