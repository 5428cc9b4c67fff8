//! Whether a picture can be made through a camera, and how the camera is turned.

use std::f64::consts::PI;

use glam::DVec3;

use super::picture::RenderError;
use crate::scene::Camera;
use crate::visibility::Frame;

/// Whether a picture of that size through that camera can be made; worth asking before the light is
/// computed.
pub fn check(camera: &Camera, width: usize, height: usize) -> Result<(), RenderError> {
    if width == 0 || height == 0 || width > 1 << 14 || height > 1 << 14 {
        return Err(RenderError::Size(width, height));
    }
    frame_of(camera).map(|_| ())
}

/// Right, down, forward.
pub(super) fn frame_of(camera: &Camera) -> Result<Frame, RenderError> {
    let forward = camera.forward.normalize_or_zero();
    if forward == DVec3::ZERO || !camera.eye.is_finite() {
        return Err(RenderError::Camera(
            "the camera looks nowhere: its eye and its target are the same point or not finite",
        ));
    }
    if !(camera.vfov > 0.0 && camera.vfov < PI) {
        return Err(RenderError::Camera(
            "the vertical angle of view must lie between 0 and 180 degrees",
        ));
    }
    let right = forward.cross(camera.up).normalize_or_zero();
    let right = if right == DVec3::ZERO { forward.any_orthonormal_vector() } else { right };
    Ok(Frame { origin: camera.eye, axes: [right, forward.cross(right), forward] })
}
