//! Irradiance and pictures by following light backwards along random paths: slow, plain, and
//! independent of patches, form factors and solvers. An oracle with error bars.
//!
//! ```text
//! H = ∫ L cos θ dω = π E[L]        L = L_e + ρ H / π        over directions of density cos θ / π
//! ```
//!
//! A path goes on from where it lands with the probability of the largest reflectance there, and
//! picks up the emission of whatever it lands on (Kajiya 1986, "The rendering equation").
//!
//! # Led paths
//!
//! [`Paths::led`] also looks from each place to a point of an emitter, chosen in proportion to
//! exitance, and to all lamps. An emitter's point counts by either way in proportion to the density
//! with which that way finds it, so nothing counts twice (Veach & Guibas 1995, "Optimally combining
//! sampling techniques", the balance heuristic). First directions and choices are stratified in
//! blocks, and errors are told by what blocks differ in.

mod lights;
mod noise;
mod pictures;

use std::f64::consts::PI;

use glam::DVec3;
use hemicube::scene::{Rgb, Scene, Side, TriangleId, luminance};
use hemicube::visibility::{Bvh, Hits, NOTHING, Packet, ROUNDING};
use rayon::prelude::*;

use lights::Lights;
pub use noise::{Noise, diffuse};
pub use pictures::{Block, Face};

/// Paths that are followed together. Sums are made in the order of these blocks, whatever thread
/// they come from.
const BLOCK: u32 = 4096;

/// Led paths along each side of a stratified block.
const STRATA: usize = 32;

/// Blocks of led paths that are followed before it is asked whether they suffice.
const BLOCKS: u32 = 16;

/// Rays in a packet.
const LANES: usize = 16;

/// Irradiance (W/m² or lx) at a point (m) on or before a surface of that unit normal, as a mean
/// over `paths` paths, and the standard error of the mean.
///
/// Emitting surfaces and the sky count; lamps do not, as no path lands on them. The same for any
/// number of threads.
pub fn irradiance(scene: &Scene, bvh: &Bvh, point: DVec3, normal: DVec3, paths: u32) -> (Rgb, Rgb) {
    assert!(scene.lamps.is_empty(), "no path lands on a lamp");
    let walk = Walk { scene, bvh, lights: None };
    let origin = above(bvh, point, normal);
    let blocks: Vec<(Rgb, Rgb)> = (0..paths.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let count = BLOCK.min(paths - block * BLOCK);
            let mut noise = Noise::new(origin, block);
            let ends = (0..count as usize)
                .map(|path| End {
                    path,
                    origin,
                    direction: diffuse(normal, noise.square()),
                    own: None,
                    weight: Rgb::ONE,
                    emission: Emission::Counts,
                })
                .collect();
            sums(&walk.follow(ends, Vec::new(), noise).0)
        })
        .collect();
    let n = f64::from(paths);
    let total = blocks.iter().fold((Rgb::ZERO, Rgb::ZERO), |s, b| (s.0 + b.0, s.1 + b.1));
    let mean = total.0 / n;
    let variance = (total.1 / n - mean * mean).max(Rgb::ZERO) / (n - 1.0);
    (mean, variance.map(f64::sqrt))
}

/// Sum and sum of squares.
fn sums(found: &[Rgb]) -> (Rgb, Rgb) {
    (found.iter().sum(), found.iter().map(|h| h * h).sum())
}

/// Mean of the means of blocks, and its standard error.
fn of_blocks(blocks: &[Rgb]) -> (Rgb, Rgb) {
    let n = blocks.len() as f64;
    let mean = blocks.iter().sum::<Rgb>() / n;
    let squares: Rgb = blocks.iter().map(|b| (b - mean) * (b - mean)).sum();
    (mean, (squares / (n * (n - 1.0))).map(f64::sqrt))
}

/// Clear of the surface that the point lies on, whichever side of it faces the normal.
fn above(bvh: &Bvh, point: DVec3, normal: DVec3) -> DVec3 {
    point + normal * (4.0 * ROUNDING * bvh.scale())
}

/// Paths that are led to what emits.
pub struct Paths<'a>(Walk<'a>);

impl<'a> Paths<'a> {
    pub fn led(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        Self(Walk { scene, bvh, lights: Some(Lights::new(scene)) })
    }

    /// Irradiance (W/m² or lx) at a point (m) on or before a surface of that unit normal, and its
    /// standard error. Paths are followed until that of luminance is at most `error` (W/m² or lx)
    /// or, if that is more, `share` of what was found, but no more than `most`. The same for any
    /// number of threads.
    pub fn irradiance(
        &self,
        point: DVec3,
        normal: DVec3,
        (error, share): (f64, f64),
        most: u32,
    ) -> (Rgb, Rgb) {
        let origin = above(self.0.bvh, point, normal);
        self.until((error, share), most, |block| self.block(origin, normal, block))
    }

