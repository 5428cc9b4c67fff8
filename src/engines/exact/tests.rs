use glam::DVec3;

use super::*;
use crate::engines::{Engine, Rays, RaysOptions};
use crate::form_factors::FormFactors;
use crate::progress::{Cancelled, Progress, Silent};
use crate::scene::builtin::{self, Mesh};
use crate::scene::{Material, SceneBuilder, Side, Sides, Surface};

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
    let mut engine = Exact::new(g, p, &bvh, options, &Silent).unwrap();
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
                let mut engine =
                    Exact::new(&g, &p, &bvh, ExactOptions::default(), &Silent).unwrap();
                let mut factors = FormFactors::new(p.len(), 1 << 32);
                let ids: Vec<PatchId> = p.ids().collect();
                engine.make(&ids, &mut factors, &Silent).unwrap();
                factors
            });
            for id in p.ids() {
                let row = &rows[id.index()];
                let stored = f.row(id).unwrap();
                assert_eq!(stored.columns, row.columns);
                assert!(stored.entries().zip(row.entries()).all(|(a, b)| a == b));
                assert_eq!(f.account(id).lost, row.lost);
            }
        }
        let mut engine = Exact::new(&g, &p, &bvh, ExactOptions::default(), &Silent).unwrap();
        for id in [3, 40, 77].map(PatchId) {
            let mut row = vec![Row::default()];
            engine.fill(&[id], &mut row).unwrap();
            assert_eq!(row[0], rows[id.index()], "{name} {id:?} alone");
        }
    }
}

/// Cancels when it has been asked this many times.
struct CancelAfter(std::sync::atomic::AtomicUsize);

impl Progress for CancelAfter {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, _n: u64) -> Result<(), crate::progress::Cancelled> {
        use std::sync::atomic::Ordering::Relaxed;
        let left = self.0.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1));
        left.map(|_| ()).map_err(|_| crate::progress::Cancelled)
    }
}

#[test]
fn an_interrupt_is_heard_between_two_pairs_of_tiles() {
    let g = builtin::build("furnace").unwrap().geometry;
    let p = Patches::uniform(&g, 0.005).unwrap();
    let bvh = Bvh::new(&g);
    let ids: Vec<PatchId> = p.ids().collect();
    let mut engine = Exact::new(&g, &p, &bvh, ExactOptions::default(), &Silent).unwrap();
    let mut factors = FormFactors::new(p.len(), 1 << 32);
    let error = engine.make(&ids, &mut factors, &CancelAfter(2.into())).unwrap_err();
    assert!(crate::progress::is_cancelled(&error), "{error}");
    // Two pairs of tiles of the first 36.
    let pairs = engine.counts()[0];
    assert!(pairs <= 2 * 128 * 128, "{pairs}");
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

#[test]
fn between_the_walls_of_a_convex_room_no_ray_is_cast() {
    let room = cuboid(DVec3::ZERO, DVec3::new(4.0, 2.7, 5.0), true);
    for turn in [0.0, 0.3, 2.0] {
        let turned = glam::DQuat::from_scaled_axis(DVec3::new(0.3, 0.8, -0.5) * turn);
        let triangles: Vec<_> = room.iter().map(|t| t.map(|v| turned * v)).collect();
        let g = scene(&triangles, Sides::One);
        for size in [1.0, 0.05] {
            let (p, bvh) = (Patches::uniform(&g, size).unwrap(), Bvh::new(&g));
            let mut engine = Exact::new(&g, &p, &bvh, ExactOptions::default(), &Silent).unwrap();
            let ids: Vec<PatchId> = p.ids().collect();
            engine.fill(&ids, &mut vec![Row::default(); ids.len()]).unwrap();
            assert_eq!(engine.counts()[1..], [0, 0], "{turn} {size}");
        }
    }
}

/// A box as squares of two triangles, its fronts outside or inside.
fn cuboid(low: DVec3, size: DVec3, inward: bool) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for k in 0..3 {
        let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
        (u[(k + 1) % 3], v[(k + 2) % 3]) = (size[(k + 1) % 3], size[(k + 2) % 3]);
        for far in [false, true] {
            let mut o = low;
            o[k] += if far { size[k] } else { 0.0 };
            let (u, v) = if far == inward { (v, u) } else { (u, v) };
            triangles.extend([[o, o + u, o + u + v], [o, o + u + v, o + v]]);
        }
    }
    triangles
}

