//! What other surfaces reflect onto a spot, smoothed over its surroundings.
//!
//! Light that comes by way of other surfaces changes slowly: over lengths of the distance to the
//! nearest of them (Ward, Rubinstein & Clear 1988, "A ray tracing solution for diffuse
//! interreflection"). So each spot may share the rays of those around it that lie on the same
//! surface and nearer than a fraction of that distance; where something stands on the surface, that
//! is none (Kontkanen, Räsänen & Keller 2006, "Irradiance filtering for Monte Carlo ray tracing").
//! A plane is fitted to what they found, weighted, and the spot takes its value there: gradients
//! and borders of surfaces do not bias it. Far around, spots are taken together in squares of
//! pixels.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::spots::{Light, SMOOTHED, Spot, Spots};
use crate::gather::{Known, Near};
use crate::scene::Rgb;

/// Spots that lie together.
#[derive(Debug, Clone, Copy)]
struct Clump {
    sheet: u32,
    point: DVec3,
    normal: DVec3,
    light: Rgb,
    rays: f64,
    /// Variance of the light's luminance.
    variance: f64,
    /// Smallest of its spots.
    reach: f64,
    /// What the first of its spots has near by.
    near: Near,
}

/// One level of squares: the clumps of each.
#[derive(Debug, Default)]
struct Level {
    clumps: Vec<Clump>,
    first: Vec<u32>,
    across: usize,
    down: usize,
}

/// Normals that differ by more than this (radians, about) are of different surfaces.
const TURN: f64 = 0.35;

/// Spots farther than this from another's tangent plane, in radii smoothed over, are of different
/// surfaces.
const APART: f64 = 0.25;

/// Spots that are smoothed over fewer pixels than this share light along what is near instead.
const NARROW: f64 = 2.0;

/// Squares of the level used are at least this many to a radius.
const FINE: f64 = 2.0;

impl Clump {
    fn of(spot: &Spot) -> Self {
        Self {
            sheet: spot.sheet,
            point: spot.point,
            normal: spot.normal,
            light: spot.reflected.irradiance,
            rays: f64::from(spot.rays),
            reach: spot.reach,
            variance: spot.reflected.variance,
            near: spot.reflected.near,
        }
    }

    /// Whether two may be taken together.
    fn is_with(&self, other: &Self) -> bool {
        let way = other.point - self.point;
        let near = SMOOTHED * self.reach.min(other.reach);
        let length = way.length();
        self.sheet == other.sheet
            && length < near
            && self.normal.distance(other.normal) < 0.5 * TURN
            && way.dot(self.normal).abs() < 0.5 * APART * length + 1e-9
    }

    fn and(&self, other: &Self) -> Self {
        let rays = self.rays + other.rays;
        let (a, b) = (self.rays / rays, other.rays / rays);
        Self {
            sheet: self.sheet,
            point: self.point * a + other.point * b,
            normal: (self.normal * a + other.normal * b).normalize_or(self.normal),
            light: self.light * a + other.light * b,
            rays,
            variance: a * a * self.variance + b * b * other.variance,
            reach: self.reach.min(other.reach),
            near: self.near,
        }
    }
}

impl Level {
    fn of_pixel(&self, x: usize, y: usize) -> &[Clump] {
        let i = y * self.across + x;
        &self.clumps[self.first[i] as usize..self.first[i + 1] as usize]
    }

    fn above(&self) -> Self {
        let (across, down) = (self.across.div_ceil(2), self.down.div_ceil(2));
        let rows: Vec<Vec<Vec<Clump>>> = (0..down)
            .into_par_iter()
            .map(|y| {
                let square = |x: usize| {
                    let mut joined: Vec<Clump> = Vec::new();
                    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        let (x, y) = (2 * x + i, 2 * y + j);
                        if x >= self.across || y >= self.down {
                            continue;
                        }
                        for clump in self.of_pixel(x, y) {
                            match joined.iter_mut().find(|c| c.is_with(clump)) {
                                Some(c) => *c = c.and(clump),
                                None => joined.push(*clump),
                            }
                        }
                    }
                    joined
                };
                (0..across).map(square).collect()
            })
            .collect();
        let mut me = Self { clumps: Vec::new(), first: vec![0], across, down };
        for square in rows.into_iter().flatten() {
            me.clumps.extend(square);
            me.first.push(me.clumps.len() as u32);
        }
        me
    }
}

