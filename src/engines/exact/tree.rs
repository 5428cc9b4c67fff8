//! A hierarchy over the patches. Its nodes are nearly flat and compact, so that a single test often
//! decides what lies between two of them.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::convex::convex_hull;
use super::places::{NodeId, Place, Places, TileId};
use crate::patches::PatchId;

/// Most patches in a leaf.
pub(super) const LEAF: usize = 4;

/// Most points whose convex hull holds the patches of a node: enough for the triangles of a leaf.
const CORNERS: usize = 3 * LEAF;

/// Corners of a box.
const BOX: u8 = 8;

/// Most patches in a tile: a node that is a unit of work.
pub(super) const TILE: usize = 128;

/// A difference of one radian between normals counts as much as this fraction of a node's diagonal.
const TURN: f64 = 0.5;

/// The box and the direction of a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub low: DVec3,
    pub high: DVec3,
    /// Unit normal; zero if it has several.
    pub normal: DVec3,
}

/// A run of patches in the order of the hierarchy.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub places: Places,
    /// None for a leaf.
    pub children: Option<[NodeId; 2]>,
    pub low: DVec3,
    pub high: DVec3,
    /// The common plane: a unit normal and the distance along it.
    pub plane: Option<(DVec3, f64)>,
    corners: [DVec3; CORNERS],
    count: u8,
    /// Mean area of its patches in m².
    pub patch_area: f64,
}

impl Node {
    /// Points whose convex hull holds all patches.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..usize::from(self.count)]
    }

    /// Takes the corners of the patches instead of those of the box, if they are few.
    fn take_few_corners<'a>(&mut self, points: impl Iterator<Item = &'a DVec3>) {
        let (mut few, mut count) = ([DVec3::ZERO; CORNERS], 0);
        for p in points.filter(|p| p.is_finite()) {
            if few[..count].contains(p) {
                continue;
            }
            let Some(place) = few.get_mut(count) else { return };
            *place = *p;
            count += 1;
        }
        if count > 0 {
            (self.corners, self.count) = (few, count as u8);
        }
    }

    pub fn is_leaf(&self) -> bool {
        self.children.is_none()
    }

    /// Square of the diagonal of its box.
    pub fn diagonal(&self) -> f64 {
        self.low.distance_squared(self.high)
    }

    /// About the factor between patches of two nodes with nothing in the way.
    pub fn factor(&self, other: &Self) -> f64 {
        let gap = (other.low - self.high).max(self.low - other.high).max(DVec3::ZERO).length();
        let distance = gap + 0.25 * (self.diagonal().sqrt() + other.diagonal().sqrt());
        0.25 * self.patch_area.max(other.patch_area) / (PI * distance * distance)
    }

    /// Whether it is to be split before another node is.
    pub fn split_before(&self, other: &Self) -> bool {
        !self.is_leaf() && (other.is_leaf() || self.diagonal() >= other.diagonal())
    }
}

/// The hierarchy.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    /// Patches in the order of the leaves.
    pub order: Vec<PatchId>,
    /// The nodes that are tiles, in the order of their patches.
    tiles: Vec<NodeId>,
}

impl Tree {
    /// The hierarchy of patches with these extents. `corners` of each patch; planes closer than
    /// `coplanar` are one.
    pub fn new<'a>(
        extents: &[Extent],
        corners: impl Fn(PatchId) -> &'a [DVec3],
        coplanar: f64,
    ) -> Self {
        let order = (0..extents.len() as u32).map(PatchId).collect();
        let mut me = Self { order, ..Self::default() };
        if extents.is_empty() {
            return me;
        }
        me.nodes.push(me.node_of(0, extents.len(), extents, &corners, coplanar));
        let mut at = 0;
        while at < me.nodes.len() {
            let range = me.nodes[at].places.range();
            let (from, to) = (range.start, range.end);
            if to - from > LEAF {
                let middle = from + divide(&mut me.order[from..to], extents);
                let first = me.nodes.len() as u32;
                me.nodes[at].children = Some([NodeId(first), NodeId(first + 1)]);
                for (from, to) in [(from, middle), (middle, to)] {
                    me.nodes.push(me.node_of(from, to, extents, &corners, coplanar));
                }
            }
            at += 1;
        }
        me.find_tiles(NodeId(0));
        me
    }

    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0 as usize]
    }

    /// All tiles, in the order of their patches.
    pub fn tiles(&self) -> impl Iterator<Item = TileId> + Clone {
        (0..self.tiles.len() as u32).map(TileId)
    }

    pub fn tile_node(&self, tile: TileId) -> NodeId {
        self.tiles[tile.index()]
    }

    /// The places of the patches of a tile.
    pub fn tile(&self, tile: TileId) -> Places {
        self.node(self.tile_node(tile)).places
    }

    /// The tile that holds a place.
    pub fn tile_of(&self, at: Place) -> TileId {
        let after = self.tiles.partition_point(|&node| self.node(node).places.first() <= at);
        TileId(after.saturating_sub(1) as u32)
    }

    /// The patches of a run.
    pub fn patches(&self, places: Places) -> &[PatchId] {
        &self.order[places.range()]
    }

    fn find_tiles(&mut self, id: NodeId) {
        let node = self.node(id);
        match node.children {
            Some(children) if node.places.len() > TILE => {
                children.into_iter().for_each(|child| self.find_tiles(child));
            }
            _ => self.tiles.push(id),
        }
    }

    /// A leaf of the patches from one place to another.
    fn node_of<'a>(
        &self,
        from: usize,
        to: usize,
        extents: &[Extent],
        corners: &impl Fn(PatchId) -> &'a [DVec3],
        coplanar: f64,
    ) -> Node {
        let patches = &self.order[from..to];
        let (low, high) = bounds(patches, extents);
        let mut node = Node {
            places: Places::new(from..to),
            children: None,
            low,
            high,
            plane: None,
            corners: std::array::from_fn(|k| {
                let pick = |bit: usize, axis: usize| {
                    if k >> bit & 1 == 1 { high[axis] } else { low[axis] }
                };
                DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
            }),
            count: BOX,
            patch_area: 0.0,
        };
        node.take_few_corners(patches.iter().flat_map(|&p| corners(p)));
        let normal = extents[patches[0].index()].normal;
        let [origin, second, ..] = *corners(patches[0]) else { return node };
        let points = || patches.iter().flat_map(|&p| corners(p));
        let flat = normal != DVec3::ZERO
            && patches.iter().all(|&p| extents[p.index()].normal.dot(normal) > 1.0 - 1e-9)
            && points().all(|&v| normal.dot(v - origin).abs() <= coplanar);
        if flat {
            node.plane = Some((normal, normal.dot(origin)));
            let (u, v) = normal.any_orthonormal_pair();
            let hull =
                convex_hull(points().map(|&p| (DVec2::new(u.dot(p), v.dot(p)), p)).collect());
            let outline: Vec<DVec3> = match hull.len() <= node.corners.len() {
                true => hull.into_iter().map(|corner| corner.1).collect(),
                false => rectangle(&points().copied().collect::<Vec<_>>(), normal, second - origin)
                    .to_vec(),
            };
            node.corners[..outline.len()].copy_from_slice(&outline);
            node.count = outline.len() as u8;
        }
        node
    }
}

