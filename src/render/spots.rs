//! What pixels see, surface by surface, and the light that arrives there.
//!
//! Samples of a pixel that see the same surface share a spot. Direct light is found for each spot,
//! with shadow rays from all of its samples, so that the border of a shadow is as sharp as pixels
//! are. What other surfaces reflect comes by few rays, more of them where little may be smoothed.

use glam::DVec3;

use crate::engines::sampling::Table;
use crate::gather::{Buffers, Gatherer, Receiving, Reflected};
use crate::patches::SurfacePoint;
use crate::reconstruct::Normals;
use crate::scene::{Rgb, Scene};

/// What some samples of a pixel see of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// Metres.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Irradiance straight from emitters and lamps, W/m² or lx.
    pub direct: Rgb,
    /// What arrives by way of other surfaces, by so many rays.
    pub reflected: Reflected,
    pub rays: u32,
    /// Width of a pixel there, m, and the cosine at which it is seen.
    pub width: f64,
    pub facing: f64,
}

/// Number of a sample that has no spot.
pub(super) const NONE: u8 = u8::MAX;

/// The spots of a rectangle of pixels.
#[derive(Debug, Default)]
pub(super) struct Spots {
    pub spots: Vec<Spot>,
    /// First spot of each pixel, and the end.
    pub first: Vec<u32>,
    /// For each sample of each pixel the number of its spot among the pixel's, or [`NONE`].
    pub of_sample: Vec<u8>,
}

/// A sample: where it meets a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub position: DVec3,
    pub face: DVec3,
    /// Unit normal of the curved surface, and its height above the face.
    pub normal: DVec3,
    pub above: f64,
}

impl Sample {
    pub fn new(scene: &Scene, normals: &Normals, at: SurfacePoint) -> Self {
        let face = scene.geometry.normal(at.triangle, at.side);
        let (normal, above) = normals.at(&scene.geometry, at).unwrap_or((face, 0.0));
        Self { position: at.position(&scene.geometry), face, normal, above }
    }

    /// Whether two samples of a pixel of that width (m) see one surface.
    fn is_with(&self, other: &Self, width: f64) -> bool {
        /// Cosine between their normals.
        const TURN: f64 = 0.97;
        /// Distance from each other's plane, in widths of a pixel.
        const APART: f64 = 0.5;
        let way = other.position - self.position;
        let apart = way.dot(self.normal).abs().min(way.dot(other.normal).abs());
        self.normal.dot(other.normal) > TURN && apart < APART * width
    }
}

/// Spots of a band of pixels in the making.
pub(super) struct Gathering<'a> {
    gatherer: &'a Gatherer<'a>,
    /// Rays of a first look, and of each further one.
    tables: &'a [Table],
    buffers: Buffers,
    /// Points of each spot.
    receiving: Vec<Receiving>,
    /// Where its samples are.
    members: Vec<Vec<DVec3>>,
    direct: Vec<Rgb>,
    reflected: Vec<Reflected>,
}

/// So many rays shall add up over the surroundings that a spot is smoothed over.
const WANTED: f64 = 2048.0;

/// The radius that spots are smoothed over is this fraction of their reach.
pub(super) const SMOOTHED: f64 = 0.5;

/// Widest radius that spots are smoothed over, in pixels.
pub(super) const WIDEST: f64 = 32.0;

/// Rays of the first look at each spot, and of further ones.
pub(super) const LOOKS: [usize; 3] = [16, 32, 64];

impl<'a> Gathering<'a> {
    pub fn new(gatherer: &'a Gatherer<'a>, tables: &'a [Table]) -> Self {
        Self {
            gatherer,
            tables,
            buffers: Buffers::default(),
            receiving: Vec::new(),
            members: Vec::new(),
            direct: Vec::new(),
            reflected: Vec::new(),
        }
    }