/// Smooths what spots of a picture `across` pixels wide found; yields what arrives at each, direct
/// light included.
pub(super) fn smooth(spots: &mut Spots, across: usize) -> Vec<Light> {
    bound_reaches(spots, across);
    let down = (spots.first.len() - 1) / across;
    let mut lowest = Level { clumps: Vec::new(), first: vec![0], across, down };
    for pixel in spots.first.windows(2) {
        let own = &spots.spots[pixel[0] as usize..pixel[1] as usize];
        lowest.clumps.extend(own.iter().filter(|s| s.rays > 0).map(Clump::of));
        lowest.first.push(lowest.clumps.len() as u32);
    }
    let mut levels = vec![lowest];
    while levels.len() < 5 {
        let next = levels[levels.len() - 1].above();
        levels.push(next);
    }
    let mut found = vec![Light::default(); spots.spots.len()];
    let pixels: Vec<(usize, &mut [Light])> = split(&mut found, &spots.first).enumerate().collect();
    pixels.into_par_iter().for_each(|(pixel, found)| {
        let (x, y) = (pixel % across, pixel / across);
        let own = &spots.spots[spots.first[pixel] as usize..][..found.len()];
        for (spot, found) in own.iter().zip(found) {
            let Known { light, share, variance: [calm, read] } = spot.calm;
            let (here, variance) =
                if share < 1.0 { around(spot, (x, y), &levels) } else { (Rgb::ZERO, 0.0) };
            let (a, b) = (share * share, (1.0 - share) * (1.0 - share));
            let (straight, shadows) = spot.direct;
            let of_solution = a * calm + b * read;
            *found = Light {
                irradiance: straight + light * share + here * (1.0 - share),
                variance: [shadows + of_solution + b * variance, of_solution],
            };
        }
    });
    found
}

/// Cuts a slice at the ends of each pixel's part.
fn split<'a>(
    mut rest: &'a mut [Light],
    first: &'a [u32],
) -> impl Iterator<Item = &'a mut [Light]> + 'a {
    first.windows(2).map(move |w| {
        let (own, others) = std::mem::take(&mut rest).split_at_mut((w[1] - w[0]) as usize);
        rest = others;
        own
    })
}

/// The reach of a spot is no more than that of one beside it, and the way there: few rays miss what
/// is thin.
fn bound_reaches(spots: &mut Spots, across: usize) {
    /// Pixels to each side that are asked.
    const BESIDE: usize = 2;
    let down = (spots.first.len() - 1) / across;
    for _ in 0..2 {
        let reaches: Vec<f64> = (0..across * down)
            .into_par_iter()
            .flat_map_iter(|pixel| {
                let (x, y) = (pixel % across, pixel / across);
                let of = |pixel: usize| {
                    &spots.spots[spots.first[pixel] as usize..spots.first[pixel + 1] as usize]
                };
                of(pixel).iter().map(move |spot| {
                    let mut reach = spot.reach;
                    for v in y.saturating_sub(BESIDE)..(y + BESIDE + 1).min(down) {
                        for u in x.saturating_sub(BESIDE)..(x + BESIDE + 1).min(across) {
                            for other in of(v * across + u) {
                                let way = other.point - spot.point;
                                let length = way.length();
                                if spot.sheet == other.sheet
                                    && way.dot(spot.normal).abs() <= 0.1 * length
                                    && spot.normal.dot(other.normal) > 0.9
                                {
                                    reach = reach.min(other.reach + length);
                                }
                            }
                        }
                    }
                    reach
                })
            })
            .collect();
        for (spot, reach) in spots.spots.iter_mut().zip(reaches) {
            spot.reach = reach;
        }
    }
}

