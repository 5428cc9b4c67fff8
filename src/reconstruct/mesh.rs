//! The conforming triangulation of all patches: one vertex for each lattice point of each side,
//! shared across smooth edges.

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
    /// Whether each vertex lies on a crease or a free border.
    border: Vec<bool>,
}

/// The vertices along one edge of a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct EdgeVertices {
    ends: [VertexId; 2],
    /// Inner vertex number 1, and the step to the next.
    inner: Option<(u32, i32)>,
    segments: u32,
}

impl EdgeVertices {
    pub fn segments(&self) -> u32 {
        self.segments
    }

    /// Vertex `i` of `segments + 1`.
    pub fn vertex(&self, i: u32) -> VertexId {
        match self.inner {
            Some((first, step)) if i > 0 && i < self.segments => {
                VertexId(first.wrapping_add_signed(step * (i as i32 - 1)))
            }
            _ => self.ends[usize::from(i > 0)],
        }
    }
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
                if let Split::Uniform { level, .. } = split {
                    let n = 1_u32 << level;
                    next += (n - 1) * n.saturating_sub(2) / 2;
                }
                base
            })
            .collect();
        let border = vec![false; next as usize];
        let mut me = Self { topology, edge_base, side_base, border };
        me.mark_borders(patches);
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

    /// The vertex at a lattice point of a side that is split `level` times.
    fn vertex(&self, side: usize, level: u8, point: [u32; 3]) -> VertexId {
        let n = 1 << level;
        if let Some(k) = point.iter().position(|&c| c == n) {
            return VertexId(self.topology.corners[side][k]);
        }
        if let Some(zero) = point.iter().position(|&c| c == 0) {
            let k = (zero + 1) % 3;
            let along = self.along(side, k, level, point[(k + 1) % 3]);
            let edge = self.topology.edges[side][k].edge as usize;
            return VertexId(self.edge_base[edge] + along - 1);
        }
        let [a, b, _] = point;
        VertexId(self.side_base[side] + (a - 1) * (n - 1) - a * (a - 1) / 2 + b - 1)
    }

    /// Position on edge k, in its own steps and direction, `m` strips from corner k.
    fn along(&self, side: usize, k: usize, level: u8, m: u32) -> u32 {
        let used = self.topology.edges[side][k];
        let m = if used.reversed { (1 << level) - m } else { m };
        m << (self.topology.levels[used.edge as usize] - level)
    }

    /// The vertices at a patch's corners.
    pub fn corners(&self, cell: &Cell) -> [VertexId; 3] {
        let side = side_index(cell.triangle, cell.side);
        cell.lattice().map(|p| self.vertex(side, cell.level, p))
    }

    /// How many splits finer the far side of a patch's edge k (corner k to k + 1) is.
    fn finer(&self, cell: &Cell, k: usize) -> u8 {
        if cell.inverted || cell.strip()[(k + 2) % 3] != 0 {
            return 0;
        }
        let used = self.topology.edges[side_index(cell.triangle, cell.side)][k];
        self.topology.levels[used.edge as usize] - cell.level
    }

    /// Whether a finer neighbour has vertices within a patch's edges.
    pub fn has_hanging(&self, cell: &Cell) -> bool {
        !cell.inverted && (0..3).any(|k| self.finer(cell, k) > 0)
    }

    /// The vertices along a patch's edge k, from corner k to corner k + 1.
    pub fn edge_vertices(&self, cell: &Cell, k: usize) -> EdgeVertices {
        let side = side_index(cell.triangle, cell.side);
        let corners = self.corners(cell);
        let ends = [corners[k], corners[(k + 1) % 3]];
        let segments = 1 << self.finer(cell, k);
        let inner = (segments > 1).then(|| {
            let used = self.topology.edges[side][k];
            let from = self.along(side, k, cell.level, cell.lattice()[k][(k + 1) % 3]);
            let step = if used.reversed { -1 } else { 1 };
            (self.edge_base[used.edge as usize].wrapping_add_signed(from as i32 + step - 1), step)
        });
        EdgeVertices { ends, inner, segments }
    }

    /// Calls `visit` with every vertex on the outline of a patch.
    fn outline(&self, cell: &Cell, mut visit: impl FnMut(VertexId)) {
        for k in 0..3 {
            let edge = self.edge_vertices(cell, k);
            for i in 0..edge.segments() {
                visit(edge.vertex(i));
            }
        }
    }

    /// Position of every vertex in metres.
    pub fn positions(&self, geometry: &Geometry, patches: &Patches) -> Vec<DVec3> {
        let mut positions = vec![DVec3::ZERO; self.len()];
        for id in patches.ids() {
            let cell = patches.cell(id);
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
            for id in patches.ids().filter(|&i| usable(i)) {
                self.outline(&patches.cell(id), |v| visit(v, id));
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
            mesh.outline(&patches.cell(id), |w| ring.extend_from_slice(self.around(w.0 as usize)));
        }
        ring.sort_unstable();
        ring.dedup();
        ring
    }
}
