//! Hemicubes on the graphics device: the twin of [`Hemicube`](super::Hemicube).
//!
//! Kulyasov & Nikulin (2012), algorithm 1, step by step; each step names the file that takes it:
//!
//! 1. Every item has a number of its own: patches their id, source triangles follow (`mesh.rs`).
//! 2. A hemicube stands on the centre of each patch of a batch; its five cameras look through the
//!    top and the upper halves of the sides (`camera.rs`), as on the CPU.
//! 3. The graphics pipeline projects all items on the five faces with a depth buffer; under each
//!    pixel the number of the nearest stays: the item buffer (`projector.rs`, `project.wgsl`).
//!    Every hemicube of a batch has a layer of one texture.
//! 4. A compute pass adds the delta form factor of each pixel to the sum of the patch it sees
//!    (`counter.rs`, `count.wgsl`, and `tables.rs` that it looks up).
//! 5. Sums above zero are a row of form factors; a second compute pass gathers them
//!    (`compact.wgsl`), and they are read while the next batch is computed (`readback.rs`; how much
//!    at a time is up to `plan.rs`).
//!
//! # Deviations
//! - Delta form factors are the fixed-point numbers of
//!   [`DeltaFormFactors`](super::delta::DeltaFormFactors): sums are exact and do not depend on
//!   order, so that the same item buffer gives the same row on any device.
//! - [`Draw::Sources`](super::Draw::Sources) projects source triangles; the counting pass finds the
//!   patch from the pixel's ray. Fragment shaders do nothing but keep a number.
//! - [`Draw::Patches`](super::Draw::Patches) projects all patches, each visible from its own side,
//!   and the source triangles a little behind: those show backs that have no patch, and close the
//!   cracks between patches of different sizes, whose corners lie beside each other's edges.
//! - The patch's own source triangle is left out of what is drawn, by its number.
//!
//! # Limits
//! What is nearer to a hemicube's centre than 2⁻¹⁸ of the scene's radius, along a face's axis, is
//! not seen. Graphics pipelines round corners to fractions of a pixel (1/256 as a rule): rows
//! differ from the CPU's where a pixel's centre lies that close to an edge.

mod camera;
mod counter;
mod device;
mod mesh;
mod pipelines;
mod plan;
mod projector;
mod readback;
mod tables;

use std::collections::VecDeque;
use std::ops::Range;
use std::time::Instant;

use serde::Serialize;
use wgpu::BufferUsages as Usage;

pub use device::{AdapterReport, Gpu, GpuError};

use self::camera::Cameras;
use self::counter::{Batch, Counter};
use self::mesh::Meshes;
use self::plan::{Plan, SLOTS};
use self::projector::Projector;
use self::readback::{read, submit};
use self::tables::{DeviceTables, Tables};
use super::engine::{Engine, EngineError};
use super::hemicube::HemicubeOptions;
use crate::form_factors::Row;
use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, TriangleId};
use crate::visibility::NOTHING;

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
    gpu: Gpu,
    projector: Projector<'a>,
    counter: Counter,
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
        let cameras = Cameras::new(geometry, patches);
        let centre = cameras.centre;
        let tables = DeviceTables::new(gpu, &Tables::new(geometry, patches, centre))?;
        let meshes = Meshes::new(gpu, geometry, patches, centre, options.draw)?;
        let (n, drawn) = (patches.len() as u64, meshes.len().into());
        let plan = Plan::new(gpu.limits(), memory, resolution, n, drawn)?;
        let projector = Projector::new(gpu, cameras, meshes, resolution, &plan);
        let counter = Counter::new(gpu, &projector, &tables, plan);
        gpu.check()?;
        Ok(Self { gpu: gpu.clone(), projector, counter, seconds: GpuSeconds::default() })
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
        let Projector { cameras, meshes, resolution: n, items, .. } = &self.projector;
        let (n, geometry) = (*n, cameras.geometry);
        let mut encoder = self.gpu.encoder();
        self.projector.project(&self.gpu, &mut encoder, &[id]);
        let stride = (4 * n).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(stride) * u64::from(3 * n);
        let reading = self.gpu.buffer("items", size, Usage::COPY_DST | Usage::MAP_READ);
        encoder.copy_texture_to_buffer(
            items.as_image_copy(),
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
        submit(&self.gpu, encoder, &reading, size)?.wait(&self.gpu)?;
        let first_source = meshes.first_source;
        let solid: Vec<TriangleId> = geometry.ids().filter(|&t| geometry.is_solid(t)).collect();
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

    /// Makes all rows: while one batch is computed, the one before is read.
    fn make(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), GpuError> {
        self.gpu.check()?;
        // Several batches even for few rows, so that there is something to overlap.
        let step =
            (rows.len().div_ceil(2 * SLOTS)).clamp(8, self.counter.plan.rows.max(8) as usize);
        let step = step.min(self.counter.plan.rows as usize);
        let n = self.projector.cameras.patches.len() as u32;
        let mut waiting = VecDeque::new();
        let mut slot = 0;
        for from in (0..rows.len()).step_by(step) {
            let range = from..rows.len().min(from + step);
            for first in (0..n).step_by(self.counter.plan.window as usize) {
                if waiting.len() == SLOTS
                    && let Some(batch) = waiting.pop_front()
                {
                    self.collect(batch, out)?;
                }
                let window = first..n.min(first.saturating_add(self.counter.plan.window));
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
        let mut encoder = self.gpu.encoder();
        self.projector.project(&self.gpu, &mut encoder, &ids[rows.clone()]);
        let batch = self.counter.count(&self.gpu, encoder, slot, rows, window)?;
        self.seconds.encoding += clock.elapsed().as_secs_f64();
        Ok(batch)
    }

    /// Waits for a batch and moves its rows into `out`.
    fn collect(&mut self, batch: Batch, out: &mut [Row]) -> Result<(), GpuError> {
        let clock = Instant::now();
        batch.pending.wait(&self.gpu)?;
        self.seconds.waiting += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        self.counter.collect(&self.gpu, batch, out)?;
        self.seconds.reading += clock.elapsed().as_secs_f64();
        Ok(())
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
        SLOTS as u64 * self.counter.plan.entries_bytes()
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        self.make(rows, out).map_err(|e| EngineError::Device(e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    #[allow(clippy::print_stderr, reason = "says what is skipped")]
    fn a_lost_device_is_an_error() {
        let gpu = match Gpu::open() {
            Ok(gpu) => gpu,
            Err(e) if std::env::var("HEMICUBE_REQUIRE_GPU").is_ok_and(|v| v == "1") => {
                panic!("HEMICUBE_REQUIRE_GPU=1, but: {e}")
            }
            Err(e) => {
                eprintln!("SKIPPED, no graphics device: {e}");
                return;
            }
        };
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
