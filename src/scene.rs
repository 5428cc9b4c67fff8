//! What the user gives: geometry, optics, lamps, sky, cameras, and what is doubtful about them.

mod builder;
pub mod builtin;
pub(crate) mod edges;
mod footprint;
pub mod geometry;
mod gltf;
mod hash;
pub mod import;
pub mod inspect;
mod obj;
pub mod optics;
mod polygon;
pub mod texture;

use glam::DVec3;

pub use builder::SceneBuilder;
pub use geometry::{Geometry, Part, Side, Sides, Surface, TriangleId};
pub use import::{ImportOptions, SceneError, SidesChoice, load};
pub use inspect::inspect;
pub use optics::{Material, Optics};
pub use texture::{Texture, TextureError, TextureSampler, Wrap};

/// Three channels of a radiometric (or photometric) quantity or of a reflectance.
pub type Rgb = DVec3;

/// Luminance weights of the three channels (ITU-R BT.709): `E = .2126 E_r + .7152 E_g + .0722 E_b`.
#[must_use]
pub fn luminance(c: Rgb) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// A point of view.
#[derive(Debug, Clone, PartialEq)]
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

/// A source of light without extent.
#[derive(Debug, Clone, PartialEq)]
pub enum Lamp {
    /// Shines alike in all directions.
    Point {
        /// Name in the file.
        name: String,
        /// Metres.
        position: DVec3,
        /// Radiant or luminous intensity, W/sr or cd.
        intensity: Rgb,
    },
    /// Shines in a cone.
    Spot {
        /// Name in the file.
        name: String,
        /// Metres.
        position: DVec3,
        /// Unit axis of the cone.
        direction: DVec3,
        /// Intensity on the axis, W/sr or cd.
        intensity: Rgb,
        /// Angle from the axis where the falloff begins, radians.
        inner: f64,
        /// Angle from the axis where it reaches zero, radians.
        outer: f64,
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

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Said for information.
    Note,
    /// The result may not be what the user expects.
    Warning,
}

/// Something worth knowing about a model: where, what, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// Where it is: a material, a surface, a line.
    pub place: String,
    /// What was found, and what was assumed.
    pub message: String,
    /// What the user can do about it; empty if nothing needs doing.
    pub remedy: String,
}

/// Everything that a picture of radiosity starts from.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The stem of the file or the built-in's name.
    pub name: String,
    /// Where surfaces are.
    pub geometry: Geometry,
    /// How they reflect and emit.
    pub optics: Optics,
    /// Sources without extent.
    pub lamps: Vec<Lamp>,
    /// Uniform radiance of the surroundings, W/(m² sr) or cd/m².
    pub sky: Rgb,
    /// Unit vector that points upwards.
    pub up: DVec3,
    /// The file's points of view.
    pub cameras: Vec<Camera>,
    /// What is wrong or doubtful, or was assumed.
    pub findings: Vec<Finding>,
}
