//! Closed bodies: the backs of their surface cannot be seen from outside.
//!
//! A body is a connected surface each of whose edges joins two triangles that run along it in
//! opposite directions, and which does not cross itself. Seen from where its winding number is
//! that of its fronts' side, whatever is first met of it is a front. So an engine may leave out its
//! backs, about half of all triangles of most scenes, and nothing changes.

use std::convert::Infallible;

use glam::{DVec3, Vec3};

use crate::scene::box_tree::{Bounds, BoxTree};
use crate::scene::disjoint_sets::DisjointSets;
use crate::scene::shares::{Looked, share_out};
use crate::scene::{Geometry, TriangleId};
use crate::simd::{LANES, multiversion};

/// The closed bodies among the solid triangles.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bodies {
    centre: DVec3,
    /// Lengths below this are rounding noise, m.
    tolerance: f32,
    /// The body of each solid triangle, or [`NONE`].
    body_of: Vec<u32>,
    bodies: Vec<Body>,
    /// Coefficients of x, y, z and 1 of the distance from each solid triangle's plane.
    planes: [Vec<f32>; 4],
}

const NONE: u32 = u32::MAX;

#[derive(Debug, Clone)]
struct Body {
    low: Vec3,
    high: Vec3,
    /// Winding number where its fronts are seen: 0 if they look outwards, -1 if they look inwards.
    fronts: i32,
    walls: Vec<Walls>,
}

type Lanes = [f32; LANES];

/// A block of triangles as met along [`PROBE`]: coefficients of x, y and 1 across the probe.
#[derive(Debug, Clone, Copy)]
struct Walls {
    /// Distances from the edges, positive inside.
    edges: [[Lanes; 3]; 3],
    /// Distance from the plane, of x, y, z along the probe and 1; positive before it.
    plane: [Lanes; 4],
    /// 1 where the probe passes from back to front, -1 for the other way, 0 where there is none.
    turn: [i32; LANES],
}

/// A direction unlikely to run along any edge or plane.
const PROBE: DVec3 = DVec3::new(0.352_673_1, 0.471_238_9, 0.808_437_6);

/// Fraction of the size of a scene below which single precision cannot tell lengths apart.
const ROUNDING: f64 = 4e-6;

impl Bodies {
    /// Finds the closed bodies among `solid`, the solid triangles of `geometry` with their corners
    /// in distinct positions.
    pub fn find(geometry: &Geometry, solid: &[TriangleId], corners: &[[u32; 3]]) -> Self {
        let (low, high) = geometry.bounds().unwrap_or_default();
        let (centre, size) = (0.5 * (low + high), (high - low).length());
        let mut me = Self {
            centre,
            tolerance: (ROUNDING * size) as f32,
            body_of: vec![NONE; solid.len()],
            bodies: Vec::new(),
            planes: Default::default(),
        };
        for &t in solid {
            let [a, ..] = geometry.corners(t);
            let n = geometry.normal(t, crate::scene::Side::Front);
            let plane = [n.x, n.y, n.z, n.dot(centre - a)];
            for (list, x) in me.planes.iter_mut().zip(plane) {
                list.push(x as f32);
            }
        }
        for members in shells(corners) {
            let triangles: Vec<[DVec3; 3]> = members
                .iter()
                .map(|&i| geometry.corners(solid[i as usize]).map(|v| v - centre))
                .collect();
            let own: Vec<[u32; 3]> = members.iter().map(|&i| corners[i as usize]).collect();
            if crosses_itself(&triangles, &own) {
                continue;
            }
            let Some(body) = Body::new(&triangles) else { continue };
            for &i in &members {
                me.body_of[i as usize] = me.bodies.len() as u32;
            }
            me.bodies.push(body);
        }
        me
    }

    /// No bodies among that many solid triangles.
    #[cfg(test)]
    pub fn none(solid: usize) -> Self {
        Self { body_of: vec![NONE; solid], ..Self::default() }
    }

