//! The studio that an object stands in: a sweep of ground, a key light and the sky.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::DVec3;

use super::model::Model;
use crate::scene::{Camera, Material, Rgb, Scene};

/// A sweep of ground that rises around the object, and where the key light hangs.
#[derive(Debug, Clone)]
pub struct Studio {
    /// Middle of the ground, m.
    base: DVec3,
    up: DVec3,
    /// Half the diagonal of the object, m.
    radius: f64,
    /// How far around the base shadows need a fine mesh, m.
    fine: f64,
    /// How far the sweep reaches, m.
    reach: f64,
    /// Unit vector to the key light.
    key: DVec3,
    /// Whether the ground is seen from above; from below it would hide the object.
    ground: bool,
}

/// The ground lies this share of the object's diagonal below it, so that the two never coincide.
const GAP: f64 = 1e-3;

/// The ground is flat up to this many radii, and bends up to the vertical at [`REACH`].
const FLAT: f64 = 3.0;
const REACH: f64 = 8.0;

/// Rings of the fine part of the mesh, and how much each ring beyond is wider than the last.
const RINGS: usize = 20;
const GROWTH: f64 = 1.2;

/// Reflectance of the sweep: grey paper. The lit sides of a grey body are brighter, its shaded ones
/// darker.
const GROUND: f64 = 0.35;

/// The key light: degrees to the camera's left, degrees above the horizon, and half the angle that
/// it fills.
const KEY_ASIDE: f64 = 65.0;
const KEY_ELEVATION: f64 = 50.0;
const KEY_HALF_ANGLE: f64 = 12.0;

/// Its distance in radii of the sweep.
const KEY_DISTANCE: f64 = 2.0;

/// Irradiance that it gives to what faces it, and radiance of the sky: such that the ground shows
/// well at an exposure of 0 stops.
const KEY_IRRADIANCE: f64 = 4.0;
const SKY: f64 = 0.14;

impl Studio {
    /// The studio for an object that is seen through that camera.
    pub(super) fn of(model: &Model<'_>, camera: &Camera) -> Self {
        let (up, (low, high)) = (model.up, model.bounds);
        let radius = 0.5 * model.size();
        let height = (high - low).dot(up.abs());
        let base = model.centre() - up * (0.5 * height + GAP * model.size());
        let to_eye = camera.eye - base;
        let away = to_eye.reject_from(up);
        let foot = (high - low).reject_from(up.abs()).length() * 0.5;
        let (sin, cos) = KEY_ASIDE.to_radians().sin_cos();
        let before = away.normalize_or(up.any_orthonormal_vector());
        let aside = before * cos - up.cross(before) * sin;
        let (rise, level) = KEY_ELEVATION.to_radians().sin_cos();
        Self {
            base,
            up,
            radius,
            fine: (foot + 0.5 * height).min(1.6 * radius),
            reach: (REACH * radius).max(1.3 * away.length()),
            key: aside * level + up * rise,
            ground: to_eye.dot(up) > 0.0,
        }
    }

    /// Adds the lights to the scene.
    pub(super) fn set_lights(&self, scene: &mut Scene) {
        let (vertices, triangles) = self.key_light();
        let solid_angle = PI * KEY_HALF_ANGLE.to_radians().sin().powi(2);
        let key = Material {
            name: "stage key light".into(),
            radiance: Rgb::splat(KEY_IRRADIANCE / solid_angle),
            ..Material::default()
        };
        let first = scene.extend(&vertices, &triangles, key);
        scene.geometry.whole_from.get_or_insert(first);
        scene.sky = Rgb::splat(SKY);
    }

    /// Adds the ground to the scene.
    pub(super) fn set_ground(&self, scene: &mut Scene) {
        if !self.ground {
            return;
        }
        let (vertices, triangles) = self.sweep();
        let paper = Material {
            name: "stage ground".into(),
            reflectance: Rgb::splat(GROUND),
            ..Material::default()
        };
        let first = scene.extend(&vertices, &triangles, paper);
        scene.geometry.whole_from.get_or_insert(first);
    }

    /// A disc that faces the object.
    fn key_light(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        const CORNERS: u32 = 24;
        let distance = KEY_DISTANCE * self.reach;
        let middle = self.base + self.up * self.radius + self.key * distance;
        let x = self.key.any_orthonormal_vector();
        let y = self.key.cross(x);
        let radius = distance * KEY_HALF_ANGLE.to_radians().tan();
        let rim = (0..CORNERS).map(|k| {
            let (sin, cos) = (f64::from(k) / f64::from(CORNERS) * TAU).sin_cos();
            middle + radius * (x * cos + y * sin)
        });
        let vertices = std::iter::once(middle).chain(rim).collect();
        // Counter-clockwise seen from the object.
        let triangles = (0..CORNERS).map(|k| [0, 1 + (k + 1) % CORNERS, 1 + k]).collect();
        (vertices, triangles)
    }

    /// The ground: a grid of squares mapped to rings (Shirley & Chiu 1997, "A low distortion map
    /// between disk and square"), fine near the object, that bends up like a bowl.
    fn sweep(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let flat = FLAT / REACH * self.reach;
        let bend = self.reach - flat;
        // Lengths along the profile from the middle to each ring.
        let mut step = self.fine / RINGS as f64;
        let mut rings = vec![0.0];
        let end = flat + bend * FRAC_PI_2;
        while let Some(&last) = rings.last().filter(|&&s| s < end) {
            if last > self.fine {
                step *= GROWTH;
            }
            rings.push((last + step).min(end));
        }
        let n = rings.len() as i64 - 1;
        let x = self.up.any_orthonormal_vector();
        let y = self.up.cross(x);
        let vertex = |i: i64, j: i64| {
            let along = rings[i.abs().max(j.abs()) as usize];
            let (sin, cos) = ((along - flat).max(0.0) / bend).sin_cos();
            let (r, height) = (along.min(flat) + bend * sin, bend * (1.0 - cos));
            let (i, j) = (i as f64, j as f64);
            let turn = if i.abs() >= j.abs() {
                FRAC_PI_4 * if i == 0.0 { 0.0 } else { j / i } + if i < 0.0 { PI } else { 0.0 }
            } else {
                FRAC_PI_2 - FRAC_PI_4 * i / j + if j < 0.0 { PI } else { 0.0 }
            };
            let (sin, cos) = turn.sin_cos();
            self.base + r * (x * cos + y * sin) + self.up * height
        };
        let side = 2 * n + 1;
        let vertices = (0..side * side).map(|k| vertex(k % side - n, k / side - n)).collect();
        let mut triangles = Vec::new();
        for (i, j) in (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (i, j))) {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                .map(|(i, j)| (j * side + i) as u32);
            // Diagonals run outwards, as those of the corners of the grid do.
            if (i < n) == (j < n) {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
        (vertices, triangles)
    }
}
