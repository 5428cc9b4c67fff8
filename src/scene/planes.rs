//! Which triangles lie in one plane.

use glam::DVec3;

use super::hash::mix;

/// Planes whose normals differ by less than this are the same: a hundred times the noise of
/// `f32` coordinates.
pub(crate) const SAME_NORMAL: f64 = 1e-4;

/// Planes whose offsets differ by less than this fraction of the model are the same.
const SAME_OFFSET: f64 = 1e-6;

/// A number that is alike for both sides of a plane, and for planes that are the same, if rounding
/// does not part them. `point` is one of the plane, counted from the middle of a model of some
/// `extent` (m).
pub(crate) fn plane_key(normal: DVec3, point: DVec3, extent: f64) -> u64 {
    let upright = upright(normal);
    let offset = (upright.dot(point) / (SAME_OFFSET * extent)).round();
    let [x, y, z] = upright.to_array().map(|x| (x / SAME_NORMAL).round());
    mix([x, y, z, offset].map(|q| q as i64 as u64))
}

/// The normal or its opposite, alike for both sides of a plane.
fn upright(n: DVec3) -> DVec3 {
    let first = n.to_array().into_iter().find(|x| x.abs() > SAME_NORMAL).unwrap_or(1.0);
    n * first.signum()
}
