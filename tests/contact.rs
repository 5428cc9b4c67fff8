//! What stands on a surface parts it: no light and no shade leaks past, wherever patches end.

#![allow(clippy::unwrap_used, reason = "a test")]

mod common;

use common::scenes::{lit_by_first, quad};
use glam::{DVec2, DVec3, dvec3};
use hemicube::engines::EngineOptions;
use hemicube::engines::{Draw, HemicubeOptions};
use hemicube::patches::SurfacePoint;
use hemicube::progress::Silent;
use hemicube::scene::{Rgb, Scene, Side, Sides};
use hemicube::solution::{LightOptions, light};

/// Where the wall stands: on no outline of any patch.
const WALL: f64 = 1.13;

/// A closed room of 3 x 1 x 1 m with a wall across it; the end at x = 0 emits. All faces are
/// two-sided, the long walls, floor and ceiling run past the wall in one piece.
fn parted_room() -> Scene {
    let end =
        |x: f64| [dvec3(x, 0.0, 0.0), dvec3(x, 1.0, 0.0), dvec3(x, 1.0, 1.0), dvec3(x, 0.0, 1.0)];
    let along = |a: [f64; 2], b: [f64; 2]| {
        [(0.0, a), (3.0, a), (3.0, b), (0.0, b)].map(|(x, [y, z])| dvec3(x, y, z))
    };
    let quads = [
        end(0.0),
        end(3.0),
        end(WALL),
        along([0.0, 0.0], [0.0, 1.0]),
        along([1.0, 0.0], [1.0, 1.0]),
        along([0.0, 0.0], [1.0, 0.0]),
        along([0.0, 1.0], [1.0, 1.0]),
    ]
    .map(quad);
    lit_by_first(&quads.each_ref(), Sides::Two)
}

#[test]
fn a_wall_across_patches_leaves_the_dark_room_at_exactly_zero() {
    let scene = parted_room();
    let g = &scene.geometry;
    for (draw, size) in [(Draw::Sources, 0.02), (Draw::Sources, 0.1), (Draw::Patches, 0.1)] {
        let options = LightOptions {
            patch_size: Some(size),
            engine: EngineOptions::Hemicube(HemicubeOptions { resolution: 64, draw }),
            ..LightOptions::default()
        };
        let solution = light(&scene, &options, &Silent).unwrap();
        let field = solution.field(&scene);
        let (mut dark, mut lit) = (0, 0);
        for triangle in g.ids() {
            for side in Side::BOTH {
                for (i, j) in (1..40).flat_map(|i| (1..40 - i).map(move |j| (i, j))) {
                    let uv = DVec2::new(f64::from(i), f64::from(j)) / 40.0;
                    let p = SurfacePoint { triangle, side, uv };
                    let at = p.position(g);
                    let before = at + 1e-6 * g.normal(triangle, side);
                    let inside =
                        before.cmpgt(DVec3::ZERO).all() && before.y < 1.0 && before.z < 1.0;
                    let h = field.at(p);
                    if inside && before.x > WALL && before.x < 3.0 {
                        assert_eq!(h, Rgb::ZERO, "{draw:?} {size}: light at {at}");
                        dark += 1;
                    } else if inside && before.x < WALL {
                        assert!(h.min_element() > 0.05, "{draw:?} {size}: {h} at {at}");
                        lit += 1;
                    }
                }
            }
        }
        assert!(dark > 1000 && lit > 1000);
    }
}
