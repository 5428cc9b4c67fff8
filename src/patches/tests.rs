use glam::{DQuat, DVec2, DVec3, EulerRot};

use super::*;
use crate::progress::Silent;
use crate::scene::builtin::Mesh;
use crate::scene::{Geometry, Side, TriangleId};
use crate::scene::{Material, SceneBuilder, Sides};

fn triangle(sides: Sides) -> Geometry {
    let mut b = SceneBuilder::new("triangle");
    let m = b.material(Material::default());
    let corners = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.5, 3.0, 1.0)];
    b.mesh("triangle", &corners, &[[0, 1, 2]], m, sides);
    b.finish().geometry
}

#[test]
fn splits_until_the_area_is_at_most_the_size() {
    let g = triangle(Sides::One);
    let area = g.area(TriangleId(0));
    assert_eq!(Patches::uniform(&g, area).unwrap().len(), 1);
    assert_eq!(Patches::uniform(&g, area * 0.999).unwrap().len(), 4);
    assert_eq!(Patches::uniform(&g, area / 16.0).unwrap().len(), 16);
    assert_eq!(Patches::uniform(&g, 0.0).unwrap_err(), PatchesError::BadArea);
    assert!(matches!(Patches::uniform(&g, 1e-30), Err(PatchesError::TooMany { .. })));
}

#[test]
fn area_is_kept_and_every_center_finds_its_patch() {
    let g = triangle(Sides::Two);
    let p = Patches::uniform(&g, 0.01).unwrap();
    let total: f64 = p.ids().map(|i| p.area(i)).sum();
    assert!((total - 2.0 * g.area(TriangleId(0))).abs() < 1e-12);
    for id in p.ids() {
        assert_eq!(p.at(p.center(id)), Some(id));
        for (x, y) in [(0.01, 0.01), (0.99, 0.01), (0.99, 0.99), (0.5, 0.5)] {
            assert_eq!(p.at(p.sample(id, DVec2::new(x, y))), Some(id));
        }
        let [a, b, c] = p.cell(id).corners(&g);
        let area = 0.5 * (b - a).cross(c - a).length();
        assert!((area - p.area(id)).abs() < 1e-12);
        let up = (b - a).cross(c - a).normalize().dot(g.normal(TriangleId(0), Side::Front));
        assert!(up > 0.999, "cells keep the winding of their source");
    }
}

#[test]
fn one_sided_backs_have_no_patch() {
    let g = triangle(Sides::One);
    let p = Patches::uniform(&g, 0.5).unwrap();
    let back = SurfacePoint { triangle: TriangleId(0), side: Side::Back, uv: DVec2::splat(0.2) };
    assert_eq!(p.at(back), None);
}

#[test]
fn the_area_for_more_patches_yields_them() {
    let g = triangle(Sides::One);
    let area = Patches::area_adding(&g, 1000);
    let n = Patches::uniform(&g, area).unwrap().len();
    assert!((1000..=4096).contains(&n), "{n}");
}

/// Numbers in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// `n` large triangles of some kind.
fn crowd(kind: &str, n: usize, turn: DQuat) -> Geometry {
    let mut random = Random(5);
    let flat = DVec3::new(1.0, 1.0, 0.0);
    let mut vertices = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    while triangles.len() < n {
        let i = triangles.len();
        let first = vertices.len() as u32;
        let lift = |z: f64| DVec3::new(0.0, 0.0, z);
        if kind == "stacked" {
            let at = random.point() * flat * 0.3 + lift(i as f64 / 12.0);
            let body = Mesh::cuboid(DVec3::ONE, [1; 3]).at(at.x, at.y, at.z);
            vertices.extend(&body.vertices);
            triangles.extend(body.triangles.iter().map(|t| t.map(|v| first + v)));
            continue;
        }
        let corner = |random: &mut Random| match kind {
            "in one plane" => random.point() * flat,
            "in planes" => random.point() * flat + lift(0.1 * (i % 7) as f64),
            "nearly in one plane" => random.point() * (flat + lift(1e-5)),
            "crossing at small angles" => random.point() * (flat + lift(0.01)),
            _ => random.point(),
        };
        vertices.extend((0..3).map(|_| corner(&mut random)));
        triangles.push([first, first + 1, first + 2]);
    }
    vertices.iter_mut().for_each(|v| *v = turn * *v);
    let mut b = SceneBuilder::new("crowd");
    let m = b.material(Material::default());
    b.mesh("crowd", &vertices, &triangles, m, Sides::Two);
    b.finish().geometry
}

/// Triangles tried, and parts that patches are cut into.
fn work(g: &Geometry) -> [usize; 2] {
    let solid: Vec<TriangleId> = g.ids().filter(|&t| g.is_solid(t)).collect();
    let tried = touching::contacts(g, &solid, &Silent).unwrap().tried;
    let patches = Patches::uniform(g, 1e9).unwrap();
    let parts = patches.ids().map(|id| patches.fragments(id).map_or(1, |parts| parts.len())).sum();
    [tried, parts]
}

#[test]
fn work_grows_with_the_number_of_triangles_that_overlap_touch_or_cross() {
    let turned = DQuat::from_euler(EulerRot::XYZ, 0.7, 0.43, 0.2);
    let kinds = [
        "in one plane",
        "in planes",
        "nearly in one plane",
        "crossing at small angles",
        "crossing",
        "stacked",
    ];
    for kind in kinds {
        for turn in [DQuat::IDENTITY, turned] {
            let [few, many] = [1000, 4000].map(|n| work(&crowd(kind, n, turn)));
            for (few, many) in few.into_iter().zip(many) {
                assert!(many as f64 <= 4.0 * 1.25 * few as f64, "{kind}: {few} and {many}");
            }
        }
    }
}

#[test]
fn what_many_lines_cut_still_adds_up() {
    let g = crowd("crossing", 300, DQuat::IDENTITY);
    for size in [1e9, 0.02] {
        let patches = Patches::uniform(&g, size).unwrap();
        let [own, all] = [Patches::own_area, Patches::area]
            .map(|area| patches.ids().map(|id| area(&patches, id)).sum::<f64>());
        assert!((own / all - 1.0).abs() < 1e-9, "{size}: {own} {all}");
    }
}