    /// Which share of the emitters that a point faces is hidden from it, asked at `count` points of
    /// them; `None` if it faces less than a quarter of these.
    pub fn hidden(
        &self,
        point: DVec3,
        normal: DVec3,
        count: usize,
        noise: &mut Noise,
    ) -> Option<f64> {
        let lights = self.0.lights.as_ref()?;
        let (mut faced, mut hidden) = (0, 0);
        for k in 0..count {
            let choice = (k as f64 + noise.next()) / count as f64;
            let spot = lights.spot(self.0.scene, choice, noise.square())?;
            if spot.arriving(point, normal) != Rgb::ZERO {
                faced += 1;
                hidden += usize::from(self.0.bvh.blocks(point, spot.position));
            }
        }
        (4 * faced >= count).then_some(hidden as f64 / f64::from(faced as u32))
    }

    /// Follows blocks of paths, each with its mean, until the standard error is small enough.
    fn until(
        &self,
        (error, share): (f64, f64),
        most: u32,
        block: impl Fn(u32) -> Rgb + Sync,
    ) -> (Rgb, Rgb) {
        let per_block = (STRATA * STRATA) as u32;
        let mut blocks: Vec<Rgb> = Vec::new();
        let mut more = BLOCKS;
        loop {
            let done = blocks.len() as u32;
            let new: Vec<Rgb> = (done..done + more).into_par_iter().map(&block).collect();
            blocks.extend(new);
            let (mean, deviation) = of_blocks(&blocks);
            let off = luminance(deviation) / error.max(share * luminance(mean));
            let done = done + more;
            // Darkness is no number of times too dark.
            if off.is_nan() || off <= 1.0 || done * per_block >= most {
                return (mean, deviation);
            }
            // As many more as are likely to suffice, but that is known roughly alone.
            more = ((f64::from(done) * (off * off - 1.0)) as u32).clamp(BLOCKS / 2, 4 * done);
            more = more.min(most.div_ceil(per_block) - done);
        }
    }

    /// Mean over a stratified block of paths from a point.
    fn block(&self, origin: DVec3, normal: DVec3, block: u32) -> Rgb {
        let mut noise = Noise::new(origin, block);
        let count = STRATA * STRATA;
        let mut shadows = Vec::new();
        let choice = noise.next();
        let mut ends = Vec::with_capacity(count);
        for path in 0..count {
            let direction = diffuse(normal, noise.stratum(path, STRATA));
            let emission = Emission::Shared(direction.dot(normal) / PI);
            ends.push(End { path, origin, direction, own: None, weight: Rgb::ONE, emission });
            // Bits of the number in reverse: even however many come together.
            let even = f64::from((path as u32).reverse_bits()) / 2_f64.powi(32);
            let from = Place { path, origin, normal, own: None, weight: Rgb::ONE };
            let choice = Some((even + choice).fract());
            self.0.look(&from, choice, &mut noise, &mut shadows);
        }
        self.0.follow(ends, shadows, noise).0.iter().sum::<Rgb>() / count as f64
    }
}

/// What paths go through.
struct Walk<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    /// What paths are led to, if they are.
    lights: Option<Lights>,
}

/// How the emission of what a path meets next counts.
#[derive(Clone, Copy)]
enum Emission {
    Counts,
    /// As far as it was not looked for, with the density of the path's direction.
    Shared(f64),
    /// Apart from all else.
    Apart,
}

/// The end of a path that goes on.
struct End {
    /// Which path.
    path: usize,
    origin: DVec3,
    direction: DVec3,
    own: Option<u32>,
    /// What the path brings of what it meets next.
    weight: Rgb,
    emission: Emission,
}

/// Where a path is, and what it brings of the irradiance there.
struct Place {
    path: usize,
    origin: DVec3,
    normal: DVec3,
    own: Option<u32>,
    weight: Rgb,
}

/// What a path brings if nothing is in the way.
struct Shadow {
    path: usize,
    origin: DVec3,
    own: Option<u32>,
    way: DVec3,
    ends: bool,
    brings: Rgb,
}

