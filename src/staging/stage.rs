//! Light for a model that has none.

use std::f64::consts::PI;

use glam::DVec3;

use super::ceiling::{Panel, panels};
use super::kind::Kind;
use super::model::Model;
use super::rays::{cast, horizon, sphere};
use super::studio::Studio;
use crate::scene::{Camera, Lamp, Rgb, Scene};

/// What lights a model that has no light of its own.
#[derive(Debug, Clone)]
pub enum Stage {
    /// A sweep of ground, a key light and the sky above: for an object.
    Studio(Studio),
    /// The ground alone: for an object that has light.
    Ground(Studio),
    /// Lights under the ceiling: for a closed room.
    Ceiling(Vec<Panel>),
    /// Sky, and a sun that shines in: for a room with openings.
    Daylight {
        /// The sun, if it can shine in from anywhere.
        sun: Option<Lamp>,
    },
}

/// A room through whose openings less than this share of what is around goes out is closed.
const CLOSED: f64 = 0.015;

/// Radiance of the sky before a room's windows.
const SKY: Rgb = Rgb::ONE;

/// Irradiance of the sun on what faces it, in units of that of the whole sky.
const SUN: f64 = 4.0;

/// Bearings and elevations (degrees) of the sun that are tried.
const BEARINGS: usize = 16;
const ELEVATIONS: [f64; 2] = [25.0, 40.0];

impl Stage {
    /// The stage for a model that is seen through that camera; `lit` if something lights it.
    #[must_use]
    pub fn of(model: &Model<'_>, kind: Kind, camera: &Camera, lit: bool) -> Self {
        if kind == Kind::Object {
            let studio = Studio::of(model, camera);
            return if lit { Self::Ground(studio) } else { Self::Studio(studio) };
        }
        let panels = if openness(model) < CLOSED { panels(model, camera.eye) } else { Vec::new() };
        if panels.is_empty() {
            Self::Daylight { sun: sun(model, camera) }
        } else {
            Self::Ceiling(panels)
        }
    }

    /// Adds the stage to the scene.
    pub fn set(&self, scene: &mut Scene) {
        match self {
            Self::Studio(studio) => {
                studio.set_lights(scene);
                studio.set_ground(scene);
            }
            Self::Ground(studio) => studio.set_ground(scene),
            Self::Ceiling(panels) => panels.iter().for_each(|p| p.set(scene)),
            Self::Daylight { sun } => {
                scene.sky = SKY;
                scene.lamps.extend(sun.clone());
            }
        }
    }

    /// The exposure in stops that the stage is lit for, if it is.
    #[must_use]
    pub fn exposure(&self) -> Option<f64> {
        matches!(self, Self::Studio(_)).then_some(0.0)
    }
}

/// Share of emptiness around the points within a room.
fn openness(model: &Model<'_>) -> f64 {
    let (sum, n) = model.free().fold((0.0, 0), |(sum, n), p| (sum + 1.0 - p.enclosure, n + 1));
    sum / f64::from(n.max(1))
}

/// The sun from where it falls on most of what the camera sees; `None` if it cannot shine in.
fn sun(model: &Model<'_>, camera: &Camera) -> Option<Lamp> {
    let seen: Vec<(DVec3, DVec3)> = sphere(2048)
        .filter(|d| d.dot(camera.forward) > (0.5 * camera.vfov).cos())
        .map(|d| (camera.eye, d))
        .collect();
    let lift = 1e-4 * model.size();
    let points: Vec<(DVec3, DVec3)> = cast(&model.bvh, &seen)
        .iter()
        .zip(&seen)
        .filter_map(|(hit, (eye, d))| {
            let hit = hit.as_ref()?;
            let normal = model.scene.geometry.normal(hit.triangle, hit.side);
            Some((*eye + *d * hit.distance + normal * lift, normal))
        })
        .collect();
    let mut best = (0, DVec3::ZERO);
    for elevation in ELEVATIONS {
        let (rise, level) = elevation.to_radians().sin_cos();
        for bearing in horizon(model.up, BEARINGS) {
            let way = bearing * level + model.up * rise;
            let facing = points.iter().filter(|p| p.1.dot(way) > 0.0);
            let rays: Vec<_> = facing.map(|p| (p.0, way)).collect();
            let lit = cast(&model.bvh, &rays).iter().filter(|h| h.is_none()).count();
            if lit > best.0 {
                best = (lit, way);
            }
        }
    }
    (best.0 > 0).then(|| Lamp::Directional {
        name: "stage sun".into(),
        direction: -best.1,
        irradiance: SKY * (SUN * PI),
    })
}
