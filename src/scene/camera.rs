//! Points of view.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A point of view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// Position in metres.
    pub eye: DVec3,
    /// Unit direction of view.
    pub forward: DVec3,
    /// Roughly upwards in the picture; need not be orthogonal to `forward`.
    pub up: DVec3,
    /// Full vertical angle of view in radians, 0..π.
    pub vfov: f64,
    /// Width over height, if the camera has an opinion.
    pub aspect: Option<f64>,
}

impl Camera {
    /// A camera at `eye` (m) that looks at `target`, y upwards, 40° high.
    #[must_use]
    pub fn at(eye: DVec3, target: DVec3) -> Self {
        Self {
            name: String::from("camera"),
            eye,
            forward: (target - eye).normalize_or_zero(),
            up: DVec3::Y,
            vfov: 40_f64.to_radians(),
            aspect: None,
        }
    }
}
