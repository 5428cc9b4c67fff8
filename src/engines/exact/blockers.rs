//! What may lie between two patches: the solid triangles, joined to convex polygons where they lie in
//! one plane, and the convex bodies that these bound.
//!
//! A wall of a thousand triangles so blocks as one rectangle, and one look tells that it hides all
//! of what is behind it.
//!
//! # Bodies
//! A segment that ends outside of a closed convex body and passes through it enters by one face and
//! leaves by another. It is enough to count the faces it enters by: as seen from a point, these do
//! not overlap, so that the shares they hide add up. The same holds of a convex body that is open
//! where it stands on another polygon.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::scene::edges::{EdgeUse, edge_uses, shared};
use crate::scene::{Geometry, TriangleId};

/// No body.
pub(super) const NONE: u32 = u32::MAX;

/// Polygons with more corners are left in parts: room in kernels.
pub(super) const MOST_CORNERS: usize = 12;

/// The area of a convex union may differ by this share from the sum of its parts.
const AREA: f64 = 1e-7;

/// A convex polygon that blocks.
#[derive(Debug, Clone)]
pub(super) struct Blocker {
    /// Unit normal of the front.
    pub normal: DVec3,
    /// A point of the plane is so far along the normal.
    pub offset: f64,
    /// Counter-clockwise about the normal.
    pub corners: Vec<DVec3>,
    /// The box about them.
    pub low: DVec3,
    pub high: DVec3,
    /// The capped convex body that it bounds, or [`NONE`].
    pub body: u32,
}

impl Blocker {
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }

    fn holds(&self, p: DVec3, coplanar: f64) -> bool {
        self.height(p).abs() <= coplanar
            && (0..self.corners.len()).all(|k| {
                let (a, b) = (self.corners[k], self.corners[(k + 1) % self.corners.len()]);
                self.normal.cross(b - a).normalize_or_zero().dot(p - a) >= -coplanar
            })
    }
}

/// The planes of a capped convex body.
#[derive(Debug, Clone)]
pub(super) struct Body {
    low: DVec3,
    high: DVec3,
    planes: Vec<(DVec3, f64)>,
}

impl Body {
    /// Whether a point is inside.
    pub fn holds(&self, p: DVec3) -> bool {
        p.cmpge(self.low).all()
            && p.cmple(self.high).all()
            && self.planes.iter().all(|(n, d)| n.dot(p) < *d)
    }
}

/// All blockers of a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Blockers {
    pub polygons: Vec<Blocker>,
    pub bodies: Vec<Body>,
}

/// Sets that merge.
struct Sets(Vec<u32>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }

    /// The smaller number stands for both.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Two uses of an edge, of one surface if they run opposite ways and nothing else is there.
fn pair(uses: &[EdgeUse]) -> Option<[&EdgeUse; 2]> {
    match uses {
        [a, b] if a.reversed != b.reversed && a.triangle != b.triangle => Some([a, b]),
        _ => None,
    }
}

impl Blockers {
    /// Joins the solid triangles of a scene; planes closer than `coplanar` are one.
    pub fn new(geometry: &Geometry, coplanar: f64) -> Self {
        let (uses, _) = edge_uses(geometry);
        let regions = flat_regions(geometry, &uses, coplanar);
        let mut of_region: HashMap<u32, Vec<TriangleId>> = HashMap::new();
        for t in geometry.ids().filter(|&t| geometry.is_solid(t)) {
            of_region.entry(regions[t.index()]).or_default().push(t);
        }
        let mut inner: HashMap<u32, Vec<(f64, [TriangleId; 2])>> = HashMap::new();
        for [a, b] in shared(&uses).filter_map(pair) {
            if regions[a.triangle.index()] == regions[b.triangle.index()] {
                let c = geometry.corners(a.triangle);
                let length = c[usize::from(a.k)].distance(c[usize::from(a.k + 1) % 3]);
                let entry = inner.entry(regions[a.triangle.index()]).or_default();
                entry.push((length, [a.triangle, b.triangle]));
            }
        }
        let mut me = Self::default();
        let mut polygon_of = vec![NONE; geometry.len()];
        let mut keys: Vec<u32> = of_region.keys().copied().collect();
        keys.sort_unstable();
        for key in keys {
            let edges = inner.remove(&key).unwrap_or_default();
            for (triangles, hull) in convex_parts(geometry, &of_region[&key], edges) {
                let normal = geometry.normal(triangles[0], crate::scene::Side::Front);
                let offset = normal.dot(hull[0]);
                for t in triangles {
                    polygon_of[t.index()] = me.polygons.len() as u32;
                }
                let low = hull.iter().fold(DVec3::INFINITY, |l, &c| l.min(c));
                let high = hull.iter().fold(DVec3::NEG_INFINITY, |h, &c| h.max(c));
                me.polygons.push(Blocker { normal, offset, corners: hull, low, high, body: NONE });
            }
        }
        me.find_bodies(geometry, &uses, &polygon_of, coplanar);
        me
    }

