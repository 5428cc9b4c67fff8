//! Which straight segments triangles block: every segment against every triangle, no acceleration
//! structure.
//!
//! A triangle is three linear functions of a point: its distance d from the triangle's plane and
//! two barycentric coordinates u, v (Baldwin & Weber 2016, "Fast ray-triangle intersections by
//! coordinate transformation"). A segment from p to q crosses the plane where d = 0, so inside the
//! triangle if d(p) and d(q) differ in sign and, with weights |d(q)| and |d(p)|,
//!
//! ```text
//! u = |d(q)| u(p) + |d(p)| u(q) ≥ 0        likewise v        u + v ≤ |d(p)| + |d(q)|
//! ```
//!
//! What depends on p alone is kept in a [`Sight`] for all segments from p. The expressions are
//! symmetric in p and q to the last bit, so both directions of a segment have the same answer.

use glam::{DVec3, Vec3};

use crate::simd::{LANES, multiversion};

/// Lengths below this fraction of the radius of all triangles are rounding noise of single
/// precision (some 16 units in the last place). A triangle whose plane an end of a segment
/// touches within it does not block that segment: so neither do the patches at its ends, nor
/// those beside them in the same plane. Triangles are wider by it at each edge, so that no segment
/// slips through between neighbours.
pub const ROUNDING: f64 = 1e-6;

/// A triangle grows by at most this fraction of its size to allow for [`ROUNDING`], so that slivers
/// do not become longer.
const MOST_GROWTH: f64 = 0.01;

/// Blocks that all segments are tested against before the next ones: with what is kept of them in
/// a [`Sight`] they fit the first-level cache (32 KiB).
const CHUNK: usize = 32;

/// Triangles that block segments.
#[derive(Debug, Clone)]
pub struct Blockers {
    centre: DVec3,
    radius: f64,
    len: usize,
    blocks: Vec<Planes>,
}

type Lanes = [f32; LANES];

/// Coefficients of x, y, z and 1 in the linear functions d, u, v of a block of triangles. All zero
/// where there is no triangle.
#[derive(Debug, Clone, Copy)]
struct Planes {
    d: [Lanes; 4],
    u: [Lanes; 4],
    v: [Lanes; 4],
}

/// What blockers look like from one point; reused from point to point.
#[derive(Debug, Clone, Default)]
pub struct Sight {
    blocks: Vec<Near>,
}

/// The part of the test that depends on the point alone.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// |d(p)|; 0 if the point touches the plane.
    d: Lanes,
    /// u(p); -1 if the point touches the plane, which no segment passes.
    u: Lanes,
    v: Lanes,
    /// -1 where d(p) is negative, else 1.
    sign: Lanes,
}

impl Blockers {
    /// The given triangles; those without area block nothing.
    #[must_use]
    pub fn new(triangles: &[[DVec3; 3]]) -> Self {
        let corners = || triangles.iter().flatten().copied();
        let (low, high) = corners()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        let (centre, radius) = if low.cmple(high).all() {
            (0.5 * (low + high), (0.5 * (high - low).length()).max(f64::MIN_POSITIVE))
        } else {
            (DVec3::ZERO, 1.0)
        };
        let empty = Planes { d: [[0.0; LANES]; 4], u: [[0.0; LANES]; 4], v: [[0.0; LANES]; 4] };
        let mut blocks = vec![empty; triangles.len().div_ceil(LANES)];
        for (i, corners) in triangles.iter().enumerate() {
            let Some(functions) = functions(corners.map(|v| (v - centre) / radius)) else {
                continue;
            };
            let Planes { d, u, v } = &mut blocks[i / LANES];
            for (lanes, (gradient, offset)) in [d, u, v].into_iter().zip(functions) {
                for (lanes, x) in lanes.iter_mut().zip([gradient.x, gradient.y, gradient.z, offset])
                {
                    lanes[i % LANES] = x as f32;
                }
            }
        }
        Self { centre, radius, len: triangles.len(), blocks }
    }

    /// Number of triangles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The length (m) below which distances are noise: [`ROUNDING`] times the triangles' radius.
    #[must_use]
    pub fn rounding(&self) -> f64 {
        ROUNDING * self.radius
    }

    /// A point (m) in the coordinates of the test.
    #[must_use]
    pub fn local(&self, point: DVec3) -> Vec3 {
        ((point - self.centre) / self.radius).as_vec3()
    }

    /// Bytes of a [`Sight`].
    #[must_use]
    pub fn sight_bytes(&self) -> usize {
        self.blocks.len() * size_of::<Near>()
    }

    /// Prepares the test of segments from `point`, given by [`local`](Self::local).
    pub fn look(&self, point: Vec3, sight: &mut Sight) {
        look(self, point, sight);
    }

    /// Whether the segments from the point of `sight` to each of `ends`, given by
    /// [`local`](Self::local), are blocked. Each is tested against one triangle after another, 16
    /// at a time, up to the first that blocks it. Returns the number of tests made.
    pub fn blocked(&self, sight: &Sight, ends: &[Vec3], blocked: &mut Vec<bool>) -> u64 {
        blocked.clear();
        blocked.resize(ends.len(), false);
        let mut tests = 0;
        test(self, sight, ends, blocked, &mut tests);
        tests
    }

