//! Hemicubes on the graphics device against those on the CPU.
//!
//! Without an adapter these tests are skipped, visibly, unless `HEMICUBE_REQUIRE_GPU=1` is set.
#![cfg(feature = "gpu")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

mod common;

use std::sync::{Arc, OnceLock};

use common::scenes::lit_by_first;
use glam::{DVec2, DVec3};
use hemicube::engines::delta::DeltaFormFactors;
use hemicube::engines::hemicube_gpu::Item;
use hemicube::engines::{Draw, Engine, Gpu, GpuError, Hemicube, HemicubeGpu, HemicubeOptions};
use hemicube::form_factors::ONE;
use hemicube::form_factors::{Row, Weights};
use hemicube::patches::{PatchId, Patches, SplitCells, SurfacePoint};
use hemicube::progress::Silent;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Geometry, Side, Sides, TriangleId, builtin};
use hemicube::visibility::{Bvh, Frame, uncover};

const MEMORY: u64 = 256 << 20;

const DRAWS: [Draw; 2] = [Draw::Sources, Draw::Patches];

/// The device that all tests share; `None` where there is none.
fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Result<Gpu, GpuError>> = OnceLock::new();
    match GPU.get_or_init(Gpu::open) {
        Ok(gpu) => Some(gpu),
        Err(e) if std::env::var("HEMICUBE_REQUIRE_GPU").is_ok_and(|v| v == "1") => {
            panic!("HEMICUBE_REQUIRE_GPU=1, but: {e}")
        }
        Err(e) => {
            eprintln!("SKIPPED, no graphics device: {e}");
            None
        }
    }
}

fn options(resolution: usize, draw: Draw) -> HemicubeOptions {
    HemicubeOptions { resolution, draw }
}

fn on_gpu(gpu: &Gpu, g: &Geometry, p: &Patches, o: HemicubeOptions, ids: &[PatchId]) -> Vec<Row> {
    fill(&mut HemicubeGpu::on(gpu, g, p, o, MEMORY).unwrap(), ids)
}

fn on_cpu(g: &Geometry, p: &Patches, o: HemicubeOptions, ids: &[PatchId]) -> Vec<Row> {
    fill(&mut Hemicube::new(g, p, o).unwrap(), ids)
}

fn fill(engine: &mut dyn Engine, ids: &[PatchId]) -> Vec<Row> {
    let mut rows = vec![Row::default(); ids.len()];
    engine.fill(ids, &mut rows).unwrap();
    rows
}

fn fixed(row: &Row) -> &[u32] {
    match &row.weights {
        Weights::Fixed(w) => w,
        Weights::Each(_) | Weights::Equal { .. } => panic!("hemicubes count in fixed point"),
    }
}

/// Half the sum of all differences, account included.
fn variation(n: usize, a: &Row, b: &Row) -> f64 {
    let mut difference = vec![0.0; n];
    for (j, f) in a.entries() {
        difference[j.index()] += f;
    }
    for (j, f) in b.entries() {
        difference[j.index()] -= f;
    }
    difference.extend([a.environment - b.environment, a.back - b.back, a.lost - b.lost]);
    difference.iter().map(|d| d.abs()).sum::<f64>() / 2.0
}

fn solid(vertices: &[DVec3], triangles: &[[u32; 3]], sides: Sides) -> Geometry {
    let mesh = Mesh { vertices: vertices.to_vec(), triangles: triangles.to_vec() };
    lit_by_first(&[&mesh], sides).geometry
}

/// The inside of a box. With unequal sides its walls are split to different levels.
fn hollow_box(size: DVec3) -> Geometry {
    let v: Vec<DVec3> = (0..8)
        .map(|i| size * DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2 & 1).into()))
        .collect();
    let quads =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|&[p, q, r, t]| [[p, q, r], [p, r, t]]).collect();
    solid(&v, &triangles, Sides::One)
}

