//! Closed rooms for which the answer, or its sum, is known exactly.

use glam::DVec3;

use super::mesh::Mesh;
use super::stage::Stage;
use crate::scene::{Rgb, Scene};

/// Reflectance of all six walls of the furnace.
pub const FURNACE_REFLECTANCE: Rgb = Rgb::new(0.3, 0.5, 0.8);

/// A cube of edge 1 m that glows: radiance 1 W/(m² sr) from every wall.
///
/// Every point receives the same from every direction, so that with E = π W/m²
///
/// ```text
/// B = H = E / (1 - ρ)        4.488, 6.283 and 15.708 W/m²
/// ```
///
/// whatever the patches are. It tests solvers and sums of rows, and nothing else: any matrix whose
/// rows sum to one passes.
pub(super) fn furnace() -> Scene {
    closed_room("furnace", DVec3::ONE, FURNACE_REFLECTANCE, [Rgb::ONE; 6])
}

/// An empty closed room: a box of edges `size` (m) seen from inside, one corner at the origin, 12
/// source triangles, and a camera in it.
///
/// All walls have the same `reflectance` (at most .9 per channel, or it is clamped); each emits a
/// `radiance` of its own in W/(m² sr), in the order -x, +x, floor, ceiling, -z, +z. What all walls
/// receive in sum is then known, however uneven the emission:
///
/// ```text
/// Σ A H = Φ / (1 - ρ)        Φ = Σ A E = Σ A π L
/// ```
#[must_use]
pub fn closed_room(name: &str, size: DVec3, reflectance: Rgb, radiance: [Rgb; 6]) -> Scene {
    const WALLS: [&str; 6] = ["wall -x", "wall +x", "floor", "ceiling", "wall -z", "wall +z"];
    let mut stage = Stage::new(name);
    let mut wall = |i: usize| {
        let paint = stage.glow(WALLS[i], reflectance.to_array(), radiance[i].to_array());
        (WALLS[i], paint, 2)
    };
    let walls = [0, 1, 2, 3, 4, 5].map(&mut wall);
    let mesh = Mesh::cuboid(size, [1; 3]).at(0.5 * size.x, 0.0, 0.5 * size.z).inverted();
    stage.add_parts(&mesh, &walls);
    stage.camera("main", size * DVec3::new(0.1, 0.55, 0.1), 0.5 * size, 75.0, 4.0 / 3.0);
    stage.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Side;
    use std::f64::consts::PI;

    #[test]
    fn walls_face_inwards_and_are_named_by_their_place() {
        let size = DVec3::new(4.0, 2.5, 3.0);
        let radiance = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(Rgb::splat);
        let scene = closed_room("uneven", size, Rgb::splat(0.5), radiance);
        let g = &scene.geometry;
        let towards = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        for t in g.ids() {
            let wall = g.surface_of[t.index()] as usize;
            assert_eq!(g.normal(t, Side::Front), towards[wall]);
            assert_eq!(scene.optics.emission(t, Side::Front), radiance[wall] * PI);
        }
        let (low, high) = g.bounds().expect("a room has walls");
        assert_eq!((low, high), (DVec3::ZERO, size));
        let area: f64 = g.ids().map(|t| g.area(t)).sum();
        assert!((area - 2.0 * (10.0 + 12.0 + 7.5)).abs() < 1e-12);
    }

    #[test]
    fn furnace_keeps_its_reflectance() {
        assert!(furnace().optics.reflectance.iter().all(|&rho| rho == FURNACE_REFLECTANCE));
        assert!(furnace().findings.is_empty());
    }
}