/// The smaller rectangle about points of a plane, along an edge or along the longest axis.
pub(super) fn rectangle(points: &[DVec3], normal: DVec3, edge: DVec3) -> [DVec3; 4] {
    let about = |direction: DVec3| {
        let u = (direction - normal * normal.dot(direction))
            .normalize_or(normal.any_orthonormal_vector());
        let v = normal.cross(u);
        let o = points[0];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points {
            for (k, x) in [u.dot(*p - o), v.dot(*p - o)].into_iter().enumerate() {
                low[k] = low[k].min(x);
                high[k] = high[k].max(x);
            }
        }
        let at = |x: f64, y: f64| o + u * x + v * y;
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let [(a, c), (b, d)] = [(low[0], high[0]), (low[1], high[1])];
        (area, [at(a, b), at(c, b), at(c, d), at(a, d)])
    };
    let by_edge = about(edge);
    let by_axis = about(DVec3::new(0.577, 0.211, 0.789).cross(normal));
    if by_axis.0 < by_edge.0 { by_axis.1 } else { by_edge.1 }
}

fn bounds(patches: &[PatchId], extents: &[Extent]) -> (DVec3, DVec3) {
    patches
        .iter()
        .map(|&p| &extents[p.index()])
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), e| {
            (low.min(e.low), high.max(e.high))
        })
}

/// Sorts patches into two halves that differ in place or in direction; returns the length of the
/// first.
fn divide(patches: &mut [PatchId], extents: &[Extent]) -> usize {
    let (low, high) = bounds(patches, extents);
    let turn = TURN * low.distance(high);
    let feature = |p: PatchId| -> [f64; 6] {
        let e = &extents[p.index()];
        let (c, n) = (0.5 * (e.low + e.high), e.normal * turn);
        [c.x, c.y, c.z, n.x, n.y, n.z]
    };
    let (mut least, mut most) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    for &p in patches.iter() {
        for (k, x) in feature(p).into_iter().enumerate() {
            least[k] = least[k].min(x);
            most[k] = most[k].max(x);
        }
    }
    let mut axis = 0;
    for k in 1..6 {
        if most[k] - least[k] > (most[axis] - least[axis]) * (1.0 + 1e-9) {
            axis = k;
        }
    }
    let middle = 0.5 * (least[axis] + most[axis]);
    patches.sort_by(|&p, &q| feature(p)[axis].total_cmp(&feature(q)[axis]).then(p.cmp(&q)));
    let at = patches.partition_point(|&p| feature(p)[axis] < middle);
    let lopsided = patches.len() / 16;
    // Patches that lie all in one place are halved by number.
    if at <= lopsided || at + lopsided >= patches.len() { patches.len() / 2 } else { at }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_patch_is_in_one_tile_and_nodes_hold_their_patches() {
        let corners: Vec<[DVec3; 3]> = (0..1000)
            .map(|k| {
                let o = DVec3::new(
                    f64::from(k % 10),
                    f64::from(k / 10 % 50),
                    f64::from(k / 500) * 99.0,
                );
                [o, o + DVec3::X, o + DVec3::Y]
            })
            .collect();
        let extents: Vec<Extent> = corners
            .iter()
            .map(|t| Extent {
                low: t[0].min(t[1]).min(t[2]),
                high: t[0].max(t[1]).max(t[2]),
                normal: DVec3::Z,
            })
            .collect();
        let tree = Tree::new(&extents, |p| &corners[p.index()], 1e-9);
        let mut next = 0;
        for tile in tree.tiles() {
            let places = tree.tile(tile).range();
            assert_eq!(places.start, next);
            assert!(places.len() <= TILE);
            next = places.end;
        }
        assert_eq!(next, 1000);
        for node in &tree.nodes {
            if let Some((n, d)) = node.plane {
                assert_eq!(n, DVec3::Z);
                assert!(node.corners().iter().all(|c| (n.dot(*c) - d).abs() < 1e-9));
            }
            for &p in tree.patches(node.places) {
                let e = &extents[p.index()];
                assert!(e.low.cmpge(node.low).all() && e.high.cmple(node.high).all());
            }
        }
        assert!(tree.tiles().all(|t| tree.node(tree.tile_node(t)).plane.is_some()));
    }
}
