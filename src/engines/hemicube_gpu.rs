//! Hemicubes on the graphics device: the twin of [`Hemicube`](super::Hemicube).
//!
//! Kulyasov & Nikulin (2012), algorithm 1, step by step; each step names the file that takes it:
//!
//! 1. Every item has a number of its own: patches their id, source triangles follow
//!    (`mesh.rs`).
//! 2. A hemicube stands on the centre of each patch of a batch; its five cameras look through the
//!    top and the upper halves of the sides ([`Frame::on_surface`], as on the CPU).
//! 3. The graphics pipeline projects all items on the five faces with a depth buffer; under each
//!    pixel the number of the nearest stays: the item buffer (`project.wgsl`). Every hemicube of a
//!    batch has a layer of one texture.
//! 4. A compute pass adds the delta form factor of each pixel to the sum of the patch it sees
//!    (`count.wgsl`).
//! 5. Sums above zero are a row of form factors; a second compute pass gathers them (`compact.wgsl`),
//!    and they are read while the next batch is computed.
//!
//! # Deviations
//! - Delta form factors are the fixed-point numbers of [`DeltaFormFactors`]: sums are exact and do not
//!   depend on order, so that the same item buffer gives the same row on any device.
//! - [`Draw::Sources`] projects source triangles; the counting pass finds the patch from the pixel's
//!   ray. Fragment shaders do nothing but keep a number.
//! - [`Draw::Patches`] projects all patches, each visible from its own side, and the source
//!   triangles a little behind: those show backs that have no patch, and close the cracks between
//!   patches of different sizes, whose corners lie beside each other's edges.
//! - The patch's own source triangle is left out of what is drawn, by its number.
//!
//! # Limits
//! What is nearer to a hemicube's centre than 2⁻¹⁸ of the scene's radius, along a face's axis, is not
//! seen. Graphics pipelines round corners to fractions of a pixel (1/256 as a rule): rows differ
//! from the CPU's where a pixel's centre lies that close to an edge.

mod device;
mod mesh;
mod pipelines;
mod plan;
mod tables;

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use wgpu::BufferUsages as Usage;

pub use device::{AdapterReport, Gpu, GpuError};

use self::device::PATIENCE;
use self::mesh::Mesh;
use self::plan::{Plan, SLOTS};
use self::tables::Tables;
use super::delta::DeltaFormFactors;
use super::engine::{Engine, EngineError};
use super::hemicube::{Draw, HemicubeOptions};
use crate::form_factors::{ONE, Row, Weights};
use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, TriangleId};
use crate::visibility::{Frame, NOTHING, turn};

/// What a pixel of an item buffer sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// Emptiness.
    Nothing,
    /// A patch.
    Patch(PatchId),
    /// Some point of a source triangle.
    Source(TriangleId),
}

/// The hemicube engine on the graphics device. Once the device has failed, every call fails.
#[derive(Debug)]
pub struct HemicubeGpu<'a> {
    geometry: &'a Geometry,
    patches: &'a Patches,
    gpu: Gpu,
    resolution: u32,
    /// Origin of single-precision coordinates.
    centre: DVec3,
    /// Distance of the near plane in metres.
    near: f32,
    sources: Mesh,
    /// The patches, if they are drawn.
    patch_mesh: Option<Mesh>,
    plan: Plan,
    /// Whether some cells, and some patches, do not own all their pixels.
    owned: [u32; 2],
    /// Item buffers, one a layer.
    items: wgpu::Texture,
    layers: Vec<Layer>,
    cameras: wgpu::Buffer,
    job: wgpu::Buffer,
    sums: wgpu::Buffer,
    project_group: wgpu::BindGroup,
    count_group: wgpu::BindGroup,
    slots: [Slot; SLOTS],
    /// Entries a row that are read at once; a batch that has more is read in two parts.
    expected: u64,
    seconds: GpuSeconds,
}

/// What the host did while rows were made, in wall-clock seconds: if it waited, the device sets the
/// pace.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct GpuSeconds {
    /// Telling the device what to do; one in software does part of it meanwhile.
    pub encoding: f64,
    /// Waiting for the device.
    pub waiting: f64,
    /// Moving what it made into rows.
    pub reading: f64,
}

