//! Points that are measured, and what is found there.

use glam::DVec3;

use crate::scene::{Geometry, Rgb, luminance};
use crate::visibility::Bvh;

/// A point this far (radii of the scene) beyond the bounds of a model, or off a surface, may be
/// said to be on them.
const CLEARANCE: f64 = 1e-5;

/// Where irradiance is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Metres.
    pub point: DVec3,
    /// Unit normal of the plane that receives.
    pub normal: DVec3,
}

/// What is known about the irradiance at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Irradiance H, W/m² or lx.
    pub irradiance: Rgb,
    /// Half the width of its 95 % interval.
    pub error: Rgb,
    /// What kind of place it is.
    pub place: Place,
    /// Fraction of what it sees that is the environment, weighted by the cosine, 0..1.
    pub escaped: f64,
}

/// What kind of place a point is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Where light can be measured.
    Free,
    /// Inside a solid: more than half of what it sees are backs that do not reflect; or backs of
    /// any kind, and it is dark (below a thousandth of the mean of lit patches).
    Covered,
    /// On a side that emits. Its own emission does not count.
    OnEmitter,
    /// Outside of the model: nothing of it is behind the point, and that is beyond its bounds, or
    /// sees emptiness and no light. A gatherer does not tell; [`Estimate::or_outside`] does.
    Outside,
}

impl Estimate {
    /// The same, where a free place that is outside of the model is told; irradiance up to `dark`
    /// (W/m² or lx) is no light.
    #[must_use]
    pub fn or_outside(mut self, probe: &Probe, geometry: &Geometry, bvh: &Bvh, dark: f64) -> Self {
        if self.place != Place::Free || self.escaped <= 0.0 {
            return self;
        }
        let Probe { point, normal } = *probe;
        let slack = CLEARANCE * bvh.scale();
        let beyond = geometry.bounds().is_none_or(|(low, high)| {
            point.cmplt(low - slack).any() || point.cmpgt(high + slack).any()
        });
        let empty = beyond || luminance(self.irradiance) <= dark;
        if empty && bvh.see(point + normal * slack, -normal, None).is_none() {
            self.place = Place::Outside;
        }
        self
    }
}
