//! Tables of points: read from CSV, or made as a grid, and written again with what was measured.

use glam::DVec3;
use hemicube::gather::{Estimate, Place, Probe};
use hemicube::scene::luminance;

use crate::args::{size, vector};
use crate::plan::Plane;

/// Points with what else is in their table.
#[derive(Debug)]
pub struct Table {
    /// The header without the columns that measuring adds.
    header: String,
    /// Each row's text without them.
    rows: Vec<String>,
    /// Each row's point and normal.
    pub probes: Vec<Probe>,
    /// The work plane that they are the cells of.
    pub plane: Option<Plane>,
}

/// Columns that every table has.
const NEEDED: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Columns that measuring adds; older ones of the same name make way.
const ADDED: [&str; 6] = ["E_r", "E_g", "E_b", "E", "error", "place"];

/// Most points of a grid.
const MOST_CELLS: usize = 10_000_000;

/// Reads a table; `name` is what errors call it.
pub fn read(name: &str, text: &str) -> Result<Table, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((_, header)) = lines.next() else {
        return Err(format!(
            "{name}: empty; the first line has to name the columns x,y,z,nx,ny,nz"
        ));
    };
    let header = fields(header);
    let titles: Vec<&str> = header.iter().map(|f| f.trim().trim_matches('"').trim()).collect();
    let mut columns = [0; 6];
    for (column, title) in columns.iter_mut().zip(NEEDED) {
        let mut found = titles.iter().enumerate().filter(|(_, t)| **t == title).map(|(at, _)| at);
        *column = found.next().ok_or_else(|| {
            format!(
                "{name}: line 1: no column '{title}'; the first line has to name x,y,z,nx,ny,nz, \
                 and has {}",
                titles.join(",")
            )
        })?;
        if found.next().is_some() {
            return Err(format!("{name}: line 1: two columns '{title}'; leave one out"));
        }
    }
    let kept = |row: &[&str]| -> String {
        let stay = |(_, title): &(&&str, &&str)| !ADDED.contains(title);
        let row: Vec<&str> = row.iter().zip(&titles).filter(stay).map(|(f, _)| *f).collect();
        row.join(",")
    };
    let (mut rows, mut probes) = (Vec::new(), Vec::new());
    for (number, line) in lines {
        let place = format!("{name}: line {}", number + 1);
        let row = fields(line);
        if row.len() != titles.len() {
            return Err(format!(
                "{place}: {} fields, but the first line names {} columns",
                row.len(),
                titles.len()
            ));
        }
        probes.push(probe(&place, &row, columns)?);
        rows.push(kept(&row));
    }
    if probes.is_empty() {
        return Err(format!("{name}: no points; each line after the first has to hold one"));
    }
    Ok(Table { header: kept(&header), rows, probes, plane: None })
}

/// The point and the normal of a row.
fn probe(place: &str, row: &[&str], columns: [usize; 6]) -> Result<Probe, String> {
    let mut numbers = [0.0; 6];
    for ((number, column), title) in numbers.iter_mut().zip(columns).zip(NEEDED) {
        let field = row[column].trim().trim_matches('"');
        *number = field.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(|| {
            format!("{place}, column {title}: '{field}' is not a number; write it like -1.25")
        })?;
    }
    let [x, y, z, nx, ny, nz] = numbers;
    let normal = DVec3::new(nx, ny, nz).try_normalize().ok_or_else(|| {
        format!("{place}, columns nx,ny,nz: the normal has no direction; upwards is 0,1,0")
    })?;
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

/// The centres of the cells of a grid over a parallelogram: a corner, two edges, and the cells
/// along each, as `--grid` gives them.
pub fn grid(values: &[String]) -> Result<Table, String> {
    let [corner, u, v, cells] = values else {
        return Err(String::from("--grid: write it like 0,0.75,0 0,0,3 5,0,0 6x10"));
    };
    let place = |text: &String| vector(text).map_err(|e| format!("--grid: {e}"));
    let (corner, u, v) = (place(corner)?, place(u)?, place(v)?);
    let (nu, nv) = size(cells)
        .map_err(|_| format!("--grid: '{cells}' is not a number of cells; write it like 6x10"))?;
    if nu == 0 || nv == 0 || nu.saturating_mul(nv) > MOST_CELLS {
        return Err(format!("--grid: {nu}x{nv} cells; 1x1 to {MOST_CELLS} in all are possible"));
    }
    let normal = u.cross(v).try_normalize().ok_or_else(|| {
        String::from("--grid: the edges U and V span no area; give two that are not parallel")
    })?;
    let (mut rows, mut probes) = (Vec::new(), Vec::new());
    for (i, j) in (0..nu).flat_map(|i| (0..nv).map(move |j| (i, j))) {
        let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        let point = corner + u * at(i, nu) + v * at(j, nv);
        let numbers = [point, normal].map(|v| v.to_array().map(number).join(","));
        rows.push(format!("{i},{j},{}", numbers.join(",")));
        probes.push(Probe { point, normal });
    }
    let plane = Some(Plane { u, v, cells: [nu, nv] });
    Ok(Table { header: format!("i,j,{}", NEEDED.join(",")), rows, probes, plane })
}

impl Table {
    /// The table with what was measured, as CSV.
    pub fn with(&self, found: &[Estimate]) -> String {
        let mut text = format!("{},{}\n", self.header, ADDED.join(","));
        for (row, e) in self.rows.iter().zip(found) {
            let h = e.irradiance;
            let numbers = [h.x, h.y, h.z, luminance(h), error(e)].map(number);
            let place = match e.place {
                Place::Free => "free",
                Place::Covered => "covered",
                Place::OnEmitter => "emitter",
                Place::Outside => "outside",
            };
            text += &format!("{row},{},{place}\n", numbers.join(","));
        }
        text
    }
}

/// Half the width of the interval of E, were the channels' errors alike: they see the same rays.
pub fn error(e: &Estimate) -> f64 {
    luminance(e.error)
}

/// Six digits, without more zeros than needed.
pub fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    match rounded.abs() {
        1e-4..1e12 => rounded.to_string(),
        0.0 => String::from("0"),
        _ => format!("{rounded:e}"),
    }
}