    /// Marks the solid triangles whose back `origin` faces and which hide it there. `own` is the
    /// solid triangle whose front (`on_front`) or back it lies on.
    pub fn hide(&self, origin: DVec3, own: Option<(usize, bool)>, hidden: &mut Vec<bool>) {
        hidden.resize(self.body_of.len(), false);
        if self.bodies.is_empty() {
            hidden.fill(false);
            return;
        }
        let origin = (origin - self.centre).as_vec3();
        let own = own.map(|(i, front)| (self.body_of[i], front));
        let closed: Vec<bool> = (0_u32..)
            .zip(&self.bodies)
            .map(|(k, body)| match own {
                Some((own, front)) if own == k => front,
                _ => body.sees_fronts(origin, self.tolerance),
            })
            .chain([false])
            .collect();
        facing_away(&self.planes, origin, hidden);
        for (hidden, &body) in hidden.iter_mut().zip(&self.body_of) {
            *hidden &= closed[(body as usize).min(self.bodies.len())];
        }
    }
}

multiversion! {
    fn facing_away(planes: &[Vec<f32>; 4], origin: Vec3, hidden: &mut [bool]) = facing_away_kernel
}

#[inline(always)]
fn facing_away_kernel([a, b, c, d]: &[Vec<f32>; 4], o: Vec3, hidden: &mut [bool]) {
    let n = hidden.len();
    let (a, b, c, d) = (&a[..n], &b[..n], &c[..n], &d[..n]);
    for i in 0..n {
        hidden[i] = a[i] * o.x + b[i] * o.y + c[i] * o.z + d[i] < 0.0;
    }
}

impl Body {
    /// `None` if it encloses nothing.
    fn new(triangles: &[[DVec3; 3]]) -> Option<Self> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut volume = 0.0;
        for &[a, b, c] in triangles {
            low = low.min(a).min(b).min(c);
            high = high.max(a).max(b).max(c);
        }
        let middle = 0.5 * (low + high);
        for &[a, b, c] in triangles {
            volume += (a - middle).dot((b - middle).cross(c - middle)) / 6.0;
        }
        // A crumpled sheet has volume by rounding alone.
        if volume.abs() <= 1e-9 * (high - low).length().powi(3) {
            return None;
        }
        let x = PROBE.any_orthonormal_vector();
        let axes = [x, PROBE.normalize().cross(x), PROBE.normalize()];
        let zero = [0.0; LANES];
        let empty = Walls { edges: [[zero; 3]; 3], plane: [zero; 4], turn: [0; LANES] };
        let mut walls = vec![empty; triangles.len().div_ceil(LANES)];
        for (i, triangle) in triangles.iter().enumerate() {
            let wall = &mut walls[i / LANES];
            let l = i % LANES;
            let v = triangle.map(|p| DVec3::from_array(axes.map(|a| a.dot(p))));
            let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize_or_zero();
            let turn = if normal.z < 0.0 { -1.0 } else { 1.0 };
            wall.turn[l] = turn as i32;
            for k in 0..3 {
                let (p, q) = (v[k], v[(k + 1) % 3]);
                let along = (q - p) / (q - p).truncate().length().max(f64::MIN_POSITIVE) * turn;
                let line = [-along.y, along.x, along.y * p.x - along.x * p.y];
                for (lanes, x) in wall.edges[k].iter_mut().zip(line) {
                    lanes[l] = x as f32;
                }
            }
            let plane = [normal.x, normal.y, normal.z, -normal.dot(v[0])];
            for (lanes, x) in wall.plane.iter_mut().zip(plane) {
                lanes[l] = (-turn * x) as f32;
            }
        }
        let fronts = if volume > 0.0 { 0 } else { -1 };
        Some(Self { low: low.as_vec3(), high: high.as_vec3(), fronts, walls })
    }

    /// Whether a point, relative to the scene's centre, surely is where the body shows its fronts.
    fn sees_fronts(&self, point: Vec3, tolerance: f32) -> bool {
        let beyond = point.cmplt(self.low - tolerance) | point.cmpgt(self.high + tolerance);
        if beyond.any() {
            return self.fronts == 0;
        }
        let p = point.as_dvec3();
        let z = PROBE.normalize();
        let x = PROBE.any_orthonormal_vector();
        let local = Vec3::new(p.dot(x) as f32, p.dot(z.cross(x)) as f32, p.dot(z) as f32);
        let mut winding = Some(0);
        wind(&self.walls, local, tolerance, &mut winding);
        winding == Some(self.fronts)
    }
}