fn furnished() -> Geometry {
    let mut t = cuboid(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5), true);
    t.extend(cuboid(DVec3::new(0.6, 0.5, 0.15), DVec3::new(1.0, 0.8, 1.2), false));
    t.extend(cuboid(DVec3::new(2.3, 1.4, 0.5), DVec3::new(0.7, 0.9, 1.0), false));
    scene(&t, Sides::One)
}

#[test]
fn pairs_are_reciprocal_and_bounded() {
    let g = furnished();
    let p = Patches::uniform(&g, 0.2).unwrap();
    let rows = rows_of(&g, &p, ExactOptions::default());
    let (mut worst, mut mean) = (0.0_f64, 0.0);
    for id in p.ids() {
        let (row, area) = (&rows[id.index()], p.area(id));
        for (j, f) in row.entries() {
            let other = rows[j.index()].factor_to(id);
            assert!((area * f / (p.area(j) * other) - 1.0).abs() < 3e-7);
            assert!(f >= 0.0 && area * f <= area.min(p.area(j)));
        }
        assert!((row.total() - 1.0).abs() < 1e-12);
        worst = worst.max(row.lost.abs());
        mean += row.lost.abs() / p.len() as f64;
    }
    assert!(mean < 5e-4 && worst < 1e-2, "{mean} {worst}");
}

#[test]
fn an_occluded_room_is_as_rays_find_it() {
    let g = furnished();
    let p = Patches::uniform(&g, 0.4).unwrap();
    let rows = rows_of(&g, &p, ExactOptions::default());
    let bvh = Bvh::new(&g);
    let rays = Rays::new(&g, &p, &bvh, RaysOptions { samples: 1 << 16, seed: 3 });
    let (mut errors, mut squares) = (0.0, 0.0);
    for id in p.ids().step_by(17) {
        let mut row = Row::default();
        rays.row(id, &mut row);
        for j in p.ids() {
            let (a, b) = (rows[id.index()].factor_to(j), row.factor_to(j));
            errors += (a - b) * (a - b);
            squares += b * b;
        }
    }
    let rms = (errors / squares).sqrt();
    // What the rays themselves err by.
    assert!(rms < 1e-2, "{rms}");
}

/// The mean factor from patches of the first source triangles to those of the others.
fn factor_between(t: &[[DVec3; 3]], first: usize, size: f64, error: f64) -> f64 {
    let g = scene(t, Sides::One);
    let p = Patches::uniform(&g, size).unwrap();
    let rows = rows_of(&g, &p, ExactOptions { error, ..ExactOptions::default() });
    let own = |id: &PatchId| p.cell(*id).triangle.index() < first;
    let (mut flux, mut area) = (0.0, 0.0);
    for id in p.ids().filter(own) {
        area += p.area(id);
        let others = rows[id.index()].entries().filter(|(j, _)| !own(j));
        flux += p.area(id) * others.map(|(_, f)| f).sum::<f64>();
    }
    flux / area
}

/// Two triangles that make a parallelogram.
fn square(o: DVec3, u: DVec3, v: DVec3) -> [[DVec3; 3]; 2] {
    [[o, o + u, o + u + v], [o, o + u + v, o + v]]
}

#[test]
fn rectangles_have_their_known_factors() {
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let cases = [
        (square(o, x, y), square(z, y, x), 0.199_824_895_7),
        (square(o, x, y), square(o, z, x), 0.200_043_776_1),
        (square(o, 2.0 * x, y), square(z, y, 2.0 * x), 0.285_875_384_9),
        // In one plane, and back to back.
        (square(o, x, y), square(x, x, y), 0.0),
        (square(o, x, y), square(-z, y, x), 0.0),
    ];
    for (a, b, expected) in cases {
        let known = |size: f64, error: f64, off: f64| {
            let f = factor_between(&[a, b].concat(), 2, size, error);
            assert!((f - expected).abs() < off, "{f} {expected}");
            assert_eq!(f == 0.0, expected == 0.0);
        };
        known(9.0, 1e-3, 1e-6);
        known(0.01, 1e-3, 1e-6);
        // Far pairs of small patches are left to a rule whose error follows from that asked for.
        known(0.01, 1e-5, 2e-7);
    }
}

