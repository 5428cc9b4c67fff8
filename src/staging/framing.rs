//! Cameras that fill their frame.

use std::f64::consts::PI;

use glam::DVec3;

use crate::scene::Camera;

/// Width over height of pictures without an opinion.
pub(super) const ASPECT: f64 = 4.0 / 3.0;

/// What is settled of a camera before it is placed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lens {
    /// Width over height of the picture.
    pub aspect: Option<f64>,
    /// Vertical angle of view in radians; one that no camera has is as good as none.
    pub vfov: Option<f64>,
}

impl Lens {
    /// The vertical angle of view in radians, if not settled the usual one, in degrees.
    pub(super) fn vfov_or(&self, usual: f64) -> f64 {
        self.vfov.filter(|v| *v > 0.0 && *v < PI).unwrap_or(usual.to_radians())
    }
}

/// A camera that is still to be placed.
pub(super) fn camera(up: DVec3) -> Camera {
    Camera {
        name: String::from("chosen"),
        eye: DVec3::ZERO,
        forward: DVec3::Z,
        up,
        vfov: 1.0,
        aspect: None,
    }
}

/// The camera that looks along `forward` and in whose frame the points fill that share of the
/// direction that limits them.
pub(super) fn fit(
    points: impl Iterator<Item = DVec3>,
    forward: DVec3,
    up: DVec3,
    vfov: f64,
    aspect: f64,
    fill: f64,
) -> Camera {
    let right = forward.cross(up).normalize_or(forward.any_orthonormal_vector());
    let above = right.cross(forward);
    let edge = fill * (0.5 * vfov).tan();
    let edges = [edge * aspect, edge];
    // How far each plane through the eye along an edge of the frame must be pushed out: the largest
    // of ±x + z tan, z towards the eye.
    let mut reach = [[f64::NEG_INFINITY; 2]; 2];
    let mut nearest = f64::NEG_INFINITY;
    for p in points {
        let z = -p.dot(forward);
        nearest = nearest.max(z);
        for (axis, along) in [right, above].into_iter().enumerate() {
            let x = p.dot(along);
            for (k, x) in [x, -x].into_iter().enumerate() {
                reach[axis][k] = reach[axis][k].max(x + z * edges[axis]);
            }
        }
    }
    let [x, y] = reach.map(|[a, b]| 0.5 * (a - b));
    let far = [0, 1].map(|axis| 0.5 * (reach[axis][0] + reach[axis][1]) / edges[axis]);
    let z = far[0].max(far[1]).max(nearest + 1e-3 * (far[0].max(far[1]) - nearest).abs());
    Camera { eye: right * x + above * y - forward * z, forward, vfov, ..camera(up) }
}
