//! A point of view for a scene that has none.

use std::collections::HashSet;

use glam::DVec3;

use crate::scene::{Camera, Geometry, Scene};
use crate::visibility::{Occluders, Surroundings, solid_angle_fraction};

/// A camera that was chosen, and what it finds around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Viewpoint {
    /// The camera.
    pub camera: Camera,
    /// What it looks at, in metres.
    pub target: DVec3,
    /// Whether it stands inside: most directions from the scene's centre meet something.
    pub inside: bool,
}

/// Eyes are this high above the floor of a room of ordinary height, in metres.
const EYE_HEIGHT: f64 = 1.6;

/// Rooms of these heights have an eye height, in metres.
const ROOM_HEIGHTS: std::ops::Range<f64> = 2.0..12.0;

/// Directions tried.
const DIRECTIONS: usize = 16;

/// Chooses a camera: inside, at eye height and in the direction that sees most, if most directions
/// from the centre meet something; outside, three-quarter from above, otherwise. `None` for a scene
/// without solid triangles.
#[must_use]
pub fn viewpoint(scene: &Scene) -> Option<Viewpoint> {
    let (low, high) = scene.geometry.bounds()?;
    let occluders = Occluders::new(&scene.geometry);
    let centre = 0.5 * (low + high);
    let up = scene.up.normalize_or(DVec3::Y);
    let east = up.any_orthonormal_vector();
    let north = up.cross(east);
    let around = Surroundings::of(&occluders, centre, up, None);
    let inside = solid_angle_fraction(around.glimpses(), |g| g.hit.is_some()) > 0.5;
    let chosen = if inside {
        let height = (high - low).dot(up.abs());
        let floor = centre - up * (0.5 * height);
        let middle = if ROOM_HEIGHTS.contains(&height) { floor + up * EYE_HEIGHT } else { centre };
        let around = Surroundings::of(&occluders, middle, up, None);
        let interior = Interior {
            geometry: &scene.geometry,
            occluders: &occluders,
            around: &around,
            middle,
            centre,
            up,
            half: 0.5 * (high - low),
        };
        (0..DIRECTIONS)
            .map(|k| {
                let angle = k as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
                interior.view(east * angle.cos() + north * angle.sin())
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))?
            .1
    } else {
        let vfov = 40_f64.to_radians();
        let radius = 0.5 * (high - low).length();
        let direction = (east * 0.55 + north * 0.8 + up * 0.5).normalize();
        let eye = centre + direction * (radius / (0.5 * vfov).sin());
        Camera { eye, forward: -direction, vfov, ..camera(up) }
    };
    let distance =
        (centre - chosen.eye).dot(chosen.forward).abs().max(1e-3 * (high - low).length());
    Some(Viewpoint { target: chosen.eye + chosen.forward * distance, camera: chosen, inside })
}

fn camera(up: DVec3) -> Camera {
    Camera {
        name: String::from("chosen"),
        eye: DVec3::ZERO,
        forward: DVec3::Z,
        up,
        vfov: 1.0,
        aspect: None,
    }
}

/// An interior that is looked at from within, or through its open side.
struct Interior<'a> {
    geometry: &'a Geometry,
    occluders: &'a Occluders,
    /// What is seen from the middle.
    around: &'a Surroundings,
    /// At eye height.
    middle: DVec3,
    centre: DVec3,
    up: DVec3,
    /// Half the extent of the scene along each axis.
    half: DVec3,
}

impl Interior<'_> {
    /// A view through the middle, and how much area of the room it shows: from as far back as the
    /// room allows, or from before its open side.
    fn view(&self, forward: DVec3) -> (f64, Camera) {
        let behind = self.around.distance(-forward);
        let extent = |axis: DVec3| self.half.dot(axis.abs());
        let (from, back, vfov) = if behind.is_finite() {
            (self.middle, 0.9 * behind.min(self.half.length()), 60_f64.to_radians())
        } else {
            let vfov = 40_f64.to_radians();
            let across = extent(forward.cross(self.up)) / ASPECT;
            let fit = 1.05 * across.max(extent(self.up)) / (0.5 * vfov).tan();
            (self.centre, extent(forward) + fit, vfov)
        };
        let eye = from - forward * back;
        let inner: HashSet<_> =
            self.around.glimpses().iter().filter_map(|g| g.hit.map(|h| (h.0, h.1))).collect();
        let seen = Surroundings::of(self.occluders, eye, self.up, None);
        let right = forward.cross(self.up);
        let edge = (0.5 * vfov).tan();
        let mut shown = 0.0;
        for g in seen.glimpses() {
            let ahead = g.direction.dot(forward);
            let high = (g.direction.dot(self.up) / ahead).abs();
            let wide = (g.direction.dot(right) / ahead).abs();
            if ahead > 0.0
                && high < edge
                && wide < ASPECT * edge
                && let Some((triangle, side, distance)) = g.hit
                && inner.contains(&(triangle, side))
            {
                let cosine = g.direction.dot(self.geometry.normal(triangle, side)).abs().max(0.1);
                shown += g.solid_angle * distance * distance / cosine;
            }
        }
        (shown, Camera { eye, forward, vfov, ..camera(self.up) })
    }
}

/// Width over height that the view is chosen for.
const ASPECT: f64 = 4.0 / 3.0;
