//! Which way is up in a format that does not say: as the model stands best.

use glam::DVec3;

use super::geometry::{Geometry, Side};

/// What lies within this share of the height above the lowest point is what a model stands on.
const FOOT: f64 = 0.03;

/// The axis that is usual gives way to one on which the model stands better by this much: the first
/// where the format says nothing at all, the second where most programs write y upwards.
const BETTER: f64 = 0.15;
const MUCH_BETTER: f64 = 0.8;

/// A model that stands less well than this does not stand at all: then z takes its place if the
/// model stands better on that by so much.
const AT_ALL: f64 = 0.05;
const ANYHOW: f64 = 0.3;

/// A model that is lower than this share of its width is a plate, and need not stand.
const PLATE: f64 = 0.1;

/// The axis upwards, where the format has no convention: `usual`, or the other one of y and z if
/// the model stands better on that.
pub(super) fn guess(geometry: &Geometry, usual: DVec3) -> DVec3 {
    let other = if usual == DVec3::Y { DVec3::Z } else { DVec3::Y };
    better(geometry, usual, &[other], BETTER)
}

/// The axis upwards, where nearly all models have y: z or -z if the model stands much better so, or
/// z if it stands on that and not at all on y.
pub(super) fn doubt(geometry: &Geometry) -> DVec3 {
    if stands(geometry, DVec3::Y) < AT_ALL {
        let up = better(geometry, DVec3::Y, &[DVec3::Z], ANYHOW);
        if up != DVec3::Y {
            return up;
        }
    }
    better(geometry, DVec3::Y, &[DVec3::Z, DVec3::NEG_Z], MUCH_BETTER)
}

fn better(geometry: &Geometry, usual: DVec3, others: &[DVec3], margin: f64) -> DVec3 {
    let least = (stands(geometry, usual) + margin, usual);
    let others = others.iter().map(|&other| (stands(geometry, other), other));
    others.fold(least, |best, next| if next.0 > best.0 { next } else { best }).1
}

/// How well a model stands with that axis upwards, 0..2: the share of its outline from above that
/// its feet span, and the share that a flat base covers.
fn stands(geometry: &Geometry, up: DVec3) -> f64 {
    let Some((low, high)) = geometry.bounds() else { return 0.0 };
    let size = high - low;
    let axis = up.abs();
    let area_across = |size: DVec3| {
        let [a, b, c] = (size * (DVec3::ONE - axis) + axis).to_array();
        a * b * c
    };
    let (outline, floor) =
        (area_across(size), low.dot(up).min(high.dot(up)) + FOOT * size.dot(axis));
    if outline <= 0.0 || size.dot(axis) < PLATE * size.max_element() {
        return 0.0;
    }
    let solid = || geometry.ids().filter(|&t| geometry.is_solid(t));
    let feet = solid().flat_map(|t| geometry.corners(t)).filter(|v| v.dot(up) <= floor);
    let span = feet.map(|v| (v, v)).reduce(|(a, b), (v, _)| (a.min(v), b.max(v)));
    let lies = |t| geometry.corners(t).iter().all(|v| v.dot(up) <= floor);
    let base: f64 = solid()
        .filter(|&t| lies(t))
        .map(|t| geometry.area(t) * geometry.normal(t, Side::Front).dot(up).abs())
        .sum();
    span.map_or(0.0, |(a, b)| area_across(b - a) / outline) + (base / outline).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::Mesh;
    use crate::scene::{Material, SceneBuilder, Sides};

    /// A pyramid with its base at the bottom of that axis.
    fn pyramid(up: DVec3) -> Geometry {
        let (x, y) = (up.any_orthonormal_vector(), up.cross(up.any_orthonormal_vector()));
        let mesh = Mesh {
            vertices: vec![x + y, y - x, -x - y, x - y, up * 2.0],
            triangles: vec![[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        };
        let mut builder = SceneBuilder::new("pyramid");
        let m = builder.material(Material::default());
        builder.mesh("pyramid", &mesh.vertices, &mesh.triangles, m, Sides::Two);
        builder.finish().geometry
    }

    /// A ball with a small foot at the bottom of that axis.
    fn bust(up: DVec3) -> Geometry {
        let (x, y) = (up.any_orthonormal_vector(), up.cross(up.any_orthonormal_vector()));
        let ring = |r: f64, h: f64| [x, y, -x, -y].map(|d| d * r + up * h);
        let vertices = [ring(1.2, 0.0), ring(1.0, 1.0), ring(2.0, 3.0), ring(1.0, 5.0)].concat();
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]];
        for k in 0..12 {
            let next = if k % 4 == 3 { k - 3 } else { k + 1 };
            triangles.extend([[k, next, k + 4], [next, next + 4, k + 4]]);
        }
        let mut builder = SceneBuilder::new("bust");
        let m = builder.material(Material::default());
        builder.mesh("bust", &vertices, &triangles, m, Sides::Two);
        builder.finish().geometry
    }

    #[test]
    fn what_stands_on_nothing_is_stood_on_its_foot() {
        assert_eq!(doubt(&bust(DVec3::Z)), DVec3::Z);
        assert_eq!(doubt(&bust(DVec3::Y)), DVec3::Y);
    }

    #[test]
    fn a_model_stands_on_its_base() {
        for usual in [DVec3::Y, DVec3::Z] {
            for up in [DVec3::Y, DVec3::Z] {
                assert_eq!(guess(&pyramid(up), usual), up);
            }
        }
        assert_eq!(doubt(&pyramid(DVec3::Z)), DVec3::Z);
        assert_eq!(doubt(&pyramid(DVec3::NEG_Z)), DVec3::NEG_Z);
        assert_eq!(doubt(&pyramid(DVec3::Y)), DVec3::Y);
        assert_eq!(guess(&Geometry::default(), DVec3::Z), DVec3::Z);
    }
}
