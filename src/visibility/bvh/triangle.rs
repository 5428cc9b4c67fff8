//! One triangle against 16 rays.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use glam::{DVec3, Vec3, dvec3};

use super::rays::{Rays, max, min};
use super::{Bvh, LANES, Lanes, NOISE, NOTHING, ROUNDING, SLAB, Triangle};

impl Rays {
    /// Meets a triangle.
    #[inline(always)]
    pub(super) fn test<const ANY: bool>(&mut self, bvh: &Bvh, triangle: &Triangle) {
        let n = &triangle.numbers;
        let [x, y, z] = self.axes;
        // Never so: spares checking each index.
        if x > 2 || y > 2 || z > 2 {
            return;
        }
        let ([sx, sy], [fx, fy]) = (&self.slope, &self.foot);
        let (az, bz, cz) = (n[z], n[3 + z], n[6 + z]);
        let (mut ea, mut eb, mut ec) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut any = 0_u32;
        for l in 0..LANES {
            let ax = n[x] - (sx[l] * az + fx[l]);
            let ay = n[y] - (sy[l] * az + fy[l]);
            let bx = n[3 + x] - (sx[l] * bz + fx[l]);
            let by = n[3 + y] - (sy[l] * bz + fy[l]);
            let cx = n[6 + x] - (sx[l] * cz + fx[l]);
            let cy = n[6 + y] - (sy[l] * cz + fy[l]);
            let a = bx * cy - cx * by;
            let b = cx * ay - ax * cy;
            let c = ax * by - bx * ay;
            ea[l] = a;
            eb[l] = b;
            ec[l] = c;
            let (least, most) = (min(min(a, b), c), max(max(a, b), c));
            any |= u32::from((least >= 0.0) | (most <= 0.0));
        }
        if any == 0 {
            return;
        }
        let mut unclear = 0_u32;
        for l in 0..LANES {
            let (a, b, c) = (ea[l], eb[l], ec[l]);
            let (least, most) = (min(min(a, b), c), max(max(a, b), c));
            let inside = (least >= 0.0) | (most <= 0.0);
            let det = (a + b) + c;
            let inverse = 1.0 / det;
            let distance = self.sense * (((a * az + b * bz) + c * cz) * inverse) - self.start[l];
            // Fronts have positive edge functions.
            let slab = n[SLAB] * inverse;
            let near = distance - slab;
            let until = if ANY { distance + slab.abs() } else { near };
            let met = inside
                & (det != 0.0)
                & (distance + slab > 0.0)
                & (until < self.best[l])
                & (self.own[l] != triangle.solid);
            let clear = (near > 0.0) & (det.abs() > n[NOISE]);
            unclear |= u32::from(met & !clear);
            let met = met & clear;
            let item = 2 * triangle.solid + u32::from(det < 0.0);
            let best = if ANY { f32::NEG_INFINITY } else { near };
            self.best[l] = if met { best } else { self.best[l] };
            self.item[l] = if met { item } else { self.item[l] };
            if !ANY {
                self.u[l] = if met { b * inverse } else { self.u[l] };
                self.v[l] = if met { c * inverse } else { self.v[l] };
                self.distance[l] = if met { distance } else { self.distance[l] };
            }
        }
        if unclear != 0 {
            self.test_closely::<ANY>(bvh, triangle, [ea, eb, ec]);
        }
    }

    /// Meets a triangle that some rays begin on or see edge on, unless it continues the plane of
    /// their own.
    #[cold]
    #[inline(never)]
    fn test_closely<const ANY: bool>(&mut self, bvh: &Bvh, triangle: &Triangle, edges: [Lanes; 3]) {
        let n = &triangle.numbers;
        let z = self.axes[2];
        for l in 0..LANES {
            let [a, b, c] = [edges[0][l], edges[1][l], edges[2][l]];
            let det = (a + b) + c;
            let inside = min(min(a, b), c) >= 0.0 || max(max(a, b), c) <= 0.0;
            if !inside || det == 0.0 || self.own[l] == triangle.solid {
                continue;
            }
            let inverse = 1.0 / det;
            let along = ((a * n[z] + b * n[3 + z]) + c * n[6 + z]) * inverse;
            let distance = self.sense * along - self.start[l];
            let slab = n[SLAB] * inverse;
            let near = distance - slab;
            let until = if ANY { distance + slab.abs() } else { near };
            let clear = near > 0.0 && det.abs() > n[NOISE];
            let met = !clear && distance + slab > 0.0 && until < self.best[l];
            if met && !bvh.continues(triangle, self.own[l]) {
                self.best[l] = if ANY { f32::NEG_INFINITY } else { near };
                self.item[l] = 2 * triangle.solid + u32::from(det < 0.0);
                (self.u[l], self.v[l]) = (b * inverse, c * inverse);
                self.distance[l] = distance;
            }
        }
    }
}

/// Normals with a smaller sine between them are those of one plane: single precision turns those of
/// small triangles by as much.
const PARALLEL: f64 = 1e-3;

impl Bvh {
    /// Whether a triangle is parallel to the solid triangle `own` and faces the same way.
    fn continues(&self, triangle: &Triangle, own: u32) -> bool {
        let place = self.place.get(own as usize).map_or(NOTHING, |&p| p);
        self.triangles.get(place as usize).is_some_and(|own| {
            let (m, n) = (own.normal(), triangle.normal());
            let along = m.dot(n);
            along > 0.0 && m.cross(n).length() <= PARALLEL * along
        })
    }
}

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
    fn normal(&self) -> DVec3 {
        let [ax, ay, az, bx, by, bz, cx, cy, cz, ..] = self.numbers.map(f64::from);
        let (a, b, c) = (dvec3(ax, ay, az), dvec3(bx, by, bz), dvec3(cx, cy, cz));
        (b - a).cross(c - a)
    }
}
