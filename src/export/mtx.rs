//! Sparse matrices in the exchange format of Matrix Market (Boisvert, Pozo & Remington 1996).

use std::io::Write;
use std::path::Path;

use super::ExportError;
use super::csv::push_number;
use super::npy::encode_rows;
use super::target::write_with;
use crate::matrix::{Origin, Rows};
use crate::progress::Progress;

/// Writes a matrix as a list of rows, columns (from 1) and form factors. Advances `progress` by one
/// a row.
pub fn write_mtx<R: Rows + ?Sized>(
    path: &Path,
    rows: &R,
    origin: &Origin,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let precision = rows.precision();
    write_with(path, |file| {
        writeln!(file, "%%MatrixMarket matrix coordinate real general")?;
        writeln!(file, "% form factors, geometry {}", origin.fingerprint)?;
        writeln!(file, "{} {} {}", rows.len(), rows.len(), rows.entries())?;
        encode_rows(rows, file, progress, |i, columns, values, bytes| {
            for (j, &f) in columns.iter().zip(values) {
                bytes.extend(format!("{} {} ", i + 1, j + 1).into_bytes());
                push_number(bytes, f, precision);
                bytes.push(b'\n');
            }
        })
    })
}
