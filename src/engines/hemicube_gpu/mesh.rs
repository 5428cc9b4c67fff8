//! What is drawn: triangles with an item each, for the graphics pipeline.

use std::collections::HashMap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::device::{Gpu, GpuError};
use crate::engines::Draw;
use crate::patches::Patches;
use crate::scene::geometry::position_key;
use crate::scene::{Geometry, Side, TriangleId};

/// A corner, in metres from the scene's centre. The item counts at a triangle's first corner.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    position: [f32; 3],
    item: u32,
}

/// Triangles in the making. Corners are shared, but every triangle has a first corner of its own,
/// which carries its item: vertices number about as many as triangles.
#[derive(Debug, Default)]
struct Triangles {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    /// The vertex at each position that other triangles share.
    at: HashMap<[u64; 3], u32>,
    /// Whether each vertex is the first corner of some triangle.
    taken: Vec<bool>,
}

impl Triangles {
    fn vertex(&mut self, position: DVec3) -> u32 {
        self.taken.push(false);
        self.vertices.push(Vertex { position: position.as_vec3().to_array(), item: 0 });
        (self.vertices.len() - 1) as u32
    }

    /// Adds a triangle, perhaps turned to begin with another corner.
    fn add(&mut self, corners: [DVec3; 3], item: u32) {
        let mut shared = corners.map(|p| {
            let key = position_key(p);
            self.at.get(&key).copied().unwrap_or_else(|| {
                let v = self.vertex(p);
                self.at.insert(key, v);
                v
            })
        });
        if let Some(k) = shared.iter().position(|&v| !self.taken[v as usize]) {
            shared.rotate_left(k);
        } else {
            shared[0] = self.vertex(corners[0]);
        }
        let first = shared[0] as usize;
        self.taken[first] = true;
        self.vertices[first].item = item;
        self.indices.extend(shared);
    }
}

/// All that hemicubes project.
#[derive(Debug)]
pub(super) struct Meshes {
    pub(super) sources: Mesh,
    /// The patches, if they are drawn.
    pub(super) patches: Option<Mesh>,
    /// The item of the first source triangle: patches come before, if they are drawn.
    pub(super) first_source: u32,
}

impl Meshes {
    pub(super) fn new(
        gpu: &Gpu,
        geometry: &Geometry,
        patches: &Patches,
        centre: DVec3,
        draw: Draw,
    ) -> Result<Self, GpuError> {
        let first_source = match draw {
            Draw::Sources => 0,
            Draw::Patches => patches.len() as u32,
        };
        Ok(Self {
            sources: Mesh::of_sources(gpu, geometry, centre, first_source)?,
            patches: match draw {
                Draw::Sources => None,
                Draw::Patches => Some(Mesh::of_patches(gpu, geometry, patches, centre)?),
            },
            first_source,
        })
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> u32 {
        self.sources.len() + self.patches.as_ref().map_or(0, Mesh::len)
    }
}

/// Triangles on the device, in chunks as large as it allows.
#[derive(Debug)]
pub(super) struct Mesh {
    chunks: Vec<Chunk>,
    /// Triangles in all chunks but the last.
    chunk_len: u32,
    len: u32,
    /// The triangles that lie on each source triangle.
    on_source: Vec<Range<u32>>,
}

#[derive(Debug)]
struct Chunk {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
}

impl Mesh {
    /// The solid source triangles; their items follow each other from `first` on.
    fn of_sources(
        gpu: &Gpu,
        geometry: &Geometry,
        centre: DVec3,
        first: u32,
    ) -> Result<Self, GpuError> {
        let mut item = first;
        Self::new(gpu, geometry, |id, add| {
            add(geometry.corners(id).map(|p| p - centre), item);
            item += 1;
        })
    }

