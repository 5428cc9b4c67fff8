//! The conforming triangulation of all patches: one vertex for each lattice point of each side
//! that is the corner of a patch, shared across smooth edges.

use glam::DVec3;

use super::topology::Topology;
use crate::patches::{Cell, PatchId, Patches, Split, at_barycentric, side_index};
use crate::scene::Geometry;

/// A vertex of the conforming triangulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct VertexId(pub u32);

/// Vertices are numbered: classes of corners, then the inner points of edges, then those of sides.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    topology: Topology,
    /// First inner vertex of each edge.
    edge_base: Vec<u32>,
    /// First inner vertex of each side.
    side_base: Vec<u32>,
    /// Number of splits of each side's lattice.
    levels: Vec<u8>,
    /// Whether each vertex lies on a crease or a free border.
    border: Vec<bool>,
    /// Whether each lattice point is the corner of a patch.
    used: Vec<bool>,
    /// Whether a patch has vertices of a finer neighbour within its edges.
    hanging: Vec<bool>,
}

impl Mesh {
    pub fn new(geometry: &Geometry, patches: &Patches) -> Self {
        let topology = Topology::new(geometry, patches);
        let mut next = topology.classes;
        let edge_base = topology
            .levels
            .iter()
            .map(|&l| {
                let base = next;
                next += (1 << l) - 1;
                base
            })
            .collect();
        let side_base = patches
            .splits()
            .iter()
            .map(|split| {
                let base = next;
                if let Some(level) = split.level() {
                    let n = 1_u32 << level;
                    next += (n - 1) * n.saturating_sub(2) / 2;
                }
                base
            })
            .collect();
        let levels = patches.splits().iter().map(|s| s.level().unwrap_or(0)).collect();
        let border = vec![false; next as usize];
        let (used, hanging) = (border.clone(), vec![false; patches.len()]);
        let mut me = Self { topology, edge_base, side_base, levels, border, used, hanging };
        me.mark_borders(patches);
        for cell in patches.ids().flat_map(|id| patches.pieces(id)) {
            for v in me.corners(&cell) {
                me.used[v.0 as usize] = true;
            }
        }
        let stitched = |cell| (0..3).any(|k| me.edge_vertices(&cell, k).len() > 2);
        me.hanging = patches.ids().map(|id| patches.pieces(id).any(stitched)).collect();
        me
    }

