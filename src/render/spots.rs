//! What pixels see, surface by surface, and the light that arrives there.
//!
//! Samples of a pixel that see the same surface share a spot. Direct light is found for each spot,
//! with shadow rays from all of its samples, so that the border of a shadow is as sharp as pixels
//! are. What other surfaces reflect comes by few rays, more of them where little may be smoothed.

use glam::{DVec2, DVec3};

use crate::engines::sampling::Table;
use crate::gather::{Buffers, Calm, Gatherer, Known, NOISE, Receiving, Reflected};
use crate::patches::SurfacePoint;
use crate::reconstruct::Normals;
use crate::scene::{Rgb, Scene, luminance};

/// What some samples of a pixel see of a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    /// Metres.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Those of different sheets share no light.
    pub sheet: u32,
    /// Irradiance straight from emitters and lamps, W/m² or lx, and the variance of its luminance.
    pub direct: (Rgb, f64),
    /// What arrives by way of other surfaces, by so many rays.
    pub reflected: Reflected,
    pub rays: u32,
    /// The same as patches know it.
    pub calm: Known,
    /// How far around it, m, its light is shared, as it and those around it know.
    pub reach: f64,
    /// Width of a pixel there, m, and the cosine at which it is seen.
    pub width: f64,
    pub facing: f64,
}

/// Number of a sample that has no spot.
pub(crate) const NONE: u8 = u8::MAX;

/// The spots of a rectangle of pixels.
#[derive(Debug, Default)]
pub(crate) struct Spots {
    pub spots: Vec<Spot>,
    /// First spot of each pixel, and the end.
    pub first: Vec<u32>,
    /// For each sample of each pixel the number of its spot among the pixel's, or [`NONE`].
    pub of_sample: Vec<u8>,
}

/// A sample: where it meets a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub at: SurfacePoint,
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
        Self { at, position: at.position(&scene.geometry), face, normal, above }
    }

    /// Another sample on the same triangle, near by.
    pub fn moved(&self, scene: &Scene, at: SurfacePoint) -> Self {
        Self { at, position: at.position(&scene.geometry), ..*self }
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

/// What a pixel sees.
#[derive(Debug, Clone)]
pub(crate) enum Seen {
    Nothing,
    /// One triangle: what stands for it, and places (m) at the corners of the pixel.
    One(Sample, [DVec3; 4]),
    /// What each of its samples sees.
    Each(Vec<Option<Sample>>),
}

/// Places that a spot stands for, m.
#[derive(Debug)]
enum Place {
    /// All within four corners.
    Square([DVec3; 4]),
    /// Samples.
    Each(Vec<DVec3>),
}

impl Place {
    /// One of them, by a point of the unit square.
    fn at(&self, u: DVec2) -> DVec3 {
        match self {
            Self::Square([a, b, c, d]) => a.lerp(*b, u.x).lerp(c.lerp(*d, u.x), u.y),
            Self::Each(all) => all[((u.x * all.len() as f64) as usize).min(all.len() - 1)],
        }
    }
}

/// Spots of a band of pixels in the making.
pub(super) struct Gathering<'a> {
    gatherer: &'a Gatherer<'a>,
    calm: &'a Calm<'a>,
    lamps: bool,
    /// Rays of a first look, and of each further one.
    tables: &'a [Table],
    buffers: Buffers,
    /// Points of each spot.
    receiving: Vec<Receiving>,
    places: Vec<Place>,
    /// Whether each gathers before others.
    leads: Vec<bool>,
    direct: Vec<(Rgb, f64)>,
    reflected: Vec<Reflected>,
}

/// A dim place has this share of the mean irradiance.
const DIM: f64 = 0.1;

/// The radius that spots are smoothed over is this fraction of their reach.
pub(super) const SMOOTHED: f64 = 0.5;

/// Widest radius that spots are smoothed over, in pixels.
pub(super) const WIDEST: f64 = 32.0;

/// Rays of the first look at each spot, and of further ones: so many at most, and more where less
/// noise is wanted.
const LOOKS: [usize; 2] = [16, 128];

/// Most rays of a look.
const MOST: f64 = 4096.0;

/// The rays of looks that bring about a noise (a share).
pub(super) fn looks(noise: f64) -> impl Iterator<Item = usize> {
    let most = (LOOKS[1] as f64 * (NOISE / noise).powi(2)).clamp(LOOKS[1] as f64, MOST) as usize;
    std::iter::successors(Some(LOOKS[0]), |rays| Some(2 * rays)).take_while(move |r| *r <= most)
}

