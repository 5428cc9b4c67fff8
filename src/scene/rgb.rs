//! Three channels of light.

use glam::DVec3;

/// Three channels of a radiometric (or photometric) quantity or of a reflectance.
pub type Rgb = DVec3;

/// Luminance weights of the three channels (ITU-R BT.709): `E = .2126 E_r + .7152 E_g + .0722 E_b`.
#[must_use]
pub fn luminance(c: Rgb) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
