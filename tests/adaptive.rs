//! Adaptive subdivision: the rule holds on the final rows, and nothing else changes.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::sync::Arc;

use glam::{DVec2, DVec3};
use hemicube::engines::{Draw, Engine, Hemicube, HemicubeOptions};
use hemicube::form_factors::{FormFactors, Row};
use hemicube::patches::{PatchId, Patches, SurfacePoint};
use hemicube::progress::Silent;
use hemicube::reconstruct::Field;
use hemicube::refine::factor::{FactorRule, Refined};
use hemicube::scene::{Geometry, Rgb, Scene, Side, builtin};

const EPS: f64 = 0.02;
const MIN_AREA: f64 = 0.02;

/// A closed room of 3 x 2 x 2.5 m.
fn room() -> Scene {
    let dark = [Rgb::ZERO; 6];
    builtin::closed_room("room", DVec3::new(3.0, 2.0, 2.5), Rgb::splat(0.5), dark)
}

fn options(draw: Draw) -> HemicubeOptions {
    HemicubeOptions { resolution: 64, draw }
}

fn refined(g: &Geometry, balance: bool) -> Refined {
    refined_to(g, EPS, MIN_AREA, balance)
}

fn refined_to(g: &Geometry, max_factor: f64, min_area: f64, balance: bool) -> Refined {
    let rule = FactorRule { max_factor, min_area, start_area: None, balance };
    let finest = Patches::uniform(g, min_area).unwrap();
    let mut engine = Hemicube::new(g, &finest, options(Draw::Sources)).unwrap();
    rule.refine(g, Arc::new(finest.clone()), &mut engine, 1 << 30, &Silent).unwrap()
}

fn entries(f: &FormFactors, id: PatchId) -> Vec<(PatchId, f64)> {
    f.row(id).unwrap().entries().collect()
}

fn fresh_rows(g: &Geometry, p: &Patches, draw: Draw) -> Vec<Row> {
    let mut engine = Hemicube::new(g, p, options(draw)).unwrap();
    let ids: Vec<PatchId> = p.ids().collect();
    let mut rows = vec![Row::default(); ids.len()];
    engine.fill(&ids, &mut rows).unwrap();
    rows
}

#[test]
fn no_factor_to_a_patch_that_may_be_split_exceeds_the_tolerance() {
    let g = room().geometry;
    let r = refined(&g, false);
    let uniform = Patches::uniform(&g, MIN_AREA).unwrap().len();
    assert!(r.patches.len() > 50 && r.patches.len() < uniform, "{}", r.patches.len());
    assert_eq!(r.rows_made, r.patches.len(), "every row is made once");
    for i in r.patches.ids() {
        for (j, f) in entries(&r.factors, i) {
            assert!(f <= EPS || r.patches.area(j) <= MIN_AREA, "{i:?} {j:?} {f}");
        }
    }
    let area: f64 = r.patches.ids().map(|i| r.patches.area(i)).sum();
    assert!((area - 37.0).abs() < 1e-9, "area is kept: {area}");
}

#[test]
fn rows_added_up_are_the_rows_of_the_adaptive_mesh() {
    let g = room().geometry;
    let r = refined(&g, false);
    for (i, row) in r.patches.ids().zip(fresh_rows(&g, &r.patches, Draw::Sources)) {
        assert_eq!(entries(&r.factors, i), row.entries().collect::<Vec<_>>(), "{i:?}");
    }
}

#[test]
fn rows_with_patches_drawn_sum_to_exactly_one_across_levels() {
    let g = room().geometry;
    let r = refined(&g, false);
    let levels: Vec<u8> = r.patches.ids().map(|i| r.patches.cell(i).level).collect();
    assert!(levels.iter().max() > levels.iter().min());
    for (i, row) in r.patches.ids().zip(fresh_rows(&g, &r.patches, Draw::Patches)) {
        assert_eq!((row.weights.sum(), row.environment, row.back), (1.0, 0.0, 0.0));
        let variation: f64 =
            r.patches.ids().map(|j| (row.factor_to(j) - r.factors.factor(i, j)).abs()).sum();
        assert!(variation / 2.0 <= 1e-3, "{i:?} {variation}");
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let g = room().geometry;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let r = refined(&g, true);
            let cells: Vec<_> = r.patches.ids().map(|i| r.patches.cell(i)).collect();
            let rows: Vec<_> = r.patches.ids().map(|i| entries(&r.factors, i)).collect();
            (cells, rows)
        })
    };
    let one = with(1);
    assert!(one == with(2) && one == with(8));
}

/// A thousand points on the common edge of the two triangles of each wall, and on edges within.
#[test]
fn the_field_has_no_crack_across_levels() {
    let g = room().geometry;
    let r = refined(&g, true);
    let values: Vec<Rgb> = r
        .patches
        .ids()
        .map(|i| {
            let p = r.patches.center(i).position(&g);
            Rgb::new((3.0 * p.x).sin() + 2.0, (5.0 * p.y * p.z).cos() + 2.0, p.x * p.y)
        })
        .collect();
    let field = Field::new(&g, &r.patches, &values, |_| true);
    let mut compared = 0;
    for id in r.patches.ids() {
        let cell = r.patches.cell(id);
        let [a, b, c] = cell.barycentric();
        let middle = (a + b + c) / 3.0;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            for step in 1..20 {
                let on_edge = p.lerp(q, f64::from(step) / 20.0);
                let outwards = (on_edge - middle) * 1e-9;
                let at = |l: DVec3| SurfacePoint {
                    triangle: cell.triangle,
                    side: Side::Front,
                    uv: DVec2::new(l.y, l.z),
                };
                let (inner, outer) = (on_edge - outwards, on_edge + outwards);
                if outer.min_element() < 0.0 {
                    continue;
                }
                let jump = field.at(at(inner)) - field.at(at(outer));
                assert!(jump.abs().max_element() < 1e-5, "{cell:?} {jump}");
                compared += 1;
            }
        }
    }
    assert!(compared > 10_000);
}

/// The most levels that two neighbours differ by, as seen from just outside each edge at four
/// points.
fn largest_step(p: &Patches) -> u8 {
    let mut largest = 0;
    for cell in p.ids().map(|id| p.cell(id)) {
        let [a, b, c] = cell.barycentric();
        let middle = (a + b + c) / 3.0;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            for t in [0.1, 0.4, 0.6, 0.9] {
                let l = from.lerp(to, t);
                let l = l + (l - middle) * 1e-6;
                if l.min_element() < 0.0 {
                    continue;
                }
                let uv = DVec2::new(l.y, l.z);
                let point = SurfacePoint { triangle: cell.triangle, side: Side::Front, uv };
                let other = p.cell(p.at(point).unwrap());
                largest = largest.max(other.level.abs_diff(cell.level));
            }
        }
    }
    largest
}

#[test]
fn balanced_neighbours_differ_by_at_most_one_level() {
    let g = room().geometry;
    let refined = |balance| refined_to(&g, 0.2, 0.002, balance);
    let (plain, balanced) = (refined(false), refined(true));
    assert!(largest_step(&plain.patches) > 1, "there was something to balance");
    assert!(balanced.patches.len() > plain.patches.len());
    assert_eq!(largest_step(&balanced.patches), 1);
}