    /// All patches, each with its id for an item. Patches of a back wind the other way round, so
    /// that all are seen from the side that winds counter-clockwise.
    fn of_patches(
        gpu: &Gpu,
        geometry: &Geometry,
        patches: &Patches,
        centre: DVec3,
    ) -> Result<Self, GpuError> {
        Self::new(gpu, geometry, |id, add| {
            for side in Side::BOTH {
                for patch in patches.of_side(id, side) {
                    let [a, b, c] =
                        patches.cell(patch).on(id).corners(geometry).map(|p| p - centre);
                    add(if side == Side::Front { [a, b, c] } else { [a, c, b] }, patch.0);
                }
            }
        })
    }

    /// Uploads what `draw` adds for each solid source triangle.
    fn new(
        gpu: &Gpu,
        geometry: &Geometry,
        mut draw: impl FnMut(TriangleId, &mut dyn FnMut([DVec3; 3], u32)),
    ) -> Result<Self, GpuError> {
        /// Bytes that a triangle takes at most in either buffer: three vertices.
        const TRIANGLE: u64 = 3 * size_of::<Vertex>() as u64;
        let chunk_len = (gpu.limits().max_buffer_size / TRIANGLE).min(u64::from(u32::MAX / 3));
        let mut me =
            Self { chunks: Vec::new(), chunk_len: chunk_len as u32, len: 0, on_source: Vec::new() };
        let mut triangles = Triangles::default();
        for id in geometry.ids() {
            let from = me.len;
            if geometry.is_solid(id) {
                draw(id, &mut |corners, item| {
                    triangles.add(corners, item);
                    me.len += 1;
                    if me.len.is_multiple_of(me.chunk_len) {
                        me.chunks.push(Chunk::new(gpu, &std::mem::take(&mut triangles)));
                    }
                });
            }
            me.on_source.push(from..me.len);
        }
        if !triangles.indices.is_empty() {
            me.chunks.push(Chunk::new(gpu, &triangles));
        }
        gpu.check()?;
        Ok(me)
    }

    fn len(&self) -> u32 {
        self.len
    }

    /// Draws all triangles but those on source triangle `own`, once for each of `faces`, the
    /// rectangles that they cover; the number of the first one's camera is given.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        own: TriangleId,
        first_camera: u32,
        faces: &[[f32; 4]; 5],
    ) {
        let own = &self.on_source[own.index()];
        for (k, chunk) in self.chunks.iter().enumerate() {
            let from = k as u32 * self.chunk_len;
            let to = self.len.min(from.saturating_add(self.chunk_len));
            pass.set_vertex_buffer(0, chunk.vertices.slice(..));
            pass.set_index_buffer(chunk.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (camera, &[x, y, width, height]) in (first_camera..).zip(faces) {
                pass.set_viewport(x, y, width, height, 0.0, 1.0);
                for run in [from..own.start.clamp(from, to), own.end.clamp(from, to)..to] {
                    if !run.is_empty() {
                        let indices = 3 * (run.start - from)..3 * (run.end - from);
                        pass.draw_indexed(indices, 0, camera..camera + 1);
                    }
                }
            }
        }
    }
}

impl Chunk {
    fn new(gpu: &Gpu, triangles: &Triangles) -> Self {
        let vertices = bytemuck::cast_slice(&triangles.vertices);
        let indices = bytemuck::cast_slice(&triangles.indices);
        Self {
            vertices: gpu.upload("vertices", vertices, wgpu::BufferUsages::VERTEX),
            indices: gpu.upload("indices", indices, wgpu::BufferUsages::INDEX),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_begins_with_a_corner_of_its_own() {
        let mut t = Triangles::default();
        let corner =
            |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let mut item = 100;
        for i in 0..8 {
            for j in 0..i {
                for k in 0..j {
                    t.add([i, j, k].map(corner), item);
                    item += 1;
                }
            }
        }
        let mut first: Vec<u32> = t.indices.chunks(3).map(|c| c[0]).collect();
        for (&v, item) in first.iter().zip(100..) {
            assert_eq!(t.vertices[v as usize].item, item);
        }
        first.sort_unstable();
        assert!(first.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(t.vertices.len(), first.len(), "no vertex without a triangle");
    }
}
