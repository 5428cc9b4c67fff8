//! A point of view for a scene that has none.

use glam::DVec3;

use crate::scene::{Camera, Scene};
use crate::visibility::{Occluders, Surroundings, share};

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
    let inside = share(around.glimpses(), |g| g.hit.is_some()) > 0.5;
    let chosen = if inside {
        let height = (high - low).dot(up.abs());
        let floor = centre - up * (0.5 * height);
        let middle = if ROOM_HEIGHTS.contains(&height) { floor + up * EYE_HEIGHT } else { centre };
        let around = Surroundings::of(&occluders, middle, up, None);
        let radius = 0.5 * (high - low).length();
        (0..DIRECTIONS)
            .map(|k| {
                let angle = (k as f64 + 0.5) / DIRECTIONS as f64 * std::f64::consts::TAU;
                let forward = east * angle.cos() + north * angle.sin();
                room_view(&occluders, &around, middle, forward, up, radius)
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

/// A view through the middle of a room, and how much it shows: from as far back as the room
/// allows, or from before its open side.
fn room_view(
    occluders: &Occluders,
    around: &Surroundings,
    middle: DVec3,
    forward: DVec3,
    up: DVec3,
    radius: f64,
) -> (f64, Camera) {
    let behind = around.distance(-forward);
    let (back, vfov) = if behind.is_finite() {
        (0.9 * behind.min(radius), 60_f64.to_radians())
    } else {
        (2.4 * radius, 40_f64.to_radians())
    };
    let eye = middle - forward * back;
    let seen = Surroundings::of(occluders, eye, up, None);
    // How much surface a view shows: far things count more than near ones, emptiness nothing.
    let mut score = 0.0;
    for g in seen.glimpses() {
        let ahead = g.direction.dot(forward);
        let high = g.direction.dot(up).atan2(ahead).abs();
        let wide = g.direction.dot(forward.cross(up)).atan2(ahead).abs();
        if ahead > 0.0 && high < 0.5 * vfov && wide < 0.6 * vfov {
            score += g.solid_angle * g.hit.map_or(0.0, |h| h.2.min(4.0 * radius).sqrt());
        }
    }
    // Of the narrow view from outside, the same share of the picture counts the same.
    let frame = 1.2 * vfov * vfov;
    (score / frame, Camera { eye, forward, vfov, ..camera(up) })
}
