//! What the user gives: geometry, optics, lamps, sky, cameras, and what is doubtful about them.

mod builder;
pub mod builtin;
pub(crate) mod edges;
mod footprint;
pub mod geometry;
mod gltf;
mod hash;
pub mod ies;
pub mod import;
pub mod inspect;
mod obj;
pub mod optics;
pub mod photometry;
mod ply;
mod polygon;
mod soup;
mod stl;
pub mod texture;

use std::sync::Arc;

use glam::DVec3;

pub use builder::SceneBuilder;
pub use geometry::{Geometry, Part, Side, Sides, Surface, TriangleId};
pub use import::{ImportOptions, SceneError, SidesChoice, load};
pub use inspect::inspect;
pub use optics::{Material, Optics};
pub use photometry::{Axes, Photometry};
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

/// A luminaire that sends out more than this multiple of its lamps' flux is doubtful; files are
/// rounded.
const GAIN: f64 = 1.02;

impl Scene {
    /// Lets the point and spot lamps of that name shine as `photometry` says, in cd. They keep their
    /// colour, but neither their intensity nor their cone. Returns whether there are any.
    pub fn set_photometry(&mut self, lamp: &str, photometry: Photometry) -> bool {
        let photometry = Arc::new(photometry);
        let mut any = false;
        for found in self.lamps.iter_mut().filter(|l| l.name() == lamp) {
            if let Lamp::Point { intensity, photometry: own, .. }
            | Lamp::Spot { intensity, photometry: own, .. } = found
            {
                let brightness = luminance(*intensity);
                *intensity = if brightness > 0.0 { *intensity / brightness } else { Rgb::ONE };
                *own = Some(Arc::clone(&photometry));
                any = true;
            }
        }
        if any {
            self.findings.extend(doubts(lamp, &photometry));
        }
        any
    }
}

/// What is doubtful about a photometry, or was assumed.
fn doubts(lamp: &str, photometry: &Photometry) -> Vec<Finding> {
    let place = format!("lamp {lamp}");
    let mut found = Vec::new();
    let flux = photometry.flux();
    if let Some(rated) = photometry.rated_flux().filter(|rated| flux > GAIN * rated) {
        found.push(Finding {
            severity: Severity::Warning,
            place: place.clone(),
            message: format!("sends out {flux:.0} lm, more than the {rated:.0} lm of its lamps"),
            remedy: "check the candela multiplier and the lumens in its photometric file".into(),
        });
    }
    if photometry.opening() > 0.0 {
        let size = photometry.opening();
        found.push(Finding {
            severity: Severity::Note,
            place,
            message: format!("is {size:.2} m wide; all its light comes from one point"),
            remedy: format!("expect it to be right from about {:.1} m on", 5.0 * size),
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(name: &str, intensity: Rgb) -> Lamp {
        let position = DVec3::ZERO;
        let x_axis = DVec3::X;
        Lamp::Point { name: name.into(), position, intensity, x_axis, photometry: None }
    }

    #[test]
    fn a_lamp_keeps_its_colour_and_takes_the_intensity_of_its_photometry() {
        let photometry = || Photometry {
            vertical: vec![0.0, 90.0],
            horizontal: vec![0.0],
            candela: vec![200.0, 200.0],
            rated: Some(100.0),
            opening: 0.4,
        };
        let warm = Rgb::new(30.0, 20.0, 10.0);
        let mut scene = Scene { up: DVec3::Y, ..Scene::default() };
        scene.lamps = vec![lamp("a", warm), lamp("b", warm), lamp("a", Rgb::ZERO)];
        assert!(!scene.set_photometry("c", photometry()));
        assert!(scene.findings.is_empty());
        assert!(scene.set_photometry("a", photometry()));
        let strength = |k: usize| {
            let Lamp::Point { intensity, .. } = &scene.lamps[k] else { panic!("a point lamp") };
            let share = scene.lamps[k].photometry().map_or(1.0, |p| p.intensity(0.0, 30.0));
            *intensity * share
        };
        assert!((luminance(strength(0)) - 200.0).abs() < 1e-9);
        assert!((strength(0) / strength(0).x - warm / warm.x).length() < 1e-12);
        assert_eq!((strength(1), strength(2)), (warm, Rgb::splat(200.0)));
        let [doubt, note] = &scene.findings[..] else { panic!("{:?}", scene.findings) };
        assert!(doubt.message.contains("1257 lm, more than the 100 lm"), "{}", doubt.message);
        assert!(note.remedy.contains("2.0 m"), "{}", note.remedy);
    }
}