/// What arrives at a spot.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Light {
    /// W/m² or lx.
    pub irradiance: Rgb,
    /// Variance of its luminance: all, and what is the solution's.
    pub variance: [f64; 2],
}

impl<'a> Gathering<'a> {
    /// `lamps`: whether lamps without extent light surfaces straight.
    pub fn new(
        gatherer: &'a Gatherer<'a>,
        calm: &'a Calm<'a>,
        lamps: bool,
        tables: &'a [Table],
    ) -> Self {
        Self {
            gatherer,
            calm,
            lamps,
            tables,
            buffers: Buffers::default(),
            receiving: Vec::new(),
            places: Vec::new(),
            leads: Vec::new(),
            direct: Vec::new(),
            reflected: Vec::new(),
        }
    }

    /// Sorts the samples of a cell into spots; `width` is that of a cell where a sample is, m, and
    /// `facing` the cosine at which it is seen; `seed` tells cells apart. A cell that does not lead
    /// may do with what those beside it gather.
    pub fn cell(
        &mut self,
        seen: &Seen,
        (width, facing): (impl Fn(&Sample) -> f64, impl Fn(&Sample) -> f64),
        (seed, leads): (u64, bool),
        of_sample: &mut [u8],
        spots: &mut Vec<Spot>,
    ) {
        of_sample.fill(NONE);
        let samples = match seen {
            Seen::Nothing => return,
            Seen::One(sample, corners) => {
                of_sample.fill(0);
                let spot = self.spot(
                    sample,
                    Place::Square(*corners),
                    (width(sample), facing(sample)),
                    seed,
                );
                spots.push(spot);
                self.leads.push(leads);
                return;
            }
            Seen::Each(samples) => samples,
        };
        let mut found: Vec<(Sample, Vec<DVec3>)> = Vec::new();
        for (sample, of_sample) in samples.iter().zip(of_sample) {
            let Some(s) = sample else { continue };
            let k = found.iter().position(|(f, _)| f.is_with(s, width(s)));
            let k = k.unwrap_or_else(|| {
                found.push((*s, Vec::new()));
                found.len() - 1
            });
            found[k].1.push(s.position);
            *of_sample = k as u8;
        }
        for (k, (lead, places)) in found.into_iter().enumerate() {
            // The sample next to the middle stands for all.
            let middle = places.iter().sum::<DVec3>() / places.len() as f64;
            let s = samples
                .iter()
                .flatten()
                .filter(|s| lead.is_with(s, width(s)))
                .min_by(|a, b| {
                    let d = |s: &Sample| s.position.distance_squared(middle);
                    d(a).total_cmp(&d(b))
                })
                .unwrap_or(&lead);
            let seed = seed << 5 | k as u64;
            spots.push(self.spot(s, Place::Each(places), (width(s), facing(s)), seed));
            self.leads.push(true);
        }
    }

    /// A spot that a sample stands for.
    fn spot(&mut self, s: &Sample, place: Place, (width, facing): (f64, f64), seed: u64) -> Spot {
        self.receiving.push(Receiving {
            point: s.position + s.face * s.above,
            face: s.face,
            normal: s.normal,
            size: width,
            seed,
        });
        self.places.push(place);
        Spot {
            point: s.position,
            normal: s.normal,
            sheet: 0,
            direct: (Rgb::ZERO, 0.0),
            reflected: Reflected::default(),
            rays: 0,
            reach: f64::INFINITY,
            calm: self.calm.at(s.at),
            width,
            facing,
        }
    }

    /// Finds the light of the spots sorted since the last call: the last ones of `spots`.
    pub fn light(&mut self, spots: &mut [Spot]) {
        let first = spots.len() - self.receiving.len();
        let spots = &mut spots[first..];
        let (receiving, places) = (&self.receiving, &self.places);
        let positions: Vec<DVec3> = spots.iter().map(|s| s.point).collect();
        let spread = |i: usize, u: DVec2| places[i].at(u) + (receiving[i].point - positions[i]);
        let (buffers, found) = (&mut self.buffers, &mut self.direct);
        self.gatherer.direct(receiving, spread, self.lamps, buffers, found);
        for (spot, direct) in spots.iter_mut().zip(&self.direct) {
            spot.direct = *direct;
        }
        let needing = (0..spots.len()).filter(|&i| spots[i].calm.share < 1.0);
        let (leads, others): (Vec<usize>, Vec<usize>) = needing.partition(|&i| self.leads[i]);
        self.gather(spots, leads.clone());
        let rest = others.into_iter().filter(|&i| !self.is_led(spots, i, &leads)).collect();
        self.gather(spots, rest);
        for i in 0..spots.len() {
            if spots[i].rays == 0
                && spots[i].calm.share < 1.0
                && let Some(lead) = self.led_by(spots, i, &leads).map(|l| spots[l])
            {
                (spots[i].reach, spots[i].reflected) = (lead.reach, lead.reflected);
            }
        }
        self.receiving.clear();
        self.places.clear();
        self.leads.clear();
    }

