//! How a page looks at first.

use crate::scene::Camera;
use crate::tone::Tone;

/// Most sources of a page: so many layers every graphics card has that knows WebGL 2.
pub const MOST_LAYERS: usize = 256;

/// How a page looks at first.
#[derive(Debug, Clone)]
pub struct PageView {
    /// Points of view, the first one first; at least one.
    pub cameras: Vec<Camera>,
    /// Exposure in stops.
    pub exposure: f64,
    /// The tone curve.
    pub tone: Tone,
    /// The unit of illuminance, `lx` or `W/m2`.
    pub unit: String,
    /// How well irradiance is known on 80 % of the surface, as a share of it, where that is known.
    pub error: Option<f64>,
    /// Whether a program serves it: texels then say of which patch they are, so that the page can
    /// show values of patches, and data is packed more quickly and less tightly.
    pub served: bool,
}
