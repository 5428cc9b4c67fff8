//! Steps 4 and 5: from item buffers to rows.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use wgpu::BufferUsages as Usage;

use super::device::{Gpu, GpuError, bind_group};
use super::plan::{Plan, SLOTS};
use super::projector::Projector;
use super::readback::{Pending, read, submit};
use super::tables::DeviceTables;
use crate::engines::delta::DeltaFormFactors;
use crate::form_factors::{ONE, Row, Weights};
use crate::patches::PatchId;

/// Sums delta form factors by patch, and reads the sums above zero.
#[derive(Debug)]
pub(super) struct Counter {
    pub(super) plan: Plan,
    resolution: u32,
    first_source: u32,
    owned: [u32; 2],
    job: wgpu::Buffer,
    sums: wgpu::Buffer,
    group: wgpu::BindGroup,
    slots: [Slot; SLOTS],
    /// Entries a row that are read at once; a batch that has more is read in two goes.
    expected: u64,
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

/// A batch under way.
pub(super) struct Batch {
    slot: usize,
    /// Which of the rows asked for.
    rows: Range<usize>,
    /// Which patches are counted.
    window: Range<u32>,
    pub(super) pending: Pending,
    /// Entries read.
    copied: u64,
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

/// Invocations beside and below each other in a workgroup of the counting pass, and the pixels that
/// each sums.
const COUNT_TILE: u32 = 8;
const COUNT_RUN: u32 = 8;

/// Words of the summary before the rows', and of each row's.
const SUMMARY_WORDS: usize = 4;

impl Counter {
    /// Of the item buffers that `projector` makes.
    pub(super) fn new(
        gpu: &Gpu,
        projector: &Projector<'_>,
        tables: &DeviceTables,
        plan: Plan,
    ) -> Self {
        let resolution = projector.resolution;
        let delta = DeltaFormFactors::new(resolution as usize);
        let weights = [delta.top, delta.side].concat();
        let weights =
            gpu.upload("delta form factors", bytemuck::cast_slice(&weights), Usage::STORAGE);
        let job = gpu.buffer("job", size_of::<Job>() as u64, Usage::UNIFORM | Usage::COPY_DST);
        let sums = gpu.buffer("sums", plan.sums_bytes(), Usage::STORAGE | Usage::COPY_DST);
        let all_items = projector.items.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let group = bind_group(
            gpu,
            &gpu.pipelines().count.get_bind_group_layout(0),
            [
                job.as_entire_binding(),
                wgpu::BindingResource::TextureView(&all_items),
                projector.buffer.as_entire_binding(),
                weights.as_entire_binding(),
                tables.sources.as_entire_binding(),
                sums.as_entire_binding(),
                tables.owners.as_entire_binding(),
                tables.cuts.as_entire_binding(),
                tables.look_on.as_entire_binding(),
            ],
        );
        let slots = std::array::from_fn(|_| Slot::new(gpu, &plan, &job, &sums));
        Self {
            plan,
            resolution,
            first_source: projector.meshes.first_source,
            owned: tables.owned,
            job,
            sums,
            group,
            slots,
            expected: 1024,
        }
    }

    /// Encodes both steps for the item buffers of some rows, after `encoder` has made them, and
    /// submits all that.
    pub(super) fn count(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        slot: usize,
        rows: Range<usize>,
        window: Range<u32>,
    ) -> Result<Batch, GpuError> {
        let n = self.resolution;
        let job = Job {
            resolution: n,
            first_source: self.first_source,
            first: window.start,
            count: window.end - window.start,
            stride: self.plan.stride(),
            owned: self.owned[0],
            looked: self.owned[1],
        };
        gpu.queue().write_buffer(&self.job, 0, bytemuck::bytes_of(&job));
        let count = rows.len() as u32;
        let at = &self.slots[slot];
        let used = u64::from(count) * u64::from(self.plan.stride()) * 4;
        encoder.clear_buffer(&self.sums, 0, Some(used));
        encoder.clear_buffer(&at.summary, 0, Some(16));
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&gpu.pipelines().count);
            pass.set_bind_group(0, &self.group, &[]);
            let (x, y) = (n.div_ceil(COUNT_TILE * COUNT_RUN), (3 * n).div_ceil(COUNT_TILE));
            pass.dispatch_workgroups(x, y, count);
            pass.set_pipeline(&gpu.pipelines().compact);
            pass.set_bind_group(0, &at.compact_group, &[]);
            pass.dispatch_workgroups(count, 1, 1);
        }
        let summary = summary_bytes(count);
        let capacity = u64::from(count) * u64::from(self.plan.capacity);
        let copied = (u64::from(count) * self.expected).min(capacity);
        encoder.copy_buffer_to_buffer(&at.summary, 0, &at.reading, 0, summary);
        encoder.copy_buffer_to_buffer(&at.entries, 0, &at.reading, summary, 8 * copied);
        let pending = submit(gpu, encoder, &at.reading, summary + 8 * copied)?;
        Ok(Batch { slot, rows, window, pending, copied })
    }

    /// Moves the rows of a batch that is done into `out`.
    pub(super) fn collect(
        &mut self,
        gpu: &Gpu,
        batch: Batch,
        out: &mut [Row],
    ) -> Result<(), GpuError> {
        let count = batch.rows.len() as u64;
        let summary = summary_bytes(count as u32);
        let at = &self.slots[batch.slot];
        let total = read(&at.reading, 16, |words| u64::from(words[0]))?;
        if total > batch.copied {
            at.reading.unmap();
            let (from, size) = (8 * batch.copied, 8 * (total - batch.copied));
            let mut encoder = gpu.encoder();
            encoder.copy_buffer_to_buffer(&at.entries, from, &at.reading, summary + from, size);
            submit(gpu, encoder, &at.reading, summary + 8 * total)?.wait(gpu)?;
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
        Ok(())
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
        let compact_group = bind_group(
            gpu,
            &gpu.pipelines().compact.get_bind_group_layout(0),
            [job, sums, &summary, &entries].map(wgpu::Buffer::as_entire_binding),
        );
        Self { summary, entries, reading, compact_group }
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
