//! Sources of light without extent.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::photometry::{Axes, Photometry};
use super::rgb::Rgb;

/// A source of light without extent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Lamp {
    /// Shines alike in all directions, or as its photometry says.
    Point {
        /// Name in the file.
        name: String,
        /// Metres.
        position: DVec3,
        /// Radiant or luminous intensity, W/sr or cd; a factor if there is a photometry.
        intensity: Rgb,
        /// Where plane C0 of a photometry lies: roughly this direction; γ = 0 is straight down.
        x_axis: DVec3,
        /// The relative intensity in each direction; `None`: 1 in all.
        photometry: Option<Arc<Photometry>>,
    },
    /// Shines in a cone, or as its photometry says.
    Spot {
        /// Name in the file.
        name: String,
        /// Metres.
        position: DVec3,
        /// Unit axis of the cone.
        direction: DVec3,
        /// Intensity on the axis, W/sr or cd; a factor if there is a photometry.
        intensity: Rgb,
        /// Angle from the axis where the falloff begins, radians.
        inner: f64,
        /// Angle from the axis where it reaches zero, radians.
        outer: f64,
        /// Where plane C0 of a photometry lies: roughly this direction; γ = 0 is the axis.
        x_axis: DVec3,
        /// The relative intensity in each direction; `None`: the cone's.
        photometry: Option<Arc<Photometry>>,
    },
    /// Shines from infinitely far.
    Directional {
        /// Name in the file.
        name: String,
        /// Unit direction in which the light travels.
        direction: DVec3,
        /// Irradiance on a surface perpendicular to it, W/m² or lx.
        irradiance: Rgb,
    },
}

impl Lamp {
    /// Name in the file.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Point { name, .. } | Self::Spot { name, .. } | Self::Directional { name, .. } => {
                name
            }
        }
    }

    /// What it emits: intensity in W/sr or cd, a factor if it has a photometry; of a directional
    /// lamp its irradiance on what faces it, W/m² or lx.
    #[must_use]
    pub fn emission(&self) -> Rgb {
        match self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => *intensity,
            Self::Directional { irradiance, .. } => *irradiance,
        }
    }

    /// Lets it emit so much.
    pub fn set_emission(&mut self, emission: Rgb) {
        match self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => *intensity = emission,
            Self::Directional { irradiance, .. } => *irradiance = emission,
        }
    }

    /// Where it is, in metres; `None` for one that is infinitely far.
    #[must_use]
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(*position),
            Self::Directional { .. } => None,
        }
    }

    /// The relative intensity in each direction, if the lamp has one of its own.
    #[must_use]
    pub fn photometry(&self) -> Option<&Photometry> {
        match self {
            Self::Point { photometry, .. } | Self::Spot { photometry, .. } => photometry.as_deref(),
            Self::Directional { .. } => None,
        }
    }

    /// How the lamp hangs in a scene whose unit vector `up` points upwards.
    #[must_use]
    pub fn axes(&self, up: DVec3) -> Axes {
        match self {
            Self::Point { x_axis, .. } => Axes::new(-up, *x_axis),
            Self::Spot { direction, x_axis, .. } => Axes::new(*direction, *x_axis),
            Self::Directional { direction, .. } => Axes::new(*direction, DVec3::ZERO),
        }
    }
}