    /// Gathers what other surfaces send to some of the spots, with more and more rays where that is
    /// of use.
    fn gather(&mut self, spots: &mut [Spot], mut rest: Vec<usize>) {
        for table in self.tables {
            let points: Vec<Receiving> = rest
                .iter()
                .map(|&i| Receiving {
                    seed: self.receiving[i].seed ^ (table.points() as u64) << 44,
                    ..self.receiving[i]
                })
                .collect();
            self.gatherer.reflected(&points, table, &mut self.buffers, &mut self.reflected);
            for (&i, found) in rest.iter().zip(&self.reflected) {
                spots[i].add(found, table.points() as u32);
            }
            bound_reaches(spots, &rest);
            // Four batches alone know the noise of a spot badly.
            let noise = rest.iter().map(|&i| spots[i].of_a_ray()).sum::<f64>();
            let common = noise / rest.len().max(1) as f64;
            rest.retain(|&i| self.needs(&spots[i], common) > 1.5 * f64::from(spots[i].rays));
        }
    }

    /// Rays that a spot should have; one ray leaves open on average what `common` says.
    fn needs(&self, spot: &Spot, common: f64) -> f64 {
        let dim = self.gatherer.mean() * DIM;
        let wanted = self.gatherer.noise() * spot.light().max(dim) / (1.0 - spot.calm.share);
        0.5 * (spot.of_a_ray() + common) / (wanted * wanted * spot.sharing())
    }

    /// The spot beside another, of `leads`, that saw the same and gathered.
    fn led_by(&self, spots: &[Spot], i: usize, leads: &[usize]) -> Option<usize> {
        /// Pixels between them.
        const APART: f64 = 2.5;
        let spot = &spots[i];
        let is_beside = |l: &&usize| {
            let (lead, way) = (&spots[**l], spots[**l].point - spot.point);
            way.length_squared() < (APART * spot.width).powi(2)
                && lead.normal.dot(spot.normal) > 0.97
                && way.dot(spot.normal).abs() < 0.5 * spot.width
        };
        leads.iter().find(is_beside).copied()
    }

    /// Whether what those beside it gathered is enough for a spot too.
    fn is_led(&self, spots: &[Spot], i: usize, leads: &[usize]) -> bool {
        /// Radius that it is shared over, in pixels, at least.
        const WIDE: f64 = 6.0;
        self.led_by(spots, i, leads).is_some_and(|l| {
            let lead = &spots[l];
            // Each stands for four.
            let has = f64::from(lead.rays) / 4.0;
            lead.radius() > WIDE * lead.width && self.needs(lead, lead.of_a_ray()) <= has
        })
    }
}

/// The reach of spots is no more than that of one beside them, and the way there: few rays miss
/// what is thin, and then too few would be cast.
fn bound_reaches(spots: &mut [Spot], of: &[usize]) {
    /// Pixels apart.
    const BESIDE: f64 = 3.0;
    for &i in of {
        let spot = &spots[i];
        let far2 = (BESIDE * spot.width).powi(2);
        let mut reach = spot.reach;
        for other in &*spots {
            let length2 = other.point.distance_squared(spot.point);
            let is_beside = other.rays > 0 && length2 < far2 && other.reach < reach;
            if is_beside && spot.normal.dot(other.normal) > 0.9 {
                reach = reach.min(other.reach + length2.sqrt());
            }
        }
        spots[i].reach = reach;
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
            me.near = me.near.or(more.near);
            me.variance = (me.variance * a * a + more.variance * b * b) / (a + b).powi(2);
        }
        self.reach = self.reflected.near.reach;
        self.rays += rays;
    }

    /// Radius that it is smoothed over, m.
    pub fn radius(&self) -> f64 {
        (SMOOTHED * self.reach).min(WIDEST * self.width)
    }

    /// What one ray leaves open: the variance of its luminance.
    fn of_a_ray(&self) -> f64 {
        self.reflected.variance * f64::from(self.rays)
    }

    /// How many spots about share their rays with it.
    fn sharing(&self) -> f64 {
        let radius = self.radius() / self.width;
        1.0 + radius * radius * self.facing
    }

    /// Luminance of its irradiance.
    fn light(&self) -> f64 {
        luminance(self.direct.0 + self.reflected.irradiance)
    }
}
