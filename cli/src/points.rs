//! Tables of points: read from CSV, or made as a grid, and written again with what was measured.

use hemicube::gather::{self, COLUMNS, Estimate, MEASURED, Place, Probe};
use hemicube::scene::luminance;

use crate::args::{size, vector};
use crate::plan::Plane;

/// Points with what else is in their table.
#[derive(Debug)]
pub struct Table {
    pub points: gather::Table,
    /// The work plane that they are the cells of.
    pub plane: Option<Plane>,
}

/// Most points of a grid.
const MOST_CELLS: usize = 10_000_000;

/// Reads a table; `name` is what errors call it.
pub fn read(name: &str, text: &str) -> Result<Table, String> {
    let points = gather::Table::parse(text).map_err(|e| format!("{name}: {e}"))?;
    Ok(Table { points, plane: None })
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
    let points = gather::Table { header: format!("i,j,{}", COLUMNS.join(",")), rows, probes };
    Ok(Table { points, plane })
}

impl Table {
    /// The table with what was measured, as CSV.
    pub fn with(&self, found: &[Estimate]) -> String {
        let gather::Table { header, rows, .. } = &self.points;
        let mut text = format!("{header},{}\n", MEASURED.join(","));
        for (row, e) in rows.iter().zip(found) {
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
