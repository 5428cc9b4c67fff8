//! Reads back the matrices that `hemicube factors` wrote.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::ORIGIN;
use crate::export::archive::{Archive, Kind, float, integer, text};
use crate::matrix::{Origin, Stored};
use crate::progress::Cancelled;
use crate::scene::files::open_regular;
use crate::scene::shortened::abridged;
use crate::units::Bytes;

/// Why a file of form factors cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The system refused.
    #[error("{}: cannot be read ({source}); check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is something else, or broken.
    #[error("{}: {}", path.display(), abridged(problem))]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
    /// It would not fit in memory.
    #[error(
        "{}: its {what} take about {}, {} are allowed",
        path.display(), Bytes(*needed), Bytes(*allowed)
    )]
    Memory {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
        /// Bytes that reading takes.
        needed: u64,
        /// Bytes that are allowed.
        allowed: u64,
    },
}

/// Most bytes of text in an array.
const MOST_TEXT: usize = 1 << 20;

/// Bytes that a row and an entry take. Numbers are taken over as they are read.
const ROW_BYTES: u64 = 24;
const ENTRY_BYTES: u64 = 8;

/// Rounding may leave a share of a row a little below 0 or above 1.
const SHARES: std::ops::RangeInclusive<f64> = -0.01..=1.01;

/// Reads a matrix in at most `memory` bytes: what arrays claim to hold is counted before any is
/// inflated, and a checksum tells whether they are as they were written.
pub fn read_npz(path: &Path, memory: u64) -> Result<Stored, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.into(), source };
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let file = open_regular(path).map_err(unreadable)?;
    let mut archive =
        Archive::new(file).map_err(|e| broken(format!("is no archive of arrays ({e})")))?;
    let origin = text_of(&mut archive, ORIGIN)
        .map_err(|_| broken("was not written by hemicube factors".into()))?;
    let origin: Origin = serde_json::from_slice(&origin).map_err(|e| broken(e.to_string()))?;
    archive.checksum();
    if origin.checksum.is_empty() {
        let problem = "was written by an older version, without a checksum; make it again with \
                       hemicube factors";
        return Err(broken(problem.into()));
    }
    let format = text_of(&mut archive, "format").map_err(&broken)?;
    if format != b"csr" {
        return Err(broken("format.npy does not say csr".into()));
    }
    let shape = archive.numbers("shape", 2, integer).map_err(&broken)?;
    let rows = shape.first().copied().unwrap_or_default();
    if shape != [rows; 2] || u32::try_from(rows).is_err() {
        return Err(broken("shape.npy does not say how many rows there are".into()));
    }
    let entries = archive.open("indices").map_err(&broken)?.count;
    archive.checksum();
    let needed = ENTRY_BYTES.saturating_mul(entries).saturating_add(ROW_BYTES * rows);
    if needed > memory {
        let (path, what, allowed) = (path.into(), format!("{entries} form factors"), memory);
        return Err(ReadError::Memory { path, what, needed, allowed });
    }
    arrays(&mut archive, origin, rows, entries).map_err(broken)
}

/// All arrays of a matrix of that many rows and entries, in the order in which they were written.
fn arrays(
    archive: &mut Archive,
    origin: Origin,
    rows: u64,
    entries: u64,
) -> Result<Stored, String> {
    text_of(archive, "format")?;
    archive.numbers("shape", 2, integer)?;
    let starts = archive.numbers("indptr", rows + 1, integer)?;
    if starts.first() != Some(&0) || starts.last() != Some(&entries) || !starts.is_sorted() {
        return Err("indptr.npy does not say where rows begin".into());
    }
    let column = |kind, b: &[u8]| integer(kind, b).filter(|&j| j < rows).map(|j| j as u32);
    let columns = archive.numbers("indices", entries, column)?;
    let in_order = |w: &[u64]| columns[w[0] as usize..w[1] as usize].is_sorted_by(|a, b| a < b);
    if !starts.windows(2).all(in_order) {
        return Err("indices.npy does not list each row's columns in order".into());
    }
    let factor =
        |kind, b: &[u8]| float(kind, b).map(|f| f as f32).filter(|f| (0.0..=2.0).contains(f));
    let values = archive.numbers("data", entries, factor)?;
    let area = |kind, b: &[u8]| float(kind, b).filter(|a| *a >= 0.0 && a.is_finite()).map(|_| ());
    archive.numbers("area", rows, area)?;
    let share = |kind, b: &[u8]| float(kind, b).filter(|f| SHARES.contains(f));
    let environment = archive.numbers("environment", rows, share)?;
    let back = archive.numbers("back", rows, share)?;
    if archive.checksum() != origin.checksum {
        return Err("its arrays are not those that were written: their checksum differs".into());
    }
    Ok(Stored { origin, starts, columns, values, environment, back })
}

/// A text in an array of its own.
fn text_of(archive: &mut Archive, name: &str) -> Result<Vec<u8>, String> {
    let array = archive.open(name)?;
    match array.kind {
        Kind::Text(bytes) if bytes <= MOST_TEXT && array.count == 1 => {}
        _ => return Err(format!("{name}.npy holds no short text")),
    }
    Ok(array.take(text)?.and_then(|texts| texts.into_iter().next()).unwrap_or_default())
}