/// Where one hemicube is drawn. Every one has a layer of its own: in another place of the same layer
/// corners would be rounded otherwise, and rows would depend on how they are grouped.
#[derive(Debug)]
struct Layer {
    items: wgpu::TextureView,
    depth: wgpu::TextureView,
}

/// Where a batch leaves its rows.
#[derive(Debug)]
struct Slot {
    summary: wgpu::Buffer,
    entries: wgpu::Buffer,
    /// Summary and entries, for the host to read.
    reading: wgpu::Buffer,
    compact_group: wgpu::BindGroup,
}

/// Tells when a buffer can be read.
type Mapped = Receiver<Result<(), wgpu::BufferAsyncError>>;

/// A batch under way.
struct Batch {
    slot: usize,
    /// Which of the rows asked for.
    rows: Range<usize>,
    /// Which patches are counted.
    window: Range<u32>,
    submission: wgpu::SubmissionIndex,
    mapped: Mapped,
    /// Entries read.
    copied: u64,
}

/// One face of one hemicube: `Camera` of the shaders.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Camera {
    right: [f32; 4],
    up: [f32; 4],
    forward: [f32; 4],
    eye: [f32; 4],
}

/// `Job` of the compute shaders.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Job {
    resolution: u32,
    first_source: u32,
    first: u32,
    count: u32,
    stride: u32,
    owned: u32,
    looked: u32,
}

/// Distance of the near plane over the scene's radius: near enough for contacts, and well above the
/// rounding of single precision.
const NEAR: f64 = 1.0 / 262_144.0;

/// Invocations beside and below each other in a workgroup of the counting pass, and the pixels that
/// each sums.
const COUNT_TILE: u32 = 8;
const COUNT_RUN: u32 = 8;

/// Words of the summary before the rows', and of each row's.
const SUMMARY_WORDS: usize = 4;

