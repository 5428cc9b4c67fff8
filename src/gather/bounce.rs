//! Where rays land near by, they go on.
//!
//! Patches know light no finer than they are. A ray that lands within a size of a patch from where
//! it began would show that: shadows at contacts, blurred over a patch. So it does not read the
//! patch but gathers once more: one shadow ray to one emitter and one to each lamp, and one ray
//! that goes on, until one lands far away (Christensen 1999, "Faster photon map global
//! illumination"; Tabellion & Lamorlette 2004, "An approximate global illumination system for
//! computer generated films"). Between near and far chance decides, so nothing jumps.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::gatherer::{CLEARANCE, Gatherer};
use crate::direct::{self, Receiver};
use crate::engines::sampling::{Random, cosine};
use crate::patches::{PatchId, SurfacePoint, side_index};
use crate::scene::{Rgb, Side};
use crate::simd::LANES;
use crate::visibility::{Frame, Hits, NOTHING, Packet};

/// Emitters that a landing sees under a larger form factor, head on, are left to the ray that goes
/// on: one ray finds them as well as one shadow ray does.
const LARGEST: f32 = 0.1;

/// A ray that is near after so many turns reads the patch all the same.
const MOST_TURNS: usize = 100;

/// A place where a ray landed near by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Landing {
    /// Which sum it adds to, and with what weight.
    pub sum: u32,
    pub weight: Rgb,
    /// Clear of the surface, m.
    pub start: DVec3,
    pub normal: DVec3,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) enum Met {
    /// Nothing.
    Sky,
    /// A side that exchanges no light.
    Dark(Side),
    /// A side that does.
    Surface {
        point: SurfacePoint,
        /// What it emits, as far as this is not found by other means; less an estimate of what it
        /// reflects, where that is.
        emitted: Rgb,
    },
}

/// A patch that a ray reads, and the ray's weight: a reflectance, times whatever is between.
pub(super) type Read = (PatchId, Rgb);

