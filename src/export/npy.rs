//! Arrays as NumPy writes them (`.npy`, version 1.0).

use std::io::{self, Write};
use std::path::Path;

use rayon::prelude::*;

use super::ExportError;
use super::target::write_with;
use crate::matrix::{Precision, Rows};
use crate::progress::Progress;

/// Magic, version 1.0 and the dictionary that says what follows, padded to a multiple of 64 bytes.
/// `kind` is NumPy's, such as `<f8`; `shape` a Python tuple.
pub(super) fn header(kind: &str, shape: &str) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let whole = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(64);
    text.extend(std::iter::repeat_n(' ', whole - MAGIC.len() - 2 - text.len() - 1));
    text.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    bytes
}

/// NumPy's name of the numbers of a matrix.
pub(super) fn kind(precision: Precision) -> &'static str {
    match precision {
        Precision::Single => "<f4",
        Precision::Double => "<f8",
    }
}

/// Appends a number.
pub(super) fn push(bytes: &mut Vec<u8>, value: f64, precision: Precision) {
    match precision {
        Precision::Single => bytes.extend((value as f32).to_le_bytes()),
        Precision::Double => bytes.extend(value.to_le_bytes()),
    }
}

/// Rows that are encoded at once.
const BLOCK: usize = 64;

/// Writes what `encode` makes of each row, in order; advances `progress` by one a row.
pub(super) fn encode_rows<R: Rows + ?Sized>(
    rows: &R,
    file: &mut dyn Write,
    progress: &dyn Progress,
    encode: impl Fn(usize, &[u32], &[f64], &mut Vec<u8>) + Sync,
) -> io::Result<()> {
    let mut blocks: Vec<Vec<u8>> = vec![Vec::new(); rayon::current_num_threads()];
    let all: Vec<usize> = (0..rows.len()).step_by(BLOCK).collect();
    for firsts in all.chunks(blocks.len()) {
        blocks.par_iter_mut().zip(firsts).try_for_each(|(bytes, &first)| {
            bytes.clear();
            let (mut columns, mut values) = (Vec::new(), Vec::new());
            for i in first..(first + BLOCK).min(rows.len()) {
                rows.row(i, &mut columns, &mut values)?;
                encode(i, &columns, &values, bytes);
            }
            io::Result::Ok(())
        })?;
        for bytes in &blocks[..firsts.len()] {
            file.write_all(bytes)?;
        }
        let done = (firsts.len() * BLOCK).min(rows.len() - firsts[0]);
        progress.advance(done as u64).map_err(|_| io::ErrorKind::Interrupted)?;
    }
    Ok(())
}

/// Writes a matrix as a dense array, rows × columns.
pub fn write_npy<R: Rows + ?Sized>(
    path: &Path,
    rows: &R,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let (n, precision) = (rows.len(), rows.precision());
    write_with(path, |file| {
        file.write_all(&header(kind(precision), &format!("({n}, {n})")))?;
        encode_rows(rows, file, progress, |_, columns, values, bytes| {
            let mut entries = columns.iter().zip(values).peekable();
            for j in 0..n as u32 {
                let value = entries.next_if(|e| *e.0 == j).map_or(0.0, |e| *e.1);
                push(bytes, value, precision);
            }
        })
    })
}
