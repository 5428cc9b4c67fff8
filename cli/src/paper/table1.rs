//! Table 1: classical radiosity against hemicubes.

use hemicube::form_factors::Draw;
use hemicube::patches::Patches;
use hemicube::progress::Progress;

use super::Folder;
use super::conditions::Conditions;
use super::fit::{gain, growth};
use super::measure::{Part, Timing, Way, all_rows, scene};
use super::plot::{Panel, Series, Style, figure};
use super::published::{SCENES, TABLE1, of};
use super::table::{Table, count, percent, short};
use crate::failure::Failure;
use crate::terminal::Bar;

/// Who is measured: what the columns begin with, and what people call it.
const WAYS: [(Way, &str, &str); 3] = [
    (Way::Classical, "classical", "classical"),
    (Way::Hemicube(Draw::Patches), "patches", "hemicube, patches drawn"),
    (Way::Hemicube(Draw::Sources), "sources", "hemicube, sources drawn"),
];

/// One scene at one size.
struct Cell {
    scene: usize,
    size: f64,
    n: usize,
    timings: [Timing; WAYS.len()],
    paper: [f64; 4],
}

impl Cell {
    fn gain(&self, way: usize) -> f64 {
        gain(self.timings[0].seconds, self.timings[way].seconds)
    }
}

/// Measures, writes `table1.csv` and plots, and returns the section of the document.
pub fn run(conditions: &Conditions, folder: &Folder<'_>) -> Result<String, Failure> {
    let mut meshes = Vec::new();
    for number in 1..=SCENES.len() {
        let scene = scene(number)?;
        for &size in &conditions.sizes {
            let patches = Patches::uniform(&scene.geometry, size).map_err(Failure::failed)?;
            meshes.push((number, size, patches.len()));
        }
    }
    let weight = |way, n| (1000.0 * expected(way, n, conditions)) as u64 + 1;
    let bar = Bar::new(false);
    let total = meshes.iter().flat_map(|m| WAYS.map(|w| weight(w.0, m.2))).sum();
    bar.stage("table 1", total);
    let mut cells = Vec::new();
    for (number, size, n) in meshes {
        let scene = scene(number)?;
        let patches = Patches::uniform(&scene.geometry, size).map_err(Failure::failed)?;
        let time = |way| {
            let part = Part::new(&bar, weight(way, n), n);
            let timing = all_rows(way, &scene.geometry, &patches, conditions, &part)?;
            part.finish().map(|()| timing)
        };
        let timings = [time(WAYS[0].0)?, time(WAYS[1].0)?, time(WAYS[2].0)?];
        cells.push(Cell { scene: number, size, n, timings, paper: of(TABLE1, number, size) });
    }
    bar.finish();
    folder.write("table1.csv", csv(&cells).as_bytes())?;
    folder.write("images/paper-table1-time.svg", times(&cells)?.as_bytes())?;
    folder.write("images/paper-table1-gain.svg", gains(&cells)?.as_bytes())?;
    Ok(section(&cells))
}

/// Seconds that a cell may take, for the time left; a rough guess.
fn expected(way: Way, n: usize, conditions: &Conditions) -> f64 {
    let n = n as f64;
    let seconds = match way {
        Way::Classical => 4e-10 * n * n * n,
        Way::Hemicube(Draw::Patches) => n * (2e-4 * conditions.pixels() + 3e-8 * n),
        Way::Hemicube(Draw::Sources) => n * 2e-4 * conditions.pixels().max(0.3),
    };
    seconds.min(conditions.budget)
}

fn csv(cells: &[Cell]) -> String {
    let mut columns: Vec<String> =
        ["scene", "fragment_size", "fragments", "paper_fragments", "fragments_deviation_percent"]
            .map(String::from)
            .to_vec();
    for (way, name, _) in WAYS {
        for column in ["s", "estimated", "rows_measured", "ms_per_row"] {
            columns.push(format!("{name}_{column}"));
        }
        columns.push(match way {
            Way::Classical => format!("{name}_tests_per_s"),
            Way::Hemicube(_) => format!("{name}_gain_percent"),
        });
    }
    columns.extend(
        ["paper_classical_s", "paper_hemicube_gpu_s", "paper_gain_percent"].map(String::from),
    );
    let mut table = Table::new(columns);
    for c in cells {
        let [n, classical, hemicube, gain] = c.paper;
        let mut row = vec![
            c.scene.to_string(),
            c.size.to_string(),
            c.n.to_string(),
            n.to_string(),
            format!("{:.2}", (c.n as f64 / n - 1.0) * 100.0),
        ];
        for (w, t) in c.timings.iter().enumerate() {
            row.push(format!("{:.5}", t.seconds));
            row.push(t.estimated.to_string());
            row.push(t.rows.to_string());
            row.push(format!("{:.5}", 1000.0 * t.seconds / c.n as f64));
            row.push(match t.tests_per_second {
                Some(tests) => format!("{tests:.0}"),
                None => format!("{:.2}", c.gain(w)),
            });
        }
        row.extend([classical, hemicube, gain].map(|x| x.to_string()));
        table.push(row);
    }
    table.csv()
}

