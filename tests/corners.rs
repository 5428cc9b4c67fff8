//! Triangles that see each other only past the corner of a box, often only at their tips: exact
//! factors are found wherever rays find any.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DVec3, dvec3};
use hemicube::engines::{Engine, Exact, ExactOptions, Rays, RaysOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::{Geometry, Material, SceneBuilder, Sides, Surface};
use hemicube::visibility::Bvh;

fn scene(triangles: &[[DVec3; 3]]) -> Geometry {
    let mut b = SceneBuilder::new("corners");
    let s = b.surface(Surface { name: "s".into(), node: 0, primitive: 0 });
    let m = b.material(Material::default());
    for t in triangles {
        let v = t.map(|p| b.vertex(p));
        b.triangle(v, None, s, m, Sides::One);
    }
    b.finish().geometry
}

/// Adds two triangles.
fn quad(t: &mut Vec<[DVec3; 3]>, [a, b, c, d]: [DVec3; 4]) {
    t.extend([[a, b, c], [a, c, d]]);
}

/// Corners of a rectangle, counter-clockwise from above.
fn corners([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> [DVec3; 4] {
    [dvec3(x0, y0, z), dvec3(x1, y0, z), dvec3(x1, y1, z), dvec3(x0, y1, z)]
}

/// Walls and roof of a box that stands on the ground.
fn stand(t: &mut Vec<[DVec3; 3]>, x: [f64; 2], y: [f64; 2], height: f64) {
    let (foot, top) = (corners(x, y, 0.0), corners(x, y, height));
    for k in 0..4 {
        let l = (k + 1) % 4;
        quad(t, [foot[k], foot[l], top[l], top[k]]);
    }
    quad(t, top);
}

/// All rows, and the stated error as a part of the root-mean-square factor.
fn rows_of(g: &Geometry, p: &Patches, error: f64) -> (Vec<Row>, f64) {
    let bvh = Bvh::new(g);
    let mut engine =
        Exact::new(g, p, &bvh, ExactOptions { error, ..ExactOptions::default() }, &Silent).unwrap();
    let ids: Vec<PatchId> = p.ids().collect();
    let mut rows = vec![Row::default(); ids.len()];
    engine.fill(&ids, &mut rows).unwrap();
    (rows, engine.estimate())
}

#[test]
fn tips_see_each_other_past_a_corner() {
    let mut t = vec![
        [dvec3(0.0, 0.0, 0.0), dvec3(8.0, 2.0, 0.0), dvec3(2.0, 2.0, 0.0)],
        [dvec3(12.0, 8.0, 0.0), dvec3(12.0, 2.0, 4.0), dvec3(12.0, 8.0, 4.0)],
    ];
    stand(&mut t, [2.0, 8.0], [2.0, 8.0], 9.0);
    let g = scene(&t);
    let p = Patches::uniform(&g, 100.0).unwrap();
    // By 3,000,000 pairs of points, to 1.1e-6.
    let expected = 1.724e-4;
    for (error, within) in [(1e-3, 5e-6), (1e-4, 3e-6)] {
        let (rows, _) = rows_of(&g, &p, error);
        let found = rows[0].factor_to(PatchId(1));
        assert!((found - expected).abs() < within, "{error}: {found}");
        // The wall has twice the area of the ground.
        assert!((2.0 * rows[1].factor_to(PatchId(0)) - found).abs() < 1e-7);
    }
}

#[test]
fn what_rays_see_among_boxes_is_never_nothing() {
    const SIDE: f64 = 10.0;
    const RAYS: usize = 1 << 16;
    for seed in 0..3_u32 {
        let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12_345);
        let mut random = |low: f64, high: f64| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            low + (high - low) * f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut t = Vec::new();
        for (i, j) in (0..9).map(|k| (f64::from(k / 3) * SIDE, f64::from(k % 3) * SIDE)) {
            let x = [i + random(1.0, 3.0), i + random(6.0, 9.0)];
            let y = [j + random(1.0, 3.0), j + random(6.0, 9.0)];
            let outer = corners([i, i + SIDE], [j, j + SIDE], 0.0);
            let inner = corners(x, y, 0.0);
            for k in 0..4 {
                let l = (k + 1) % 4;
                quad(&mut t, [outer[k], outer[l], inner[l], inner[k]]);
            }
            stand(&mut t, x, y, random(4.0, 16.0));
        }
        let g = scene(&t);
        let p = Patches::uniform(&g, 1000.0).unwrap();
        let (rows, stated) = rows_of(&g, &p, 1e-4);
        let bvh = Bvh::new(&g);
        let rays = Rays::new(&g, &p, &bvh, RaysOptions { samples: RAYS, seed });
        let (mut seen, mut errors, mut noise, mut squares) = (0, 0.0, 0.0, 0.0);
        for i in p.ids() {
            let mut row = Row::default();
            rays.row(i, &mut row);
            for j in p.ids() {
                let (found, traced) = (rows[i.index()].factor_to(j), row.factor_to(j));
                let variance = (traced * (1.0 - traced)).max(0.0) / RAYS as f64;
                // A dozen rays are no chance.
                let clearly = traced * RAYS as f64 > 12.0;
                assert!(found > 0.0 || !clearly, "{seed}: {i:?} {j:?} {traced}");
                let within = 6.0 * variance.sqrt() + 6.0 / RAYS as f64;
                assert!((found - traced).abs() < within, "{seed}: {i:?} {j:?} {found} {traced}");
                seen += u32::from(clearly);
                errors += (found - traced).powi(2);
                noise += variance;
                squares += found * found;
            }
        }
        assert!(seen > 3000, "{seen}");
        // All together differ from rays by less than independent rays would.
        assert!(errors < noise + 9.0 * stated * stated * squares, "{errors} {noise}");
        assert!(stated < 2e-4, "{stated}");
    }
}
