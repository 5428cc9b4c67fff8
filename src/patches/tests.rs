use glam::{DVec2, DVec3};

use super::*;
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
