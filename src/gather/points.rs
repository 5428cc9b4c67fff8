//! Irradiance at points: the rays of each, what they bring, and what is left open.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bounce::{Landing, Met, Read};
use super::estimate::{Estimate, Place, Probe};
use super::gatherer::{CLEARANCE, GATHER, Gatherer};
use super::options::SETS;
use crate::direct::{self, Receiver, Workspace};
use crate::engines::sampling::{Random, Starts, Table, aim};
use crate::patches::PatchId;
use crate::progress::{Cancelled, Progress};
use crate::scene::{Rgb, Side, luminance};
use crate::simd::LANES;
use crate::uncertainty::IN_COMMON;
use crate::visibility::{COVERED, Frame, Hits, NOTHING, Packet};

/// Half the width of the 95 % interval of Student's t with [`SETS`] - 1 degrees of freedom.
const STUDENT: f64 = 2.131;

/// Half the width of the 95 % interval of a normal distribution.
const NORMAL: f64 = 1.96;

/// What the rays of a point met, counted.
#[derive(Debug, Default)]
struct Tally {
    escaped: usize,
    /// Backs that do not reflect, and all backs.
    dark: usize,
    backs: usize,
    /// What the errors of patches contribute, ray by ray: noise, and what their size blurs.
    doubts: Vec<(PatchId, Rgb, Rgb)>,
    /// Where they landed near by.
    near: Vec<Landing>,
}

impl Tally {
    /// Notes what a patch that is read contributes to the error.
    fn read(&mut self, gatherer: &Gatherer<'_>, (id, weight): Read) {
        if weight != Rgb::ZERO {
            let (noise, blur) = gatherer.doubt[id.index()];
            self.doubts.push((id, weight * noise, weight * blur));
        }
    }
}

