//! The solid triangles of a scene, ready to be projected, and how they look from one point.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::Bodies;
use crate::scene::geometry::position_key;
use crate::scene::{Geometry, TriangleId};
use crate::simd::multiversion;

/// All solid triangles in single precision, centred on the scene.
#[derive(Debug, Clone)]
pub struct Occluders {
    centre: DVec3,
    /// Distinct positions, coordinate by coordinate.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Corners in the distinct positions, of solid triangles only.
    corners: Vec<[u32; 3]>,
    /// The source triangle of each.
    ids: Vec<TriangleId>,
}

/// A pinhole and its right-handed axes; the third looks along the normal or the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Position of the pinhole in metres.
    pub origin: DVec3,
    /// Unit axes: x, y, z of the frame.
    pub axes: [DVec3; 3],
}

/// Hemicubes are turned about their normal by this angle (radians): the edges of rooms then run
/// at an angle to the pixels, which averages out the error of counting them.
const SLANT: f64 = 0.47;

impl Frame {
    /// A frame at `origin` whose z axis is `normal`. The other two axes depend on the normal alone
    /// (Duff et al. 2017, "Building an orthonormal basis, revisited"), turned by a fixed slant.
    #[must_use]
    pub fn on_surface(origin: DVec3, normal: DVec3) -> Self {
        let sign = 1.0_f64.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        let t = DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
        let u = DVec3::new(b, sign + normal.y * normal.y * a, -normal.y);
        let (sin, cos) = SLANT.sin_cos();
        Self { origin, axes: [t * cos + u * sin, u * cos - t * sin, normal] }
    }
}

/// The occluders as seen in a [`Frame`]; reused from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct View {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// On which side of the planes of the hemicube's pyramids each vertex lies.
    codes: Vec<u16>,
}

impl Occluders {
    /// Collects the solid triangles.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        let centre = geometry.bounds().map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi));
        let mut index = HashMap::new();
        let mut me = Self {
            centre,
            x: Vec::new(),
            y: Vec::new(),
            z: Vec::new(),
            corners: Vec::new(),
            ids: Vec::new(),
        };
        for id in geometry.ids().filter(|&t| geometry.is_solid(t)) {
            let corners = geometry.corners(id).map(|v| {
                *index.entry(position_key(v)).or_insert_with(|| {
                    let p = (v - centre).as_vec3();
                    me.x.push(p.x);
                    me.y.push(p.y);
                    me.z.push(p.z);
                    (me.x.len() - 1) as u32
                })
            });
            me.corners.push(corners);
            me.ids.push(id);
        }
        me
    }

    /// Number of solid triangles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The source triangle of each solid triangle.
    #[must_use]
    pub fn ids(&self) -> &[TriangleId] {
        &self.ids
    }

    /// The closed bodies among the triangles.
    pub(crate) fn bodies(&self, geometry: &Geometry) -> Bodies {
        Bodies::find(geometry, &self.ids, &self.corners)
    }

    /// Moves all vertices into `frame`.
    pub fn look(&self, frame: &Frame, view: &mut View) {
        let origin = (frame.origin - self.centre).as_vec3();
        let axes = frame.axes.map(|a| a.as_vec3());
        look(self, origin, axes, view);
    }

    /// The corners of solid triangle number `i` in the frame of `view`.
    #[inline(always)]
    pub(crate) fn corners_in(&self, view: &View, i: usize) -> [Vec3; 3] {
        let at = |v: u32| Vec3::new(view.x[v as usize], view.y[v as usize], view.z[v as usize]);
        let [a, b, c] = self.corners[i];
        [at(a), at(b), at(c)]
    }

    /// Which faces of the hemicube solid triangle number `i` may touch: bit f for face f. Never
    /// misses one.
    #[inline(always)]
    pub(crate) fn faces_in(&self, view: &View, i: usize) -> u8 {
        let [a, b, c] = self.corners[i];
        faces_of(view.codes[a as usize] | view.codes[b as usize] | view.codes[c as usize])
    }
}

/// Code of one point of the frame, as for vertices.
#[inline(always)]
pub(crate) fn code(x: f32, y: f32, z: f32) -> u16 {
    let bit = |b: bool, n: u16| u16::from(b) << n;
    bit(z > 0.0, 0)
        | bit(x + y > 0.0, 1)
        | bit(x + y < 0.0, 2)
        | bit(x - y > 0.0, 3)
        | bit(x - y < 0.0, 4)
        | bit(x > z, 5)
        | bit(-x > z, 6)
        | bit(y > z, 7)
        | bit(-y > z, 8)
        | bit(z > x, 9)
        | bit(z > -x, 10)
        | bit(z > y, 11)
        | bit(z > -y, 12)
}

/// Which faces each joined code may touch.
static FACES: [u8; 1 << 13] = {
    const UP: usize = 1;
    const NEEDS: [usize; 5] = [
        UP | 1 << 9 | 1 << 10 | 1 << 11 | 1 << 12,
        UP | 1 << 1 | 1 << 3 | 1 << 5,
        UP | 1 << 2 | 1 << 4 | 1 << 6,
        UP | 1 << 1 | 1 << 4 | 1 << 7,
        UP | 1 << 2 | 1 << 3 | 1 << 8,
    ];
    let mut table = [0; 1 << 13];
    let mut joined = 0;
    while joined < table.len() {
        let mut f = 0;
        while f < NEEDS.len() {
            if joined & NEEDS[f] == NEEDS[f] {
                table[joined] |= 1 << f;
            }
            f += 1;
        }
        joined += 1;
    }
    table
};

/// A convex body can touch a face only if, for each plane of the face's pyramid, some vertex lies
/// on the inner side: bits of several vertices are joined by "or".
#[inline(always)]
pub(crate) fn faces_of(joined: u16) -> u8 {
    FACES[usize::from(joined) % FACES.len()]
}

multiversion! {
    fn look(occluders: &Occluders, origin: Vec3, axes: [Vec3; 3], view: &mut View) = look_kernel
}

#[inline(always)]
fn look_kernel(o: &Occluders, origin: Vec3, axes: [Vec3; 3], view: &mut View) {
    let n = o.x.len();
    for list in [&mut view.x, &mut view.y, &mut view.z] {
        list.resize(n, 0.0);
    }
    view.codes.resize(n, 0);
    let [t, u, w] = axes;
    let (x, y, z) = (&o.x[..n], &o.y[..n], &o.z[..n]);
    let (vx, vy, vz) = (&mut view.x[..n], &mut view.y[..n], &mut view.z[..n]);
    for i in 0..n {
        let (dx, dy, dz) = (x[i] - origin.x, y[i] - origin.y, z[i] - origin.z);
        vx[i] = dx * t.x + dy * t.y + dz * t.z;
        vy[i] = dx * u.x + dy * u.y + dz * u.z;
        vz[i] = dx * w.x + dy * w.y + dz * w.z;
    }
    let codes = &mut view.codes[..n];
    for i in 0..n {
        codes[i] = code(vx[i], vy[i], vz[i]);
    }
}
