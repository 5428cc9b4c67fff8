//! Light at many points that lie together, as pictures and bakes need it: direct light exactly or
//! by shadow rays, point by point; what is reflected by few rays a point, to be smoothed.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use super::bounce::{Landing, Met};
use super::gatherer::{CLEARANCE, Gatherer};
use crate::direct::{self, Receiver, Workspace};
use crate::engines::sampling::{Random, Starts, Table, aim};
use crate::scene::{Rgb, luminance};
use crate::simd::LANES;
use crate::visibility::{Frame, Hits, NOTHING, Packet};

/// A point of a surface that receives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Receiving {
    /// Metres; on the surface, or above it where a curved one is meant.
    pub point: DVec3,
    /// Unit normal of the face.
    pub face: DVec3,
    /// Unit normal of the curved surface that the face stands for.
    pub normal: DVec3,
    /// Width of what it stands for, m.
    pub size: f64,
    /// Tells points apart.
    pub seed: u64,
}

/// What a point receives by way of other surfaces and of the sky.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Reflected {
    /// Irradiance, W/m² or lx.
    pub irradiance: Rgb,
    /// Variance of its luminance, as rays that know nothing of each other differ.
    pub variance: f64,
    pub near: Near,
}

/// What shapes the light around a point most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// How far around the point its light may change, m: the distance to the nearest thing that
    /// rays meet, or to where its plane would cut the point's.
    pub reach: f64,
    /// The direction to that, along the surface.
    pub toward: Vec3,
}

impl Default for Near {
    fn default() -> Self {
        Self { reach: f64::INFINITY, toward: Vec3::ZERO }
    }
}

impl Near {
    /// The nearer of two.
    pub fn or(self, other: Self) -> Self {
        if other.reach < self.reach { other } else { self }
    }
}

/// Rays of a look that tell how far light is alike: more would hardly tell more.
const TELLING: usize = 32;

/// Sets of rays whose differences tell the variance.
const BATCHES: usize = 4;

/// Buffers.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    work: Workspace,
    packets: Vec<Packet>,
    hits: Vec<Hits>,
}

/// Points so many sizes apart share what they know of shadows.
const BESIDE_IT: f64 = 2.5;

/// Of a thing met at a distance d in a plane that cuts the point's plane nearer than that: no
/// nearer than this fraction of d.
const BESIDE: f64 = 0.25;

