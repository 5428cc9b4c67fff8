//! Tables of points, as CSV.

use glam::DVec3;
use thiserror::Error;

use super::estimate::Probe;
use crate::scene::shortened::{abridged, shortened};

/// Points with what else is in their table.
#[derive(Debug)]
pub struct Table {
    /// The header without the columns that measuring adds.
    pub header: String,
    /// Each row's text without them.
    pub rows: Vec<String>,
    /// Each row's point and normal.
    pub probes: Vec<Probe>,
}

/// Columns that every table has: a point in metres and a normal of any length.
pub const COLUMNS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Columns that measuring adds; older ones of the same name make way.
pub const MEASURED: [&str; 6] = ["E_r", "E_g", "E_b", "E", "error", "place"];

/// Why a table of points cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TableError {
    /// There is nothing in it.
    #[error("empty; the first line has to name the columns x,y,z,nx,ny,nz")]
    Empty,
    /// A column is missing.
    #[error(
        "line 1: no column '{column}'; the first line has to name x,y,z,nx,ny,nz, and has {found}"
    )]
    Missing {
        /// The column.
        column: &'static str,
        /// Those that there are.
        found: String,
    },
    /// A column is there twice.
    #[error("line 1: two columns '{0}'; leave one out")]
    Twice(&'static str),
    /// A line is longer or shorter than the first.
    #[error("line {line}: {fields} fields, but the first line names {columns} columns")]
    Fields {
        /// The line, counted from 1.
        line: usize,
        /// What it has.
        fields: usize,
        /// What it should have.
        columns: usize,
    },
    /// A field is no number.
    #[error("line {line}, column {column}: '{field}' is not a number; write it like -1.25")]
    Number {
        /// The line, counted from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// What stands there.
        field: String,
    },
    /// A normal has no length.
    #[error("line {0}, columns nx,ny,nz: the normal has no direction; upwards is 0,1,0")]
    Normal(usize),
    /// It has a header and nothing else.
    #[error("no points; each line after the first has to hold one")]
    NoPoints,
}

impl Table {
    /// Reads a table from CSV: the first line names the columns, among them [`COLUMNS`], each line
    /// after it is a point. Others are kept as they are.
    ///
    /// # Errors
    /// If a column is missing, or a line is none of numbers.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let (_, header) = lines.next().ok_or(TableError::Empty)?;
        let header = fields(header);
        let titles: Vec<&str> = header.iter().map(|f| f.trim().trim_matches('"').trim()).collect();
        let mut columns = [0; 6];
        for (at, column) in columns.iter_mut().zip(COLUMNS) {
            let mut found = (0..titles.len()).filter(|&at| titles[at] == column);
            let missing =
                || TableError::Missing { column, found: abridged(&titles.join(",")).into() };
            *at = found.next().ok_or_else(missing)?;
            if found.next().is_some() {
                return Err(TableError::Twice(column));
            }
        }
        let kept = |row: &[&str]| -> String {
            let stay = |(_, title): &(&&str, &&str)| !MEASURED.contains(title);
            let row: Vec<&str> = row.iter().zip(&titles).filter(stay).map(|(f, _)| *f).collect();
            row.join(",")
        };
        let (mut rows, mut probes) = (Vec::new(), Vec::new());
        for (line, text) in lines.map(|(number, text)| (number + 1, text)) {
            let row = fields(text);
            if row.len() != titles.len() {
                let (fields, columns) = (row.len(), titles.len());
                return Err(TableError::Fields { line, fields, columns });
            }
            probes.push(probe(line, &row, columns)?);
            rows.push(kept(&row));
        }
        if probes.is_empty() {
            return Err(TableError::NoPoints);
        }
        Ok(Self { header: kept(&header), rows, probes })
    }
}

/// The point and the normal of a row.
fn probe(line: usize, row: &[&str], columns: [usize; 6]) -> Result<Probe, TableError> {
    let mut numbers = [0.0; 6];
    for ((number, at), column) in numbers.iter_mut().zip(columns).zip(COLUMNS) {
        let field = row[at].trim().trim_matches('"');
        let parsed = field.parse().ok().filter(|n: &f64| n.is_finite());
        *number =
            parsed.ok_or_else(|| TableError::Number { line, column, field: shortened(field) })?;
    }
    let [x, y, z, nx, ny, nz] = numbers;
    let normal = DVec3::new(nx, ny, nz).try_normalize().ok_or(TableError::Normal(line))?;
    Ok(Probe { point: DVec3::new(x, y, z), normal })
}

/// The fields of a line; commas between quotation marks part none.
fn fields(line: &str) -> Vec<&str> {
    let (mut fields, mut from, mut quoted) = (Vec::new(), 0, false);
    for (at, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => {
                fields.push(&line[from..at]);
                from = at + 1;
            }
            _ => {}
        }
    }
    fields.push(&line[from..]);
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        Table::parse(text).unwrap_err().to_string()
    }

    #[test]
    fn columns_come_in_any_order_and_others_stay() {
        let text = "\u{feff}name,nz,ny,nx,x,y,z,E\n\"a,b\",0,2,0,\"1\",2,3,old\n\n";
        let table = Table::parse(text).unwrap();
        assert_eq!(table.header, "name,nz,ny,nx,x,y,z");
        assert_eq!(table.rows, ["\"a,b\",0,2,0,\"1\",2,3"]);
        let Probe { point, normal } = table.probes[0];
        assert_eq!((point, normal), (DVec3::new(1.0, 2.0, 3.0), DVec3::Y));
    }

    #[test]
    fn what_is_no_table_of_points_is_refused_by_place() {
        const HEADER: &str = "x,y,z,nx,ny,nz";
        assert!(message("\n \n").starts_with("empty"));
        assert!(message("x,y,z,nx,ny\n").contains("no column 'nz'"));
        assert!(message("x,x,y,z,nx,ny,nz\n").contains("two columns 'x'"));
        assert!(message(HEADER).starts_with("no points"));
        let line = |line: &str| message(&format!("{HEADER}\n\n{line}"));
        assert!(line("1,2,3").starts_with("line 3: 3 fields"));
        assert!(line("1,2,inf,0,0,1").contains("line 3, column z: 'inf' is not a number"));
        assert!(line("1,2,3,0,0,0").contains("the normal has no direction"));
    }
}