    fn find_bodies(
        &mut self,
        geometry: &Geometry,
        uses: &[EdgeUse],
        polygon_of: &[u32],
        coplanar: f64,
    ) {
        let mut sets = Sets::new(geometry.len());
        for [a, b] in shared(uses).filter_map(pair) {
            sets.join(a.triangle.0, b.triangle.0);
        }
        // Edges that no neighbour closes.
        let mut rims: HashMap<u32, Vec<DVec3>> = HashMap::new();
        for u in shared(uses).filter(|u| pair(u).is_none()).flatten() {
            let c = geometry.corners(u.triangle);
            let rim = rims.entry(sets.find(u.triangle.0)).or_default();
            rim.extend([c[usize::from(u.k)], c[usize::from(u.k + 1) % 3]]);
        }
        let mut faces: Vec<(u32, u32)> = geometry
            .ids()
            .filter(|&t| geometry.is_solid(t))
            .map(|t| (sets.find(t.0), polygon_of[t.index()]))
            .collect();
        faces.sort_unstable();
        faces.dedup();
        for faces in faces.chunk_by(|a, b| a.0 == b.0) {
            let rim = rims.get(&faces[0].0).map_or(&[][..], |r| r);
            if let Some(body) = self.body(faces, rim, coplanar) {
                for &(_, polygon) in faces {
                    self.polygons[polygon as usize].body = self.bodies.len() as u32;
                }
                self.bodies.push(body);
            }
        }
    }

    /// The body that faces bound, if it is convex and closed, or open only where it stands.
    fn body(&self, faces: &[(u32, u32)], rim: &[DVec3], coplanar: f64) -> Option<Body> {
        /// Larger bodies are not looked at: every face is held against every corner.
        const MOST_FACES: usize = 4096;
        if !(3..=MOST_FACES).contains(&faces.len()) {
            return None;
        }
        let face = |f: &(u32, u32)| &self.polygons[f.1 as usize];
        let corners = || faces.iter().flat_map(|f| face(f).corners.iter().copied());
        let convex = faces.iter().all(|f| corners().all(|p| face(f).height(p) <= coplanar));
        let stands = || {
            self.polygons.iter().any(|ground| {
                rim.iter().all(|&p| ground.holds(p, coplanar))
                    && corners().all(|p| ground.height(p) >= -coplanar)
            })
        };
        if !convex || !(rim.is_empty() || stands()) {
            return None;
        }
        let (low, high) = corners()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let planes = faces.iter().map(|f| (face(f).normal, face(f).offset)).collect();
        Some(Body { low, high, planes })
    }
}

/// For each triangle a number that connected triangles of one plane share.
fn flat_regions(geometry: &Geometry, uses: &[EdgeUse], coplanar: f64) -> Vec<u32> {
    let mut next_to: Vec<Vec<TriangleId>> = vec![Vec::new(); geometry.len()];
    for [a, b] in shared(uses).filter_map(pair) {
        next_to[a.triangle.index()].push(b.triangle);
        next_to[b.triangle.index()].push(a.triangle);
    }
    let mut region = vec![NONE; geometry.len()];
    let front = |t| geometry.normal(t, crate::scene::Side::Front);
    for seed in geometry.ids().filter(|&t| geometry.is_solid(t)) {
        if region[seed.index()] != NONE {
            continue;
        }
        let (normal, [origin, ..]) = (front(seed), geometry.corners(seed));
        let mut stack = vec![seed];
        region[seed.index()] = seed.0;
        while let Some(t) = stack.pop() {
            for &n in &next_to[t.index()] {
                let flat = region[n.index()] == NONE
                    && front(n).dot(normal) > 0.999
                    && geometry
                        .corners(n)
                        .iter()
                        .all(|&v| normal.dot(v - origin).abs() <= coplanar);
                if flat {
                    region[n.index()] = seed.0;
                    stack.push(n);
                }
            }
        }
    }
    region
}

/// Joins the triangles of a flat region to convex polygons, across the longest edges first.
fn convex_parts(
    geometry: &Geometry,
    triangles: &[TriangleId],
    mut edges: Vec<(f64, [TriangleId; 2])>,
) -> Vec<(Vec<TriangleId>, Vec<DVec3>)> {
    let normal = geometry.normal(triangles[0], crate::scene::Side::Front);
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let flat = |p: DVec3| DVec2::new(u.dot(p), v.dot(p));
    let mut parts: Vec<Part> = triangles
        .iter()
        .map(|&t| {
            let corners = geometry.corners(t);
            let hull = corners.map(|p| (flat(p), p)).to_vec();
            Part { area: geometry.area(t), hull: convex_hull(hull) }
        })
        .collect();
    let whole = Part {
        area: parts.iter().map(|p| p.area).sum(),
        hull: convex_hull(parts.iter().flat_map(|p| p.hull.iter().copied()).collect()),
    };
    if whole.is_convex() {
        return vec![(triangles.to_vec(), whole.corners())];
    }
    let index: HashMap<TriangleId, u32> =
        triangles.iter().enumerate().map(|(k, &t)| (t, k as u32)).collect();
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut sets = Sets::new(parts.len());
    loop {
        let before = edges.len();
        edges.retain(|(_, [a, b])| {
            let (a, b) = (sets.find(index[a]), sets.find(index[b]));
            if a == b {
                return false;
            }
            let (p, q) = (&parts[a as usize], &parts[b as usize]);
            let hull = convex_hull(p.hull.iter().chain(&q.hull).copied().collect());
            let joined = Part { area: p.area + q.area, hull };
            let convex = joined.is_convex();
            if convex {
                sets.join(a, b);
                parts[a.min(b) as usize] = joined;
            }
            !convex
        });
        if edges.len() == before {
            break;
        }
    }
    let mut members: Vec<Vec<TriangleId>> = vec![Vec::new(); parts.len()];
    for (k, &t) in (0..).zip(triangles) {
        members[sets.find(k) as usize].push(t);
    }
    let joined = members.into_iter().zip(&parts).filter(|(m, _)| !m.is_empty());
    joined.map(|(m, p)| (m, p.corners())).collect()
}