multiversion! {
    fn wind(walls: &[Walls], p: Vec3, tolerance: f32, winding: &mut Option<i32>) = wind_kernel
}

/// The winding number of a closed surface about a point: how many more times the probe passes from
/// back to front than from front to back; `None` if it nearly meets an edge or the point
/// nearly lies on the surface.
#[inline(always)]
fn wind_kernel(walls: &[Walls], p: Vec3, tolerance: f32, winding: &mut Option<i32>) {
    let (mut sums, mut doubts) = ([0; LANES], [0_u32; LANES]);
    for wall in walls {
        for l in 0..LANES {
            let edge = |k: usize| {
                let e = &wall.edges[k];
                e[0][l] * p.x + e[1][l] * p.y + e[2][l]
            };
            let inside = edge(0).min(edge(1)).min(edge(2));
            let w = &wall.plane;
            let before = w[0][l] * p.x + w[1][l] * p.y + w[2][l] * p.z + w[3][l];
            let near = (inside > -tolerance) & (before > -tolerance) & (wall.turn[l] != 0);
            let clear = (inside > tolerance) & (before > tolerance);
            sums[l] += if near & clear { wall.turn[l] } else { 0 };
            doubts[l] |= u32::from(near & !clear);
        }
    }
    let sure = doubts.iter().fold(0, |any, d| any | d) == 0;
    *winding = sure.then(|| sums.iter().sum());
}

/// The solid triangles of each connected surface whose every edge joins two triangles that run
/// along it in opposite directions.
fn shells(corners: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut uses: Vec<(u64, bool, u32)> = (0_u32..)
        .zip(corners)
        .flat_map(|(i, &[a, b, c])| {
            [(a, b), (b, c), (c, a)]
                .map(|(p, q)| (u64::from(p.min(q)) << 32 | u64::from(p.max(q)), p < q, i))
        })
        .collect();
    uses.sort_unstable();
    let mut sets = DisjointSets::new(corners.len());
    let mut open = vec![false; corners.len()];
    for shared in uses.chunk_by(|a, b| a.0 == b.0) {
        let closed = matches!(shared, [a, b] if a.1 != b.1);
        for &(_, _, i) in shared {
            sets.join(shared[0].2, i);
            open[i as usize] |= !closed;
        }
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); corners.len()];
    let mut whole = vec![true; corners.len()];
    for i in 0..corners.len() as u32 {
        let root = sets.find(i) as usize;
        whole[root] &= !open[i as usize];
        members[root].push(i);
    }
    let closed = members.into_iter().zip(whole).filter(|(m, whole)| *whole && !m.is_empty());
    closed.map(|(members, _)| members).collect()
}

/// Triangles tried for each one of a body, on the average.
const MOST_TRIED: usize = 1024;

/// Whether an edge of a triangle meets another one that it has no end in common with; also where so
/// many lie about each other that not all are tried.
fn crosses_itself(triangles: &[[DVec3; 3]], corners: &[[u32; 3]]) -> bool {
    let boxes: Vec<Bounds> =
        triangles.iter().map(|&[a, b, c]| (a.min(b).min(c), a.max(b).max(c))).collect();
    let crosses = |i: usize, j: usize| {
        (0..3).any(|k| {
            let ends = [k, (k + 1) % 3];
            !ends.iter().any(|&e| corners[j].contains(&corners[i][e]))
                && meets(ends.map(|e| triangles[i][e]), triangles[j])
        })
    };
    let tree = BoxTree::new(&boxes);
    let around = |i: usize, most: usize| {
        let own = boxes[i];
        let apart = |low: DVec3, high: DVec3| !(own.0.cmple(high) & low.cmple(own.1)).all();
        let (mut tried, mut found) = (0, false);
        let all = tree.near_while(apart, |j| {
            let other = j as usize;
            tried += 1;
            found = other != i
                && !apart(boxes[other].0, boxes[other].1)
                && (crosses(i, other) || crosses(other, i));
            !found && tried < most
        });
        Ok::<_, Infallible>(Looked { found: !all, tried, all: all || found })
    };
    let Ok(shared) = share_out(boxes.len(), MOST_TRIED, around);
    shared.found.contains(&true)
}