impl Gatherer<'_> {
    /// What lane `l` of a packet met, on its way to a receiver.
    pub(super) fn met(&self, hits: &Hits, l: usize, receiver: &Receiver) -> Met {
        let item = hits.item[l];
        if item == NOTHING {
            return Met::Sky;
        }
        let solid = &self.solids[item as usize / 2];
        let triangle = solid.id;
        let side = if item & 1 == 1 { Side::Back } else { Side::Front };
        if !solid.exchanges[item as usize & 1] {
            return Met::Dark(side);
        }
        let emitted = if !solid.emits {
            Rgb::ZERO
        } else {
            let e = self.scene.optics.emission(triangle, side);
            let side = side_index(triangle, side);
            let analytic = e != Rgb::ZERO && self.emitters.is_analytic(receiver, side);
            if analytic { -self.reflected[side] } else { e }
        };
        let uv = [hits.u[l], hits.v[l]].map(f64::from).into();
        Met::Surface { point: SurfacePoint { triangle, side, uv }, emitted }
    }

    /// The radiosity (W/m² or lx) that a point reflects, as its patch knows it, and that patch;
    /// `None` if it is so near (a distance in m, of a ray that has made so many `turns`) that it
    /// is to be gathered. `chance` is a number of 0..1.
    pub(super) fn read(
        &self,
        p: SurfacePoint,
        (distance, turns): (f64, usize),
        chance: impl FnOnce() -> f64,
    ) -> Option<(Rgb, Read)> {
        let rho = self.scene.optics.reflectance[p.triangle.index()];
        let Some(id) = self.patches.at(p) else {
            return Some((Rgb::ZERO, (PatchId(0), Rgb::ZERO)));
        };
        let limit = f64::from(self.near[id.index()]);
        let near = (2.0 - distance / limit).min(1.0);
        let is_near = limit > 0.0 && rho != Rgb::ZERO && near > 0.0 && turns < MOST_TURNS;
        if is_near && (near >= 1.0 || chance() < near) {
            return None;
        }
        let radius = f64::from(self.radii[id.index()]);
        let light = if limit == 0.0 && distance < 2.0 * radius {
            self.field.within(id, p)
        } else {
            self.field.of_patches()[id.index()]
        };
        Some((rho * light, (id, rho)))
    }

    /// Where a ray that met a near point goes on from.
    pub(super) fn landing(&self, p: SurfacePoint, sum: u32, weight: Rgb) -> Landing {
        let g = &self.scene.geometry;
        let normal = g.normal(p.triangle, p.side);
        let start = p.position(g) + normal * (CLEARANCE * self.bvh.scale());
        let rho = self.reflectance(p);
        Landing { sum, weight: weight * rho, start, normal }
    }

    /// Adds to `sums` what landings bring, and to `reads` the patches read.
    pub(super) fn go_on(
        &self,
        mut landings: Vec<Landing>,
        seed: u64,
        sums: &mut [Rgb],
        mut reads: impl FnMut(Read),
    ) {
        let mut random = Random::new(seed);
        let (scale, sky) = (self.bvh.scale(), self.scene.sky * PI);
        for turns in 1.. {
            if landings.is_empty() {
                return;
            }
            let receiver =
                |l: &Landing| self.emitters.point(l.start, l.normal, 0).with_largest(LARGEST);
            let mut receivers: Vec<Receiver> = landings.iter().map(receiver).collect();
            self.direct_of(&landings, &receivers, &mut random, sums);
            if turns > self.turns {
                // Rays that bring little go on for others like them too (Arvo & Kirk 1990,
                // "Particle transport and image synthesis").
                landings.retain_mut(|l| {
                    let chance = l.weight.max_element().min(1.0);
                    l.weight /= chance;
                    random.numbers::<1>()[0] < chance
                });
                if landings.is_empty() {
                    return;
                }
                receivers = landings.iter().map(receiver).collect();
            }
            let mut packets = vec![Packet::EMPTY; landings.len().div_ceil(LANES)];
            for (i, l) in landings.iter().enumerate() {
                let [u, v] = random.numbers();
                let way = cosine(u as f32, v as f32).map(f64::from);
                let axes = Frame::on_surface(l.start, l.normal).axes;
                let way: DVec3 = axes.iter().zip(way).map(|(a, w)| *a * w).sum();
                let from = self.bvh.local(l.start);
                packets[i / LANES].set(i % LANES, from, way.as_vec3(), f32::INFINITY, None);
            }
            let mut hits = vec![Hits::NONE; packets.len()];
            self.bvh.closest(&packets, &mut hits);
            let mut next = Vec::new();
            for (i, (l, receiver)) in landings.iter().zip(&receivers).enumerate() {
                let (hits, lane) = (&hits[i / LANES], i % LANES);
                match self.met(hits, lane, receiver) {
                    Met::Sky => sums[l.sum as usize] += l.weight * sky,
                    Met::Dark(_) => {}
                    Met::Surface { point, emitted } => {
                        sums[l.sum as usize] += l.weight * emitted;
                        let distance = f64::from(hits.distance[lane]) * scale;
                        let chance = || random.numbers::<1>()[0];
                        match self.read(point, (distance, turns), chance) {
                            Some((light, (id, rho))) => {
                                sums[l.sum as usize] += l.weight * light;
                                reads((id, rho * l.weight));
                            }
                            None => next.push(self.landing(point, l.sum, l.weight)),
                        }
                    }
                }
            }
            landings = next;
        }
    }

    /// Adds to `sums` what landings reflect of emitters and lamps.
    fn direct_of(
        &self,
        landings: &[Landing],
        receivers: &[Receiver],
        random: &mut Random,
        sums: &mut [Rgb],
    ) {
        let mut segments: Vec<(u32, Rgb, Vec3, Vec3)> = Vec::new();
        for (l, receiver) in landings.iter().zip(receivers) {
            let from = self.bvh.local(l.start);
            if let Some((light, to)) = self.emitters.one(receiver, random) {
                segments.push((l.sum, l.weight * light, from, self.bvh.local(to) - from));
            }
        }
        let mut packets = vec![Packet::EMPTY; segments.len().div_ceil(LANES)];
        for (i, (_, _, from, way)) in segments.iter().enumerate() {
            packets[i / LANES].set(i % LANES, *from, *way, 1.0, None);
        }
        let mut blocked = vec![0_u16; packets.len()];
        self.bvh.blocked(&packets, &mut blocked);
        for (i, (sum, light, ..)) in segments.iter().enumerate() {
            if blocked[i / LANES] >> (i % LANES) & 1 == 0 {
                sums[*sum as usize] += *light;
            }
        }
        if !self.scene.lamps.is_empty() {
            let mut found = vec![Rgb::ZERO; landings.len()];
            let points = landings.iter().map(|l| (l.start, l.normal));
            direct::lamps_over(self.scene, self.bvh, points, &mut found);
            for (l, found) in landings.iter().zip(found) {
                sums[l.sum as usize] += l.weight * found;
            }
        }
    }
}
