//! Table 1: classical radiosity against hemicubes.

use hemicube::engines::Draw;
use hemicube::patches::Patches;
use hemicube::progress::Progress;

use super::Folder;
use super::conditions::Conditions;
use super::device::Device;
use super::fit::{gain, growth};
use super::measure::{Subject, Timing, Way, scene};
use super::plot::{Panel, Series, Style, figure};
use super::published::{SCENES, TABLE1, of};
use super::stretch::Stretch;
use super::table::{Table, count, percent, short};
use crate::failure::Failure;
use crate::terminal::Bar;

/// Who is measured: what columns of the CSV begin with, and what people call it.
type Measured = (Way, &'static str, &'static str);

const ON_CPU: [Measured; 3] = [
    (Way::Classical, "classical", "classical"),
    (Way::Hemicube(Draw::Patches), "patches", "hemicube, patches drawn"),
    (Way::Hemicube(Draw::Sources), "sources", "hemicube, sources drawn"),
];
const ON_GPU: [Measured; 2] = [
    (Way::Gpu(Draw::Patches), "gpu_patches", "GPU, patches drawn"),
    (Way::Gpu(Draw::Sources), "gpu_sources", "GPU, sources drawn"),
];

/// All that was measured.
struct Results {
    ways: Vec<Measured>,
    cells: Vec<Cell>,
    device: String,
}

/// One scene at one size.
struct Cell {
    scene: usize,
    size: f64,
    n: usize,
    /// In the order of the ways.
    timings: Vec<Timing>,
    paper: [f64; 4],
}

impl Cell {
    fn gain(&self, way: usize) -> f64 {
        gain(self.timings[0].seconds, self.timings[way].seconds)
    }

    /// Of the number of patches from the paper's, in percent.
    fn deviation(&self) -> f64 {
        (self.n as f64 / self.paper[0] - 1.0) * 100.0
    }
}

/// Measures, writes `table1.csv` and plots, and returns the section of the document.
pub fn run(conditions: &Conditions, folder: &Folder<'_>) -> Result<String, Failure> {
    let results = measure(conditions)?;
    folder.write("table1.csv", results.csv().as_bytes())?;
    folder.write("images/paper-table1-time.svg", results.times()?.as_bytes())?;
    folder.write("images/paper-table1-gain.svg", results.gains()?.as_bytes())?;
    Ok(results.section())
}

fn measure(conditions: &Conditions) -> Result<Results, Failure> {
    let device = Device::open(conditions);
    let mut ways = ON_CPU.to_vec();
    if device.is_there() {
        ways.extend(ON_GPU);
    }
    let mut meshes = Vec::new();
    for number in 1..=SCENES.len() {
        let geometry = scene(number)?.geometry;
        for &size in &conditions.sizes {
            let patches = Patches::uniform(&geometry, size).map_err(Failure::failed)?;
            meshes.push((number, size, patches));
        }
    }
    let weight = |way, n| (1000.0 * expected(way, n, conditions)) as u64 + 1;
    let bar = Bar::new(false);
    let of_mesh = |n| ways.iter().map(|w| weight(w.0, n)).sum::<u64>();
    bar.stage("table 1", meshes.iter().map(|m| of_mesh(m.2.len())).sum());
    let mut cells = Vec::new();
    for (number, size, patches) in &meshes {
        let (geometry, n) = (&scene(*number)?.geometry, patches.len());
        let subject = Subject { geometry, patches, conditions, device: &device };
        let mut timings = Vec::new();
        for (way, _, _) in &ways {
            let part = Stretch::new(&bar, weight(*way, n), n);
            timings.push(subject.all_rows(*way, &part)?);
            part.finish()?;
        }
        let paper = of(TABLE1, *number, *size);
        cells.push(Cell { scene: *number, size: *size, n, timings, paper });
    }
    bar.finish();
    Ok(Results { ways, cells, device: device.says })
}

/// Seconds that a cell may take, for the time left; a rough guess.
fn expected(way: Way, n: usize, conditions: &Conditions) -> f64 {
    let n = n as f64;
    let seconds = match way {
        Way::Classical => 4e-10 * n * n * n,
        Way::Hemicube(Draw::Patches) => n * (2e-4 * conditions.pixels() + 3e-8 * n),
        Way::Hemicube(Draw::Sources) => n * 2e-4 * conditions.pixels().max(0.3),
        Way::Gpu(_) => n * 5e-5,
    };
    seconds.min(conditions.budget)
}