/// Whether a segment meets a triangle, but for segments in its plane.
fn meets([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    /// What nearly meets is taken to meet.
    const SLACK: f64 = 1e-9;
    let normal = (b - a).cross(c - a);
    let (from, to) = (normal.dot(p - a), normal.dot(q - a));
    if from == to || from * to > 0.0 {
        return false;
    }
    let at = p.lerp(q, from / (from - to)) - a;
    let scale = normal.length_squared();
    let v = normal.dot((b - a).cross(at)) / scale;
    let u = normal.dot(at.cross(c - a)) / scale;
    u >= -SLACK && v >= -SLACK && u + v <= 1.0 + SLACK
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::Mesh;
    use crate::scene::{Material, SceneBuilder, Sides};

    /// Boxes (centre, half the edge length); negative lengths turn the faces inwards.
    fn boxes(all: &[(DVec3, f64)]) -> (Geometry, Bodies) {
        let mut b = SceneBuilder::new("boxes");
        let m = b.material(Material::default());
        for &(centre, half) in all {
            let at = |i: u32, n: u32| if i >> n & 1 == 1 { half } else { -half };
            let corner = |i: u32| centre + DVec3::new(at(i, 0), at(i, 1), at(i, 2));
            let mesh = Mesh::from_quads(
                (0..8).map(corner).collect(),
                &[
                    [0, 2, 3, 1],
                    [4, 5, 7, 6],
                    [0, 1, 5, 4],
                    [2, 6, 7, 3],
                    [0, 4, 6, 2],
                    [1, 3, 7, 5],
                ],
            );
            b.mesh("box", &mesh.vertices, &mesh.triangles, m, Sides::One);
        }
        let geometry = b.finish().geometry;
        let bodies = crate::visibility::Occluders::new(&geometry).bodies(&geometry);
        (geometry, bodies)
    }

    fn hidden(bodies: &Bodies, x: f64) -> usize {
        let mut hidden = Vec::new();
        bodies.hide(DVec3::new(x, 0.1, 0.07), None, &mut hidden);
        hidden.iter().filter(|h| **h).count()
    }

    #[test]
    fn backs_are_hidden_from_outside_and_not_from_inside() {
        let (_, bodies) = boxes(&[(DVec3::ZERO, 1.0), (DVec3::X * 5.0, 1.0)]);
        assert_eq!(bodies.bodies.len(), 2);
        // From beside each box five of its faces are seen from behind, or four from before a
        // corner.
        assert_eq!(hidden(&bodies, -3.0), 20);
        assert_eq!(hidden(&bodies, 0.2), 10, "inside the first, all of it stays");
        assert_eq!(hidden(&bodies, -1.0), 10, "on the surface nothing is sure");
    }

    #[test]
    fn a_room_hides_its_backs_inside() {
        let (_, bodies) = boxes(&[(DVec3::ZERO, -4.0), (DVec3::ZERO, 1.0)]);
        assert_eq!(hidden(&bodies, -3.0), 10, "of the inner box");
        assert_eq!(hidden(&bodies, -5.0), 10, "from outside, the room's backs are seen");
    }

    #[test]
    fn open_and_crossing_surfaces_hide_nothing() {
        let (mut geometry, _) = boxes(&[(DVec3::ZERO, 1.0)]);
        geometry.state[3] = crate::scene::TriangleState::Transparent;
        let open = crate::visibility::Occluders::new(&geometry).bodies(&geometry);
        assert!(open.bodies.is_empty());
        let bowtie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let mut b = SceneBuilder::new("bow tie");
        let m = b.material(Material::default());
        let vertices: Vec<DVec3> =
            [0.0, 1.0].iter().flat_map(|&z| bowtie.map(|[x, y]| DVec3::new(x, y, z))).collect();
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
        for (p, q) in (0..4).map(|k| (k, (k + 1) % 4)) {
            triangles.extend([[p, q, q + 4], [p, q + 4, p + 4]]);
        }
        b.mesh("prism", &vertices, &triangles, m, Sides::One);
        let geometry = b.finish().geometry;
        let crossing = crate::visibility::Occluders::new(&geometry).bodies(&geometry);
        assert!(crossing.bodies.is_empty());
    }
}
