//! Points where irradiance is hard to find: beside and upon contacts, in slits, under what curves
//! away, at the borders of shadows; and points anywhere.

use std::fmt;

use glam::DVec3;
use hemicube::scene::{Rgb, Scene, Side, TriangleId};
use hemicube::visibility::{Bvh, Met};

use super::paths::{Noise, Paths, diffuse};

/// What makes a point hard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Nothing: anywhere on the surface.
    Plain,
    /// .1 to 10 mm beside what stands there.
    Beside,
    /// Less than .05 mm beside what stands there.
    Line,
    /// Less than 30 mm before a parallel surface.
    Slit,
    /// Less than 50 mm before a surface that curves or slopes away.
    Under,
    /// Where 10 % to 90 % of the emitters that it faces are hidden.
    Penumbra,
}

impl Kind {
    pub const ALL: [Self; 6] =
        [Self::Plain, Self::Beside, Self::Line, Self::Slit, Self::Under, Self::Penumbra];
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Plain => "plain",
            Self::Beside => "beside",
            Self::Line => "line",
            Self::Slit => "slit",
            Self::Under => "under",
            Self::Penumbra => "penumbra",
        };
        f.pad(name)
    }
}

/// A point on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    pub kind: Kind,
    pub point: DVec3,
    pub normal: DVec3,
}

/// Height (m) above a surface from which it is looked round.
const LIFT: f64 = 3e-4;

/// How far (m) things are looked for.
const REACH: f64 = 0.5;

/// Points tried for one that is found, at most.
const TRIES: usize = 4000;

/// Up to `each` points of each kind, and so many plain ones that there are `least` in all. None is
/// on what emits or within a solid.
pub fn places(scene: &Scene, bvh: &Bvh, each: usize, least: usize) -> Vec<Placed> {
    let search = Search::new(scene, bvh);
    let mut found = Vec::new();
    for kind in Kind::ALL.into_iter().filter(|&k| k != Kind::Plain) {
        found.extend(search.some(kind, each));
    }
    let plain = each.max(least.saturating_sub(found.len()));
    found.extend(search.some(Kind::Plain, plain));
    found
}

struct Search<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    paths: Paths<'a>,
    sides: Vec<(TriangleId, Side)>,
    /// Sum of the areas of all sides up to each.
    upto: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        let g = &scene.geometry;
        let dark = |&(t, s): &(TriangleId, Side)| scene.optics.emission(t, s) == Rgb::ZERO;
        let sides: Vec<_> = g
            .ids()
            .flat_map(|t| Side::BOTH.map(|s| (t, s)))
            .filter(|&(t, s)| g.exchanges(t, s))
            .filter(dark)
            .collect();
        let mut sum = 0.0;
        let upto = sides.iter().map(|&(t, _)| {
            sum += g.area(t);
            sum
        });
        let upto = upto.collect();
        Self { scene, bvh, paths: Paths::led(scene, bvh), sides, upto }
    }

    fn some(&self, kind: Kind, count: usize) -> Vec<Placed> {
        let mut noise = Noise::new(DVec3::splat(f64::from(kind as u8)), 0);
        let mut found = Vec::new();
        for _ in 0..TRIES * count {
            if found.len() == count {
                break;
            }
            let (p, n) = self.anywhere(&mut noise);
            let at = match kind {
                Kind::Plain => Some(p),
                Kind::Beside => {
                    let distance = 10_f64.powf(-4.0 + 2.0 * noise.next());
                    self.beside(p, n, distance, &mut noise)
                }
                Kind::Line => {
                    let distance = 10_f64.powf(-5.0 + 0.7 * noise.next());
                    self.beside(p, n, distance, &mut noise)
                }
                Kind::Slit => self.slit(p, n).filter(|parallel| *parallel).map(|_| p),
                Kind::Under => self.slit(p, n).filter(|parallel| !parallel).map(|_| p),
                Kind::Penumbra => {
                    let hidden = self.paths.hidden(p + n * LIFT, n, 64, &mut noise);
                    hidden.filter(|h| (0.1..0.9).contains(h)).map(|_| p)
                }
            };
            if let Some(point) = at.filter(|&at| self.is_open(at, n, &mut noise)) {
                found.push(Placed { kind, point, normal: n });
            }
        }
        found
    }

    /// A point of the surface, even by area.
    fn anywhere(&self, noise: &mut Noise) -> (DVec3, DVec3) {
        let at = noise.next() * self.upto.last().copied().unwrap_or_default();
        let k = self.upto.partition_point(|&upto| upto <= at).min(self.sides.len() - 1);
        let (t, side) = self.sides[k];
        let [a, b, c] = self.scene.geometry.corners(t);
        let mut u = noise.square();
        if u.x + u.y > 1.0 {
            u = glam::DVec2::ONE - u;
        }
        (a + (b - a) * u.x + (c - a) * u.y, self.scene.geometry.normal(t, side))
    }

    /// A point of the same plane, at that distance before something that stands there.
    fn beside(&self, p: DVec3, n: DVec3, distance: f64, noise: &mut Noise) -> Option<DVec3> {
        let (sin, cos) = (std::f64::consts::TAU * noise.next()).sin_cos();
        let (x, y) = n.any_orthonormal_pair();
        let along = x * cos + y * sin;
        let met = self.bvh.see(p + n * LIFT, along, None)?;
        let facing = -self.normal(&met).dot(along);
        if met.distance > REACH || met.distance < distance || facing < 0.3 {
            return None;
        }
        // Beside the plane of what was met, wherever that stands on the surface.
        let at = p + along * (met.distance - distance / facing);
        let below = self.bvh.see(at + n * LIFT, -n, None)?;
        let lies = (below.distance / LIFT - 1.0).abs() < 0.05 && self.normal(&below).dot(n) > 0.999;
        (lies && self.emission(&below) == Rgb::ZERO).then_some(at)
    }

    /// Whether something close before a point is parallel, if there is something.
    fn slit(&self, p: DVec3, n: DVec3) -> Option<bool> {
        let gap = |at: DVec3| {
            let met = self.bvh.see(at + n * LIFT, n, None)?;
            Some((met.distance + LIFT, -self.normal(&met).dot(n)))
        };
        let (wide, facing) = gap(p)?;
        if wide > 0.05 {
            return None;
        }
        let step = wide.clamp(0.002, 0.01);
        let (x, y) = n.any_orthonormal_pair();
        let around = [x, -x, y, -y].map(|d| gap(p + d * step).map(|g| g.0));
        let alike = |g: &Option<f64>| g.is_some_and(|g| (g / wide - 1.0).abs() < 0.01);
        let parallel = facing > 0.9999 && around.iter().filter(|g| alike(g)).count() >= 3;
        match parallel {
            true => (wide < 0.03).then_some(true),
            false => Some(false),
        }
    }

    /// Whether most of what a point sees are fronts, or sides as good as these.
    fn is_open(&self, p: DVec3, n: DVec3, noise: &mut Noise) -> bool {
        let lift = 4.0 * hemicube::visibility::ROUNDING * self.bvh.scale();
        let backs = (0..64)
            .filter(|&k| {
                let direction = diffuse(n, noise.stratum(k, 8));
                let met = self.bvh.see(p + n * lift, direction, None);
                met.is_some_and(|m| m.side == Side::Back)
            })
            .count();
        backs <= 16
    }

    fn normal(&self, met: &Met) -> DVec3 {
        self.scene.geometry.normal(met.triangle, met.side)
    }

    fn emission(&self, met: &Met) -> Rgb {
        self.scene.optics.emission(met.triangle, met.side)
    }
}
