//! Contact lines: where a surface stands on, or passes through, a side of a source triangle.
//!
//! Beyond such a line lies another room: what happens there says nothing about this side of it. A
//! patch that a line passes through would carry light from one room to the other; so a point of a
//! patch that does not see the patch's centre along the surface belongs to a neighbour that it
//! does see.

use glam::{DVec2, DVec3};

use crate::scene::box_tree::{Bounds, map_overlaps};
use crate::scene::{Geometry, Side, TriangleId};

/// A segment of contact in the coordinates `uv` of a source triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub from: DVec2,
    pub to: DVec2,
}

/// The contact lines of all sides.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactLines {
    starts: Vec<u32>,
    lines: Vec<Line>,
    /// For each side the edges that something stands on: bit k for that from corner k to the next.
    edges: Vec<u8>,
}

/// Points this near to a plane lie in it, relative to the size of the scene: exporters keep six or
/// seven digits.
const TOUCH: f64 = 2e-6;

/// Barycentric coordinates below this lie on the edge.
const EDGE: f64 = 1e-6;

impl ContactLines {
    pub fn find(geometry: &Geometry) -> Self {
        let solid: Vec<TriangleId> = geometry.ids().filter(|&t| geometry.is_solid(t)).collect();
        let size = geometry.bounds().map_or(0.0, |(low, high)| (high - low).length());
        let reach = TOUCH * size;
        let bounds = |&t: &TriangleId| {
            let [a, b, c] = geometry.corners(t);
            (a.min(b).min(c) - reach, a.max(b).max(c) + reach)
        };
        let boxes: Vec<Bounds> = solid.iter().map(bounds).collect();
        let found = map_overlaps(&boxes, |i, near| {
            let mut sides = [Contacts::default(), Contacts::default()];
            for &k in near {
                touch(geometry, solid[i], solid[k as usize], reach, &mut sides);
            }
            sides
        });
        let mut me = Self { starts: vec![0], ..Self::default() };
        let mut found = solid.iter().zip(found).peekable();
        for t in geometry.ids() {
            let own = found.next_if(|f| *f.0 == t).map_or_else(Default::default, |f| f.1);
            for side in own {
                me.lines.extend(side.lines);
                me.starts.push(me.lines.len() as u32);
                me.edges.push(side.edges);
            }
        }
        me
    }

    /// Whether another triangle, which does not have this edge too, stands on edge `k` of a side.
    pub fn on_edge(&self, side: usize, k: u8) -> bool {
        self.edges[side] >> k & 1 == 1
    }

    /// The lines on one side.
    pub fn of(&self, side: usize) -> &[Line] {
        &self.lines[self.starts[side] as usize..self.starts[side + 1] as usize]
    }
}

/// What touches one side.
#[derive(Debug, Clone, Default)]
struct Contacts {
    lines: Vec<Line>,
    edges: u8,
}

/// Adds the line along which triangle `other` touches or crosses `own` to the sides of `own` from
/// which `other` rises.
fn touch(
    geometry: &Geometry,
    own: TriangleId,
    other: TriangleId,
    reach: f64,
    sides: &mut [Contacts; 2],
) {
    let corners = geometry.corners(own);
    let normal = geometry.normal(own, Side::Front);
    let p = geometry.corners(other);
    let heights = p.map(|p| {
        let h = (p - corners[0]).dot(normal);
        if h.abs() <= reach { 0.0 } else { h }
    });
    let rises = [heights.iter().any(|&h| h > 0.0), heights.iter().any(|&h| h < 0.0)];
    let mut ends: Vec<DVec3> = (0..3).filter(|&k| heights[k] == 0.0).map(|k| p[k]).collect();
    for k in 0..3 {
        let (a, b) = (heights[k], heights[(k + 1) % 3]);
        if a * b < 0.0 {
            ends.push(p[k].lerp(p[(k + 1) % 3], a / (a - b)));
        }
    }
    let &[from, to] = &ends[..] else { return };
    let plane = Plane::of(corners);
    let [from, to] = [from, to].map(|p| plane.barycentric(p));
    let line = clip(from, to);
    let edge = if line.is_none() { edge_under(from, to) } else { None };
    // A neighbour that has the edge too does not stand on it.
    let edge = edge.filter(|&k| {
        [k, (k + 1) % 3].iter().any(|&c| p.iter().all(|q| q.distance(corners[c]) > reach))
    });
    for (side, _) in sides.iter_mut().zip(rises).filter(|(_, rises)| *rises) {
        side.lines.extend(line);
        side.edges |= edge.map_or(0, |k| 1 << k);
    }
}

/// Barycentric coordinates in the plane of a triangle.
pub(super) struct Plane {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Plane {
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        let (e, f) = (b - a, c - a);
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let determinant = ee * ff - ef * ef;
        Self { origin: a, u: (e * ff - f * ef) / determinant, v: (f * ee - e * ef) / determinant }
    }