    /// Whether any triangle blocks the segment between two points (m).
    #[must_use]
    pub fn blocks(&self, from: DVec3, to: DVec3) -> bool {
        let (mut sight, mut blocked) = (Sight::default(), Vec::new());
        self.look(self.local(from), &mut sight);
        self.blocked(&sight, &[self.local(to)], &mut blocked);
        blocked[0]
    }
}

/// Gradient and offset of d, u and v of a triangle; `None` without area.
fn functions([a, b, c]: [DVec3; 3]) -> Option<[(DVec3, f64); 3]> {
    let double_area = (b - a).cross(c - a).length();
    let (ea, eb, ec) = ((c - b).length(), (a - c).length(), (b - a).length());
    let perimeter = ea + eb + ec;
    if !(double_area > 0.0 && perimeter.is_finite()) {
        return None;
    }
    // All edges move outwards by the same distance if a triangle grows about its incentre.
    let incentre = (a * ea + b * eb + c * ec) / perimeter;
    let growth = 1.0 + (ROUNDING * perimeter / double_area).min(MOST_GROWTH);
    let [a, b, c] = [a, b, c].map(|v| incentre + (v - incentre) * growth);
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let scale = normal.length_squared().recip();
    let through_a = |gradient: DVec3| (gradient, -gradient.dot(a));
    let functions = [
        through_a(normal * scale.sqrt()),
        through_a(e2.cross(normal) * scale),
        through_a(normal.cross(e1) * scale),
    ];
    functions.iter().all(|f| f.0.is_finite()).then_some(functions)
}

multiversion! {
    fn look(blockers: &Blockers, point: Vec3, sight: &mut Sight) = look_kernel
}

multiversion! {
    fn test(
        blockers: &Blockers,
        sight: &Sight,
        ends: &[Vec3],
        blocked: &mut [bool],
        tests: &mut u64,
    )
        = test_kernel
}

/// The linear function with these coefficients at a point, in one lane.
#[inline(always)]
fn at(f: &[Lanes; 4], p: Vec3, l: usize) -> f32 {
    (f[0][l] * p.x + f[1][l] * p.y) + (f[2][l] * p.z + f[3][l])
}

#[inline(always)]
fn look_kernel(blockers: &Blockers, point: Vec3, sight: &mut Sight) {
    const TOUCH: f32 = ROUNDING as f32;
    sight.blocks.clear();
    sight.blocks.extend(blockers.blocks.iter().map(|planes| {
        let zero = [0.0; LANES];
        let mut near = Near { d: zero, u: zero, v: zero, sign: zero };
        for l in 0..LANES {
            let d = at(&planes.d, point, l);
            let touches = d.abs() <= TOUCH;
            near.d[l] = if touches { 0.0 } else { d.abs() };
            near.u[l] = if touches { -1.0 } else { at(&planes.u, point, l) };
            near.v[l] = at(&planes.v, point, l);
            near.sign[l] = if d < 0.0 { -1.0 } else { 1.0 };
        }
        near
    }));
}

