//! Table 3: adaptive subdivision at eight tolerances.

use std::sync::Arc;

use hemicube::patches::Patches;
use hemicube::progress::Progress;

use super::Folder;
use super::conditions::Conditions;
use super::measure::{best, scene};
use super::plot::{Panel, Series, Style, figure};
use super::published::{TABLE3, rows};
use super::stretch::Stretch;
use super::table::{Table, count, short};
use super::table2::{Made, adaptive};
use crate::failure::Failure;
use crate::terminal::Bar;

/// The scenes measured, and the paper's columns of fragments and seconds.
const SCENES: [(usize, usize, usize); 2] = [(1, 1, 2), (2, 3, 4)];

/// One tolerance.
struct Line {
    tolerance: f64,
    made: [Made; SCENES.len()],
    /// The paper's fragments and seconds.
    paper: [(f64, f64); SCENES.len()],
}

/// Measures, writes `table3.csv` and a plot, and returns the section of the document.
pub fn run(conditions: &Conditions, folder: &Folder<'_>) -> Result<String, Failure> {
    let published = rows(TABLE3);
    let mut meshes = Vec::new();
    for (number, _, _) in SCENES {
        let geometry = scene(number)?.geometry;
        let finest = Patches::uniform(&geometry, conditions.finest).map_err(Failure::failed)?;
        meshes.push((geometry, Arc::new(finest)));
    }
    let bar = Bar::new(false);
    let units = |n: usize| (n / 2 * conditions.repeats) as u64;
    let once: u64 = meshes.iter().map(|m| units(m.1.len())).sum();
    bar.stage("table 3", once * published.len() as u64);
    let mut lines = Vec::new();
    for row in &published {
        let tolerance = row[0];
        let made = |m: usize| {
            let (geometry, finest) = &meshes[m];
            let part = Stretch::new(&bar, units(finest.len()), units(finest.len()) as usize);
            let size = conditions.finest;
            let mut made = Made { patches: 0, rows: 0, seconds: 0.0 };
            let [seconds] = best(conditions, || {
                made = adaptive(geometry, finest, size, tolerance, conditions, &part)?;
                Ok([made.seconds])
            })?;
            made.seconds = seconds;
            part.finish().map(|()| made)
        };
        let made = [made(0)?, made(1)?];
        let paper = SCENES.map(|(_, fragments, seconds)| (row[fragments], row[seconds]));
        lines.push(Line { tolerance, made, paper });
    }
    bar.finish();
    folder.write("table3.csv", csv(&lines).as_bytes())?;
    folder.write("images/paper-table3.svg", plot(&lines)?.as_bytes())?;
    Ok(section(&lines, conditions))
}

fn csv(lines: &[Line]) -> String {
    let ours = ["fragments", "rows", "s"];
    let columns = SCENES.iter().flat_map(|(number, _, _)| {
        let ours = ours.map(|c| format!("scene{number}_{c}"));
        let paper = ["fragments", "s"].map(|c| format!("paper_scene{number}_{c}"));
        ours.into_iter().chain(paper)
    });
    let mut table = Table::new(std::iter::once(String::from("tolerance")).chain(columns));
    for line in lines {
        let cells = line.made.iter().zip(line.paper).flat_map(|(m, (fragments, seconds))| {
            [
                m.patches.to_string(),
                m.rows.to_string(),
                format!("{:.5}", m.seconds),
                fragments.to_string(),
                seconds.to_string(),
            ]
        });
        table.push(std::iter::once(line.tolerance.to_string()).chain(cells));
    }
    table.csv()
}

fn section(lines: &[Line], conditions: &Conditions) -> String {
    let mut table = Table::new([
        "tolerance",
        "scene 1: patches",
        "rows made",
        "s",
        "paper: patches",
        "s",
        "scene 2: patches",
        "rows made",
        "s",
        "paper: patches",
        "s",
    ]);
    for line in lines {
        let cells = line.made.iter().zip(line.paper).flat_map(|(m, (fragments, seconds))| {
            [
                count(m.patches),
                count(m.rows),
                short(m.seconds),
                count(fragments as usize),
                short(seconds),
            ]
        });
        table.push(std::iter::once(line.tolerance.to_string()).chain(cells));
    }
    format!(
        "Smallest size {} m² (the paper: 0.1 m²).\n\n{}\n\
         ![Patches and time against the tolerance](images/paper-table3.svg)\n",
        conditions.finest,
        table.markdown()
    )
}

fn plot(lines: &[Line]) -> Result<String, Failure> {
    type Value = fn(&Line, usize) -> f64;
    let panel = |name: &'static str, ours: Value, paper: Value| {
        let series = (0..SCENES.len()).flat_map(|s| {
            let points = |value: Value| lines.iter().map(|l| (l.tolerance, value(l, s))).collect();
            let number = SCENES[s].0;
            [
                Series::new(format!("scene {number}, ours"), points(ours), s, Style::Ours),
                Series::new(format!("scene {number}, paper"), points(paper), s, Style::Paper),
            ]
        });
        Panel::new(String::from(name), "tolerance", name, series.collect()).log_y()
    };
    figure(&[
        panel("patches", |l, s| l.made[s].patches as f64, |l, s| l.paper[s].0),
        panel("seconds", |l, s| l.made[s].seconds, |l, s| l.paper[s].1),
    ])
}
