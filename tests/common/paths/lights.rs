//! Points of emitting sides, and lamps, to which paths are led.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use hemicube::scene::{Axes, Lamp, Rgb, Scene, Side, TriangleId, luminance};

/// All that emits, of which points are chosen in proportion to exitance.
pub struct Lights {
    sides: Vec<(TriangleId, Side)>,
    /// Sum of the flux of all sides up to each.
    upto: Vec<f64>,
    lamps: Vec<(Lamp, Axes)>,
}

/// A point of an emitting side.
pub struct Spot {
    pub position: DVec3,
    pub normal: DVec3,
    /// E, of the side that it lies on.
    pub exitance: Rgb,
    /// 1/m².
    pub density: f64,
}

impl Lights {
    pub fn new(scene: &Scene) -> Self {
        let g = &scene.geometry;
        let mut lights = Self { sides: Vec::new(), upto: Vec::new(), lamps: Vec::new() };
        let mut sum = 0.0;
        for t in g.ids() {
            for side in Side::BOTH.into_iter().filter(|&s| g.exchanges(t, s)) {
                let flux = luminance(scene.optics.emission(t, side)) * g.area(t);
                if flux > 0.0 {
                    sum += flux;
                    lights.sides.push((t, side));
                    lights.upto.push(sum);
                }
            }
        }
        lights.lamps = scene.lamps.iter().map(|l| (l.clone(), l.axes(scene.up))).collect();
        lights
    }

    /// Density (1/m²) with which points of a side that emits `exitance` are chosen.
    pub fn density(&self, exitance: Rgb) -> f64 {
        self.upto.last().map_or(0.0, |all| luminance(exitance) / all)
    }

    /// A point of an emitting side; `choice` is in 0..1.
    pub fn spot(&self, scene: &Scene, choice: f64, mut at: DVec2) -> Option<Spot> {
        let all = *self.upto.last()?;
        let k = self.upto.partition_point(|&upto| upto <= choice * all).min(self.sides.len() - 1);
        let (t, side) = self.sides[k];
        if at.x + at.y > 1.0 {
            at = DVec2::ONE - at;
        }
        let [a, b, c] = scene.geometry.corners(t);
        let exitance = scene.optics.emission(t, side);
        Some(Spot {
            position: a + (b - a) * at.x + (c - a) * at.y,
            normal: scene.geometry.normal(t, side),
            exitance,
            density: self.density(exitance),
        })
    }

    /// What each lamp brings to a point of that normal if nothing is in its way, and the way to it
    /// (m); to one that is infinitely far a unit vector and `false`.
    pub fn lamps(
        &self,
        point: DVec3,
        normal: DVec3,
    ) -> impl Iterator<Item = (Rgb, DVec3, bool)> + '_ {
        self.lamps.iter().map(move |(lamp, axes)| arriving(lamp, axes, point, normal))
    }
}

fn arriving(lamp: &Lamp, axes: &Axes, point: DVec3, normal: DVec3) -> (Rgb, DVec3, bool) {
    match lamp {
        Lamp::Directional { direction, irradiance, .. } => {
            (*irradiance * normal.dot(-*direction).max(0.0), -*direction, false)
        }
        Lamp::Point { position, intensity, .. } | Lamp::Spot { position, intensity, .. } => {
            let way = *position - point;
            let r = way.length();
            let cos = normal.dot(way / r).max(0.0);
            let share = match (lamp.photometry(), lamp) {
                (Some(photometry), _) => photometry.towards(axes, -way / r),
                (None, Lamp::Spot { direction, inner, outer, .. }) => {
                    let (inner, outer) = (inner.cos(), outer.cos());
                    let t = (direction.dot(-way / r) - outer) / (inner - outer).max(1e-9);
                    t.clamp(0.0, 1.0).powi(2)
                }
                (None, _) => 1.0,
            };
            let h = *intensity * (share * cos / (r * r));
            (if h.is_finite() { h } else { Rgb::ZERO }, way, true)
        }
    }
}

impl Spot {
    /// What it brings to a point of that normal if nothing is in its way: its irradiance over the
    /// density of its choice, and of the choice of its direction by its cosine.
    pub fn arriving(&self, point: DVec3, normal: DVec3) -> Rgb {
        let way = self.position - point;
        let r2 = way.length_squared();
        let (here, there) = (normal.dot(way) / r2.sqrt(), -self.normal.dot(way) / r2.sqrt());
        if !(here > 0.0 && there > 0.0) {
            return Rgb::ZERO;
        }
        // Both densities as of directions: the second is cos θ / π.
        let led = self.density * r2 / there;
        self.exitance * (here / PI / (led + here / PI))
    }
}
