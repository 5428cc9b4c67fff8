//! Points that are measured, and what is found there.

use glam::DVec3;

use crate::scene::Rgb;

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
}