    fn mark_borders(&mut self, patches: &Patches) {
        for (s, split) in patches.splits().iter().enumerate() {
            if *split == Split::None {
                continue;
            }
            for k in 0..3 {
                let edge = self.topology.edges[s][k].edge as usize;
                if !self.topology.smooth[edge] {
                    let corners = self.topology.corners[s];
                    self.border[corners[k] as usize] = true;
                    self.border[corners[(k + 1) % 3] as usize] = true;
                    let from = self.edge_base[edge] as usize;
                    let inner = (1 << self.topology.levels[edge]) - 1;
                    self.border[from..from + inner].fill(true);
                }
            }
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.border.len()
    }

    /// Whether a vertex lies on a crease or a free border.
    pub fn on_border(&self, v: usize) -> bool {
        self.border[v]
    }

    /// The vertex at a lattice point of a side, and for a point on its border with the finer
    /// lattice of a neighbour, in that.
    fn vertex(&self, side: usize, point: [u32; 3]) -> VertexId {
        let level = self.levels[side];
        let n = 1 << level;
        if let Some(k) = point.iter().position(|&c| c == n) {
            return VertexId(self.topology.corners[side][k]);
        }
        if let Some(zero) = point.iter().position(|&c| c == 0) {
            let k = (zero + 1) % 3;
            let finer = self.finer(side, k);
            return self.on_edge(side, k, point[(k + 1) % 3] << finer);
        }
        let [a, b, _] = point;
        VertexId(self.side_base[side] + (a - 1) * (n - 1) - a * (a - 1) / 2 + b - 1)
    }

    /// How many splits finer edge k's lattice is than the side's own.
    fn finer(&self, side: usize, k: usize) -> u8 {
        let edge = self.topology.edges[side][k].edge as usize;
        self.topology.levels[edge] - self.levels[side]
    }

    /// The vertex `m` steps of the edge's lattice from corner k towards corner k + 1.
    fn on_edge(&self, side: usize, k: usize, m: u32) -> VertexId {
        let used = self.topology.edges[side][k];
        let n = 1 << self.topology.levels[used.edge as usize];
        let corners = self.topology.corners[side];
        match m {
            0 => VertexId(corners[k]),
            m if m == n => VertexId(corners[(k + 1) % 3]),
            m => {
                let m = if used.reversed { n - m } else { m };
                VertexId(self.edge_base[used.edge as usize] + m - 1)
            }
        }
    }

    /// A patch's corners on its side's lattice.
    fn lattice(&self, cell: &Cell) -> [[u32; 3]; 3] {
        let shift = self.levels[side_index(cell.triangle, cell.side)] - cell.level;
        cell.lattice().map(|p| p.map(|c| c << shift))
    }

    /// The vertices at a patch's corners.
    pub fn corners(&self, cell: &Cell) -> [VertexId; 3] {
        let side = side_index(cell.triangle, cell.side);
        self.lattice(cell).map(|p| self.vertex(side, p))
    }

    /// Whether a finer neighbour has vertices within a patch's edges.
    pub fn has_hanging(&self, id: PatchId) -> bool {
        self.hanging[id.index()]
    }

    /// The vertices along a patch's edge k from corner k to corner k + 1, each with its place on
    /// it, 0..1.
    pub fn edge_vertices(&self, cell: &Cell, k: usize) -> Vec<(f64, VertexId)> {
        let side = side_index(cell.triangle, cell.side);
        let lattice = self.lattice(cell);
        let (from, to) = (lattice[k], lattice[(k + 1) % 3]);
        let on_border = (0..3).find(|&c| from[c] == 0 && to[c] == 0);
        let shift = self.levels[side] - cell.level;
        let (steps, at): (u32, Box<dyn Fn(u32) -> VertexId>) = match on_border {
            Some(zero) => {
                let edge = (zero + 1) % 3;
                let finer = self.finer(side, edge);
                let [a, b] = [from, to].map(|p| p[(edge + 1) % 3] << finer);
                let at = move |m: u32| if b > a { a + m } else { a - m };
                (1 << (shift + finer), Box::new(move |m| self.on_edge(side, edge, at(m))))
            }
            None => {
                let steps = 1 << shift;
                let at =
                    move |m: u32| [0, 1, 2].map(|c| (from[c] * (steps - m) + to[c] * m) / steps);
                (steps, Box::new(move |m| self.vertex(side, at(m))))
            }
        };
        (0..=steps)
            .map(|m| (f64::from(m) / f64::from(steps), at(m)))
            .filter(|(_, v)| self.used[v.0 as usize])
            .collect()
    }

    /// Calls `visit` with every vertex on the outline of a patch.
    fn outline(&self, id: PatchId, cell: &Cell, mut visit: impl FnMut(VertexId)) {
        if !self.hanging[id.index()] {
            self.corners(cell).into_iter().for_each(visit);
            return;
        }
        for k in 0..3 {
            let edge = self.edge_vertices(cell, k);
            edge[..edge.len() - 1].iter().for_each(|(_, v)| visit(*v));
        }
    }

    /// Position of every vertex in metres.
    pub fn positions(&self, geometry: &Geometry, patches: &Patches) -> Vec<DVec3> {
        let mut positions = vec![DVec3::ZERO; self.len()];
        for cell in patches.ids().flat_map(|id| patches.pieces(id)) {
            let corners = geometry.corners(cell.triangle);
            let vertices = self.corners(&cell);
            for (v, l) in vertices.into_iter().zip(cell.barycentric()) {
                positions[v.0 as usize] = at_barycentric(corners, l);
            }
        }
        positions
    }

    /// Which patches lie around each vertex, `usable` ones only.
    pub fn incidence(&self, patches: &Patches, usable: impl Fn(PatchId) -> bool) -> Incidence {
        let mut starts = vec![0_u32; self.len() + 1];
        let each = |visit: &mut dyn FnMut(VertexId, PatchId)| {
            // The last patch about each vertex: a cluster comes once.
            let mut last = vec![u32::MAX; self.len()];
            for id in patches.ids().filter(|&i| usable(i)) {
                for cell in patches.pieces(id) {
                    self.outline(id, &cell, |v| {
                        if std::mem::replace(&mut last[v.0 as usize], id.0) != id.0 {
                            visit(v, id);
                        }
                    });
                }
            }
        };
        each(&mut |v, _| starts[v.0 as usize + 1] += 1);
        for v in 0..self.len() {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut around = vec![PatchId(0); starts[self.len()] as usize];
        each(&mut |v, id| {
            let at = &mut next[v.0 as usize];
            around[*at as usize] = id;
            *at += 1;
        });
        Incidence { starts, around }
    }
}

/// The patches around each vertex.
pub(super) struct Incidence {
    starts: Vec<u32>,
    around: Vec<PatchId>,
}

impl Incidence {
    pub fn around(&self, v: usize) -> &[PatchId] {
        &self.around[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// The patches around `v` and those around their vertices.
    pub fn second_ring(&self, patches: &Patches, mesh: &Mesh, v: usize) -> Vec<PatchId> {
        let mut ring = Vec::new();
        for &id in self.around(v) {
            for cell in patches.pieces(id) {
                mesh.outline(id, &cell, |w| ring.extend_from_slice(self.around(w.0 as usize)));
            }
        }
        ring.sort_unstable();
        ring.dedup();
        ring
    }
}
