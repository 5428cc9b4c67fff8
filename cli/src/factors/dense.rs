//! Whether a matrix would take less memory as a dense array.

use std::path::Path;

use hemicube::matrix::{NpzReport, Precision, Rows};
use hemicube::units::Bytes;

/// What the .npz at `path` takes, and what a dense array would; `None` of what is no file.
pub fn compare(path: &Path, rows: &dyn Rows) -> Option<NpzReport> {
    let file = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
    let (n, entries) = (rows.len() as u64, rows.entries());
    let number = match rows.precision() {
        Precision::Single => 4,
        Precision::Double => 8,
    };
    // SciPy has one width for columns and starts.
    let index = if n.max(entries) <= i32::MAX as u64 { 4 } else { 8 };
    Some(NpzReport {
        file_bytes: file.len(),
        read_bytes: entries * (number + index) + (n + 1) * index,
        dense_bytes: n * n * number,
    })
}

/// What to say of a file that takes much more memory than a dense array.
pub fn note(path: &Path, npz: &NpzReport) -> Option<String> {
    /// Less memory is not worth a word.
    const WORTH: u64 = 256 << 20;
    /// Nor is a smaller part of it saved.
    const PART: u64 = 10;
    let saved = npz.read_bytes.saturating_sub(npz.dense_bytes);
    (npz.read_bytes >= WORTH && saved >= npz.read_bytes / PART).then(|| {
        format!(
            "most pairs have a form factor: {} takes {} of memory once read, and the dense {} \
             would take {} ({} on disk instead of {})",
            path.display(),
            Bytes(npz.read_bytes),
            path.with_extension("npy").display(),
            Bytes(npz.dense_bytes),
            Bytes(npz.dense_bytes),
            Bytes(npz.file_bytes)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_saves_much_memory_is_said() {
        const MIB: u64 = 1 << 20;
        let said = |read: u64, dense: u64| {
            let npz = NpzReport { file_bytes: 390 * MIB, read_bytes: read, dense_bytes: dense };
            note(Path::new("out/F.npz"), &npz)
        };
        let text = said(763 * MIB, 382 * MIB).unwrap_or_default();
        for part in [
            "out/F.npz takes 763 MiB of memory once read",
            "the dense out/F.npy would take 382 MiB (382 MiB on disk instead of 390 MiB)",
        ] {
            assert!(text.contains(part), "{text}");
        }
        assert_eq!(said(400 * MIB, 700 * MIB), None, "mostly zeros");
        assert_eq!(said(400 * MIB, 390 * MIB), None, "hardly less");
        assert_eq!(said(200 * MIB, 100 * MIB), None, "hardly anything");
    }
}
