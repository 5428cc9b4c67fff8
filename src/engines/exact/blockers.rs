//! What may lie between two patches: the solid triangles, joined to convex polygons where they lie
//! in one plane, and the convex bodies that these bound.
//!
//! # Bodies
//! A segment that ends outside of a closed convex body and passes through it enters by one face and
//! leaves by another. It is enough to count the faces it enters by: seen from a point, these do not
//! overlap, so the fractions that they hide add up. The same holds for a convex body that is open
//! where it stands on another polygon.

use std::collections::HashMap;

use glam::DVec3;

use super::convex::{convex_polygons, joined};
use crate::scene::disjoint_sets::DisjointSets;
use crate::scene::edges::{EdgeUse, edge_uses, shared};
use crate::scene::{Geometry, Side};

/// A convex polygon that blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct BlockerId(pub u32);

impl BlockerId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A closed convex body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct BodyId(pub u32);

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
    /// The closed convex body that it bounds.
    pub body: Option<BodyId>,
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

/// The planes of a closed convex body.
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

impl Blockers {
    pub fn polygon(&self, id: BlockerId) -> &Blocker {
        &self.polygons[id.index()]
    }

    /// The bodies that a point is inside of.
    pub fn inside(&self, p: DVec3) -> Vec<BodyId> {
        let bodies = (0..).zip(&self.bodies);
        bodies.filter(|(_, body)| body.holds(p)).map(|(k, _)| BodyId(k)).collect()
    }

    /// Joins the solid triangles of a scene; planes closer than `coplanar` are one.
    pub fn new(geometry: &Geometry, coplanar: f64) -> Self {
        let (uses, _) = edge_uses(geometry);
        let mut me = Self::default();
        let mut polygon_of = vec![None; geometry.len()];
        for (triangles, hull) in convex_polygons(geometry, &uses, coplanar) {
            let normal = geometry.normal(triangles[0], Side::Front);
            let offset = normal.dot(hull[0]);
            for t in triangles {
                polygon_of[t.index()] = Some(BlockerId(me.polygons.len() as u32));
            }
            let low = hull.iter().fold(DVec3::INFINITY, |l, &c| l.min(c));
            let high = hull.iter().fold(DVec3::NEG_INFINITY, |h, &c| h.max(c));
            me.polygons.push(Blocker { normal, offset, corners: hull, low, high, body: None });
        }
        me.find_bodies(geometry, &uses, &polygon_of, coplanar);
        me
    }

    fn find_bodies(
        &mut self,
        geometry: &Geometry,
        uses: &[EdgeUse],
        polygon_of: &[Option<BlockerId>],
        coplanar: f64,
    ) {
        let mut sets = DisjointSets::new(geometry.len());
        for [a, b] in shared(uses).filter_map(joined) {
            sets.join(a.triangle.0, b.triangle.0);
        }
        // Edges that no neighbour closes.
        let mut rims: HashMap<u32, Vec<DVec3>> = HashMap::new();
        for u in shared(uses).filter(|u| joined(u).is_none()).flatten() {
            let c = geometry.corners(u.triangle);
            let rim = rims.entry(sets.find(u.triangle.0)).or_default();
            rim.extend([c[usize::from(u.k)], c[usize::from(u.k + 1) % 3]]);
        }
        let mut faces: Vec<(u32, BlockerId)> =
            geometry.ids().filter_map(|t| Some((sets.find(t.0), polygon_of[t.index()]?))).collect();
        faces.sort_unstable();
        faces.dedup();
        for faces in faces.chunk_by(|a, b| a.0 == b.0) {
            let rim = rims.get(&faces[0].0).map_or(&[][..], |r| r);
            if let Some(body) = self.body(faces, rim, coplanar) {
                for &(_, polygon) in faces {
                    self.polygons[polygon.index()].body = Some(BodyId(self.bodies.len() as u32));
                }
                self.bodies.push(body);
            }
        }
    }

    /// The body that faces bound, if it is convex and closed, or open only where it stands.
    fn body(&self, faces: &[(u32, BlockerId)], rim: &[DVec3], coplanar: f64) -> Option<Body> {
        /// Larger bodies are not looked at: every face is held against every corner.
        const MOST_FACES: usize = 4096;
        if !(3..=MOST_FACES).contains(&faces.len()) {
            return None;
        }
        let face = |f: &(u32, BlockerId)| self.polygon(f.1);
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
            let faces = blockers.polygons.iter().filter(|p| p.body == Some(BodyId(k as u32)));
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