/// A disc of radius 1 about the point at height `z` on the axis z, of the area of a circle, facing
/// up or down.
fn disc(z: f64, up: bool) -> Vec<[DVec3; 3]> {
    const SIDES: usize = 96;
    let step = std::f64::consts::TAU / SIDES as f64;
    let radius = (step / step.sin()).sqrt();
    let at = |k: usize| {
        let (y, x) = (step * k as f64).sin_cos();
        DVec3::new(radius * x, radius * y, z)
    };
    let c = DVec3::Z * z;
    (0..SIDES).map(|k| if up { [c, at(k), at(k + 1)] } else { [c, at(k + 1), at(k)] }).collect()
}

#[test]
fn coaxial_discs_have_their_known_factor() {
    for z in [0.2, 1.0, 5.0] {
        // Of equal radii 1: x = 2 + z², F = (x - √(x² - 4)) / 2.
        let x = 2.0 + z * z;
        let expected = 0.5 * (x - f64::sqrt(x * x - 4.0));
        let f = factor_between(&[disc(0.0, true), disc(z, false)].concat(), 96, 9.0, 1e-3);
        assert!((f / expected - 1.0).abs() < 1e-4, "{z}: {f} {expected}");
    }
}

#[test]
fn slivers_add_up_to_the_square_that_they_make() {
    // 64 strips of a square, each split along its diagonal: 1 : 64, and 1 : 10⁴ beside it.
    let strips = |n: usize, width: f64, o: DVec3, u: DVec3, v: DVec3| -> Vec<[DVec3; 3]> {
        (0..n).flat_map(|k| square(o + u * (width * k as f64), u * width, v)).collect()
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut floor = strips(64, 1e-4, DVec3::ZERO, x, y);
    floor.extend(square(x * 64e-4, x * (1.0 - 64e-4), y));
    let first = floor.len();
    for (other, expected) in
        [(square(z, y, x), 0.199_824_895_7), (square(DVec3::ZERO, y, z), 0.200_043_776_1)]
    {
        let f = factor_between(&[&floor[..], &other].concat(), first, 9.0, 1e-3);
        assert!((f - expected).abs() < 2e-6, "{f} {expected}");
    }
}

#[test]
fn tiny_against_huge_at_all_distances() {
    for distance in [1e-4, 1e-2, 1.0, 1e2, 1e4] {
        // A square of 1e-4 over the middle of one of 2: a point sees F = Σ of four corners.
        let tiny = square(DVec3::new(-5e-5, -5e-5, 0.0), DVec3::X * 1e-4, DVec3::Y * 1e-4);
        let huge = square(DVec3::new(-1.0, -1.0, distance), DVec3::Y * 2.0, DVec3::X * 2.0);
        let f = factor_between(&[tiny, huge].concat(), 2, 9.0, 1e-3);
        let (d, r) = (distance, (1.0 + distance * distance).sqrt());
        let expected = 4.0 / std::f64::consts::PI * (1.0 / r) * (1.0 / r).atan();
        assert!((f / expected - 1.0).abs() < 1e-4, "{d}: {f} {expected}");
    }
}

#[test]
fn random_scenes_keep_the_bounds() {
    let mut random = crate::engines::sampling::Random::new(11);
    for scene_number in 0..4 {
        let mut t = cuboid(DVec3::ZERO, DVec3::ONE, true);
        for _ in 0..12 {
            let n: [f64; 9] = random.numbers();
            let corner = |k: usize| DVec3::new(n[3 * k], n[3 * k + 1], n[3 * k + 2]) * 0.98 + 0.01;
            let size = if scene_number % 2 == 0 { 1.0 } else { 0.3 };
            let first = corner(0);
            t.push([first, first.lerp(corner(1), size), first.lerp(corner(2), size)]);
        }
        let g = scene(&t, Sides::Two);
        let p = Patches::uniform(&g, 0.3).unwrap();
        let rows = rows_of(&g, &p, ExactOptions::default());
        let (mut lost, mut inside) = (0.0, 0.0);
        for id in p.ids() {
            let (row, area) = (&rows[id.index()], p.own_area(id));
            for (j, f) in row.entries() {
                let other = rows[j.index()].factor_to(id);
                assert!((area * f / (p.own_area(j) * other) - 1.0).abs() < 3e-7);
                assert!(f >= 0.0 && area * f <= area.min(p.own_area(j)) * (1.0 + 1e-12));
            }
            // The outsides of the box see nothing but each other: none.
            let is_outside = p.cell(id).triangle.index() < 12 && p.cell(id).side == Side::Back;
            assert!(!is_outside || row.columns.is_empty());
            if !is_outside {
                (lost, inside) = (lost + area * row.lost.abs(), inside + area);
            }
        }
        // Large triangles that pierce each other are the hardest: few patches, all of them parted.
        let most = if scene_number % 2 == 0 { 4e-3 } else { 1.2e-3 };
        assert!(lost / inside < most, "{scene_number}: {}", lost / inside);
    }
}

#[test]
fn clusters_see_as_what_they_consist_of() {
    let g = builtin::build("paper-1").unwrap().geometry;
    let joined = Patches::clustered(&g, 2.0, &[]).unwrap();
    let parts = Patches::uniform(&g, 2.0).unwrap();
    assert!(joined.len() < parts.len());
    let rows = rows_of(&g, &joined, ExactOptions::default());
    let part_rows = rows_of(&g, &parts, ExactOptions::default());
    // A_i F_ij of clusters, added up over what they consist of.
    let whole = |part: PatchId| joined.at(parts.center(part)).unwrap();
    let mut expected = vec![vec![0.0; joined.len()]; joined.len()];
    for part in parts.ids() {
        for (to, f) in part_rows[part.index()].entries() {
            expected[whole(part).index()][whole(to).index()] += parts.own_area(part) * f;
        }
    }
    let (mut errors, mut squares) = (0.0, 0.0);
    for id in joined.ids().filter(|&id| joined.is_cluster(id)) {
        for to in joined.ids() {
            let found = joined.own_area(id) * rows[id.index()].factor_to(to);
            let back = joined.own_area(to) * rows[to.index()].factor_to(id);
            assert!((found - back).abs() <= 3e-7 * found);
            errors += (found - expected[id.index()][to.index()]).powi(2);
            squares += found * found;
        }
    }
    let rms = (errors / squares).sqrt();
    assert!(squares > 0.0 && rms < 3e-3, "{rms}");
}

/// In a sphere F_ij = A_j / A, whatever i.
#[test]
fn a_polyhedral_sphere_is_closed_and_everything_sees_alike() {
    let ball = Mesh::geodesic(1.0, 6).inverted();
    let corners = |t: &[u32; 3]| t.map(|v| ball.vertices[v as usize]);
    let faces: Vec<[DVec3; 3]> = ball.triangles.iter().map(corners).collect();
    let sphere = scene(&faces, Sides::One);
    let p = Patches::uniform(&sphere, 9.0).unwrap();
    let rows = rows_of(&sphere, &p, ExactOptions::default());
    let all: f64 = p.ids().map(|id| p.area(id)).sum();
    for (id, row) in p.ids().zip(&rows) {
        assert!(row.lost.abs() < 1e-4, "{id:?} {}", row.lost);
        // Of its neighbours a flat face sees less than a part of a sphere would, of none much more.
        let off: f64 = p.ids().map(|j| (row.factor_to(j) - p.area(j) / all).abs()).sum();
        assert!(0.5 * off < 0.05, "{id:?} {off}");
    }
}

#[test]
fn the_visible_fraction_is_weighted_by_the_kernel() {
    // The wall's lowest tenth hides behind a skirting that hangs just before it.
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let [s, h] = [y * 1e-4 + z * 1e-4, z * 0.1];
    let t = [
        [o, x, x + y],
        [o, x + y, y],
        [o, x + z, x],
        [o, z, x + z],
        [s - x, s - x + h, s + 2.0 * x + h],
        [s - x, s + 2.0 * x + h, s + 2.0 * x],
    ];
    let g = scene(&t, Sides::One);
    let p = Patches::uniform(&g, 10.0).unwrap();
    for (error, bound) in [(1e-3, 2e-3), (1e-4, 6e-4), (1e-5, 6e-4)] {
        let fraction = visible_fraction(&g, &p, ExactOptions { error, ..ExactOptions::default() });
        // Integrated apart, with what lines along the edge exchange in closed form. What lies
        // within 1e-4 of the edge is hidden least, and weighs 2.5e-4.
        assert!((fraction - 0.783_874).abs() < bound, "{error}: {fraction}");
    }
}

/// Fraction that is visible of what the first two patches, a unit square, exchange with the next
/// two, a square upright on its edge.
fn visible_fraction(g: &Geometry, p: &Patches, options: ExactOptions) -> f64 {
    let rows = rows_of(g, p, options);
    let f: f64 = [0, 1].iter().flat_map(|&i| [2, 3].map(|j| rows[i].factor_to(PatchId(j)))).sum();
    0.5 * f / 0.200_043_776_1
}

#[test]
fn rays_between_touching_patches_go_by_solid_angle() {
    // So many slats before the wall's foot that they are left to rays.
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let mut t = vec![[o, x, x + y], [o, x + y, y], [o, x + z, x], [o, z, x + z]];
    for k in 0..60 {
        let at = |k: i32, slant: f64| {
            let away = 1e-4 + slant * 0.002 * f64::from(k * 7 % 10);
            x * (f64::from(k) / 20.0 - 1.0) + y * away + z * 1e-4
        };
        let (a, b, h) = (at(k, 1.0), at(k, 0.5) + x / 20.0, z * 0.1);
        t.extend([[a, a + h, b + h], [a, b + h, b]]);
    }
    let g = scene(&t, Sides::One);
    let p = Patches::uniform(&g, 10.0).unwrap();
    let bvh = Bvh::new(&g);
    let rays = Rays::new(&g, &p, &bvh, RaysOptions { samples: 1 << 20, seed: 1 });
    let expected: f64 = [0, 1]
        .map(|i| {
            let mut row = Row::default();
            rays.row(PatchId(i), &mut row);
            row.factor_to(PatchId(2)) + row.factor_to(PatchId(3))
        })
        .iter()
        .sum();
    let expected = 0.5 * expected / 0.200_043_776_1;
    for seed in 0..8 {
        let fraction =
            visible_fraction(&g, &p, ExactOptions { error: 1e-4, seed, ..ExactOptions::default() });
        assert!((fraction - expected).abs() < 0.01, "{seed}: {fraction} {expected}");
    }
}

/// Stops at the first time that it is asked.
struct Stop;

impl Progress for Stop {
    fn stage(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

/// Counts how often it is asked.
#[derive(Default)]
struct Count(std::sync::atomic::AtomicUsize);

impl Progress for Count {
    fn stage(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) -> Result<(), Cancelled> {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        Ok(())
    }
}

#[test]
fn preparing_can_be_stopped_at_any_time() {
    let g = builtin::build("cornell-box").unwrap().geometry;
    let p = Patches::uniform(&g, 0.05).unwrap();
    let (bvh, options) = (Bvh::new(&g), ExactOptions::default());
    assert!(Exact::new(&g, &p, &bvh, options, &Stop).is_err());
    let count = Count::default();
    let mut engine = Exact::new(&g, &p, &bvh, options, &count).unwrap();
    // Each pair of tiles is a fraction of what is prepared, and asks first.
    let prepared = count.0.load(std::sync::atomic::Ordering::Relaxed);
    assert!(prepared > 100, "{prepared}");
    let rows: Vec<PatchId> = p.ids().take(64).collect();
    engine.fill(&rows, &mut vec![Row::default(); 64]).unwrap();
    let asked = count.0.load(std::sync::atomic::Ordering::Relaxed) - prepared;
    assert!(asked > 64, "{asked}");
}