    /// Sorts the samples of a pixel into spots, seen from `eye` at `width` m a pixel; `seed` tells
    /// pixels apart.
    pub fn pixel(
        &mut self,
        samples: &[Option<Sample>],
        (eye, width): (DVec3, impl Fn(&Sample) -> f64),
        seed: u64,
        of_sample: &mut [u8],
        spots: &mut Vec<Spot>,
    ) {
        let mut found: Vec<(Sample, Vec<DVec3>)> = Vec::new();
        for (sample, of_sample) in samples.iter().zip(of_sample) {
            *of_sample = NONE;
            let Some(s) = sample else { continue };
            let k = found.iter().position(|(f, _)| f.is_with(s, width(s)));
            let k = k.unwrap_or_else(|| {
                found.push((*s, Vec::new()));
                found.len() - 1
            });
            found[k].1.push(s.position);
            *of_sample = k as u8;
        }
        for (k, (lead, members)) in found.into_iter().enumerate() {
            // The sample next to the middle stands for all.
            let middle = members.iter().sum::<DVec3>() / members.len() as f64;
            let s = samples
                .iter()
                .flatten()
                .filter(|s| lead.is_with(s, width(s)))
                .min_by(|a, b| {
                    let d = |s: &Sample| s.position.distance_squared(middle);
                    d(a).total_cmp(&d(b))
                })
                .unwrap_or(&lead);
            self.receiving.push(Receiving {
                point: s.position + s.face * s.above,
                face: s.face,
                normal: s.normal,
                seed: seed << 5 | k as u64,
            });
            self.members.push(members);
            spots.push(Spot {
                point: s.position,
                normal: s.normal,
                direct: Rgb::ZERO,
                reflected: Reflected::default(),
                rays: 0,
                width: width(s),
                facing: s.face.dot((eye - s.position).normalize_or_zero()).abs(),
            });
        }
    }

    /// Finds the light of the spots sorted since the last call: the last ones of `spots`.
    pub fn light(&mut self, spots: &mut [Spot]) {
        let first = spots.len() - self.receiving.len();
        let spots = &mut spots[first..];
        let (receiving, members) = (&self.receiving, &self.members);
        let positions: Vec<DVec3> = spots.iter().map(|s| s.point).collect();
        let spread = |i: usize, u: f64| {
            let own: &[DVec3] = &members[i];
            let lift = receiving[i].point - positions[i];
            own[((u * own.len() as f64) as usize).min(own.len() - 1)] + lift
        };
        self.gatherer.direct(receiving, spread, &mut self.buffers, &mut self.direct);
        for (spot, direct) in spots.iter_mut().zip(&self.direct) {
            spot.direct = *direct;
        }
        let mut rest: Vec<usize> = (0..spots.len()).collect();
        for table in self.tables {
            let points: Vec<Receiving> = rest
                .iter()
                .map(|&i| Receiving {
                    seed: receiving[i].seed ^ (table.points() as u64) << 44,
                    ..receiving[i]
                })
                .collect();
            self.gatherer.reflected(&points, table, &mut self.buffers, &mut self.reflected);
            for (&i, found) in rest.iter().zip(&self.reflected) {
                spots[i].add(found, table.points() as u32);
            }
            rest.retain(|&i| spots[i].needs() > 1.5 * f64::from(spots[i].rays));
        }
        self.receiving.clear();
        self.members.clear();
    }
}

impl Spot {
    /// Takes in what more rays brought.
    fn add(&mut self, more: &Reflected, rays: u32) {
        let (a, b) = (f64::from(self.rays), f64::from(rays));
        let me = &mut self.reflected;
        if self.rays == 0 {
            *me = *more;
        } else {
            me.irradiance = (me.irradiance * a + more.irradiance * b) / (a + b);
            me.reach = me.reach.min(more.reach);
        }
        self.rays += rays;
    }

    /// Radius that it is smoothed over, m.
    pub fn radius(&self) -> f64 {
        (SMOOTHED * self.reflected.reach).min(WIDEST * self.width)
    }

    /// Rays that it should have, as few pixels around it may share theirs.
    fn needs(&self) -> f64 {
        let radius = self.radius() / self.width;
        WANTED / (1.0 + radius * radius * self.facing)
    }
}
