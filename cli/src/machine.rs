//! What the system tells about memory and disks.

use std::fs;
use std::path::Path;

/// Bytes of memory that are free for use; a cautious guess where the system does not tell.
pub fn available_memory() -> u64 {
    const GUESS: u64 = 4 << 30;
    kib("/proc/meminfo", "MemAvailable:").map_or(GUESS, |k| k << 10)
}

/// Largest resident memory of this process in bytes, where the system tells.
pub fn peak_memory() -> Option<u64> {
    kib("/proc/self/status", "VmHWM:").map(|k| k << 10)
}

/// Bytes that are free on the disk of a folder, where the system tells.
#[cfg(unix)]
pub fn free_disk(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// Bytes that are free on the disk of a folder, where the system tells.
#[cfg(not(unix))]
pub fn free_disk(_: &Path) -> Option<u64> {
    None
}

fn kib(file: &str, key: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find(|l| l.starts_with(key))?;
    line[key.len()..].trim().trim_end_matches(" kB").trim().parse().ok()
}