#[test]
fn rows_of_closed_boxes_sum_to_exactly_one() {
    let Some(gpu) = gpu() else { return };
    for size in [DVec3::ONE, DVec3::new(7.0, 0.9, 2.3)] {
        let g = hollow_box(size);
        let finest = 0.02 * size.element_product();
        for p in [Patches::uniform(&g, finest).unwrap(), mixed(&g, finest)] {
            for draw in DRAWS {
                for resolution in [16, 50, 128] {
                    closed_rows_sum_to_one(gpu, &g, &p, options(resolution, draw));
                }
            }
        }
    }
}

fn closed_rows_sum_to_one(gpu: &Gpu, g: &Geometry, p: &Patches, o: HemicubeOptions) {
    let ids: Vec<PatchId> = p.ids().collect();
    for (id, row) in ids.iter().zip(&on_gpu(gpu, g, p, o, &ids)) {
        let sum = fixed(row).iter().map(|&w| u64::from(w)).sum::<u64>();
        assert_eq!(sum, u64::from(ONE), "{o:?} {id:?}");
        assert!(row.columns.windows(2).all(|c| c[0] < c[1]));
        assert_eq!([row.environment, row.back, row.lost], [0.0; 3]);
    }
}

#[test]
fn rows_agree_with_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for scene in builtin::list() {
        let name = scene.name;
        let scene = builtin::build(name).unwrap();
        let g = &scene.geometry;
        let size = Patches::area_adding(g, 1000);
        let uniform = Patches::uniform(g, size).unwrap();
        let uniform = uncover(g, uniform, &Bvh::new(g), &Silent).unwrap();
        for (kind, p) in [("uniform", uniform), ("mixed", mixed(g, size))] {
            let ids: Vec<PatchId> = p.ids().step_by(p.len().div_ceil(100)).collect();
            for draw in DRAWS {
                let o = options(128, draw);
                let (a, b) = (on_gpu(gpu, g, &p, o, &ids), on_cpu(g, &p, o, &ids));
                let worst = (ids.iter().zip(a.iter().zip(&b)))
                    .map(|(id, (a, b))| (variation(p.len(), a, b), id))
                    .max_by(|x, y| x.0.total_cmp(&y.0))
                    .unwrap();
                eprintln!(
                    "{name}, {} {kind} patches, {draw:?}: worst variation {worst:?}",
                    p.len()
                );
                assert!(worst.0 <= 1e-2, "{name} {kind} {draw:?}: {worst:?}");
                for row in a {
                    assert!((row.total() - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}

/// Fronts and backs, one-sided and two-sided, in the open.
#[test]
fn both_sides_are_told_apart() {
    let Some(gpu) = gpu() else { return };
    let v: Vec<DVec3> = (0..12)
        .map(|i| {
            let (layer, corner) = (i / 4, i % 4);
            DVec3::new((corner & 1).into(), (corner >> 1).into(), f64::from(layer) * 0.7)
                + DVec3::splat(f64::from(layer) * 0.1)
        })
        .collect();
    let t: Vec<[u32; 3]> =
        [0, 4, 8].iter().flat_map(|&k| [[k, k + 1, k + 3], [k, k + 3, k + 2]]).collect();
    for sides in [Sides::One, Sides::Two] {
        let g = solid(&v, &t, sides);
        let p = Patches::uniform(&g, 0.05).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        for draw in DRAWS {
            let o = options(128, draw);
            let (a, b) = (on_gpu(gpu, &g, &p, o, &ids), on_cpu(&g, &p, o, &ids));
            for (id, (a, b)) in ids.iter().zip(a.iter().zip(&b)) {
                let v = variation(p.len(), a, b);
                assert!(v <= 1e-2, "{sides:?} {draw:?} {id:?}: {v} {} {}", a.back, b.back);
            }
            assert_eq!(a.iter().any(|r| r.back > 0.1), sides == Sides::One);
        }
    }
}

/// Counts the item buffer of a hemicube on the CPU: sums of all patches, environment, back. If
/// `exact`, nothing parts any patch: a pixel that sees a patch belongs to it.
fn count(
    g: &Geometry,
    p: &Patches,
    id: PatchId,
    items: &[Item],
    n: usize,
    exact: bool,
) -> Vec<u32> {
    let delta = DeltaFormFactors::new(n);
    let cell = p.cell(id);
    let eye = p.origin(id).position(g);
    let [t, u, w] = Frame::on_surface(eye, g.normal(cell.triangle, cell.side)).axes;
    let faces = [[t, u, w], [u, w, t], [-u, w, -t], [-t, w, u], [t, w, -u]];
    let mut sums = vec![0; p.len() + 2];
    for (line, items) in items.chunks(n).enumerate() {
        let (face, row) =
            if line < n { (0, line) } else { (1 + (line - n) / (n / 2), (line - n) % (n / 2)) };
        let weights = if face == 0 { &delta.top } else { &delta.side };
        let y = (2 * row + 1) as f64 / n as f64 - if face == 0 { 1.0 } else { 0.0 };
        for (column, &item) in items.iter().enumerate() {
            let x = (2 * column + 1) as f64 / n as f64 - 1.0;
            let [right, up, forward] = faces[face];
            let at = match item {
                Item::Nothing => p.len(),
                Item::Patch(id) if exact => id.index(),
                Item::Patch(PatchId(_)) | Item::Source(_) => {
                    let triangle = match item {
                        Item::Patch(id) => p.cell(id).triangle,
                        Item::Source(triangle) => triangle,
                        Item::Nothing => continue,
                    };
                    seen_from(g, p, triangle, eye, right * x + up * y + forward)
                        .map_or(p.len() + 1, PatchId::index)
                }
            };
            sums[at] += weights[row * n + column];
        }
    }
    sums
}

/// The patch of a triangle in some direction.
fn seen_from(
    g: &Geometry,
    p: &Patches,
    triangle: TriangleId,
    eye: DVec3,
    direction: DVec3,
) -> Option<PatchId> {
    let [a, b, c] = g.corners(triangle).map(|v| v - eye);
    let [f, u, v] = [b.cross(c), c.cross(a), a.cross(b)].map(|e| e.dot(direction));
    let sum = f + u + v;
    let back = (b - a).cross(c - a).dot(a) > 0.0;
    let side = if back { Side::Back } else { Side::Front };
    p.at(SurfacePoint { triangle, side, uv: DVec2::new(u, v) / sum })
}

#[test]
fn the_same_item_buffer_gives_the_same_row() {
    let Some(gpu) = gpu() else { return };
    let cornell = builtin::build("cornell-box").unwrap().geometry;
    let empty = hollow_box(DVec3::new(7.0, 0.9, 2.3));
    for (g, size, parted) in [(&cornell, 0.1, true), (&empty, 0.3, false)] {
        let uniform = Patches::uniform(g, size).unwrap();
        for p in [mixed(g, size), uniform] {
            for (draw, n) in [(DRAWS[0], 34), (DRAWS[0], 128), (DRAWS[1], 34), (DRAWS[1], 128)] {
                same_items_same_rows(gpu, g, &p, options(n, draw), parted);
            }
        }
    }
}

fn same_items_same_rows(gpu: &Gpu, g: &Geometry, p: &Patches, o: HemicubeOptions, parted: bool) {
    let n = o.resolution;
    let exact = o.draw == Draw::Patches && !parted;
    let mut engine = HemicubeGpu::on(gpu, g, p, o, MEMORY).unwrap();
    for id in p.ids().step_by(p.len() / 5) {
        let items = engine.items(id).unwrap();
        let counted = count(g, p, id, &items, n, exact);
        let row = fill(&mut engine, &[id]).remove(0);
        let mut made = vec![0; p.len() + 2];
        for (&j, &w) in row.columns.iter().zip(fixed(&row)) {
            made[j.index()] = w;
        }
        let share = |x: f64| (x * f64::from(ONE)).round() as u32;
        made[p.len()] = share(row.environment);
        made[p.len() + 1] = share(row.back);
        let sources = items.iter().filter(|i| matches!(i, Item::Source(_))).count();
        if o.draw == Draw::Patches {
            assert!(sources < items.len() / 4, "patches hide the sources: {sources}");
        }
        assert_eq!(made[p.len()..], counted[p.len()..]);
        if exact && sources == 0 {
            assert_eq!(made, counted, "bit for bit");
        } else {
            // A pixel on the border of two patches may fall on either: single precision, and where
            // patches are drawn, corners rounded to fractions of a pixel.
            let moved: u64 =
                made.iter().zip(&counted).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
            let pixels = if o.draw == Draw::Patches { 8 } else { 1 };
            let pixel = DeltaFormFactors::new(n).top.iter().copied().max().unwrap();
            assert!(moved <= 2 * pixels * u64::from(pixel), "{o:?} {id:?} {moved}");
        }
    }
}

/// Patches of several levels: every third cell of level 1 is split down to `size`.
fn mixed(g: &Geometry, size: f64) -> Patches {
    let finest = Arc::new(Patches::uniform(g, size).unwrap());
    let mut cells = SplitCells::new(finest, |_| 1);
    for _ in 0..4 {
        for (k, cell) in cells.leaves().iter().enumerate() {
            if k % 3 == 0 && cells.may_split(cell) {
                cells.split(cell);
            }
        }
    }
    cells.patches()
}

#[test]
fn neither_batches_nor_memory_change_a_row() {
    let Some(gpu) = gpu() else { return };
    let scene = builtin::build("cornell-box").unwrap();
    let g = &scene.geometry;
    let p = Patches::uniform(g, 0.05).unwrap();
    assert!(p.len() > 4096, "{} patches: too few for several windows", p.len());
    let ids: Vec<PatchId> = p.ids().step_by(p.len() / 40).collect();
    for draw in DRAWS {
        let o = options(64, draw);
        let whole = on_gpu(gpu, g, &p, o, &ids);
        let mut engine = HemicubeGpu::on(gpu, g, &p, o, MEMORY).unwrap();
        let one_by_one: Vec<Row> = ids.iter().flat_map(|&id| fill(&mut engine, &[id])).collect();
        assert!(whole == one_by_one, "one_by_one");
        let backwards: Vec<PatchId> = ids.iter().rev().copied().collect();
        let mut rows = fill(&mut engine, &backwards);
        rows.reverse();
        assert!(whole == rows, "rows");
        // So little memory that patches are counted a window at a time, one row a batch.
        let mut engine = HemicubeGpu::on(gpu, g, &p, o, 4096).unwrap();
        assert!(whole == fill(&mut engine, &ids), "little memory");
    }
}

#[test]
fn a_scene_without_patches_makes_no_rows() {
    let Some(gpu) = gpu() else { return };
    let g = solid(&[], &[], Sides::One);
    let p = Patches::uniform(&g, 1.0).unwrap();
    for draw in DRAWS {
        assert!(on_gpu(gpu, &g, &p, options(64, draw), &[]).is_empty());
    }
}

#[test]
fn bad_resolutions_are_refused_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let g = hollow_box(DVec3::ONE);
    let p = Patches::uniform(&g, 1.0).unwrap();
    for n in [0, 15, 17, 2048] {
        let e = HemicubeGpu::on(gpu, &g, &p, options(n, Draw::Sources), MEMORY).unwrap_err();
        assert_eq!(
            e.to_string(),
            Hemicube::new(&g, &p, options(n, Draw::Sources)).err().unwrap().to_string()
        );
    }
}

#[test]
fn rows_of_clusters_are_those_of_the_processor() {
    let Some(gpu) = gpu() else { return };
    let room = Mesh::cuboid(DVec3::splat(2.0), [8; 3]).inverted();
    let ball = Mesh::geodesic(0.4, 8).at(0.1, 0.9, -0.2);
    let g = lit_by_first(&[&room, &ball], Sides::One).geometry;
    let p = Patches::clustered(&g, 0.15, &[]).unwrap();
    assert!(p.has_clusters());
    let ids: Vec<PatchId> = p.ids().collect();
    for draw in DRAWS {
        let o = options(64, draw);
        let (a, b) = (on_gpu(gpu, &g, &p, o, &ids), on_cpu(&g, &p, o, &ids));
        for (a, b) in a.iter().zip(&b) {
            assert!((a.total() - 1.0).abs() < 1e-9);
            assert!(variation(p.len(), a, b) < 0.01, "{draw:?}: {}", variation(p.len(), a, b));
        }
    }
}
