//! Irradiance by following light backwards along random paths: slow, plain, and independent of
//! patches, form factors and solvers. An oracle with error bars.
//!
//! ```text
//! H = ∫ L cos θ dω = π E[L]        L = L_e + ρ H / π        over directions of density cos θ / π
//! ```
//!
//! A path goes on from where it lands with the probability of the largest reflectance there, and
//! picks up the emission of whatever it lands on. It is not led to emitters (Kajiya 1986, "The
//! rendering equation", without his refinements).

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use hemicube::scene::{Rgb, Scene, Side, TriangleId};
use hemicube::visibility::{Bvh, Hits, NOTHING, Packet, ROUNDING};
use rayon::prelude::*;

/// Paths that are followed together. Sums are made in the order of these blocks, whatever thread
/// they come from.
const BLOCK: u32 = 4096;

/// Rays in a packet.
const LANES: usize = 16;

/// Irradiance (W/m² or lx) at a point (m) on or before a surface of that unit normal, as a mean
/// over `paths` paths, and the standard error of the mean.
///
/// Emitting surfaces and the sky count; lamps do not, as no path lands on them. The same for any
/// number of threads.
pub fn irradiance(scene: &Scene, bvh: &Bvh, point: DVec3, normal: DVec3, paths: u32) -> (Rgb, Rgb) {
    assert!(scene.lamps.is_empty(), "no path lands on a lamp");
    // Clear of the surface that the point lies on, whichever side of it faces the normal.
    let origin = point + normal * (4.0 * ROUNDING * bvh.scale());
    let blocks: Vec<(Rgb, Rgb)> = (0..paths.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let count = BLOCK.min(paths - block * BLOCK);
            let noise = Noise::new(origin, block);
            sums(&follow(scene, bvh, origin, normal, count, noise))
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

/// The end of a path that goes on.
struct End {
    /// Which path.
    path: usize,
    origin: DVec3,
    direction: DVec3,
    own: Option<u32>,
    /// What the path brings of what it meets next.
    weight: Rgb,
}

/// What each of `count` paths brings.
fn follow(
    scene: &Scene,
    bvh: &Bvh,
    origin: DVec3,
    normal: DVec3,
    count: u32,
    mut noise: Noise,
) -> Vec<Rgb> {
    let mut found = vec![Rgb::ZERO; count as usize];
    let mut ends: Vec<End> = (0..found.len())
        .map(|path| {
            let direction = noise.diffuse(normal);
            End { path, origin, direction, own: None, weight: Rgb::ONE }
        })
        .collect();
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
            let uv = [hits.u[l].into(), hits.v[l].into()];
            found[e.path] += e.weight * arrive(scene, triangle, item, uv, e, &mut noise);
            e.weight != Rgb::ZERO
        });
    }
    found
}

/// Lands a path on one side of a triangle and sends it on, or ends it with no weight. Returns what
/// that side emits (exitance).
fn arrive(
    scene: &Scene,
    triangle: TriangleId,
    item: u32,
    [u, v]: [f64; 2],
    end: &mut End,
    noise: &mut Noise,
) -> Rgb {
    let side = if item & 1 == 1 { Side::Back } else { Side::Front };
    let (g, optics) = (&scene.geometry, &scene.optics);
    let rho =
        if g.exchanges(triangle, side) { optics.reflectance[triangle.index()] } else { Rgb::ZERO };
    let goes_on = rho.max_element();
    if noise.next() >= goes_on {
        end.weight = Rgb::ZERO;
    } else {
        let [a, b, c] = g.corners(triangle);
        end.weight *= rho / goes_on;
        end.origin = a + (b - a) * u + (c - a) * v;
        end.direction = noise.diffuse(g.normal(triangle, side));
        end.own = Some(item / 2);
    }
    optics.emission(triangle, side)
}

/// Numbers that look random (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
/// generators").
struct Noise(u64);

impl Noise {
    /// Others for each place and block.
    fn new(place: DVec3, block: u32) -> Self {
        let mut noise = Self(u64::from(block));
        for x in place.to_array() {
            noise.0 = noise.bits() ^ x.to_bits();
        }
        noise
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..1.
    fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A unit direction of density cos θ / π about a unit normal.
    fn diffuse(&mut self, normal: DVec3) -> DVec3 {
        let (u, (sin, cos)) = (self.next(), (TAU * self.next()).sin_cos());
        let (x, y) = normal.any_orthonormal_pair();
        let local = DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt());
        DMat3::from_cols(x, y, normal) * local
    }
}
