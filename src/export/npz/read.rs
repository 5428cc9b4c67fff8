//! Reads back the matrices that `hemicube factors` wrote.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use thiserror::Error;
use zip::ZipArchive;

use super::ORIGIN;
use crate::matrix::{Origin, Stored};

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
    #[error("{}: {problem}; make it again with hemicube factors -o F.npz", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// It would not fit in memory.
    #[error("{}: its {entries} form factors take about {} MiB, {} are allowed; allow more with --memory", path.display(), needed.div_ceil(1 << 20), allowed.div_ceil(1 << 20))]
    Memory {
        /// The file.
        path: PathBuf,
        /// How many form factors it holds.
        entries: u64,
        /// Bytes that reading takes.
        needed: u64,
        /// Bytes that are allowed.
        allowed: u64,
    },
}

/// Reads a matrix in at most `memory` bytes.
pub fn read_npz(path: &Path, memory: u64) -> Result<Stored, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.into(), source };
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let file = File::open(path).map_err(unreadable)?;
    let zip = ZipArchive::new(BufReader::new(file))
        .map_err(|e| broken(format!("is no archive of arrays ({e})")))?;
    let mut archive = Archive { zip };
    let (header, bytes) = archive
        .array(ORIGIN, u64::MAX)
        .map_err(|_| broken("was not written by hemicube factors".into()))?;
    let origin: Origin = match header.kind {
        Kind::Bytes => serde_json::from_slice(&bytes).map_err(|e| broken(e.to_string()))?,
        _ => return Err(broken(format!("{ORIGIN}.npy holds no text"))),
    };
    let [shape, starts] = ["shape", "indptr"].map(|name| archive.array(name, u64::MAX));
    let starts = starts.map_err(&broken)?;
    let rows = integers(&shape.map_err(&broken)?).first().copied().unwrap_or_default();
    let starts = integers(&starts);
    let entries = starts.last().copied().unwrap_or_default();
    /// Bytes that an entry takes while it is read: in the file's form, and twice in ours.
    const ENTRY_BYTES: u64 = 24;
    let needed = ENTRY_BYTES.saturating_mul(entries);
    if needed > memory {
        let (path, allowed) = (path.into(), memory);
        return Err(ReadError::Memory { path, entries, needed, allowed });
    }
    let ascending = starts.first() == Some(&0) && starts.is_sorted();
    if starts.len() as u64 != rows + 1 || !ascending || u32::try_from(rows).is_err() {
        return Err(broken("indptr.npy does not say where rows begin".into()));
    }
    let columns = integers(&archive.array("indices", entries).map_err(&broken)?);
    if columns.iter().any(|&j| j >= rows) {
        return Err(broken("indices.npy names columns that do not exist".into()));
    }
    let columns: Vec<u32> = columns.into_iter().map(|j| j as u32).collect();
    let in_order = |w: &[u64]| columns[w[0] as usize..w[1] as usize].is_sorted_by(|a, b| a < b);
    if columns.len() as u64 != entries || !starts.windows(2).all(in_order) {
        return Err(broken("indices.npy does not list each row's columns in order".into()));
    }
    let data = archive.array("data", entries).map_err(&broken)?;
    let values: Vec<f32> = doubles(&data).map(|f| f as f32).collect();
    if values.len() as u64 != entries || !values.iter().all(|f| (0.0..=2.0).contains(f)) {
        return Err(broken("data.npy does not hold form factors".into()));
    }
    let [environment, back] = ["environment", "back"]
        .map(|name| archive.array(name, rows).map(|a| doubles(&a).collect::<Vec<f64>>()));
    let (environment, back) = (environment.map_err(&broken)?, back.map_err(&broken)?);
    if [&environment, &back].iter().any(|a| a.len() as u64 != rows) {
        return Err(broken("environment.npy or back.npy is not of all rows".into()));
    }
    Ok(Stored { origin, starts, columns, values, environment, back })
}

struct Archive {
    zip: ZipArchive<BufReader<File>>,
}

/// What the numbers of an array are.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Int32,
    Int64,
    Single,
    Double,
    Bytes,
}

struct Header {
    kind: Kind,
}

type Array = (Header, Vec<u8>);

impl Archive {
    /// An array of at most `most` numbers.
    fn array(&mut self, name: &str, most: u64) -> Result<Array, String> {
        let name = format!("{name}.npy");
        let wrong = |problem: &str| format!("{name} {problem}");
        let mut file = self.zip.by_name(&name).map_err(|e| format!("{name}: {e}"))?;
        let mut start = [0; 10];
        file.read_exact(&mut start).map_err(|_| wrong("is cut off"))?;
        if start[..8] != *b"\x93NUMPY\x01\x00" {
            return Err(wrong("is no array of version 1.0"));
        }
        let mut text = vec![0; usize::from(u16::from_le_bytes([start[8], start[9]]))];
        file.read_exact(&mut text).map_err(|_| wrong("is cut off"))?;
        let text = String::from_utf8_lossy(&text).into_owned();
        let kind = ["<i4", "<i8", "<f4", "<f8", "|S"];
        let kinds = [Kind::Int32, Kind::Int64, Kind::Single, Kind::Double, Kind::Bytes];
        let is = |kind: &str| text.contains(&format!("'descr': '{kind}"));
        let kind = kind.iter().zip(kinds).find(|k| is(k.0)).map(|k| k.1);
        let kind = kind.ok_or_else(|| wrong("holds numbers of a kind that is not read"))?;
        let mut bytes = Vec::new();
        // Whatever the archive promises: no more is read than can be meant.
        let limit = most.saturating_mul(8);
        file.take(limit).read_to_end(&mut bytes).map_err(|e| format!("{name}: {e}"))?;
        Ok((Header { kind }, bytes))
    }
}

/// The numbers of an array of integers; negative ones become too large.
fn integers((header, bytes): &Array) -> Vec<u64> {
    match header.kind {
        Kind::Int32 => bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b) as u64).collect(),
        Kind::Int64 => bytes.as_chunks().0.iter().map(|b| u64::from_le_bytes(*b)).collect(),
        Kind::Single | Kind::Double | Kind::Bytes => Vec::new(),
    }
}

/// The numbers of an array of floats.
fn doubles((header, bytes): &Array) -> Box<dyn Iterator<Item = f64> + '_> {
    match header.kind {
        Kind::Single => {
            Box::new(bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))))
        }
        Kind::Double => Box::new(bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b))),
        Kind::Int32 | Kind::Int64 | Kind::Bytes => Box::new(std::iter::empty()),
    }
}