impl Gatherer<'_> {
    /// The rays of [`reflected`](Self::reflected): so many a point, rounded up to a power of two of
    /// at least 16.
    pub(crate) fn table(&self, rays: usize) -> Table {
        Table::new(rays, self.seed(), LANES)
    }

    /// Direct irradiance from emitters, and from `lamps` if they count, at points that lie
    /// together, and the variance of its luminance.
    /// `spread` gives places (m) that a point stands for, by its number and a point of the unit
    /// square.
    pub(crate) fn direct(
        &self,
        points: &[Receiving],
        spread: impl Fn(usize, DVec2) -> DVec3,
        lamps: bool,
        buffers: &mut Buffers,
        found: &mut Vec<(Rgb, f64)>,
    ) {
        let clear = CLEARANCE * self.bvh.scale();
        let work = &mut buffers.work;
        let receivers: Vec<Receiver> = points
            .iter()
            .map(|p| {
                let at = p.point + p.face * clear;
                self.emitters.point(at, p.normal, p.seed).with_largest(f32::INFINITY)
            })
            .collect();
        self.emitters.look(&receivers, work);
        found.clear();
        found.resize(points.len(), (Rgb::ZERO, 0.0));
        let sample = |i: usize, u: DVec2| {
            let p = &points[i];
            (spread(i, u) + p.face * clear, p.normal, None)
        };
        let near = |i: usize| BESIDE_IT * points[i].size;
        self.emitters.light_together(&receivers, sample, near, work, found);
        if !lamps {
            return;
        }
        let starts = points.iter().map(|p| (p.point + p.face * clear, p.normal));
        let mut lamps = vec![Rgb::ZERO; points.len()];
        direct::lamps_over(self.scene, self.bvh, starts, &mut lamps);
        for (found, lamp) in found.iter_mut().zip(lamps) {
            found.0 += lamp;
        }
    }

    /// What points that lie together receive by way of other surfaces, and of the sky; `table`
    /// says by how many rays each.
    pub(crate) fn reflected(
        &self,
        points: &[Receiving],
        table: &Table,
        buffers: &mut Buffers,
        found: &mut Vec<Reflected>,
    ) {
        found.clear();
        let mut landings = Vec::new();
        let mut sums = vec![Rgb::ZERO; BATCHES * points.len()];
        for (block, points) in points.chunks(LANES).enumerate() {
            let first = block * LANES;
            self.first_rays(points, table, buffers);
            for (l, p) in points.iter().enumerate() {
                let start = p.point + p.face * (CLEARANCE * self.bvh.scale());
                let receiver =
                    self.emitters.point(start, p.normal, p.seed).with_largest(f32::INFINITY);
                let own = BATCHES * (first + l);
                let near =
                    self.look_around(p, &receiver, l, buffers, |batch, brought| match brought {
                        Ok(light) => sums[own + batch] += light,
                        Err(landing) => {
                            landings.push(Landing { sum: (own + batch) as u32, ..landing });
                        }
                    });
                found.push(Reflected { near, ..Reflected::default() });
            }
        }
        let seed = points.first().map_or(0, |p| p.seed);
        self.go_on(landings, seed ^ 0x6e61, &mut sums, |_| {});
        let rays = table.points() as f64;
        for (found, sums) in found.iter_mut().zip(sums.chunks_exact(BATCHES)) {
            found.irradiance = sums.iter().sum::<Rgb>() / rays;
            let mean = luminance(found.irradiance);
            let off = |sum: &Rgb| luminance(*sum) * BATCHES as f64 / rays - mean;
            let squares: f64 = sums.iter().map(|s| off(s).powi(2)).sum();
            found.variance = squares / (BATCHES * (BATCHES - 1)) as f64;
        }
    }

    /// Traces the first rays of up to [`LANES`] points, a lane each.
    fn first_rays(&self, points: &[Receiving], table: &Table, buffers: &mut Buffers) {
        let mut starts = Starts::NONE;
        for (l, p) in points.iter().enumerate() {
            let start = p.point + p.face * (CLEARANCE * self.bvh.scale());
            let axes = Frame::on_surface(start, p.normal).axes.map(|a| a.as_vec3());
            starts.set(l, [self.bvh.local(start), Vec3::ZERO, Vec3::ZERO], axes, NOTHING);
            starts.set_mask(l, table.mask(p.seed));
        }
        buffers.packets.clear();
        buffers.packets.resize(table.packets().len(), Packet::EMPTY);
        aim(table.packets(), &starts, &mut buffers.packets);
        for (l, p) in points.iter().enumerate().filter(|(_, p)| p.face != p.normal) {
            // Rays that would go into the face are mirrored by it.
            let face = p.face.as_vec3();
            for packet in &mut buffers.packets {
                let d = Vec3::from_array(packet.direction.map(|d| d[l]));
                let up = d.dot(face);
                if up < 0.0 {
                    let d = d - face * (2.0 * up);
                    (0..3).for_each(|axis| packet.direction[axis][l] = d[axis]);
                }
            }
        }
        buffers.hits.clear();
        buffers.hits.resize(buffers.packets.len(), Hits::NONE);
        self.bvh.closest(&buffers.packets, &mut buffers.hits);
    }

    /// What the rays of lane `l` bring, or where they land near by, and for which batch; yields
    /// what is nearest.
    fn look_around(
        &self,
        p: &Receiving,
        receiver: &Receiver,
        l: usize,
        buffers: &Buffers,
        mut bring: impl FnMut(usize, Result<Rgb, Landing>),
    ) -> Near {
        let (scale, sky) = (self.bvh.scale(), self.scene.sky * PI);
        let face = p.face.as_vec3();
        let mut random = Random::new(p.seed);
        let mut nearest = Near::default();
        // Rays are sorted by where they go.
        let step = (buffers.hits.len() / TELLING).max(1);
        for (number, hits) in buffers.hits.iter().enumerate() {
            let distance = f64::from(hits.distance[l]) * scale;
            if number % step == 0 {
                nearest = nearest.or(self.near_of(&buffers.packets[number], hits, l, face));
            }
            let batch = number % BATCHES;
            match self.met(hits, l, receiver) {
                Met::Sky => bring(batch, Ok(sky)),
                Met::Dark(_) => {}
                Met::Surface { point, emitted } => {
                    bring(batch, Ok(emitted));
                    let chance = || random.numbers::<1>()[0];
                    match self.read(point, (distance, 0), chance) {
                        Some((light, _)) => bring(batch, Ok(light)),
                        None => bring(batch, Err(self.landing(point, 0, Rgb::ONE))),
                    }
                }
            }
        }
        nearest
    }

    /// How far from where the ray of lane `l` began, on a surface with the normal `face`, light may
    /// change because of what it met.
    pub(super) fn near_of(&self, packet: &Packet, hits: &Hits, l: usize, face: Vec3) -> Near {
        if hits.item[l] == NOTHING {
            return Near::default();
        }
        let distance = f64::from(hits.distance[l]) * self.bvh.scale();
        let normal = self.solids[hits.item[l] as usize / 2].normal;
        let along = f64::from(normal.dot(face));
        let in_plane = (1.0 - along * along).max(0.0).sqrt();
        let direction = Vec3::from_array(packet.direction.map(|d| d[l]));
        let height = f64::from(normal.dot(direction).abs()) * distance;
        let beside = height / in_plane.max(1e-9);
        let reach = beside.clamp(BESIDE * distance, distance);
        let along = normal - face * normal.dot(face);
        let toward = along.normalize_or_zero() * along.dot(direction).signum();
        Near { reach, toward }
    }
}
