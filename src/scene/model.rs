//! The scene as a whole.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::camera::Camera;
use super::finding::{Finding, Severity};
use super::geometry::Geometry;
use super::lamp::Lamp;
use super::optics::Optics;
use super::photometry::Photometry;
use super::rgb::{Rgb, luminance};

/// Everything that a picture of radiosity starts from.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The stem of the file or the built-in's name.
    pub name: String,
    /// Where surfaces are.
    pub geometry: Geometry,
    /// Name of the file's object that each surface is of; empty where it has none.
    pub object_of: Vec<String>,
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
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
    /// Of a scene that was read from a solution: the files of its model, by their paths beside it.
    pub held: Vec<(PathBuf, Arc<[u8]>)>,
}

/// A luminaire that sends out more than this multiple of its lamps' flux is doubtful; files are
/// rounded.
const GAIN: f64 = 1.02;

impl Scene {
    /// Lets the point and spot lamps of that name shine as `photometry` says, in cd. They keep
    /// their colour, but neither their intensity nor their cone. Returns whether there are any.
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
        found.push(Finding::new(
            Severity::Warning,
            place.clone(),
            format!("sends out {flux:.0} lm, more than the {rated:.0} lm of its lamps"),
            "check the candela multiplier and the lumens in its photometric file",
        ));
    }
    if photometry.opening() > 0.0 {
        let size = photometry.opening();
        found.push(Finding::new(
            Severity::Note,
            place,
            format!("is {size:.2} m wide; all its light comes from one point"),
            format!("expect it to be right from about {:.1} m on", 5.0 * size),
        ));
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