impl Walk<'_> {
    /// What each path brings, and what it meets first that emits, if that counts apart.
    fn follow(
        &self,
        mut ends: Vec<End>,
        mut shadows: Vec<Shadow>,
        mut noise: Noise,
    ) -> (Vec<Rgb>, Vec<Rgb>) {
        let (scene, bvh) = (self.scene, self.bvh);
        let mut found = vec![Rgb::ZERO; ends.len()];
        let mut apart = vec![Rgb::ZERO; ends.len()];
        self.shine(&mut shadows, &mut found);
        while !ends.is_empty() {
            let mut packets = vec![Packet::EMPTY; ends.len().div_ceil(LANES)];
            for (i, e) in ends.iter().enumerate() {
                let (origin, direction) = (bvh.local(e.origin), e.direction.as_vec3());
                packets[i / LANES].set(i % LANES, origin, direction, f32::INFINITY, e.own);
            }
            let mut hits = vec![Hits::NONE; packets.len()];
            bvh.closest(&packets, &mut hits);
            let mut i = 0;
            ends.retain_mut(|e| {
                let (hits, l) = (&hits[i / LANES], i % LANES);
                i += 1;
                let item = hits.item[l];
                if item == NOTHING {
                    found[e.path] += e.weight * scene.sky * PI;
                    return false;
                }
                let triangle = bvh.ids()[item as usize / 2];
                let side = if item & 1 == 1 { Side::Back } else { Side::Front };
                let distance = f64::from(hits.distance[l]) * bvh.scale();
                let emitted = match scene.geometry.exchanges(triangle, side) {
                    true => scene.optics.emission(triangle, side),
                    false => Rgb::ZERO,
                };
                if emitted != Rgb::ZERO {
                    match e.emission {
                        Emission::Counts => found[e.path] += e.weight * emitted,
                        Emission::Apart => apart[e.path] += emitted,
                        Emission::Shared(density) => {
                            let normal = scene.geometry.normal(triangle, side);
                            let cos = -normal.dot(e.direction);
                            let share = density / (density + self.led(emitted, distance, cos));
                            found[e.path] += e.weight * emitted * share;
                        }
                    }
                }
                let uv = [hits.u[l].into(), hits.v[l].into()];
                self.go_on(e, (triangle, side, item), uv, &mut noise, &mut shadows)
            });
            self.shine(&mut shadows, &mut found);
        }
        (found, apart)
    }

    /// Density of directions with which a point that emits is looked for.
    fn led(&self, emitted: Rgb, distance: f64, cos: f64) -> f64 {
        let density = self.lights.as_ref().map_or(0.0, |l| l.density(emitted));
        density * distance * distance / cos.max(1e-12)
    }

    /// Sends a path on from where it lands, or ends it.
    fn go_on(
        &self,
        end: &mut End,
        (triangle, side, item): (TriangleId, Side, u32),
        [u, v]: [f64; 2],
        noise: &mut Noise,
        shadows: &mut Vec<Shadow>,
    ) -> bool {
        let (g, optics) = (&self.scene.geometry, &self.scene.optics);
        let rho = match g.exchanges(triangle, side) {
            true => optics.reflectance[triangle.index()],
            false => Rgb::ZERO,
        };
        let goes_on = rho.max_element();
        if goes_on <= 0.0 {
            return false;
        }
        let [a, b, c] = g.corners(triangle);
        end.origin = a + (b - a) * u + (c - a) * v;
        end.own = Some(item / 2);
        let normal = g.normal(triangle, side);
        let from = Place {
            path: end.path,
            origin: end.origin,
            normal,
            own: end.own,
            weight: end.weight * rho,
        };
        self.look(&from, None, noise, shadows);
        if noise.next() >= goes_on {
            return false;
        }
        end.weight *= rho / goes_on;
        end.direction = diffuse(normal, noise.square());
        end.emission = match self.lights {
            Some(_) => Emission::Shared(end.direction.dot(normal) / PI),
            None => Emission::Counts,
        };
        true
    }

    /// Looks from a place to a point of an emitter and to all lamps.
    fn look(
        &self,
        from: &Place,
        choice: Option<f64>,
        noise: &mut Noise,
        shadows: &mut Vec<Shadow>,
    ) {
        let Some(lights) = &self.lights else { return };
        let &Place { path, origin, normal, own, weight } = from;
        let mut add = |arriving: Rgb, way: DVec3, ends: bool| {
            if arriving != Rgb::ZERO {
                shadows.push(Shadow { path, origin, own, way, ends, brings: weight * arriving });
            }
        };
        let choice = choice.unwrap_or_else(|| noise.next());
        if let Some(spot) = lights.spot(self.scene, choice, noise.square()) {
            add(spot.arriving(origin, normal), spot.position - origin, true);
        }
        for (arriving, way, ends) in lights.lamps(origin, normal) {
            add(arriving, way, ends);
        }
    }

    /// Adds what is not in the shadow of anything.
    fn shine(&self, shadows: &mut Vec<Shadow>, found: &mut [Rgb]) {
        let bvh = self.bvh;
        let mut packets = vec![Packet::EMPTY; shadows.len().div_ceil(LANES)];
        for (i, s) in shadows.iter().enumerate() {
            let from = bvh.local(s.origin);
            let (way, far) = match s.ends {
                true => (bvh.local(bvh.approach(s.origin + s.way, -s.way)) - from, 1.0),
                false => (s.way.as_vec3(), f32::INFINITY),
            };
            packets[i / LANES].set(i % LANES, from, way, far, s.own);
        }
        let mut blocked = vec![0; packets.len()];
        bvh.blocked(&packets, &mut blocked);
        for (i, s) in shadows.drain(..).enumerate() {
            if blocked[i / LANES] >> (i % LANES) & 1 == 0 {
                found[s.path] += s.brings;
            }
        }
    }
}