impl<'a> HemicubeGpu<'a> {
    /// An engine on a device of its own that takes about `memory` bytes for rows under way.
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        options: HemicubeOptions,
        memory: u64,
    ) -> Result<Self, GpuError> {
        options.check()?;
        Self::on(&Gpu::open()?, geometry, patches, options, memory)
    }

    /// An engine on an open device.
    pub fn on(
        gpu: &Gpu,
        geometry: &'a Geometry,
        patches: &'a Patches,
        options: HemicubeOptions,
        memory: u64,
    ) -> Result<Self, GpuError> {
        options.check()?;
        gpu.check()?;
        let resolution = options.resolution as u32;
        let (low, high) = geometry.bounds().unwrap_or_default();
        let centre = 0.5 * (low + high);
        let radius = (0.5 * (high - low).length()).max(f64::from(f32::MIN_POSITIVE) / NEAR);

        let first_source = first_source(patches, options.draw);
        let tables = Tables::new(geometry, patches, centre);
        let owned = [!tables.owners.is_empty(), !tables.look_on.is_empty()].map(u32::from);
        let [triangles, owners, cuts, look_on] = [
            ("the table of source triangles (bytes)", bytemuck::cast_slice(&tables.sources)),
            ("the table of cells (bytes)", bytemuck::cast_slice(&tables.owners)),
            ("the table of contacts (bytes)", bytemuck::cast_slice(&tables.cuts)),
            ("the table of patches (bytes)", bytemuck::cast_slice(&tables.look_on)),
        ]
        .map(|(what, contents)| table(gpu, what, contents));
        let (triangles, owners, cuts, look_on) = (triangles?, owners?, cuts?, look_on?);
        let sources = Mesh::of_sources(gpu, geometry, centre, first_source)?;
        let patch_mesh = match options.draw {
            Draw::Sources => None,
            Draw::Patches => Some(Mesh::of_patches(gpu, geometry, patches, centre)?),
        };
        let drawn = sources.len() + patch_mesh.as_ref().map_or(0, Mesh::len);
        let n = patches.len() as u64;
        let plan = Plan::new(gpu.limits(), memory, resolution, n, drawn.into())?;

        let delta = DeltaFormFactors::new(options.resolution);
        let weights = [delta.top, delta.side].concat();
        let weights =
            gpu.upload("delta form factors", bytemuck::cast_slice(&weights), Usage::STORAGE);
        let cameras = gpu.buffer("cameras", plan.cameras_bytes(), Usage::STORAGE | Usage::COPY_DST);
        let job = gpu.buffer("job", size_of::<Job>() as u64, Usage::UNIFORM | Usage::COPY_DST);
        let sums = gpu.buffer("sums", plan.sums_bytes(), Usage::STORAGE | Usage::COPY_DST);
        let [items, depth] = [pipelines::ITEMS, pipelines::DEPTH]
            .map(|format| texture(gpu, resolution, plan.rows, format));
        let layers = (0..plan.rows).map(|layer| Layer::new(&items, &depth, layer)).collect();
        let all_items = items.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let pipelines = gpu.pipelines();
        let project_group = group(gpu, &pipelines.cameras, [cameras.as_entire_binding()]);
        let count_group = group(
            gpu,
            &pipelines.count.get_bind_group_layout(0),
            [
                job.as_entire_binding(),
                wgpu::BindingResource::TextureView(&all_items),
                cameras.as_entire_binding(),
                weights.as_entire_binding(),
                triangles.as_entire_binding(),
                sums.as_entire_binding(),
                owners.as_entire_binding(),
                cuts.as_entire_binding(),
                look_on.as_entire_binding(),
            ],
        );
        let slots = std::array::from_fn(|_| Slot::new(gpu, &plan, &job, &sums));
        gpu.check()?;
        Ok(Self {
            geometry,
            patches,
            gpu: gpu.clone(),
            resolution,
            centre,
            near: (radius * NEAR) as f32,
            sources,
            patch_mesh,
            plan,
            owned,
            items,
            layers,
            cameras,
            job,
            sums,
            project_group,
            count_group,
            slots,
            expected: 1024,
            seconds: GpuSeconds::default(),
        })
    }

    /// Which adapter it runs on.
    #[must_use]
    pub fn adapter(&self) -> &AdapterReport {
        self.gpu.adapter()
    }

    /// Where the host's time went, over all rows so far.
    #[must_use]
    pub fn seconds(&self) -> GpuSeconds {
        self.seconds
    }

    /// The item buffer of one hemicube: lines of as many pixels as the resolution, first all of the
    /// top, then of the sides +x, -x, +y, -y, from the lowest y up.
    pub fn items(&mut self, id: PatchId) -> Result<Vec<Item>, GpuError> {
        let n = self.resolution;
        let mut encoder = self.encoder();
        self.project(&mut encoder, &[id]);
        let stride = (4 * n).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(stride) * u64::from(3 * n);
        let reading = self.gpu.buffer("items", size, Usage::COPY_DST | Usage::MAP_READ);
        encoder.copy_texture_to_buffer(
            self.items.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &reading,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width: n, height: 3 * n, depth_or_array_layers: 1 },
        );
        let (submission, mapped) = self.submit(encoder, &reading, size)?;
        self.wait(submission, &mapped)?;
        let first_source = self.first_source();
        let solid: Vec<TriangleId> =
            self.geometry.ids().filter(|&t| self.geometry.is_solid(t)).collect();
        read(&reading, size, |words| {
            words
                .chunks(stride as usize / 4)
                .flat_map(|line| &line[..n as usize])
                .map(|&item| match item {
                    NOTHING => Item::Nothing,
                    item if item < first_source => Item::Patch(PatchId(item)),
                    item => Item::Source(solid[(item - first_source) as usize]),
                })
                .collect()
        })
    }

    fn draw(&self) -> Draw {
        if self.patch_mesh.is_some() { Draw::Patches } else { Draw::Sources }
    }

    fn first_source(&self) -> u32 {
        first_source(self.patches, self.draw())
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Makes all rows: while one batch is computed, the one before is read.
    fn make(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), GpuError> {
        self.gpu.check()?;
        // Several batches even for few rows, so that there is something to overlap.
        let step = (rows.len().div_ceil(2 * SLOTS)).clamp(8, self.plan.rows.max(8) as usize);
        let step = step.min(self.plan.rows as usize);
        let n = self.patches.len() as u32;
        let mut waiting = VecDeque::new();
        let mut slot = 0;
        for from in (0..rows.len()).step_by(step) {
            let range = from..rows.len().min(from + step);
            for first in (0..n).step_by(self.plan.window as usize) {
                if waiting.len() == SLOTS
                    && let Some(batch) = waiting.pop_front()
                {
                    self.collect(batch, out)?;
                }
                let window = first..n.min(first.saturating_add(self.plan.window));
                waiting.push_back(self.begin(slot, rows, range.clone(), window)?);
                slot = (slot + 1) % SLOTS;
            }
        }
        for batch in waiting {
            self.collect(batch, out)?;
        }
        Ok(())
    }

    /// Steps 2 to 5 of the algorithm for some rows and patches.
    fn begin(
        &mut self,
        slot: usize,
        ids: &[PatchId],
        rows: Range<usize>,
        window: Range<u32>,
    ) -> Result<Batch, GpuError> {
        let clock = Instant::now();
        let n = self.resolution;
        let job = Job {
            resolution: n,
            first_source: self.first_source(),
            first: window.start,
            count: window.end - window.start,
            stride: self.plan.stride(),
            owned: self.owned[0],
            looked: self.owned[1],
        };
        self.gpu.queue().write_buffer(&self.job, 0, bytemuck::bytes_of(&job));
        let mut encoder = self.encoder();
        self.project(&mut encoder, &ids[rows.clone()]);

        let count = rows.len() as u32;
        let at = &self.slots[slot];
        let used = u64::from(count) * u64::from(self.plan.stride()) * 4;
        encoder.clear_buffer(&self.sums, 0, Some(used));
        encoder.clear_buffer(&at.summary, 0, Some(16));
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.gpu.pipelines().count);
            pass.set_bind_group(0, &self.count_group, &[]);
            let (x, y) = (n.div_ceil(COUNT_TILE * COUNT_RUN), (3 * n).div_ceil(COUNT_TILE));
            pass.dispatch_workgroups(x, y, count);
            pass.set_pipeline(&self.gpu.pipelines().compact);
            pass.set_bind_group(0, &at.compact_group, &[]);
            pass.dispatch_workgroups(count, 1, 1);
        }
        let summary = summary_bytes(count);
        let capacity = u64::from(count) * u64::from(self.plan.capacity);
        let copied = (u64::from(count) * self.expected).min(capacity);
        encoder.copy_buffer_to_buffer(&at.summary, 0, &at.reading, 0, summary);
        encoder.copy_buffer_to_buffer(&at.entries, 0, &at.reading, summary, 8 * copied);
        let (submission, mapped) = self.submit(encoder, &at.reading, summary + 8 * copied)?;
        self.seconds.encoding += clock.elapsed().as_secs_f64();
        Ok(Batch { slot, rows, window, submission, mapped, copied })
    }

    /// Encodes step 3: the item buffers of some patches, one a layer.
    fn project(&self, encoder: &mut wgpu::CommandEncoder, ids: &[PatchId]) {
        let n = self.resolution;
        let cameras: Vec<Camera> = ids.iter().flat_map(|&id| self.cameras(id)).collect();
        self.gpu.queue().write_buffer(&self.cameras, 0, bytemuck::cast_slice(&cameras));
        let (size, half) = (n as f32, (n / 2) as f32);
        let faces = [0.0, 1.0, 1.5, 2.0, 2.5]
            .map(|line| [0.0, line * size, size, if line == 0.0 { size } else { half }]);
        let pipelines = self.gpu.pipelines();
        for ((layer, &id), camera) in self.layers.iter().zip(ids).zip((0..).step_by(5)) {
            let mut pass = layer.begin(encoder);
            pass.set_bind_group(0, &self.project_group, &[]);
            let own = self.patches.cell(id).triangle;
            if let Some(patches) = &self.patch_mesh {
                pass.set_pipeline(&pipelines.patches);
                patches.draw(&mut pass, own, camera, &faces);
                pass.set_pipeline(&pipelines.backing);
            } else {
                pass.set_pipeline(&pipelines.sources);
            }
            self.sources.draw(&mut pass, own, camera, &faces);
        }
    }

    /// The five cameras of a patch's hemicube.
    fn cameras(&self, id: PatchId) -> [Camera; 5] {
        let cell = self.patches.cell(id);
        let normal = self.geometry.normal(cell.triangle, cell.side);
        let frame = Frame::on_surface(self.patches.origin(id).position(self.geometry), normal);
        let eye = (frame.origin - self.centre).as_vec3().extend(self.near).to_array();
        let axes = frame.axes.map(|a| a.as_vec3());
        let turns = [turn::<0>, turn::<1>, turn::<2>, turn::<3>, turn::<4>];
        std::array::from_fn(|face| {
            // What each axis of the frame contributes to right, up and forward.
            let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(turns[face]);
            let axis = |k: usize| axes[0] * x[k] + axes[1] * y[k] + axes[2] * z[k];
            let (up, forward) = if face == 0 { (1.0, 0.0) } else { (2.0, -1.0) };
            Camera {
                right: axis(0).extend(0.0).to_array(),
                up: axis(1).extend(up).to_array(),
                forward: axis(2).extend(forward).to_array(),
                eye,
            }
        })
    }

    /// Submits what was encoded and has `reading` mapped when it is done.
    fn submit(
        &self,
        encoder: wgpu::CommandEncoder,
        reading: &wgpu::Buffer,
        size: u64,
    ) -> Result<(wgpu::SubmissionIndex, Mapped), GpuError> {
        let submission = self.gpu.queue().submit([encoder.finish()]);
        let (send, mapped) = channel();
        reading.map_async(wgpu::MapMode::Read, ..size, move |r| {
            // Nobody listens any more if another batch failed.
            let _ = send.send(r);
        });
        self.gpu.check()?;
        Ok((submission, mapped))
    }

    fn wait(&self, submission: wgpu::SubmissionIndex, mapped: &Mapped) -> Result<(), GpuError> {
        self.gpu.wait(submission)?;
        // Another engine's thread on the same device may be about to pass the message on.
        match mapped.recv_timeout(PATIENCE) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(e)) => Err(GpuError::Failed(e.to_string())),
            Err(e) => Err(GpuError::Failed(e.to_string())),
        }
    }

    /// Waits for a batch and moves its rows into `out`.
    fn collect(&mut self, mut batch: Batch, out: &mut [Row]) -> Result<(), GpuError> {
        let clock = Instant::now();
        self.wait(batch.submission.clone(), &batch.mapped)?;
        self.seconds.waiting += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let count = batch.rows.len() as u64;
        let summary = summary_bytes(count as u32);
        let at = &self.slots[batch.slot];
        let total = read(&at.reading, 16, |words| u64::from(words[0]))?;
        if total > batch.copied {
            at.reading.unmap();
            let (from, size) = (8 * batch.copied, 8 * (total - batch.copied));
            let mut encoder = self.encoder();
            encoder.copy_buffer_to_buffer(&at.entries, from, &at.reading, summary + from, size);
            (batch.submission, batch.mapped) =
                self.submit(encoder, &at.reading, summary + 8 * total)?;
            self.wait(batch.submission, &batch.mapped)?;
        }
        read(&at.reading, summary + 8 * total, |words| {
            let (head, entries) = words.split_at(summary as usize / 4);
            let rows = head[SUMMARY_WORDS..].par_chunks(SUMMARY_WORDS);
            rows.zip(&mut out[batch.rows]).for_each(|(head, row)| {
                let (from, len) = (2 * head[0] as usize, 2 * head[1] as usize);
                write(row, batch.window.start == 0, &entries[from..from + len], head[2], head[3]);
            });
        })?;
        // A quarter more than was seen, so that rows of the same kind fit.
        self.expected = self.expected.max((total * 5 / 4).div_ceil(count));
        at.reading.unmap();
        self.seconds.reading += clock.elapsed().as_secs_f64();
        Ok(())
    }
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

