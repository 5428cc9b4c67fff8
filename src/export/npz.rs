//! Sparse matrices as SciPy stores them (`scipy.sparse.save_npz`): a zip archive of arrays.
//!
//! `indptr`, `indices`, `data`, `shape` and `format` are compressed sparse rows, which
//! `scipy.sparse.load_npz` reads. Beside them lie, for `numpy.load`, `area` (m²), `environment` and
//! `back` (shares of each row), `names` where rows are lumped, and `hemicube`: what the matrix is
//! of, as JSON, with a checksum of the arrays.

pub(super) mod read;
#[cfg(test)]
mod tests;

use std::io::{self, Seek, Write};
use std::path::Path;

use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

use super::ExportError;
use super::archive_writer::{LARGE, Writer};
use super::npy::{encode_rows, header, kind, push};
use super::target::write_with;
use crate::matrix::{Origin, Rows, SurfaceRow};
use crate::progress::Progress;

/// Columns shrink to a fraction even so; compressing harder takes longer than making the rows.
const LEVEL: i64 = 1;

/// The array that says what the matrix is of.
const ORIGIN: &str = "hemicube";

/// The integers of columns and starts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Index {
    Int32,
    Int64,
}

impl Index {
    /// Wide enough for so many.
    fn for_counts(rows: u64, entries: u64) -> Self {
        if rows.max(entries) <= i32::MAX as u64 { Self::Int32 } else { Self::Int64 }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::Int32 => "<i4",
            Self::Int64 => "<i8",
        }
    }

    fn push(self, bytes: &mut Vec<u8>, value: u64) {
        match self {
            Self::Int32 => bytes.extend((value as i32).to_le_bytes()),
            Self::Int64 => bytes.extend((value as i64).to_le_bytes()),
        }
    }
}

/// Writes a matrix with what its rows stand for. Advances `progress` by three a row.
pub fn write_npz<R: Rows + ?Sized>(
    path: &Path,
    rows: &R,
    surfaces: &[SurfaceRow],
    origin: &Origin,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let index = Index::for_counts(rows.len() as u64, rows.entries());
    write_with(path, |file| write_as(file, rows, surfaces, origin, index, progress))
}

fn write_as<R: Rows + ?Sized>(
    file: &mut (impl Write + Seek),
    rows: &R,
    surfaces: &[SurfaceRow],
    origin: &Origin,
    index: Index,
    progress: &dyn Progress,
) -> io::Result<()> {
    let (n, entries, precision) = (rows.len(), rows.entries(), rows.precision());
    let mut zip = Writer::new(file);
    let options = |bytes: u64| {
        SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(LEVEL))
            .large_file(bytes > LARGE)
    };
    let small = |zip: &mut Writer<_>, name: &str, kind: &str, shape: &str, bytes: &[u8]| {
        zip.start(&format!("{name}.npy"), options(bytes.len() as u64))?;
        zip.write_all(&header(kind, shape))?;
        zip.write_all(bytes)
    };
    small(&mut zip, "format", "|S3", "()", b"csr")?;
    let shape = [n as u64; 2].map(u64::to_le_bytes).concat();
    small(&mut zip, "shape", "<i8", "(2,)", &shape)?;

    zip.start("indptr.npy", options(8 * n as u64))?;
    zip.write_all(&header(index.kind(), &format!("({},)", n + 1)))?;
    let (mut starts, mut end) = (Vec::new(), 0);
    index.push(&mut starts, 0);
    let mut counts = Vec::new();
    encode_rows(rows, &mut counts, progress, |_, columns, _, bytes| {
        bytes.extend((columns.len() as u32).to_le_bytes());
    })?;
    for count in counts.as_chunks::<4>().0 {
        end += u64::from(u32::from_le_bytes(*count));
        index.push(&mut starts, end);
    }
    zip.write_all(&starts)?;

    zip.start("indices.npy", options(8 * entries))?;
    zip.write_all(&header(index.kind(), &format!("({entries},)")))?;
    encode_rows(rows, &mut zip, progress, |_, columns, _, bytes| {
        columns.iter().for_each(|&j| index.push(bytes, u64::from(j)));
    })?;
    // Fractions hardly shrink at all.
    let stored = options(8 * entries).compression_method(CompressionMethod::Stored);
    zip.start("data.npy", stored.compression_level(None))?;
    zip.write_all(&header(kind(precision), &format!("({entries},)")))?;
    encode_rows(rows, &mut zip, progress, |_, _, values, bytes| {
        values.iter().for_each(|&f| push(bytes, f, precision));
    })?;

    let doubles = |value: &dyn Fn(usize) -> f64| -> Vec<u8> {
        (0..n).flat_map(|i| value(i).to_le_bytes()).collect()
    };
    let one = format!("({n},)");
    small(&mut zip, "area", "<f8", &one, &doubles(&|i| surfaces[i].area))?;
    small(&mut zip, "environment", "<f8", &one, &doubles(&|i| rows.rest(i)[0]))?;
    small(&mut zip, "back", "<f8", &one, &doubles(&|i| rows.rest(i)[1]))?;
    let origin = Origin { checksum: zip.checksum(), ..origin.clone() };
    if origin.lumped {
        let names: Vec<&str> = surfaces.iter().map(|s| s.name.as_str()).collect();
        let (kind, bytes) = unicode(&names);
        small(&mut zip, "names", &kind, &one, &bytes)?;
    }
    let origin = serde_json::to_vec(&origin)?;
    small(&mut zip, ORIGIN, &format!("|S{}", origin.len()), "()", &origin)?;
    zip.finish()
}

/// Strings as an array of Unicode of one length.
fn unicode(names: &[&str]) -> (String, Vec<u8>) {
    let longest = names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(1);
    let padded = |name: &&str| {
        let chars = name.chars().map(u32::from);
        chars
            .chain(std::iter::repeat(0))
            .take(longest)
            .flat_map(u32::to_le_bytes)
            .collect::<Vec<_>>()
    };
    (format!("<U{longest}"), names.iter().flat_map(padded).collect())
}
