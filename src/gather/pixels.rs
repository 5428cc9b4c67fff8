//! Light at many points that lie together, as pictures and bakes need it: direct light exactly or
//! by shadow rays, point by point; what is reflected by few rays a point, to be smoothed.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::bounce::{Landing, Met};
use super::gatherer::{CLEARANCE, Gatherer};
use crate::direct::{self, Receiver, Workspace};
use crate::engines::sampling::{Random, Starts, Table, aim};
use crate::scene::Rgb;
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
    /// Tells points apart.
    pub seed: u64,
}

/// What a point receives by way of other surfaces and of the sky.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Reflected {
    /// Irradiance, W/m² or lx.
    pub irradiance: Rgb,
    /// How far around the point its light may change, m: the distance to the nearest thing that
    /// rays meet, or to where its plane would cut the point's.
    pub reach: f64,
}

/// Buffers.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    work: Workspace,
    packets: Vec<Packet>,
    hits: Vec<Hits>,
}

/// Of a thing met at a distance d in a plane that cuts the point's plane nearer than that: no
/// nearer than this fraction of d.
const BESIDE: f64 = 0.25;

impl Gatherer<'_> {
    /// The rays of [`reflected`](Self::reflected): so many a point, rounded up to a power of two of
    /// at least 16.
    pub(crate) fn table(&self, rays: usize) -> Table {
        Table::new(rays, self.seed(), LANES)
    }

    /// Direct irradiance from emitters and lamps at points that lie together.
    /// `spread` gives places (m) that a point stands for, by its number and a number of 0..1.
    pub(crate) fn direct(
        &self,
        points: &[Receiving],
        spread: impl Fn(usize, f64) -> DVec3,
        buffers: &mut Buffers,
        found: &mut Vec<Rgb>,
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
        for (i, (p, receiver)) in points.iter().zip(&receivers).enumerate() {
            let sample = |u: glam::DVec2| (spread(i, u.x) + p.face * clear, p.normal, None);
            let (light, _) = self.emitters.light_replicated::<1>(receiver, sample, work);
            found.push(light);
        }
        let starts = points.iter().map(|p| (p.point + p.face * clear, p.normal));
        direct::lamps_over(self.scene, self.bvh, starts, found);
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
        let mut sums = vec![Rgb::ZERO; points.len()];
        for (block, points) in points.chunks(LANES).enumerate() {
            let first = block * LANES;
            self.first_rays(points, table, buffers);
            for (l, p) in points.iter().enumerate() {
                let start = p.point + p.face * (CLEARANCE * self.bvh.scale());
                let receiver =
                    self.emitters.point(start, p.normal, p.seed).with_largest(f32::INFINITY);
                let sum = &mut sums[first + l];
                let reach = self.look_around(p, &receiver, l, buffers, |brought| match brought {
                    Ok(light) => *sum += light,
                    Err(landing) => {
                        landings.push(Landing { sum: (first + l) as u32, ..landing });
                    }
                });
                found.push(Reflected { reach, ..Reflected::default() });
            }
        }
        let seed = points.first().map_or(0, |p| p.seed);
        self.go_on(landings, seed ^ 0x6e61, &mut buffers.work, &mut sums, |_| {});
        let rays = table.points() as f64;
        for (found, sum) in found.iter_mut().zip(sums) {
            found.irradiance = sum / rays;
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

    /// What the rays of lane `l` bring, or where they land near by; yields the point's reach.
    fn look_around(
        &self,
        p: &Receiving,
        receiver: &Receiver,
        l: usize,
        buffers: &Buffers,
        mut bring: impl FnMut(Result<Rgb, Landing>),
    ) -> f64 {
        let (scale, sky) = (self.bvh.scale(), self.scene.sky * PI);
        let face = p.face.as_vec3();
        let mut random = Random::new(p.seed);
        let mut reach = f64::INFINITY;
        for (number, hits) in buffers.hits.iter().enumerate() {
            let distance = f64::from(hits.distance[l]) * scale;
            if hits.item[l] != NOTHING {
                let normal = self.solids[hits.item[l] as usize / 2].normal;
                let along = f64::from(normal.dot(face));
                let in_plane = (1.0 - along * along).max(0.0).sqrt();
                let direction = Vec3::from_array(buffers.packets[number].direction.map(|d| d[l]));
                let height = f64::from(normal.dot(direction).abs()) * distance;
                let beside = height / in_plane.max(1e-9);
                reach = reach.min(beside.clamp(BESIDE * distance, distance));
            }
            match self.met(hits, l, receiver) {
                Met::Sky => bring(Ok(sky)),
                Met::Dark(_) => {}
                Met::Surface { point, emitted } => {
                    bring(Ok(emitted));
                    let chance = || random.numbers::<1>()[0];
                    match self.read(point, (distance, 0), chance) {
                        Some((light, _)) => bring(Ok(light)),
                        None => bring(Err(self.landing(point, 0, Rgb::ONE))),
                    }
                }
            }
        }
        reach
    }
}
