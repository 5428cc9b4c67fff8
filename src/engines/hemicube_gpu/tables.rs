//! What the counting pass needs to find the patch under a pixel: the uniform grid on each source
//! triangle, and the patch that each of its cells belongs to.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3};

use super::device::{Gpu, GpuError};
use crate::patches::{PatchId, Patches, Split, side_index};
use crate::scene::{Geometry, Side, TriangleId};

/// The tables, as the counting shader has them.
#[derive(Debug)]
pub(super) struct Tables {
    /// All solid triangles in order.
    pub(super) sources: Vec<Source>,
    /// For each cell of the uniform grids the patch that it belongs to, or [`CUT`] and where in
    /// `cuts` one learns it. Empty if every cell is a patch of its own.
    pub(super) owners: Vec<u32>,
    /// For each cell that contacts cut: how to find whom its points belong to.
    pub(super) cuts: Vec<u32>,
    /// For each patch the solid triangle on which to look up what its pixels belong to, or
    /// [`ITSELF`]. Empty if no pixel of a patch belongs to another.
    pub(super) look_on: Vec<u32>,
}

/// The same on the device.
#[derive(Debug)]
pub(super) struct DeviceTables {
    pub(super) sources: wgpu::Buffer,
    pub(super) owners: wgpu::Buffer,
    pub(super) cuts: wgpu::Buffer,
    pub(super) look_on: wgpu::Buffer,
    /// Whether some cells, and some patches, do not own all their pixels.
    pub(super) owned: [u32; 2],
}

impl DeviceTables {
    pub(super) fn new(gpu: &Gpu, tables: &Tables) -> Result<Self, GpuError> {
        let sources = bytemuck::cast_slice(&tables.sources);
        let [owners, cuts, look_on] =
            [&tables.owners, &tables.cuts, &tables.look_on].map(|t| bytemuck::cast_slice(t));
        Ok(Self {
            sources: upload(gpu, "the table of source triangles (bytes)", sources)?,
            owners: upload(gpu, "the table of cells (bytes)", owners)?,
            cuts: upload(gpu, "the table of contacts (bytes)", cuts)?,
            look_on: upload(gpu, "the table of patches (bytes)", look_on)?,
            owned: [&tables.owners, &tables.look_on].map(|t| u32::from(!t.is_empty())),
        })
    }
}

fn upload(gpu: &Gpu, what: &'static str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
    let (limits, needed) = (gpu.limits(), contents.len() as u64);
    let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if needed > allowed {
        return Err(GpuError::Limit { what, needed, allowed });
    }
    Ok(gpu.upload(what, contents, wgpu::BufferUsages::STORAGE))
}

/// A solid source triangle: `Source` of the counting shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Source {
    a: [f32; 3],
    front_first: u32,
    b: [f32; 3],
    back_first: u32,
    c: [f32; 3],
    levels: u32,
}

/// Marks a cut cell among the owners; ids of patches are smaller.
const CUT: u32 = 1 << 31;

/// Marks a patch whose pixels all belong to it.
const ITSELF: u32 = u32::MAX;

/// Level of a side without patches.
const NO_PATCH: u32 = 0xffff;

/// Marks a region of a cut cell in which the point itself decides whom it belongs to.
const MIXED: u32 = u32::MAX;

impl Tables {
    pub(super) fn new(geometry: &Geometry, patches: &Patches, centre: DVec3) -> Self {
        let (finest, patch_of) = patches.finest().map_or((patches, None), |(f, p)| (f, Some(p)));
        let whole = |id: PatchId| patch_of.map_or(id.0, |p| p[id.index()]);
        let solid: Vec<TriangleId> = geometry.ids().filter(|&t| geometry.is_solid(t)).collect();
        let grid = |id, side| match finest.split_of(id, side) {
            Split::Uniform { first, level } => (first, u32::from(level)),
            Split::None | Split::Adaptive { .. } => (0, NO_PATCH),
        };
        let sources = solid.iter().map(|&id| {
            let [a, b, c] = geometry.corners(id).map(|p| (p - centre).as_vec3().to_array());
            let (front_first, front) = grid(id, Side::Front);
            let (back_first, back) = grid(id, Side::Back);
            Source { a, front_first, b, back_first, c, levels: front | back << 16 }
        });
        let mut me = Self {
            sources: sources.collect(),
            owners: patch_of.map(<[u32]>::to_vec).unwrap_or_default(),
            cuts: Vec::new(),
            look_on: Vec::new(),
        };
        for (number, &triangle) in (0..).zip(&solid) {
            for side in Side::BOTH {
                if !finest.has_crossed(side_index(triangle, side)) {
                    continue;
                }
                me.owners
                    .extend((me.owners.len() as u32..finest.len() as u32).map(PatchId).map(whole));
                me.look_on.resize(patches.len(), ITSELF);
                for id in patches.of_side(triangle, side) {
                    me.look_on[id.index()] = number;
                }
                for id in finest.of_side(triangle, side) {
                    me.cut(finest, id, whole);
                }
            }
        }
        me
    }

    /// Adds what is known about a cell, if contacts cut it: as the counting shader reads it, with
    /// coordinates within the cell.
    fn cut(&mut self, finest: &Patches, id: PatchId, whole: impl Fn(PatchId) -> u32) {
        let Some(cut) = finest.crossed(id) else { return };
        let cell = finest.cell(id);
        let point = |uv: DVec2| {
            let l = cell.local(DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y));
            [l.x, l.y].map(|x| (x as f32).to_bits())
        };
        self.owners[id.index()] = CUT | self.cuts.len() as u32;
        self.cuts.extend(cut.table(id).map(|owner| owner.map_or(MIXED, &whole)));
        self.cuts.extend([whole(id), cut.others.len() as u32, cut.lines().len() as u32]);
        self.cuts.extend(point(cut.centre));
        for &(other, centre) in &cut.others {
            self.cuts.push(whole(other));
            self.cuts.extend(point(centre));
        }
        self.cuts.extend(cut.lines().flatten().flat_map(point));
    }
}
