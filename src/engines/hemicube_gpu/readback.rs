//! Submissions to the device, and reading what they made.

use std::sync::mpsc::{Receiver, channel};

use super::device::{Gpu, GpuError, PATIENCE};

/// A submission under way, after which a buffer can be read.
pub(super) struct Pending {
    submission: wgpu::SubmissionIndex,
    /// Tells when the buffer can be read.
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

/// Submits what was encoded and has `reading` mapped when it is done.
pub(super) fn submit(
    gpu: &Gpu,
    encoder: wgpu::CommandEncoder,
    reading: &wgpu::Buffer,
    size: u64,
) -> Result<Pending, GpuError> {
    let submission = gpu.queue().submit([encoder.finish()]);
    let (send, mapped) = channel();
    reading.map_async(wgpu::MapMode::Read, ..size, move |r| {
        // Nobody listens any more if another batch failed.
        let _ = send.send(r);
    });
    gpu.check()?;
    Ok(Pending { submission, mapped })
}

impl Pending {
    pub(super) fn wait(&self, gpu: &Gpu) -> Result<(), GpuError> {
        gpu.wait(self.submission.clone())?;
        // Another engine's thread on the same device may be about to pass the message on.
        match self.mapped.recv_timeout(PATIENCE) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(e)) => Err(GpuError::Failed(e.to_string())),
            Err(e) => Err(GpuError::Failed(e.to_string())),
        }
    }
}

/// Reads the first bytes of a mapped buffer.
pub(super) fn read<R>(
    buffer: &wgpu::Buffer,
    size: u64,
    f: impl FnOnce(&[u32]) -> R,
) -> Result<R, GpuError> {
    let failed = |e: String| GpuError::Failed(format!("reading back: {e}"));
    let view = buffer.get_mapped_range(..size).map_err(|e| failed(e.to_string()))?;
    Ok(f(bytemuck::try_cast_slice(&view).map_err(|e| failed(e.to_string()))?))
}