fn section(cells: &[Cell]) -> String {
    let mut table = Table::new([
        "scene, size (m²)",
        "patches",
        "paper",
        "classical s",
        "patches drawn s",
        "sources drawn s",
        "T patches",
        "T sources",
        "paper: classical s",
        "GPU s",
        "T",
    ]);
    for c in cells {
        let [n, classical, hemicube, gain] = c.paper;
        let seconds = |w: usize| {
            let t = &c.timings[w];
            format!("{}{}", if t.estimated { "≈ " } else { "" }, short(t.seconds))
        };
        table.push([
            format!("{}, {}", c.scene, c.size),
            count(c.n),
            format!("{} ({:+.1} %)", count(n as usize), (c.n as f64 / n - 1.0) * 100.0),
            seconds(0),
            seconds(1),
            seconds(2),
            percent(c.gain(1)),
            percent(c.gain(2)),
            short(classical),
            short(hemicube),
            percent(gain),
        ]);
    }
    let mut rows = Table::new([
        "scene, size (m²)",
        "classical: rows measured",
        "ms a row",
        "tests a second",
        "patches drawn: rows measured",
        "ms a row",
        "sources drawn: ms a row",
        "paper: classical ms a row",
        "GPU ms a row",
    ]);
    for c in cells {
        let each = |w: usize| short(1000.0 * c.timings[w].seconds / c.n as f64);
        let [n, classical, hemicube, _] = c.paper;
        rows.push([
            format!("{}, {}", c.scene, c.size),
            count(c.timings[0].rows),
            each(0),
            c.timings[0].tests_per_second.map_or_else(String::new, |t| format!("{t:.2e}")),
            count(c.timings[1].rows),
            each(1),
            each(2),
            short(1000.0 * classical / n),
            short(1000.0 * hemicube / n),
        ]);
    }
    format!(
        "{}\nHow time grows with the number n of patches:\n\n{}\nRow by row:\n\n{}\n\
         ![Time against the number of patches](images/paper-table1-time.svg)\n\n\
         ![Gain over classical radiosity](images/paper-table1-gain.svg)\n",
        table.markdown(),
        exponents(cells).markdown(),
        rows.markdown()
    )
}

fn exponents(cells: &[Cell]) -> Table {
    let names = WAYS.map(|w| w.2);
    let paper = ["the paper's classical", "the paper's GPU hemicube"];
    let mut table = Table::new(std::iter::once("scene").chain(names).chain(paper));
    for number in 1..=SCENES.len() {
        let ours = (0..WAYS.len()).map(|w| growth(&points(cells, number, w)));
        let theirs = (1..=2).map(|k| growth(&published(cells, number, k)));
        table.push(std::iter::once(number.to_string()).chain(ours).chain(theirs));
    }
    table
}

/// (n, seconds) of ours in one scene.
fn points(cells: &[Cell], scene: usize, way: usize) -> Vec<(f64, f64)> {
    let cells = cells.iter().filter(|c| c.scene == scene);
    cells.map(|c| (c.n as f64, c.timings[way].seconds)).collect()
}

/// (n, column) of the paper's in one scene.
fn published(cells: &[Cell], scene: usize, column: usize) -> Vec<(f64, f64)> {
    let cells = cells.iter().filter(|c| c.scene == scene);
    cells.map(|c| (c.paper[0], c.paper[column])).collect()
}

fn times(cells: &[Cell]) -> Result<String, Failure> {
    let panels = (1..=SCENES.len()).map(|number| {
        let ours = (0..WAYS.len()).map(|w| {
            let points = points(cells, number, w);
            Series::new(format!("{} {}", WAYS[w].2, growth(&points)), points, w, Style::Ours)
        });
        let theirs = [("paper, classical", 1, 0), ("paper, GPU hemicube", 2, 1)].map(|p| {
            let points = published(cells, number, p.1);
            Series::new(format!("{} {}", p.0, growth(&points)), points, p.2, Style::Paper)
        });
        let series = ours.chain(theirs).collect();
        Panel::new(format!("scene {number}"), "patches", "seconds for all rows", series).log_y()
    });
    figure(&panels.collect::<Vec<_>>())
}

fn gains(cells: &[Cell]) -> Result<String, Failure> {
    let panels = (1..=SCENES.len()).map(|number| {
        let ours = (1..WAYS.len()).map(|w| {
            let cells = cells.iter().filter(|c| c.scene == number);
            let points = cells.map(|c| (c.n as f64, c.gain(w))).filter(|p| p.1 > 0.0).collect();
            Series::new(WAYS[w].2, points, w, Style::Ours)
        });
        let paper =
            Series::new("paper, GPU hemicube", published(cells, number, 3), 1, Style::Paper);
        let series = ours.chain([paper]).collect();
        Panel::new(format!("scene {number}"), "patches", "gain over classical, %", series).log_y()
    });
    figure(&panels.collect::<Vec<_>>())
}