    /// Coordinates `uv` of the foot of a point.
    pub fn uv(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.u), (p - self.origin).dot(self.v))
    }

    fn barycentric(&self, p: DVec3) -> DVec3 {
        let uv = self.uv(p);
        DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y)
    }
}

/// The part of a segment within the triangle; `None` if it is empty, a point, or lies on an edge.
fn clip(from: DVec3, to: DVec3) -> Option<Line> {
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let (a, b) = (from[k], to[k]);
        if a <= EDGE && b <= EDGE {
            return None;
        }
        if a < 0.0 {
            t0 = t0.max(a / (a - b));
        } else if b < 0.0 {
            t1 = t1.min(a / (a - b));
        }
    }
    let (from, to) = (from.lerp(to, t0), from.lerp(to, t1));
    let line = Line { from: DVec2::new(from.y, from.z), to: DVec2::new(to.y, to.z) };
    (t1 > t0 && line.from.distance(line.to) > EDGE).then_some(line)
}

/// The edge, from corner k to the next, that a segment runs along for some way.
fn edge_under(from: DVec3, to: DVec3) -> Option<usize> {
    let zero = (0..3).find(|&k| from[k].abs() <= EDGE && to[k].abs() <= EDGE)?;
    let k = (zero + 1) % 3;
    // Places along the edge, 0..1, counted from its far end.
    let (a, b) = (from[k], to[k]);
    (a.max(b).min(1.0) - a.min(b).max(0.0) > EDGE).then_some(k)
}

impl Line {
    /// Whether the way from `a` to `b` crosses this line. Ways that only touch it do not.
    pub fn separates(&self, a: DVec2, b: DVec2) -> bool {
        let turn = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
        let (sa, sb) = (turn(self.from, self.to, a), turn(self.from, self.to, b));
        if sa * sb >= 0.0 {
            return false;
        }
        // Lines of one outline meet at their ends: no way leads through between them.
        let (s, t) = (turn(a, b, self.from), turn(a, b, self.to));
        let slack = 1e-9 * (b - a).length();
        s.min(t) <= slack && s.max(t) >= -slack
    }

    /// Whether the line comes within the box of half size `reach` about `centre`.
    pub fn near(&self, centre: DVec2, reach: f64) -> bool {
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        for k in 0..2 {
            let (a, b) = (self.from[k] - centre[k], self.to[k] - centre[k]);
            for (a, b) in [(a + reach, b + reach), (reach - a, reach - b)] {
                if a < 0.0 && b < 0.0 {
                    return false;
                }
                if a < 0.0 {
                    t0 = t0.max(a / (a - b));
                } else if b < 0.0 {
                    t1 = t1.min(a / (a - b));
                }
            }
        }
        t0 <= t1
    }

    /// Whether the line passes through the inside of a triangle.
    pub fn enters(&self, [a, b, c]: [DVec2; 3]) -> bool {
        let area = (b - a).perp_dot(c - a);
        let barycentric = |p: DVec2| {
            let (l1, l2) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
            DVec3::new(1.0 - l1 - l2, l1, l2)
        };
        clip(barycentric(self.from), barycentric(self.to)).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::super::point::side_index;
    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides};

    #[test]
    fn a_wall_parts_the_floor_it_stands_on_and_only_its_upper_side() {
        let mut b = SceneBuilder::new("wall");
        let m = b.material(Material::default());
        let vertices = [
            DVec3::new(-2.0, 0.0, -2.0),
            DVec3::new(-2.0, 0.0, 6.0),
            DVec3::new(6.0, 0.0, -2.0),
            DVec3::new(0.5, 0.0, -1.0),
            DVec3::new(0.5, 0.0, 1.0),
            DVec3::new(0.5, 2.0, 0.0),
        ];
        b.mesh("floor and wall", &vertices, &[[0, 1, 2], [3, 4, 5]], m, Sides::Two);
        let g = b.finish().geometry;
        let lines = ContactLines::find(&g);
        let floor = TriangleId(0);
        let [upper] = lines.of(side_index(floor, Side::Front)) else { panic!("one line") };
        assert!(lines.of(side_index(floor, Side::Back)).is_empty());
        assert!(lines.of(2).is_empty() && lines.of(3).is_empty(), "the wall's foot is its edge");
        let plane = Plane::of(g.corners(floor));
        let at = |x: f64, z: f64| plane.uv(DVec3::new(x, 0.0, z));
        assert!(upper.separates(at(0.0, 0.0), at(1.0, 0.0)));
        assert!(!upper.separates(at(0.0, 0.0), at(0.4, 0.5)));
        assert!(!upper.separates(at(0.0, 1.5), at(1.0, 1.5)), "past the wall's end");
        assert!(!upper.separates(at(0.5, 0.0), at(1.0, 0.0)), "from its foot");
    }
}