/// A part of a plane: what it covers, and the convex hull of its corners.
struct Part {
    area: f64,
    hull: Vec<(DVec2, DVec3)>,
}

impl Part {
    fn is_convex(&self) -> bool {
        let h = &self.hull;
        let o = h[0].0;
        let twice: f64 = (2..h.len()).map(|k| (h[k - 1].0 - o).perp_dot(h[k].0 - o)).sum();
        h.len() <= MOST_CORNERS && (0.5 * twice - self.area).abs() <= AREA * self.area
    }

    fn corners(&self) -> Vec<DVec3> {
        self.hull.iter().map(|h| h.1).collect()
    }
}

/// The convex hull, counter-clockwise (Andrew 1979, "Another efficient algorithm for convex hulls in
/// two dimensions"); corners that stand out by rounding alone are left out.
fn convex_hull(mut points: Vec<(DVec2, DVec3)>) -> Vec<(DVec2, DVec3)> {
    points.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.0.y.total_cmp(&b.0.y)));
    points.dedup_by(|a, b| a.0 == b.0);
    let turns = |hull: &[(DVec2, DVec3)], p: DVec2| {
        let [.., a, b] = hull else { return true };
        let (along, on) = (b.0 - a.0, p - b.0);
        along.perp_dot(on) > 1e-10 * along.length() * on.length()
    };
    let mut hull: Vec<(DVec2, DVec3)> = Vec::new();
    for half in 0..2 {
        let start = hull.len();
        for &p in &points {
            while hull.len() >= start + 2 && !turns(&hull[start..], p.0) {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        if half == 0 {
            points.reverse();
        }
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides, builtin};

    fn built(name: &str) -> Blockers {
        let g = builtin::build(name).unwrap().geometry;
        Blockers::new(&g, 1e-6)
    }

    #[test]
    fn the_walls_of_a_cube_are_squares() {
        let blockers = built("furnace");
        assert_eq!(blockers.polygons.len(), 6);
        assert!(blockers.polygons.iter().all(|p| p.corners.len() == 4));
        // Seen from inside: no convex body with its front outside.
        assert!(blockers.bodies.is_empty());
    }

    #[test]
    fn boxes_on_a_floor_are_bodies() {
        let blockers = built("cornell-box");
        assert_eq!(blockers.bodies.len(), 2);
        for (k, body) in blockers.bodies.iter().enumerate() {
            let faces = blockers.polygons.iter().filter(|p| p.body == k as u32);
            let centre = 0.5 * (body.low + body.high);
            assert!((5..=6).contains(&faces.count()));
            assert!(body.holds(centre) && !body.holds(body.high + 1.0));
        }
    }

    #[test]
    fn an_l_is_two_rectangles_of_the_same_area() {
        let mut b = SceneBuilder::new("l");
        let s = b.surface(crate::scene::Surface { name: "l".into(), node: 0, primitive: 0 });
        let m = b.material(Material::default());
        let cells = [[0, 0], [1, 0], [2, 0], [0, 1], [0, 2], [1, 1]];
        for [i, j] in cells {
            let v = [[0, 0], [1, 0], [1, 1], [0, 1]]
                .map(|[x, y]| b.vertex(DVec3::new(f64::from(i + x), f64::from(j + y), 0.0)));
            b.triangle([v[0], v[1], v[2]], None, s, m, Sides::One);
            b.triangle([v[0], v[2], v[3]], None, s, m, Sides::One);
        }
        let g = b.finish().geometry;
        let parts = Blockers::new(&g, 1e-6).polygons;
        assert!(parts.len() < 6, "{}", parts.len());
        let area = |p: &Blocker| {
            let c = &p.corners;
            let cross: DVec3 = (2..c.len()).map(|k| (c[k - 1] - c[0]).cross(c[k] - c[0])).sum();
            0.5 * cross.dot(p.normal)
        };
        assert!((parts.iter().map(area).sum::<f64>() - 6.0).abs() < 1e-9);
    }
}
