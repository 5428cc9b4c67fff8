use glam::DVec3;

use super::*;
use crate::form_factors::Engine;
use crate::progress::Silent;
use crate::scene::{Material, SceneBuilder, Sides, Surface, builtin};

/// A scene of triangles.
fn scene(triangles: &[[DVec3; 3]], sides: Sides) -> Geometry {
    let mut b = SceneBuilder::new("test");
    let s = b.surface(Surface { name: "s".into(), node: 0, primitive: 0 });
    let m = b.material(Material::default());
    for t in triangles {
        let v = t.map(|p| b.vertex(p));
        b.triangle(v, None, s, m, sides);
    }
    b.finish().geometry
}

fn rows_of(g: &Geometry, p: &Patches, options: ExactOptions) -> Vec<Row> {
    let bvh = Bvh::new(g);
    let mut engine = Exact::new(g, p, &bvh, options);
    let ids: Vec<PatchId> = p.ids().collect();
    let mut rows = vec![Row::default(); ids.len()];
    engine.fill(&ids, &mut rows).unwrap();
    rows
}

#[test]
fn the_matrix_has_the_bits_of_its_rows_for_any_threads() {
    for (name, size) in [("cornell-box", 0.3), ("furnace", 0.05)] {
        let g = builtin::build(name).unwrap().geometry;
        let p = Patches::uniform(&g, size).unwrap();
        let rows = rows_of(&g, &p, ExactOptions::default());
        let bvh = Bvh::new(&g);
        for threads in [1, 2, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let f = pool.install(|| {
                let engine = Exact::new(&g, &p, &bvh, ExactOptions::default());
                engine.matrix(1 << 32, &Silent).unwrap()
            });
            for id in p.ids() {
                let row = &rows[id.index()];
                let stored = f.row(id).unwrap();
                assert_eq!(stored.columns, row.columns);
                assert!(stored.entries().zip(row.entries()).all(|(a, b)| a == b));
                assert_eq!(f.account(id).lost, row.lost);
            }
        }
        let mut engine = Exact::new(&g, &p, &bvh, ExactOptions::default());
        for id in [3, 40, 77].map(PatchId) {
            let mut row = vec![Row::default()];
            engine.fill(&[id], &mut row).unwrap();
            assert_eq!(row[0], rows[id.index()], "{name} {id:?} alone");
        }
    }
}

#[test]
fn a_closed_cube_loses_nothing() {
    let g = builtin::build("furnace").unwrap().geometry;
    for size in [1.0, 0.1, 0.01] {
        let p = Patches::uniform(&g, size).unwrap();
        let rows = rows_of(&g, &p, ExactOptions::default());
        let worst = rows.iter().map(|r| r.lost.abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{size} {worst}");
        assert!(rows.iter().all(|r| r.environment == 0.0 && r.back == 0.0));
    }
}
