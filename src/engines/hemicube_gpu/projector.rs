//! Step 3: the item buffers of hemicubes.

use wgpu::BufferUsages as Usage;

use super::camera::{Camera, Cameras};
use super::device::{Gpu, bind_group};
use super::mesh::Meshes;
use super::pipelines::{DEPTH, ITEMS};
use super::plan::Plan;
use crate::patches::PatchId;
use crate::visibility::NOTHING;

/// Projects triangles on the faces of hemicubes.
#[derive(Debug)]
pub(super) struct Projector<'a> {
    pub(super) cameras: Cameras<'a>,
    pub(super) meshes: Meshes,
    /// Pixels along the top.
    pub(super) resolution: u32,
    /// Item buffers, one a layer.
    pub(super) items: wgpu::Texture,
    layers: Vec<Layer>,
    /// The cameras of a batch.
    pub(super) buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl<'a> Projector<'a> {
    pub(super) fn new(
        gpu: &Gpu,
        cameras: Cameras<'a>,
        meshes: Meshes,
        resolution: u32,
        plan: &Plan,
    ) -> Self {
        let usage = Usage::STORAGE | Usage::COPY_DST;
        let buffer = gpu.buffer("cameras", plan.cameras_bytes(), usage);
        let [items, depth] =
            [ITEMS, DEPTH].map(|format| texture(gpu, resolution, plan.rows, format));
        let layers = (0..plan.rows).map(|layer| Layer::new(&items, &depth, layer)).collect();
        let group = bind_group(gpu, &gpu.pipelines().cameras, [buffer.as_entire_binding()]);
        Self { cameras, meshes, resolution, items, layers, buffer, group }
    }

    /// Encodes the item buffers of some patches, one a layer.
    pub(super) fn project(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, ids: &[PatchId]) {
        let n = self.resolution;
        let cameras: Vec<Camera> = ids.iter().flat_map(|&id| self.cameras.of(id)).collect();
        gpu.queue().write_buffer(&self.buffer, 0, bytemuck::cast_slice(&cameras));
        let (size, half) = (n as f32, (n / 2) as f32);
        let faces = [0.0, 1.0, 1.5, 2.0, 2.5]
            .map(|line| [0.0, line * size, size, if line == 0.0 { size } else { half }]);
        let pipelines = gpu.pipelines();
        for ((layer, &id), camera) in self.layers.iter().zip(ids).zip((0..).step_by(5)) {
            let mut pass = layer.begin(encoder);
            pass.set_bind_group(0, &self.group, &[]);
            let own = self.cameras.own(id);
            if let Some(patches) = &self.meshes.patches {
                pass.set_pipeline(&pipelines.patches);
                patches.draw(&mut pass, own, camera, &faces);
                pass.set_pipeline(&pipelines.backing);
            } else {
                pass.set_pipeline(&pipelines.sources);
            }
            self.meshes.sources.draw(&mut pass, own, camera, &faces);
        }
    }
}

/// Where one hemicube is drawn. Every one has a layer of its own: in another place of the same
/// layer corners would be rounded otherwise, and rows would depend on how they are grouped.
#[derive(Debug)]
struct Layer {
    items: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl Layer {
    /// Of a texture of items and one of depths.
    fn new(items: &wgpu::Texture, depth: &wgpu::Texture, layer: u32) -> Self {
        let [items, depth] = [items, depth].map(|texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        });
        Self { items, depth }
    }

    /// Begins to draw on emptiness.
    fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        let nothing = wgpu::Color { r: NOTHING.into(), ..wgpu::Color::TRANSPARENT };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("item buffer"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.items,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(nothing),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }
}

/// A texture with a layer for the item buffer or the depths of each row.
fn texture(gpu: &Gpu, n: u32, rows: u32, format: wgpu::TextureFormat) -> wgpu::Texture {
    let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let read = if format == ITEMS { read } else { wgpu::TextureUsages::empty() };
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("hemicubes"),
        size: wgpu::Extent3d { width: n, height: 3 * n, depth_or_array_layers: rows },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | read,
        view_formats: &[],
    })
}