impl Gatherer<'_> {
    /// Irradiance at many points, the same for any number of threads. Advances by one for each
    /// point.
    ///
    /// # Errors
    /// If the caller cancelled.
    pub fn all(
        &self,
        probes: &[Probe],
        progress: &dyn Progress,
    ) -> Result<Vec<Estimate>, Cancelled> {
        probes
            .par_iter()
            .enumerate()
            .map(|(i, probe)| {
                progress.advance(1)?;
                Ok(self.at(*probe, i as u64))
            })
            .collect()
    }

    /// Irradiance at one point; `index` (below 2³²) tells points apart, so that their errors are
    /// independent.
    #[must_use]
    pub fn at(&self, probe: Probe, index: u64) -> Estimate {
        let mut k = 0;
        loop {
            let (found, of_solution) = self.look_from(probe, index, k);
            let light = luminance(found.irradiance).max(self.dark);
            let wanted = self.options.error.map_or(f64::INFINITY, |e| e * light);
            k += 1;
            // What the solution does not know more rays do not mend.
            let is_done = luminance(found.error) <= wanted || luminance(of_solution) > wanted;
            if is_done || k == self.tables.len() {
                return found;
            }
        }
    }

    /// Whether a point lies within a solid, or under one: it sees backs for the most part, and
    /// little light.
    pub(crate) fn is_enclosed(&self, probe: Probe, index: u64) -> bool {
        /// Share of rays that meet backs.
        const BACKS: f64 = 0.7;
        /// Of the mean irradiance; what leaks in at contacts is less.
        const DIM: f64 = 0.2;
        let start = probe.point + probe.normal * (CLEARANCE * self.bvh.scale());
        let receiver = self.emitters.point(start, probe.normal, index);
        let hits = self.cast(start, probe.normal, index, &self.tables[0]);
        let rays = (SETS * hits.len()) as f64;
        let (mut backs, mut light) = (0, 0.0);
        for (hits, set) in hits.iter().flat_map(|h| (0..SETS).map(move |set| (h, set))) {
            match self.met(hits, set, &receiver) {
                Met::Sky => light += PI * luminance(self.scene.sky),
                Met::Dark(side) => backs += usize::from(side == Side::Back),
                Met::Surface { point, .. } => {
                    backs += usize::from(point.side == Side::Back);
                    let emission = self.scene.optics.emission(point.triangle, point.side);
                    let known = self.patches.at(point).map(|p| self.solution.irradiance[p.index()]);
                    let reflected = known.unwrap_or_default() * self.reflectance(point);
                    light += luminance(emission + reflected);
                }
            }
        }
        backs as f64 > BACKS * rays && light < DIM * self.mean() * rays
    }

    /// Irradiance at a point by the rays of look `k`, and what the solution adds to its error.
    fn look_from(&self, probe: Probe, index: u64, k: usize) -> (Estimate, Rgb) {
        let table = &self.tables[k];
        let Probe { point, normal } = probe;
        let start = point + normal * (CLEARANCE * self.bvh.scale());
        let receiver = self.emitters.point(start, normal, index);
        let here = |_| (start, normal, None);
        let mut work = Workspace::default();
        let shadow = self.options.shadow() << (2 * k);
        self.emitters.look(std::slice::from_ref(&receiver), &mut work);
        let (direct, sets) =
            self.emitters.light_replicated::<{ SETS / 2 }>(&receiver, here, shadow, &mut work);
        let mut lamps = [Rgb::ZERO];
        let here_alone = std::iter::once((start, normal));
        direct::lamps_over(self.scene, self.bvh, here_alone, &mut lamps);

        let rays = table.points();
        let hits = self.cast(start, normal, index, table);
        let mut tally = Tally::default();
        let mut gathered: Vec<Rgb> =
            (0..SETS).map(|set| self.gather(&receiver, &hits, set, &mut tally)).collect();
        let near = std::mem::take(&mut tally.near);
        let seed = index << 32 ^ u64::from(GATHER ^ self.seed);
        self.go_on(near, seed, &mut gathered, |read| tally.read(self, read));
        let mut alone: Vec<Rgb> = sets.iter().flatten().copied().collect();
        for (alone, gathered) in alone.iter_mut().zip(&mut gathered) {
            *gathered /= rays as f64;
            *alone += *gathered;
        }
        let reflected = gathered.iter().sum::<Rgb>() / SETS as f64;
        let irradiance = direct + lamps[0] + reflected;
        let mean = alone.iter().sum::<Rgb>() / SETS as f64;
        let squares: Rgb = alone.iter().map(|h| (*h - mean) * (*h - mean)).sum();
        let noise = (squares / (SETS * (SETS - 1)) as f64).map(f64::sqrt);
        let doubt = spread(&mut tally.doubts) / (SETS * rays) as f64;
        let fraction = |count: usize| count as f64 / (SETS * rays) as f64;
        let dark = fraction(tally.backs) > COVERED && irradiance.max_element() <= self.dark;
        let place = if self.is_on_emitter(start, normal) {
            Place::OnEmitter
        } else if dark || fraction(tally.dark) > COVERED {
            Place::Covered
        } else {
            Place::Free
        };
        let error = noise * STUDENT + doubt * NORMAL;
        let found = Estimate { irradiance, error, place, escaped: fraction(tally.escaped) };
        (found, doubt * NORMAL)
    }

    /// Traces the rays of all sets.
    fn cast(&self, start: DVec3, normal: DVec3, index: u64, table: &Table) -> Vec<Hits> {
        let axes = Frame::on_surface(start, normal).axes.map(|a| a.as_vec3());
        let mut starts = Starts::NONE;
        for set in 0..SETS {
            // A triangle without extent is a point.
            starts.set(set, [self.bvh.local(start), Vec3::ZERO, Vec3::ZERO], axes, NOTHING);
            let seed = GATHER ^ self.seed.wrapping_mul(SETS as u32).wrapping_add(set as u32);
            starts.set_mask(set, table.mask(index << 32 | u64::from(seed)));
        }
        let mut packets = vec![Packet::EMPTY; table.packets().len()];
        aim(table.packets(), &starts, &mut packets);
        if (start - self.bvh.center()).length() > 2.0 * self.bvh.scale() {
            for packet in &mut packets {
                for l in 0..LANES {
                    let [x, y, z] = packet.direction.map(|d| f64::from(d[l]));
                    let from = self.bvh.local(self.bvh.approach(start, DVec3::new(x, y, z)));
                    for axis in 0..3 {
                        packet.origin[axis][l] = from[axis];
                    }
                }
            }
        }
        let mut hits = vec![Hits::NONE; packets.len()];
        self.bvh.closest(&packets, &mut hits);
        hits
    }

    /// Sum of what the rays of a set bring: all that is reflected, and what emitters emit
    /// that are not analytic. What lands near by goes to the tally.
    fn gather(&self, receiver: &Receiver, hits: &[Hits], set: usize, tally: &mut Tally) -> Rgb {
        let (scale, sky) = (self.bvh.scale(), self.scene.sky * PI);
        let mut sum = Rgb::ZERO;
        for (number, hits) in hits.iter().enumerate() {
            match self.met(hits, set, receiver) {
                Met::Sky => {
                    tally.escaped += 1;
                    sum += sky;
                }
                Met::Dark(side) => {
                    tally.backs += usize::from(side == Side::Back);
                    tally.dark += 1;
                }
                Met::Surface { point, emitted } => {
                    tally.backs += usize::from(point.side == Side::Back);
                    sum += emitted;
                    let distance = f64::from(hits.distance[set]) * scale;
                    let seed = receiver.seed() ^ (number as u64) << 16 ^ set as u64;
                    let chance = || Random::new(seed).numbers::<1>()[0];
                    match self.read(point, (distance, 0), chance) {
                        Some((light, read)) => {
                            sum += light;
                            tally.read(self, read);
                        }
                        None => tally.near.push(self.landing(point, set as u32, Rgb::ONE)),
                    }
                }
            }
        }
        sum
    }

    /// Whether the surface just behind the point emits towards the side of the normal.
    fn is_on_emitter(&self, start: DVec3, normal: DVec3) -> bool {
        let met = self.bvh.see(start, -normal, None);
        met.is_some_and(|m| {
            m.distance <= 2.0 * CLEARANCE * self.bvh.scale()
                && self.scene.geometry.exchanges(m.triangle, m.side)
                && self.scene.optics.emission(m.triangle, m.side) != Rgb::ZERO
        })
    }
}

/// Standard error of a sum over rays, each of which carries the errors of a patch: patches err
/// independently, and by their noise and a share of what they blur also all together.
fn spread(doubts: &mut [(PatchId, Rgb, Rgb)]) -> Rgb {
    doubts.sort_unstable_by_key(|d| d.0);
    let (mut squares, mut all, mut all_blurred) = (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO);
    for patch in doubts.chunk_by(|a, b| a.0 == b.0) {
        let noise: Rgb = patch.iter().map(|d| d.1).sum();
        let blur: Rgb = patch.iter().map(|d| d.2).sum();
        squares += noise * noise + blur * blur;
        all += noise;
        all_blurred += blur * IN_COMMON;
    }
    (squares + all * all + all_blurred * all_blurred).map(f64::sqrt)
}
