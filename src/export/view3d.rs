//! Factors as View3D writes them (Walton 2002, NISTIR 6925), for programs that read its results.

use std::io::{self, Write};
use std::path::Path;

use super::ExportError;
use super::npy::encode_rows;
use super::target::{write_whole, write_with};
use crate::matrix::Rows;
use crate::progress::Progress;
use crate::scene::view3d::OutputFormat;

/// What View3D's files hold.
#[derive(Clone, Copy)]
pub struct View3dTable<'a> {
    /// The factors.
    pub rows: &'a dyn Rows,
    /// Area of each row.
    pub areas: &'a [f64],
    /// Emittance of each row.
    pub emittances: &'a [f64],
    /// Whether the surfaces form an enclosure.
    pub enclosure: bool,
    /// Whether factors count reflection between grey surfaces.
    pub grey: bool,
}

/// Bytes of the header before the end of its line. Readers skip just so many.
const HEADER: usize = 30;

/// The version of View3D whose files these are like, with who wrote this one; without, where the
/// header has no room for it.
const VERSIONS: [&str; 2] = ["4.0-hemicube", "4.0"];

/// Smaller factors are left out of lists: they round to 0.
const LEAST: f64 = 5e-7;

/// Writes factors in one of View3D's formats. Advances `progress` by one a row.
///
/// # Errors
/// If the system refuses, or `progress` stops it.
pub fn write_view3d(
    path: &Path,
    table: View3dTable<'_>,
    format: OutputFormat,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    write_with(path, |file| match format {
        OutputFormat::Text => text(file, table, progress),
        OutputFormat::Binary => binary(file, table, progress),
        OutputFormat::Sparse => sparse(file, table.rows, progress),
    })
}

/// Writes the factors of one row, a line each.
///
/// # Errors
/// If the system refuses.
pub fn write_view3d_row(path: &Path, factors: &[f64]) -> Result<(), ExportError> {
    let lines: String = factors.iter().map(|f| format!("{f:.5}\n")).collect();
    write_whole(path, lines.as_bytes())
}

fn header(table: View3dTable<'_>, format: u8) -> String {
    let flags = [table.enclosure, table.grey].map(u8::from);
    let text = |version: &&str| {
        format!("View3D {version} {format} {} {} {}", flags[0], flags[1], table.rows.len())
    };
    let all = VERSIONS.iter().map(text);
    let text = all.reduce(|long, short| if long.len() > HEADER { short } else { long });
    format!("{:HEADER$}", text.unwrap_or_default())
}

fn text(file: &mut dyn Write, table: View3dTable<'_>, progress: &dyn Progress) -> io::Result<()> {
    let n = table.rows.len() as u32;
    writeln!(file, "{}", header(table, 0))?;
    let line = |words: Vec<String>| words.join(" ");
    // View3D keeps areas in single precision.
    let areas = table.areas.iter().map(|&a| general(f64::from(a as f32)));
    writeln!(file, "{}", line(areas.collect()))?;
    encode_rows(table.rows, file, progress, |_, columns, values, bytes| {
        let mut entries = columns.iter().zip(values).peekable();
        for j in 0..n {
            match entries.next_if(|e| *e.0 == j) {
                Some((_, f)) => bytes.extend(format!("{f:.6}").into_bytes()),
                None => bytes.extend(b"0.000000"),
            }
            bytes.push(if j + 1 < n { b' ' } else { b'\n' });
        }
    })?;
    writeln!(file, "{}", line(table.emittances.iter().map(|e| format!("{e:.3}")).collect()))
}

fn binary(file: &mut dyn Write, table: View3dTable<'_>, progress: &dyn Progress) -> io::Result<()> {
    let n = table.rows.len();
    let numbers =
        |all: &[f64]| -> Vec<u8> { all.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect() };
    write!(file, "{}\r\n", header(table, 1))?;
    file.write_all(&numbers(table.areas))?;
    encode_rows(table.rows, file, progress, |_, columns, values, bytes| {
        let start = bytes.len();
        bytes.resize(start + 4 * n, 0);
        for (&j, &f) in columns.iter().zip(values) {
            let at = start + 4 * j as usize;
            bytes[at..at + 4].copy_from_slice(&(f as f32).to_le_bytes());
        }
    })?;
    file.write_all(&numbers(table.emittances))
}

fn sparse(file: &mut dyn Write, rows: &dyn Rows, progress: &dyn Progress) -> io::Result<()> {
    encode_rows(rows, file, progress, |i, columns, values, bytes| {
        for (&j, &f) in columns.iter().zip(values).filter(|e| *e.1 >= LEAST) {
            bytes.extend(format!("{} {} {f:.6}\n", i + 1, j + 1).into_bytes());
        }
    })
}

/// A number as C's `%g` writes it: to six significant digits, without zeros at the end, and with an
/// exponent where that is shorter.
fn general(x: f64) -> String {
    const DIGITS: i32 = 6;
    let rounded = format!("{x:.*e}", DIGITS as usize - 1);
    let Some((digits, exponent)) = rounded.split_once('e') else { return rounded };
    let exponent: i32 = exponent.parse().unwrap_or_default();
    let short = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-4..DIGITS).contains(&exponent) {
        return short(&format!("{x:.*}", (DIGITS - 1 - exponent) as usize));
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", short(digits), exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_c() {
        for (x, expected) in [
            (0.0, "0"),
            (1.0, "1"),
            (9.0, "9"),
            (0.5, "0.5"),
            (123_456.0, "123456"),
            (1_234_567.0, "1.23457e+06"),
            (999_999.5, "1e+06"),
            (999_999.4, "999999"),
            (1e-4, "0.0001"),
            (1e-5, "1e-05"),
            (1.234_567_8e-5, "1.23457e-05"),
            (0.000_123_456_7, "0.000123457"),
            (9.999_999e-5, "0.0001"),
            (1e100, "1e+100"),
            (2.0 / 3.0, "0.666667"),
            (100.0, "100"),
            (-1.5, "-1.5"),
        ] {
            assert_eq!(general(x), expected);
        }
    }

    /// Rows that see nothing.
    struct Nothing(usize);

    impl Rows for Nothing {
        fn len(&self) -> usize {
            self.0
        }

        fn entries(&self) -> u64 {
            0
        }

        fn precision(&self) -> crate::matrix::Precision {
            crate::matrix::Precision::Double
        }

        fn row(&self, _: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
            columns.clear();
            values.clear();
            Ok(())
        }

        fn label(&self, i: usize) -> String {
            i.to_string()
        }

        fn surfaces(&self, _: &crate::scene::Geometry) -> Vec<crate::matrix::SurfaceRow> {
            Vec::new()
        }

        fn rest(&self, _: usize) -> [f64; 2] {
            [0.0; 2]
        }
    }

    #[test]
    fn headers_have_the_length_that_readers_skip() {
        for (n, version) in [(1, "4.0-hemicube"), (9_999, "4.0-hemicube"), (10_000, "4.0")] {
            let (areas, emittances) = (&[][..], &[][..]);
            let table =
                View3dTable { rows: &Nothing(n), areas, emittances, enclosure: true, grey: false };
            let text = header(table, 1);
            assert_eq!(text.len(), HEADER);
            let words: Vec<&str> = text.split_whitespace().collect();
            assert_eq!(words, ["View3D", version, "1", "1", "0", &n.to_string()]);
        }
    }
}