impl Slot {
    fn new(gpu: &Gpu, plan: &Plan, job: &wgpu::Buffer, sums: &wgpu::Buffer) -> Self {
        let summary_bytes = summary_bytes(plan.rows);
        let both = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let summary = gpu.buffer("summary", summary_bytes, both);
        let entries = gpu.buffer("entries", plan.entries_bytes(), both);
        let reading = gpu.buffer(
            "reading",
            summary_bytes + plan.entries_bytes(),
            Usage::COPY_DST | Usage::MAP_READ,
        );
        let compact_group = group(
            gpu,
            &gpu.pipelines().compact.get_bind_group_layout(0),
            [job, sums, &summary, &entries].map(wgpu::Buffer::as_entire_binding),
        );
        Self { summary, entries, reading, compact_group }
    }
}

impl Engine for HemicubeGpu<'_> {
    fn name(&self) -> &'static str {
        "hemicube"
    }

    fn device(&self) -> Option<String> {
        Some(self.adapter().to_string())
    }

    fn sees_from_centres(&self) -> bool {
        true
    }

    fn bytes(&self, _rows: usize) -> u64 {
        // What the host can see; the device's own memory may be the same.
        SLOTS as u64 * self.plan.entries_bytes()
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        self.make(rows, out).map_err(|e| EngineError::Device(e.to_string()))
    }
}

