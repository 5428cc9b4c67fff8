//! Tables as text: matrices, and what their rows stand for.

use std::io::{self, Write};
use std::path::Path;

use super::ExportError;
use super::npy::encode_rows;
use super::target::{write_whole, write_with};
use crate::matrix::{Precision, Rows, SurfaceRow};
use crate::progress::Progress;
use crate::scene::Side;

/// Appends a number with as many digits as it takes to read the same back.
pub(super) fn push_number(bytes: &mut Vec<u8>, value: f64, precision: Precision) {
    /// Smaller numbers are written with an exponent.
    const SMALL: f64 = 1e-4;
    let plain = value == 0.0 || value.abs() >= SMALL;
    let text = match (precision, plain) {
        (Precision::Single, true) => (value as f32).to_string(),
        (Precision::Single, false) => format!("{:e}", value as f32),
        (Precision::Double, true) => value.to_string(),
        (Precision::Double, false) => format!("{value:e}"),
    };
    bytes.extend(text.into_bytes());
}

/// A field, in quotation marks if it needs them.
pub(super) fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Writes a dense table whose first line and first column are the rows' labels. Advances `progress`
/// by one a row.
pub fn write_csv<R: Rows + ?Sized>(
    file: &mut dyn Write,
    rows: &R,
    progress: &dyn Progress,
) -> io::Result<()> {
    let (n, precision) = (rows.len(), rows.precision());
    let labels: Vec<String> = (0..n).map(|i| field(&rows.label(i))).collect();
    writeln!(file, "from,{}", labels.join(","))?;
    encode_rows(rows, file, progress, |i, columns, values, bytes| {
        bytes.extend(labels[i].as_bytes());
        let mut entries = columns.iter().zip(values).peekable();
        for j in 0..n as u32 {
            bytes.push(b',');
            let value = entries.next_if(|e| *e.0 == j).map_or(0.0, |e| *e.1);
            push_number(bytes, value, precision);
        }
        bytes.push(b'\n');
    })
}

/// Writes such a table to a file.
pub fn write_csv_file<R: Rows + ?Sized>(
    path: &Path,
    rows: &R,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    write_with(path, |file| write_csv(file, rows, progress))
}

/// Writes what the rows of a matrix stand for.
pub fn write_surfaces(path: &Path, surfaces: &[SurfaceRow]) -> Result<(), ExportError> {
    let mut bytes =
        b"patch,triangle,side,name,area,cx,cy,cz,nx,ny,nz,front,back,environment\n".to_vec();
    for (i, s) in surfaces.iter().enumerate() {
        let side = match s.side {
            Some(Side::Front) => "front",
            Some(Side::Back) => "back",
            None => "",
        };
        let triangle = s.triangle.map_or(String::new(), |t| t.to_string());
        bytes.extend(format!("{i},{triangle},{side},{}", field(&s.name)).into_bytes());
        let account = [s.account.front, s.account.back, s.account.environment];
        let numbers = [&[s.area][..], &s.centroid.to_array(), &s.normal.to_array(), &account];
        for &number in numbers.into_iter().flatten() {
            bytes.push(b',');
            // Rounding leaves zeros of either sign.
            push_number(&mut bytes, number + 0.0, Precision::Double);
        }
        bytes.push(b'\n');
    }
    write_whole(path, &bytes)
}
