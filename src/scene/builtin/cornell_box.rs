//! The Cornell box, as measured at the Cornell University Program of Computer Graphics.
//!
//! The published corners are those of a real box, not quite rectangular; this is the common
//! rectangular variant, 5.56 × 5.488 × 5.592 m (ten times the real size, the published millimetres
//! read as centimetres). As in the data, the front is open and the two blocks have no bottom: they
//! stand on the floor.

use glam::{DVec3, dvec3};

use super::furniture::shell;
use super::mesh::Mesh;
use super::stage::Stage;
use crate::scene::Scene;

/// Width, height and depth of the box (m); one corner is the origin.
const SIZE: DVec3 = dvec3(5.56, 5.488, 5.592);

/// Lowest and highest x and z (m) of the light, which lies flush in a hole of the ceiling.
const LIGHT: [[f64; 2]; 2] = [[2.13, 3.43], [2.27, 3.32]];

/// x and z (m) of the corners of a block, and its height.
type Block = ([[f64; 2]; 4], f64);
const SHORT_BLOCK: Block = ([[1.30, 0.65], [0.82, 2.25], [2.40, 2.72], [2.90, 1.14]], 1.65);
#[expect(clippy::approx_constant, reason = "a measured corner happens to lie at 3.14")]
const TALL_BLOCK: Block = ([[4.23, 2.47], [2.65, 2.96], [3.14, 4.56], [4.72, 4.06]], 3.30);

/// The Cornell box: 38 source triangles, open in front, with a panel of 17, 12, 4 W/(m² sr) in the
/// ceiling.
pub(super) fn cornell_box() -> Scene {
    let mut stage = Stage::new("cornell-box");
    let white = stage.paint("white", [0.725, 0.71, 0.68]);
    let red = stage.paint("red", [0.63, 0.065, 0.05]);
    let green = stage.paint("green", [0.14, 0.45, 0.091]);
    let light = stage.glow("light", [0.78; 3], [17.0, 12.0, 4.0]);

    stage.add_parts(
        &shell(SIZE, LIGHT),
        &[
            ("floor", white, 2),
            ("ceiling", white, 8),
            ("light", light, 2),
            ("back wall", white, 2),
            ("right wall", green, 2),
            ("left wall", red, 2),
        ],
    );
    stage.add("short block", white, &block(SHORT_BLOCK));
    stage.add("tall block", white, &block(TALL_BLOCK));
    stage.camera("main", dvec3(2.78, 2.73, -8.0), dvec3(2.78, 2.73, 0.0), 39.3077, 1.0);
    stage.finish()
}

/// Top, then the four sides.
fn block((corners, height): Block) -> Mesh {
    let at = |y: f64| corners.map(|[x, z]| dvec3(x, y, z));
    let sides = [0, 1, 2, 3].map(|i| [i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4]);
    let quads = [&[[4, 5, 6, 7]], &sides[..]].concat();
    Mesh::from_quads([at(0.0), at(height)].concat(), &quads)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Side;

    fn area_of(scene: &Scene, surface: &str) -> f64 {
        let g = &scene.geometry;
        g.ids()
            .filter(|t| g.surfaces[g.surface_of[t.index()] as usize].name == surface)
            .map(|t| g.area(t))
            .sum()
    }

    #[test]
    fn areas_are_the_measured_ones() {
        let scene = cornell_box();
        let expected = [
            ("floor", SIZE.x * SIZE.z),
            ("light", 1.30 * 1.05),
            ("ceiling", SIZE.x * SIZE.z - 1.30 * 1.05),
            ("left wall", SIZE.y * SIZE.z),
            ("back wall", SIZE.x * SIZE.y),
        ];
        for (surface, area) in expected {
            assert!((area_of(&scene, surface) - area).abs() < 1e-12, "{surface}");
        }
        assert_eq!(scene.geometry.len(), 38);
    }

    #[test]
    fn walls_face_inwards_and_blocks_outwards() {
        let scene = cornell_box();
        let g = &scene.geometry;
        for t in g.ids() {
            let middle = g.corners(t).iter().sum::<DVec3>() / 3.0;
            let name = g.surfaces[g.surface_of[t.index()] as usize].name.as_str();
            let outward = match name {
                "short block" => middle - dvec3(1.86, 0.8, 1.69),
                "tall block" => middle - dvec3(3.69, 1.6, 3.51),
                _ => 0.5 * SIZE - middle,
            };
            assert!(g.normal(t, Side::Front).dot(outward) > 0.0, "{name}");
        }
    }

    #[test]
    fn the_red_wall_is_on_the_viewers_left() {
        let scene = cornell_box();
        let (g, camera) = (&scene.geometry, &scene.cameras[0]);
        let right = camera.forward.cross(camera.up);
        let red = g.ids().find(|t| scene.optics.material(*t).name == "red").expect("a red wall");
        assert!((g.corners(red)[0] - camera.eye).dot(right) < 0.0);
    }
}
