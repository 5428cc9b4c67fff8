//! What may lie between two patches: the solid triangles, joined to convex polygons where they lie
//! in one plane, and the convex bodies that these bound.
//!
//! # Closed surfaces
//! A segment between two points outside of a closed surface enters it as often as it leaves it. So
//! it is enough to know what the faces hide that it enters by. The same holds for a surface that
//! is open only where it stands on another polygon, and for all segments between two polygons that
//! do not pass by a rim of the surface, if one of them enters it as often as it leaves it.

use std::collections::HashMap;

use glam::DVec3;

use super::convex::{convex_polygons, joined};
use crate::scene::box_tree::{Bounds, BoxTree};
use crate::scene::disjoint_sets::DisjointSets;
use crate::scene::edges::{EdgeUse, edge_uses, shared};
use crate::scene::{Geometry, Side, TriangleId};

/// The number of a blocker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct BlockerId(pub u32);

impl BlockerId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A convex polygon that blocks.
#[derive(Debug, Clone)]
pub(super) struct Blocker {
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Distance of the plane from the origin, along the normal.
    pub offset: f64,
    /// Counter-clockwise about the normal.
    pub corners: Vec<DVec3>,
    /// The box about them.
    pub low: DVec3,
    pub high: DVec3,
    /// The number of the connected surface that it belongs to.
    pub surface: u32,
    /// Whether that surface is closed, or open only where it stands on another polygon.
    pub closed: bool,
    /// Whether the surface ends at one of its edges.
    pub rim: bool,
    /// Whether both sides of it exchange light.
    pub two_sided: bool,
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

/// All blockers of a scene.
#[derive(Debug, Default)]
pub(super) struct Blockers {
    pub polygons: Vec<Blocker>,
    /// The boxes about them.
    pub tree: BoxTree,
    /// The one that each triangle is a part of.
    of_triangles: Vec<Option<BlockerId>>,
    /// Those that share an edge with each, one after the other, and where those of each begin.
    neighbours: Vec<BlockerId>,
    starts: Vec<u32>,
}

impl Blockers {
    pub fn polygon(&self, id: BlockerId) -> &Blocker {
        &self.polygons[id.index()]
    }

    /// The polygon that a solid triangle is a part of.
    pub fn of_triangle(&self, id: TriangleId) -> Option<BlockerId> {
        self.of_triangles[id.index()]
    }

    /// The polygons that share an edge with one, each at least once.
    pub fn neighbours(&self, id: BlockerId) -> &[BlockerId] {
        let [from, to] = [0, 1].map(|k| self.starts[id.index() + k] as usize);
        &self.neighbours[from..to]
    }

    /// Joins the solid triangles of a scene; planes closer than `coplanar` are one.
    pub fn new(geometry: &Geometry, coplanar: f64) -> Self {
        let (uses, _) = edge_uses(geometry);
        let mut me = Self::default();
        let mut polygon_of = vec![None; geometry.len()];
        for (triangles, hull) in convex_polygons(geometry, &uses, coplanar) {
            let normal = geometry.normal(triangles[0], Side::Front);
            let offset = normal.dot(hull[0]);
            let two_sided = triangles.iter().any(|&t| geometry.exchanges(t, Side::Back));
            for t in triangles {
                polygon_of[t.index()] = Some(BlockerId(me.polygons.len() as u32));
            }
            let low = hull.iter().fold(DVec3::INFINITY, |l, &c| l.min(c));
            let high = hull.iter().fold(DVec3::NEG_INFINITY, |h, &c| h.max(c));
            me.polygons.push(Blocker {
                normal,
                offset,
                corners: hull,
                low,
                high,
                surface: 0,
                closed: false,
                rim: false,
                two_sided,
            });
        }
        let boxes: Vec<Bounds> = me.polygons.iter().map(|p| (p.low, p.high)).collect();
        me.tree = BoxTree::new(&boxes);
        me.find_neighbours(&uses, &polygon_of);
        me.find_surfaces(geometry, &uses, &polygon_of, coplanar);
        me.of_triangles = polygon_of;
        me
    }