impl Results {
    fn csv(&self) -> String {
        let mut columns: Vec<String> = [
            "scene",
            "fragment_size",
            "fragments",
            "paper_fragments",
            "fragments_deviation_percent",
        ]
        .map(String::from)
        .to_vec();
        for (way, name, _) in &self.ways {
            for column in ["s", "estimated", "rows_measured", "ms_per_row"] {
                columns.push(format!("{name}_{column}"));
            }
            let last = if *way == Way::Classical { "tests_per_s" } else { "gain_percent" };
            columns.push(format!("{name}_{last}"));
        }
        let paper = ["paper_classical_s", "paper_hemicube_gpu_s", "paper_gain_percent"];
        columns.extend(paper.map(String::from));
        let mut table = Table::new(columns);
        for c in &self.cells {
            let [n, classical, hemicube, gain] = c.paper;
            let mut row = vec![
                c.scene.to_string(),
                c.size.to_string(),
                c.n.to_string(),
                n.to_string(),
                format!("{:.2}", c.deviation()),
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

    fn section(&self) -> String {
        format!(
            "{}\n\n{}\nHow time grows with the number n of patches:\n\n{}\nRow by row:\n\n{}\n\
             ![Time against the number of patches](images/paper-table1-time.svg)\n\n\
             ![Gain over classical radiosity](images/paper-table1-gain.svg)\n",
            self.device,
            self.seconds().markdown(),
            self.exponents().markdown(),
            self.rows().markdown()
        )
    }

    /// Seconds, and gains over the classical engine.
    fn seconds(&self) -> Table {
        let mut columns =
            vec![String::from("scene, size (m²)"), String::from("patches"), String::from("paper")];
        columns.extend(self.ways.iter().map(|w| format!("{}: s", w.2)));
        columns.extend(self.ways[1..].iter().map(|w| format!("T {}", w.2)));
        columns.extend(["paper: classical s", "GPU s", "T"].map(String::from));
        let mut table = Table::new(columns);
        for c in &self.cells {
            let [n, classical, hemicube, gain] = c.paper;
            let about = |t: &Timing| if t.estimated { "≈ " } else { "" };
            let mut row = vec![
                format!("{}, {}", c.scene, c.size),
                count(c.n),
                format!("{} ({:+.1} %)", count(n as usize), c.deviation()),
            ];
            row.extend(c.timings.iter().map(|t| format!("{}{}", about(t), short(t.seconds))));
            row.extend((1..self.ways.len()).map(|w| percent(c.gain(w))));
            row.extend([short(classical), short(hemicube), percent(gain)]);
            table.push(row);
        }
        table
    }

    /// Milliseconds a row, and how many rows were measured.
    fn rows(&self) -> Table {
        let mut columns =
            vec![String::from("scene, size (m²)"), String::from("classical: tests a second")];
        for (_, _, name) in &self.ways {
            columns.extend([format!("{name}: ms a row"), String::from("rows measured")]);
        }
        columns.extend(["paper: classical ms a row", "GPU ms a row"].map(String::from));
        let mut table = Table::new(columns);
        for c in &self.cells {
            let [n, classical, hemicube, _] = c.paper;
            let tests = c.timings[0].tests_per_second;
            let mut row = vec![
                format!("{}, {}", c.scene, c.size),
                tests.map_or_else(String::new, |t| format!("{t:.2e}")),
            ];
            for t in &c.timings {
                row.extend([short(1000.0 * t.seconds / c.n as f64), count(t.rows)]);
            }
            row.extend([classical, hemicube].map(|s| short(1000.0 * s / n)));
            table.push(row);
        }
        table
    }

    fn exponents(&self) -> Table {
        let names = self.ways.iter().map(|w| w.2);
        let paper = ["the paper's classical", "the paper's GPU hemicube"];
        let mut table = Table::new(std::iter::once("scene").chain(names).chain(paper));
        for number in 1..=SCENES.len() {
            let ours = (0..self.ways.len()).map(|w| growth(&self.points(number, w)));
            let theirs = (1..=2).map(|k| growth(&self.published(number, k)));
            table.push(std::iter::once(number.to_string()).chain(ours).chain(theirs));
        }
        table
    }

    fn of_scene(&self, scene: usize) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |c| c.scene == scene)
    }

    /// (n, seconds) of ours in one scene.
    fn points(&self, scene: usize, way: usize) -> Vec<(f64, f64)> {
        self.of_scene(scene).map(|c| (c.n as f64, c.timings[way].seconds)).collect()
    }

    /// (n, column) of the paper's in one scene.
    fn published(&self, scene: usize, column: usize) -> Vec<(f64, f64)> {
        self.of_scene(scene).map(|c| (c.paper[0], c.paper[column])).collect()
    }

    fn times(&self) -> Result<String, Failure> {
        let panels = (1..=SCENES.len()).map(|number| {
            let ours = self.ways.iter().enumerate().map(|(w, (_, _, name))| {
                let points = self.points(number, w);
                Series::new(format!("{name} {}", growth(&points)), points, w, Style::Ours)
            });
            let theirs = [("paper, classical", 1, 0), ("paper, GPU hemicube", 2, 1)].map(|p| {
                let points = self.published(number, p.1);
                Series::new(format!("{} {}", p.0, growth(&points)), points, p.2, Style::Paper)
            });
            let series = ours.chain(theirs).collect();
            Panel::new(format!("scene {number}"), "patches", "seconds for all rows", series).log_y()
        });
        figure(&panels.collect::<Vec<_>>())
    }

    fn gains(&self) -> Result<String, Failure> {
        let panels = (1..=SCENES.len()).map(|number| {
            // Logarithms show no losses; the table does.
            let gains = |w: usize| {
                let points = self.of_scene(number).map(|c| (c.n as f64, c.gain(w)));
                points.filter(|p| p.1 > 0.0).collect()
            };
            let ours =
                (1..self.ways.len()).map(|w| Series::new(self.ways[w].2, gains(w), w, Style::Ours));
            let paper = self.published(number, 3);
            let paper = Series::new("paper, GPU hemicube", paper, 1, Style::Paper);
            let series = ours.chain([paper]).collect();
            Panel::new(format!("scene {number}"), "patches", "gain over classical, %", series)
                .log_y()
        });
        figure(&panels.collect::<Vec<_>>())
    }
}