/// The value at a spot of the plane that fits its surroundings best, and the variance of its
/// luminance.
fn around(spot: &Spot, (x, y): (usize, usize), levels: &[Level]) -> (Rgb, f64) {
    let radius = spot.radius();
    let pixels = radius / spot.width;
    if pixels < NARROW {
        return along(spot, (x, y), &levels[0]);
    }
    let level = ((pixels / FINE).log2().floor().max(0.0) as usize).min(levels.len() - 1);
    let squares = &levels[level];
    let (cx, cy) = (x >> level, y >> level);
    let wide = (pixels / f64::from(1 << level)).ceil() as usize;
    let (t, u) = spot.normal.any_orthonormal_pair();
    let mut matrix = DMat3::ZERO;
    let mut right = [DVec3::ZERO; 3];
    let mut sum = (Rgb::ZERO, 0.0, 0.0);
    for v in cy.saturating_sub(wide)..(cy + wide + 1).min(squares.down) {
        for h in cx.saturating_sub(wide)..(cx + wide + 1).min(squares.across) {
            for c in squares.of_pixel(h, v) {
                let way = c.point - spot.point;
                let d2 = way.length_squared() / (radius * radius);
                let turn2 = c.normal.distance_squared(spot.normal) / (TURN * TURN);
                let height = way.dot(spot.normal) / (APART * radius);
                let inside = [1.0 - d2, 1.0 - turn2, 1.0 - height * height];
                let reach = SMOOTHED * c.reach * 1.5;
                let is_other = c.sheet != spot.sheet;
                if is_other
                    || inside.iter().any(|i| *i <= 0.0)
                    || d2 * radius * radius > reach * reach
                {
                    continue;
                }
                let weight = c.rays * inside.iter().map(|i| i * i).product::<f64>();
                let at = DVec3::new(1.0, way.dot(t) / radius, way.dot(u) / radius);
                matrix += DMat3::from_cols(at * at.x, at * at.y, at * at.z) * weight;
                for (right, light) in right.iter_mut().zip(c.light.to_array()) {
                    *right += at * (weight * light);
                }
                sum.0 += c.light * weight;
                sum.1 += weight;
                sum.2 += weight * weight * c.variance;
            }
        }
    }
    if sum.1 <= 0.0 {
        return (spot.reflected.irradiance, spot.reflected.variance);
    }
    /// Slopes weigh this much against what is found: where all lies along a line.
    const RIDGE: f64 = 1e-2;
    let ridge = DMat3::from_diagonal(DVec3::new(0.0, RIDGE, RIDGE) * sum.1);
    let inverse = (matrix + ridge).inverse();
    let value = Rgb::from_array(right.map(|r| (inverse * r).x));
    let mean = sum.0 / sum.1;
    let value = if value.is_finite() { value.clamp(mean * 0.25, mean * 4.0) } else { mean };
    (value, sum.2 / (sum.1 * sum.1))
}

/// The mean, and the variance of its luminance, of spots about that have the same thing as near
/// by on the same side: along a contact light changes slowly, however fast it does across.
fn along(spot: &Spot, (x, y): (usize, usize), pixels: &Level) -> (Rgb, f64) {
    /// Pixels to each side.
    const ABOUT: usize = 6;
    /// Ratio of distances to what is near, and cosine between the directions to it.
    const ALIKE: f64 = 1.4;
    const SAME_SIDE: f32 = 0.95;
    let own = spot.reflected.near;
    let farthest = ABOUT as f64 * spot.width;
    let mut sum = (Rgb::ZERO, 0.0, 0.0);
    for v in y.saturating_sub(ABOUT)..(y + ABOUT + 1).min(pixels.down) {
        for u in x.saturating_sub(ABOUT)..(x + ABOUT + 1).min(pixels.across) {
            for c in pixels.of_pixel(u, v) {
                let way = c.point - spot.point;
                let ratio = c.near.reach / own.reach;
                let is_alike = c.sheet == spot.sheet
                    && (1.0 / ALIKE..ALIKE).contains(&ratio)
                    && c.near.toward.dot(own.toward) > SAME_SIDE
                    && c.normal.distance(spot.normal) < 0.5 * TURN
                    && way.dot(spot.normal).abs() < 0.5 * spot.width;
                let d2 = way.length_squared() / (farthest * farthest);
                if is_alike && d2 < 1.0 {
                    let weight = c.rays * (1.0 - d2);
                    sum.0 += c.light * weight;
                    sum.1 += weight;
                    sum.2 += weight * weight * c.variance;
                }
            }
        }
    }
    if sum.1 <= 0.0 {
        return (spot.reflected.irradiance, spot.reflected.variance);
    }
    (sum.0 / sum.1, sum.2 / (sum.1 * sum.1))
}