    fn find_neighbours(&mut self, uses: &[EdgeUse], polygon_of: &[Option<BlockerId>]) {
        let mut pairs = Vec::new();
        for [a, b] in shared(uses).filter_map(joined) {
            let of = [a, b].map(|u| polygon_of[u.triangle.index()]);
            if let [Some(p), Some(q)] = of
                && p != q
            {
                pairs.extend([(p, q), (q, p)]);
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        self.starts = (0..=self.polygons.len() as u32)
            .map(|k| pairs.partition_point(|pair| pair.0.0 < k) as u32)
            .collect();
        self.neighbours = pairs.into_iter().map(|pair| pair.1).collect();
    }

    fn find_surfaces(
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
        // Edges that a surface does not run through as often one way as the other. Those where
        // surfaces touch each other are edges of more than two triangles.
        let mut rims: HashMap<u32, Vec<DVec3>> = HashMap::new();
        let mut at_edge: Vec<(u32, &EdgeUse)> = Vec::new();
        for uses in shared(uses).filter(|u| joined(u).is_none()) {
            at_edge.clear();
            at_edge.extend(uses.iter().map(|u| (sets.find(u.triangle.0), u)));
            at_edge.sort_by_key(|&(surface, _)| surface);
            let of_surfaces = at_edge.chunk_by(|a, b| a.0 == b.0);
            let once = |uses: &&[(u32, &EdgeUse)]| {
                2 * uses.iter().filter(|(_, u)| u.reversed).count() != uses.len()
            };
            for &(surface, u) in of_surfaces.filter(once).flatten() {
                let c = geometry.corners(u.triangle);
                let rim = rims.entry(surface).or_default();
                rim.extend([c[usize::from(u.k)], c[usize::from(u.k + 1) % 3]]);
                if let Some(polygon) = polygon_of[u.triangle.index()] {
                    self.polygons[polygon.index()].rim = true;
                }
            }
        }
        let mut faces: Vec<(u32, BlockerId)> =
            geometry.ids().filter_map(|t| Some((sets.find(t.0), polygon_of[t.index()]?))).collect();
        faces.sort_unstable();
        faces.dedup();
        for faces in faces.chunk_by(|a, b| a.0 == b.0) {
            let closed = match rims.get(&faces[0].0) {
                Some(rim) => self.stands(faces, rim, coplanar),
                None => true,
            };
            for &(surface, polygon) in faces {
                let polygon = &mut self.polygons[polygon.index()];
                (polygon.surface, polygon.closed) = (surface, closed);
            }
        }
    }

    /// Whether faces with this rim stand on another polygon: three at least, as fewer enclose
    /// nothing.
    fn stands(&self, faces: &[(u32, BlockerId)], rim: &[DVec3], coplanar: f64) -> bool {
        let corners = || faces.iter().flat_map(|f| &self.polygon(f.1).corners);
        let (low, high) = rim
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
        let apart = |from: DVec3, to: DVec3| {
            (low + coplanar).cmplt(from).any() || (high - coplanar).cmpgt(to).any()
        };
        let mut stands = false;
        if faces.len() >= 3 {
            self.tree.near(apart, |k| {
                let ground = self.polygon(BlockerId(k));
                stands |= rim.iter().all(|&p| ground.holds(p, coplanar))
                    && corners().all(|&p| ground.height(p) >= -coplanar);
            });
        }
        stands
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
        assert!(blockers.polygons.iter().all(|p| p.closed));
        assert!((0..6).all(|k| blockers.neighbours(BlockerId(k)).len() == 4));
    }

    #[test]
    fn boxes_on_a_floor_are_closed() {
        let blockers = built("cornell-box");
        let mut surfaces: Vec<(u32, bool)> =
            blockers.polygons.iter().map(|p| (p.surface, p.closed)).collect();
        surfaces.sort_unstable();
        let sizes: Vec<(usize, bool)> =
            surfaces.chunk_by(|a, b| a == b).map(|c| (c.len(), c[0].1)).collect();
        let boxes = sizes.iter().filter(|(faces, closed)| *closed && (5..=6).contains(faces));
        assert_eq!(boxes.count(), 2, "{sizes:?}");
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
