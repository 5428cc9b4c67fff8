//! How much is done at a time: within the limits of the adapter and the memory allowed.

use super::device::GpuError;

/// What a submission holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Plan {
    /// Rows at most.
    pub(super) rows: u32,
    /// Patches counted at a time; if there are more, hemicubes are made and counted repeatedly.
    pub(super) window: u32,
    /// Entries that a row may have.
    pub(super) capacity: u32,
}

/// Submissions under way: while one is computed, the one before is read.
pub(super) const SLOTS: usize = 2;

/// More rows in a submission gain nothing and take memory.
const MAX_ROWS: u64 = 64;

/// A submission projects about so many triangles at most: systems reset devices that are busy for
/// seconds.
const MAX_TRIANGLES: u64 = 1 << 27;

/// Bytes of a sum, of an entry and of a row's five cameras.
const SUM: u64 = 4;
const ENTRY: u64 = 8;
const CAMERAS: u64 = 5 * 64;

impl Plan {
    /// For hemicubes of `resolution` that project `triangles` and count `patches`, in about
    /// `memory` bytes; one row is always made, in as many windows as it takes.
    pub(super) fn new(
        limits: &wgpu::Limits,
        memory: u64,
        resolution: u32,
        patches: u64,
        triangles: u64,
    ) -> Result<Self, GpuError> {
        let (width, height) = (resolution, 3 * resolution);
        let side = limits.max_texture_dimension_2d;
        if height > side {
            return Err(GpuError::Limit {
                what: "a hemicube (lines of pixels)",
                needed: height.into(),
                allowed: side.into(),
            });
        }
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let window = patches.min(binding / SUM - 4).min((memory / 2 / SUM).max(1024)).max(1);
        let pixels = u64::from(width) * u64::from(height);
        let capacity = window.min(pixels);
        let sums = (window + 2) * SUM;
        let entries = capacity * ENTRY;
        // Items and depth of each pixel; entries on the device and in reading.
        let row = 8 * pixels + sums + CAMERAS + 2 * SLOTS as u64 * entries;
        let rows = (memory / row)
            .min(MAX_ROWS)
            .min(MAX_TRIANGLES / (5 * triangles.max(1)))
            .min(binding / sums)
            // The summary of all rows is read together with the entries.
            .min((binding - 4096) / entries)
            .min(limits.max_texture_array_layers.into())
            .min(limits.max_compute_workgroups_per_dimension.into())
            .max(1);
        Ok(Self { rows: rows as u32, window: window as u32, capacity: capacity as u32 })
    }

    /// Sums of a row: patches, the environment, backs.
    pub(super) fn stride(&self) -> u32 {
        self.window + 2
    }

    /// Bytes of the sums of all rows.
    pub(super) fn sums_bytes(&self) -> u64 {
        u64::from(self.rows) * u64::from(self.stride()) * SUM
    }

    /// Bytes of the entries of all rows.
    pub(super) fn entries_bytes(&self) -> u64 {
        u64::from(self.rows) * u64::from(self.capacity) * ENTRY
    }

    /// Bytes of the cameras of all rows.
    pub(super) fn cameras_bytes(&self) -> u64 {
        u64::from(self.rows) * CAMERAS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_stay_within_limits() {
        for limits in [wgpu::Limits::downlevel_defaults(), wgpu::Limits::defaults()] {
            for memory in [0, 1 << 20, 1 << 28, 1 << 34] {
                for patches in [0, 1, 5_000, 1 << 20, 1 << 30] {
                    for resolution in [16, 128, 512] {
                        let p = Plan::new(&limits, memory, resolution, patches, 1 << 14).unwrap();
                        assert!(p.rows <= limits.max_texture_array_layers);
                        assert!(p.rows >= 1 && p.window >= 1 && p.capacity >= 1);
                        let largest = p.sums_bytes().max(p.entries_bytes()).max(p.cameras_bytes());
                        assert!(largest <= limits.max_storage_buffer_binding_size, "{p:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_texture_too_small_for_a_hemicube_is_refused() {
        let limits = wgpu::Limits::downlevel_defaults();
        let e = Plan::new(&limits, 1 << 28, 1024, 100, 100).unwrap_err();
        assert_eq!(
            e.to_string(),
            "a hemicube (lines of pixels) needs 3072, and the graphics adapter allows 2048"
        );
    }
}
