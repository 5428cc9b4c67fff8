//! The graphics device: which adapter it is, what it can hold, and what went wrong on it.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde::Serialize;
use thiserror::Error;

use super::pipelines::Pipelines;
use crate::engines::HemicubeError;

/// Which adapter makes the hemicubes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AdapterReport {
    /// Its name, as its driver tells.
    pub name: String,
    /// The interface to it: `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// The driver, with its version where known.
    pub driver: String,
    /// Whether it is a program on the processor rather than a graphics card.
    pub is_software: bool,
}

impl fmt::Display for AdapterReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.backend)?;
        if self.is_software { f.write_str(", in software") } else { Ok(()) }
    }
}

/// Why hemicubes cannot be made on the graphics device.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GpuError {
    /// The options are wrong on any device.
    #[error(transparent)]
    Options(#[from] HemicubeError),
    /// There is no adapter.
    #[error("no graphics adapter was found (Vulkan, Metal or DirectX 12)")]
    NoAdapter,
    /// The adapter gives no device.
    #[error("the graphics adapter {adapter} cannot be used: {reason}")]
    Refused {
        /// Name of the adapter.
        adapter: String,
        /// What its driver says.
        reason: String,
    },
    /// Something is larger than the adapter allows.
    #[error("{what} needs {needed}, and the graphics adapter allows {allowed}")]
    Limit {
        /// What is too large.
        what: &'static str,
        /// How large it is.
        needed: u64,
        /// How large it may be.
        allowed: u64,
    },
    /// The memory of the device does not suffice.
    #[error("the graphics device has not enough memory")]
    OutOfMemory,
    /// The device is gone: reset, unplugged, or its driver failed.
    #[error("the graphics device was lost ({0})")]
    Lost(String),
    /// The device did not do as told.
    #[error("the graphics device failed: {0}")]
    Failed(String),
}

/// An open graphics device. Cheap to clone; several engines may share one.
#[derive(Debug, Clone)]
pub struct Gpu(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    limits: wgpu::Limits,
    report: AdapterReport,
    pipelines: Pipelines,
    /// The first thing that went wrong.
    fault: Arc<Mutex<Option<GpuError>>>,
}

/// A device that has not answered for so long is taken for lost.
pub(super) const PATIENCE: Duration = Duration::from_secs(300);

/// What an adapter must be able to do; everything made for graphics in the last ten years is.
const NEEDS: wgpu::DownlevelFlags = wgpu::DownlevelFlags::COMPUTE_SHADERS
    .union(wgpu::DownlevelFlags::VERTEX_STORAGE)
    .union(wgpu::DownlevelFlags::BASE_VERTEX)
    .union(wgpu::DownlevelFlags::FULL_DRAW_INDEX_UINT32);

impl Gpu {
    /// Opens the most able adapter: graphics cards before what is built into a processor, and that
    /// before software.
    pub fn open() -> Result<Self, GpuError> {
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
        let adapter = adapters
            .into_iter()
            .filter(|a| a.get_downlevel_capabilities().flags.contains(NEEDS))
            .min_by_key(|a| rank(a.get_info().device_type))
            .ok_or(GpuError::NoAdapter)?;
        let info = adapter.get_info();
        // Sizes as large as there are; of the rest, what every adapter has.
        let (has, common) = (adapter.limits(), wgpu::Limits::defaults());
        let required_limits = wgpu::Limits {
            max_buffer_size: has.max_buffer_size,
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            ..common.or_worse_values_from(&has)
        };
        let report = AdapterReport {
            name: info.name.clone(),
            backend: info.backend.to_str().to_owned(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            is_software: info.device_type == wgpu::DeviceType::Cpu,
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hemicube"),
            required_features: wgpu::Features::empty(),
            required_limits,
            ..Default::default()
        }))
        .map_err(|e| GpuError::Refused { adapter: info.name, reason: e.to_string() })?;

        let fault = Arc::new(Mutex::new(None));
        let first = fault.clone();
        device.on_uncaptured_error(Arc::new(move |e| note(&first, from_wgpu(e))));
        let first = fault.clone();
        device.set_device_lost_callback(move |reason, message| {
            note(&first, GpuError::Lost(format!("{reason:?}: {message}").trim_end().to_owned()));
        });
        let limits = device.limits();
        let pipelines = Pipelines::new(&device);
        let me = Self(Arc::new(Inner { device, queue, limits, report, pipelines, fault }));
        me.check()?;
        Ok(me)
    }

    /// Which adapter it is.
    #[must_use]
    pub fn adapter(&self) -> &AdapterReport {
        &self.0.report
    }

    pub(super) fn device(&self) -> &wgpu::Device {
        &self.0.device
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.0.queue
    }

    pub(super) fn limits(&self) -> &wgpu::Limits {
        &self.0.limits
    }

    pub(super) fn pipelines(&self) -> &Pipelines {
        &self.0.pipelines
    }

    /// An error if anything went wrong on the device so far.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        let fault = self.0.fault.lock().unwrap_or_else(PoisonError::into_inner);
        fault.clone().map_or(Ok(()), Err)
    }

    /// Waits until the device has done what was submitted.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.check()?;
        let poll =
            wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(PATIENCE) };
        // wgpu panics here, and only here, when the driver reports a lost device.
        let polled = catch_unwind(AssertUnwindSafe(|| self.0.device.poll(poll)));
        self.check()?;
        let lost = match polled {
            Ok(Ok(_)) => return Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => "it does not answer",
            Ok(Err(wgpu::PollError::WrongSubmissionIndex(..))) => "it takes no more work",
            Err(_) => "its driver gave it up",
        };
        note(&self.0.fault, GpuError::Lost(lost.into()));
        self.check()
    }

    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// A buffer with the given contents, at least 256 bytes long.
    pub(super) fn upload(
        &self,
        label: &str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        let buffer = self.buffer(label, contents.len() as u64, usage);
        if !contents.is_empty() {
            self.0.queue.write_buffer(&buffer, 0, contents);
        }
        buffer
    }

    /// A buffer of zeros, at least 256 bytes long.
    pub(super) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.0.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.next_multiple_of(16).max(256),
            usage,
            mapped_at_creation: false,
        })
    }
}

/// Resources bound in their order.
pub(super) fn bind_group<const N: usize>(
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

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::VirtualGpu => 1,
        wgpu::DeviceType::IntegratedGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// Keeps the first fault, but for the loss of the device, which explains others.
fn note(fault: &Mutex<Option<GpuError>>, error: GpuError) {
    let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
    let lost = |e: &GpuError| matches!(e, GpuError::Lost(_));
    if fault.as_ref().is_none_or(|first| lost(&error) && !lost(first)) {
        *fault = Some(error);
    }
}

fn from_wgpu(error: wgpu::Error) -> GpuError {
    match error {
        wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory,
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            GpuError::Failed(description)
        }
    }
}