/// The item of the first source triangle: patches come before, if they are drawn.
fn first_source(patches: &Patches, draw: Draw) -> u32 {
    match draw {
        Draw::Sources => 0,
        Draw::Patches => patches.len() as u32,
    }
}

fn summary_bytes(rows: u32) -> u64 {
    4 * SUMMARY_WORDS as u64 * (1 + u64::from(rows))
}

/// Adds a row's entries; `anew` begins it.
fn write(row: &mut Row, anew: bool, entries: &[u32], environment: u32, back: u32) {
    let mut weights = match std::mem::take(&mut row.weights) {
        Weights::Fixed(weights) => weights,
        Weights::Each(_) | Weights::Equal { .. } => Vec::new(),
    };
    if anew {
        row.columns.clear();
        weights.clear();
        row.environment = f64::from(environment) / f64::from(ONE);
        row.back = f64::from(back) / f64::from(ONE);
        row.lost = 0.0;
    }
    let (entries, _) = entries.as_chunks();
    row.columns.extend(entries.iter().map(|&[column, _]| PatchId(column)));
    weights.extend(entries.iter().map(|&[_, weight]| weight));
    row.weights = Weights::Fixed(weights);
}

/// Reads the first bytes of a mapped buffer.
fn read<R>(buffer: &wgpu::Buffer, size: u64, f: impl FnOnce(&[u32]) -> R) -> Result<R, GpuError> {
    let failed = |e: String| GpuError::Failed(format!("reading back: {e}"));
    let view = buffer.get_mapped_range(..size).map_err(|e| failed(e.to_string()))?;
    Ok(f(bytemuck::try_cast_slice(&view).map_err(|e| failed(e.to_string()))?))
}

