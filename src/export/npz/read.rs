//! Reads back the matrices that `hemicube factors` wrote.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use thiserror::Error;
use zip::ZipArchive;

use super::ORIGIN;
use crate::matrix::{Origin, Stored};
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
    #[error("{}: {problem}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// It would not fit in memory.
    #[error(
        "{}: its {entries} form factors take about {}, {} are allowed",
        path.display(), Bytes(*needed), Bytes(*allowed)
    )]
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
    /// Bytes that an entry takes: numbers are taken over as they are read.
    const ENTRY_BYTES: u64 = 8;
    let needed = ENTRY_BYTES.saturating_mul(entries);
    if needed > memory {
        let (path, allowed) = (path.into(), memory);
        return Err(ReadError::Memory { path, entries, needed, allowed });
    }
    let ascending = starts.first() == Some(&0) && starts.is_sorted();
    if starts.len() as u64 != rows + 1 || !ascending || u32::try_from(rows).is_err() {
        return Err(broken("indptr.npy does not say where rows begin".into()));
    }
    let column = |kind, b: &[u8]| integer(kind, b).filter(|&j| j < rows).map(|j| j as u32);
    let columns = archive.numbers("indices", entries, column).map_err(&broken)?;
    let columns =
        columns.ok_or_else(|| broken("indices.npy names columns that do not exist".into()))?;
    let in_order = |w: &[u64]| columns[w[0] as usize..w[1] as usize].is_sorted_by(|a, b| a < b);
    if columns.len() as u64 != entries || !starts.windows(2).all(in_order) {
        return Err(broken("indices.npy does not list each row's columns in order".into()));
    }
    let factor =
        |kind, b: &[u8]| float(kind, b).map(|f| f as f32).filter(|f| (0.0..=2.0).contains(f));
    let values = archive.numbers("data", entries, factor).map_err(&broken)?;
    let values = values
        .filter(|values| values.len() as u64 == entries)
        .ok_or_else(|| broken("data.npy does not hold form factors".into()))?;
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
        let (kind, file) = self.open(name)?;
        let mut bytes = Vec::new();
        // Whatever the archive promises: no more is read than can be meant.
        let read = file.take(most.saturating_mul(8)).read_to_end(&mut bytes);
        read.map_err(|e| format!("{name}.npy: {e}"))?;
        Ok((Header { kind }, bytes))
    }

    /// What `take` makes of the numbers of an array, at most `most`; `None` if it makes nothing of
    /// one. Memory holds no more than the result.
    fn numbers<T>(
        &mut self,
        name: &str,
        most: u64,
        take: impl Fn(Kind, &[u8]) -> Option<T>,
    ) -> Result<Option<Vec<T>>, String> {
        /// Bytes read at once: a multiple of those of any number.
        const CHUNK: u64 = 1 << 18;
        let (kind, mut file) = self.open(name)?;
        let size = kind.bytes();
        let (mut numbers, mut bytes) = (Vec::new(), Vec::new());
        let room = usize::try_from(most).ok().and_then(|n| numbers.try_reserve_exact(n).ok());
        room.ok_or_else(|| format!("{name}.npy: there is no memory for it"))?;
        let mut left = most.saturating_mul(size as u64);
        while left > 0 {
            bytes.clear();
            let read = file.by_ref().take(CHUNK.min(left)).read_to_end(&mut bytes);
            read.map_err(|e| format!("{name}.npy: {e}"))?;
            if bytes.is_empty() {
                break;
            }
            left -= bytes.len() as u64;
            for number in bytes.chunks_exact(size) {
                let Some(number) = take(kind, number) else { return Ok(None) };
                numbers.push(number);
            }
        }
        Ok(Some(numbers))
    }

    /// What the numbers of an array are, and where they begin.
    fn open(&mut self, name: &str) -> Result<(Kind, impl Read + '_), String> {
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
        Ok((kind, file))
    }
}

impl Kind {
    /// Bytes of a number.
    fn bytes(self) -> usize {
        match self {
            Self::Int32 | Self::Single => 4,
            Self::Int64 | Self::Double => 8,
            Self::Bytes => 1,
        }
    }
}

/// An integer; a negative one becomes too large.
fn integer(kind: Kind, bytes: &[u8]) -> Option<u64> {
    match kind {
        Kind::Int32 => bytes.try_into().ok().map(|b| i32::from_le_bytes(b) as u64),
        Kind::Int64 => bytes.try_into().ok().map(u64::from_le_bytes),
        Kind::Single | Kind::Double | Kind::Bytes => None,
    }
}

/// A float.
fn float(kind: Kind, bytes: &[u8]) -> Option<f64> {
    match kind {
        Kind::Single => bytes.try_into().ok().map(|b| f32::from_le_bytes(b).into()),
        Kind::Double => bytes.try_into().ok().map(f64::from_le_bytes),
        Kind::Int32 | Kind::Int64 | Kind::Bytes => None,
    }
}

/// The numbers of an array of integers.
fn integers((header, bytes): &Array) -> Vec<u64> {
    let numbers = bytes.chunks_exact(header.kind.bytes());
    numbers.filter_map(|b| integer(header.kind, b)).collect()
}

/// The numbers of an array of floats.
fn doubles((header, bytes): &Array) -> impl Iterator<Item = f64> + '_ {
    bytes.chunks_exact(header.kind.bytes()).filter_map(|b| float(header.kind, b))
}