#[inline(always)]
fn test_kernel(
    blockers: &Blockers,
    sight: &Sight,
    ends: &[Vec3],
    blocked: &mut [bool],
    tests: &mut u64,
) {
    const TOUCH: f32 = ROUNDING as f32;
    let chunks = blockers.blocks.chunks(CHUNK).zip(sight.blocks.chunks(CHUNK));
    for (first, (planes, near)) in (0..).step_by(CHUNK * LANES).zip(chunks) {
        for (&end, blocked) in ends.iter().zip(&mut *blocked).filter(|(_, blocked)| !**blocked) {
            let mut passed = 0;
            for (planes, near) in planes.iter().zip(near) {
                let mut hits = [0_u32; LANES];
                for (l, hit) in hits.iter_mut().enumerate() {
                    let far = -near.sign[l] * at(&planes.d, end, l);
                    let u = far * near.u[l] + near.d[l] * at(&planes.u, end, l);
                    let v = far * near.v[l] + near.d[l] * at(&planes.v, end, l);
                    let inside = (u >= 0.0) & (v >= 0.0) & (u + v <= far + near.d[l]);
                    *hit = u32::from((far > TOUCH) & inside);
                }
                passed += LANES;
                if hits.iter().fold(0, |any, hit| any | hit) != 0 {
                    *blocked = true;
                    break;
                }
            }
            *tests += passed.min(blockers.len - first) as u64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// A number in 0..1 that looks random.
    fn noise(seed: &mut u64) -> f64 {
        *seed =
            seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(seed: &mut u64) -> DVec3 {
        dvec3(noise(seed), noise(seed), noise(seed))
    }

    /// Möller & Trumbore (1997) in double precision; `None` if an edge is too near to tell.
    fn crosses([a, b, c]: [DVec3; 3], p: DVec3, q: DVec3) -> Option<bool> {
        let (e1, e2, along) = (b - a, c - a, q - p);
        let h = along.cross(e2);
        let det = e1.dot(h);
        let s = p - a;
        let (u, v, t) = (s.dot(h) / det, along.dot(s.cross(e1)) / det, e2.dot(s.cross(e1)) / det);
        let least = u.min(v).min(1.0 - u - v).min(t).min(1.0 - t);
        (least.abs() > 1e-4).then_some(least > 0.0)
    }

    #[test]
    fn agrees_with_double_precision() {
        let mut seed = 1;
        let mut counts = [0; 2];
        for _ in 0..3_000 {
            let triangle = [point(&mut seed), point(&mut seed), point(&mut seed)];
            let (p, q) = (point(&mut seed), point(&mut seed));
            let blockers = Blockers::new(&[triangle]);
            if let Some(expected) = crosses(triangle, p, q) {
                assert_eq!(blockers.blocks(p, q), expected, "{triangle:?} {p} {q}");
                counts[usize::from(expected)] += 1;
            }
        }
        assert!(counts[0] > 2_000 && counts[1] > 30, "{counts:?}");
    }

    #[test]
    fn both_directions_agree_to_the_bit() {
        let mut seed = 7;
        let triangles: Vec<_> = (0..5).map(|_| [0; 3].map(|_| point(&mut seed))).collect();
        let blockers = Blockers::new(&triangles);
        // Points in the planes and on the edges of the triangles are the hard ones.
        let mut points: Vec<DVec3> = (0..60).map(|_| point(&mut seed)).collect();
        for [a, b, c] in &triangles {
            for _ in 0..20 {
                let (u, v) = (noise(&mut seed), noise(&mut seed));
                points.push(a + (b - a) * u + (c - a) * v);
                points.push(a + (b - a) * u);
            }
        }
        for p in &points {
            for q in &points {
                assert_eq!(blockers.blocks(*p, *q), blockers.blocks(*q, *p), "{p} {q}");
            }
        }
    }

    /// A unit square at z = 0 of n × n cells, two triangles each.
    fn square(n: u32) -> Vec<[DVec3; 3]> {
        let at = |i: u32, j: u32| dvec3(f64::from(i), f64::from(j), 0.0) / f64::from(n);
        (0..n * n)
            .flat_map(|k| {
                let (i, j) = (k % n, k / n);
                [
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                ]
            })
            .collect()
    }

    #[test]
    fn nothing_slips_through_between_neighbours() {
        let blockers = Blockers::new(&square(7));
        for i in 1..98 {
            for j in 1..98 {
                let middle = dvec3(f64::from(i), f64::from(j), 0.0) / 98.0;
                for along in [dvec3(0.0, 0.0, 1.0), dvec3(0.3, 0.5, 0.2), dvec3(-1.0, 0.0, 0.1)] {
                    assert!(blockers.blocks(middle - along, middle + along), "{middle} {along}");
                }
            }
        }
    }

    #[test]
    fn triangles_in_the_plane_of_an_end_do_not_block() {
        let blockers = Blockers::new(&square(5));
        let on = dvec3(0.31, 0.42, 0.0);
        assert!(!blockers.blocks(on, dvec3(0.4, 0.4, 1.0)));
        assert!(!blockers.blocks(on, dvec3(0.4, 0.4, -1.0)));
        assert!(!blockers.blocks(on, dvec3(0.9, 0.1, 0.0)));
        assert!(blockers.blocks(on + 1e-4 * DVec3::Z, dvec3(0.4, 0.4, -1.0)));
        assert!(!blockers.blocks(dvec3(1.01, 0.5, -1.0), dvec3(1.01, 0.5, 1.0)), "beside it");
        assert!(!blockers.blocks(dvec3(0.5, 0.5, 0.1), dvec3(0.5, 0.5, 1.0)), "before it");
    }

    #[test]
    fn tests_are_counted_up_to_the_first_blocker() {
        let blockers = Blockers::new(&square(5));
        let (mut sight, mut blocked) = (Sight::default(), Vec::new());
        let local = |p: DVec3| blockers.local(p);
        blockers.look(local(dvec3(0.1, 0.05, 1.0)), &mut sight);
        let ends = [dvec3(0.1, 0.05, -1.0), dvec3(0.1, 0.05, 0.5)].map(local);
        assert_eq!(blockers.blocked(&sight, &ends, &mut blocked), 16 + 50);
        assert_eq!(blocked, [true, false]);
        assert_eq!((blockers.len(), blockers.is_empty()), (50, false));
    }

    #[test]
    fn no_triangle_and_flat_triangles_block_nothing() {
        assert!(!Blockers::new(&[]).blocks(DVec3::ZERO, DVec3::ONE));
        let line = [DVec3::ZERO, DVec3::ONE, 2.0 * DVec3::ONE];
        for flat in [line, [DVec3::ONE; 3], [DVec3::splat(f64::NAN); 3]] {
            assert!(!Blockers::new(&[flat]).blocks(dvec3(-1.0, 1.0, 0.0), dvec3(3.0, 1.0, 2.0)));
        }
    }
}
