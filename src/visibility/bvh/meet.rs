//! One triangle against 16 rays.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use super::hierarchy::Hierarchy;
use super::rays::{Rays, max, min};
use super::triangle::{NOISE, SLAB, Triangle};
use crate::simd::LANES;

/// A triangle drawn for a ray: twice the areas of the ray's point with each edge.
#[derive(Clone, Copy)]
struct Drawing {
    a: f32,
    b: f32,
    c: f32,
    /// Whether the point is within the edges.
    inside: bool,
}

/// How a ray and the plane of a triangle meet.
struct Meeting {
    /// Whether they do within the edges.
    inside: bool,
    /// Twice the area of the drawing, negative for a back.
    double_area: f32,
    /// Distance to the plane.
    distance: f32,
    /// Half the distance along the ray between the two faces of the slab; negative for a back.
    slab: f32,
    /// Barycentric coordinates of corners b and c.
    u: f32,
    v: f32,
}

impl Rays {
    /// Draws a triangle for the ray in lane `l`, in `axes` of the drawing.
    #[inline(always)]
    fn draw(&self, [x, y, z]: [usize; 3], n: &[f32; 11], l: usize) -> Drawing {
        let ([sx, sy], [fx, fy]) = (&self.slope, &self.foot);
        let (az, bz, cz) = (n[z], n[3 + z], n[6 + z]);
        let ax = n[x] - (sx[l] * az + fx[l]);
        let ay = n[y] - (sy[l] * az + fy[l]);
        let bx = n[3 + x] - (sx[l] * bz + fx[l]);
        let by = n[3 + y] - (sy[l] * bz + fy[l]);
        let cx = n[6 + x] - (sx[l] * cz + fx[l]);
        let cy = n[6 + y] - (sy[l] * cz + fy[l]);
        let a = bx * cy - cx * by;
        let b = cx * ay - ax * cy;
        let c = ax * by - bx * ay;
        let (least, most) = (min(min(a, b), c), max(max(a, b), c));
        Drawing { a, b, c, inside: (least >= 0.0) | (most <= 0.0) }
    }

    /// Where the ray in lane `l` meets the plane of a triangle drawn for it.
    #[inline(always)]
    fn meeting(&self, z: usize, n: &[f32; 11], d: &Drawing, l: usize) -> Meeting {
        let Drawing { a, b, c, inside } = *d;
        let double_area = (a + b) + c;
        let inverse = 1.0 / double_area;
        let along = ((a * n[z] + b * n[3 + z]) + c * n[6 + z]) * inverse;
        Meeting {
            inside: inside & (double_area != 0.0),
            double_area,
            distance: self.sense * along - self.start[l],
            slab: n[SLAB] * inverse,
            u: b * inverse,
            v: c * inverse,
        }
    }

    /// Whether the ray in lane `l` meets a triangle before its best hit, and whether single
    /// precision can tell.
    #[inline(always)]
    fn meets<const ANY: bool>(&self, m: &Meeting, triangle: &Triangle, l: usize) -> (bool, bool) {
        let near = m.distance - m.slab;
        let until = if ANY { m.distance + m.slab.abs() } else { near };
        let met = m.inside
            & (m.distance + m.slab > 0.0)
            & (until < self.best[l])
            & (self.own[l] != triangle.solid);
        (met, (near > 0.0) & (m.double_area.abs() > triangle.numbers[NOISE]))
    }

    /// Makes a triangle the best hit of lane `l` if it is `met`.
    #[inline(always)]
    fn keep<const ANY: bool>(&mut self, met: bool, m: &Meeting, triangle: &Triangle, l: usize) {
        let best = if ANY { f32::NEG_INFINITY } else { m.distance - m.slab };
        let item = 2 * triangle.solid + u32::from(m.double_area < 0.0);
        self.best[l] = if met { best } else { self.best[l] };
        self.item[l] = if met { item } else { self.item[l] };
        if !ANY {
            self.u[l] = if met { m.u } else { self.u[l] };
            self.v[l] = if met { m.v } else { self.v[l] };
            self.distance[l] = if met { m.distance } else { self.distance[l] };
        }
    }

    /// Tests a triangle against all rays.
    #[inline(always)]
    pub(super) fn test<const ANY: bool>(&mut self, boxes: &Hierarchy, triangle: &Triangle) {
        let axes = self.axes;
        // Never so: spares checking each index.
        if axes[0] > 2 || axes[1] > 2 || axes[2] > 2 {
            return;
        }
        let n = &triangle.numbers;
        let (mut a, mut b, mut c) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut inside = [0_u32; LANES];
        let mut any = 0_u32;
        for l in 0..LANES {
            let d = self.draw(axes, n, l);
            (a[l], b[l], c[l]) = (d.a, d.b, d.c);
            inside[l] = u32::from(d.inside);
            any |= inside[l];
        }
        // Most triangles are met by no ray, and divisions are slow.
        if any == 0 {
            return;
        }
        let mut unclear = 0_u32;
        for l in 0..LANES {
            let d = Drawing { a: a[l], b: b[l], c: c[l], inside: inside[l] != 0 };
            let m = self.meeting(axes[2], n, &d, l);
            let (met, clear) = self.meets::<ANY>(&m, triangle, l);
            unclear |= u32::from(met & !clear);
            self.keep::<ANY>(met & clear, &m, triangle, l);
        }
        if unclear != 0 {
            self.test_closely::<ANY>(boxes, triangle);
        }
    }

    /// Tests a triangle that some rays begin on or see edge on: these do not meet what continues
    /// the plane of their own.
    #[cold]
    #[inline(never)]
    fn test_closely<const ANY: bool>(&mut self, boxes: &Hierarchy, triangle: &Triangle) {
        for l in 0..LANES {
            let n = &triangle.numbers;
            let m =
                self.meeting(self.axes[2] % 3, n, &self.draw(self.axes.map(|a| a % 3), n, l), l);
            let (met, clear) = self.meets::<ANY>(&m, triangle, l);
            let met = met && !clear && !boxes.continues(triangle, self.own[l]);
            self.keep::<ANY>(met, &m, triangle, l);
        }
    }
}