/// A table for the counting pass.
fn table(gpu: &Gpu, what: &'static str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
    let (limits, needed) = (gpu.limits(), contents.len() as u64);
    let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if needed > allowed {
        return Err(GpuError::Limit { what, needed, allowed });
    }
    Ok(gpu.upload(what, contents, Usage::STORAGE))
}

/// A texture with a layer for the item buffer or the depths of each row.
fn texture(gpu: &Gpu, n: u32, rows: u32, format: wgpu::TextureFormat) -> wgpu::Texture {
    let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let read = if format == pipelines::ITEMS { read } else { wgpu::TextureUsages::empty() };
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

fn group<const N: usize>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = resources
        .into_iter()
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn a_lost_device_is_an_error() {
        let Ok(gpu) = Gpu::open() else { return };
        let g = builtin::build("furnace").unwrap().geometry;
        let p = Patches::uniform(&g, 0.5).unwrap();
        let mut engine = HemicubeGpu::on(&gpu, &g, &p, HemicubeOptions::default(), 0).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        let mut rows = vec![Row::default(); ids.len()];
        engine.fill(&ids, &mut rows).unwrap();
        gpu.device().destroy();
        for _ in 0..2 {
            let error = engine.fill(&ids, &mut rows).unwrap_err().to_string();
            assert!(error.contains("lost"), "{error}");
        }
        assert!(HemicubeGpu::on(&gpu, &g, &p, HemicubeOptions::default(), 0).is_err());
    }
}
