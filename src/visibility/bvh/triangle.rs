//! A triangle, ready to be tested against rays.

use glam::{DVec3, Vec3, dvec3};

use crate::visibility::ROUNDING;

/// A triangle, ready to be tested.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(16))]
pub(super) struct Triangle {
    /// x, y, z of corners a, b, c; then what [`SLAB`] and [`NOISE`] say.
    pub(super) numbers: [f32; 11],
    /// Index among the solid triangles.
    pub(super) solid: u32,
}

/// Where in [`Triangle::numbers`] [`ROUNDING`] times twice the area is.
pub(super) const SLAB: usize = 9;

/// Where in [`Triangle::numbers`] 16 times [`ROUNDING`] times the perimeter is: twice the area of a
/// drawing may be rounding noise below that, and the triangle is seen edge on.
pub(super) const NOISE: usize = 10;

impl Triangle {
    /// Triangle number `solid` with these corners.
    pub(super) fn new(corners: [Vec3; 3], solid: u32) -> Self {
        let mut numbers = [0.0; 11];
        for (numbers, corner) in numbers.chunks_exact_mut(3).zip(corners) {
            numbers.copy_from_slice(&corner.to_array());
        }
        let mut triangle = Self { numbers, solid };
        let [a, b, c] = corners;
        let perimeter = (b - a).length() + (c - b).length() + (a - c).length();
        triangle.numbers[NOISE] = 16.0 * ROUNDING as f32 * perimeter;
        triangle.numbers[SLAB] = (ROUNDING * triangle.normal().length()) as f32;
        triangle
    }

    /// Normal, as long as twice the area.
    pub(super) fn normal(&self) -> DVec3 {
        let [ax, ay, az, bx, by, bz, cx, cy, cz, ..] = self.numbers.map(f64::from);
        let (a, b, c) = (dvec3(ax, ay, az), dvec3(bx, by, bz), dvec3(cx, cy, cz));
        (b - a).cross(c - a)
    }
}
