//! Table 2: uniform against adaptive subdivision at one tolerance.

use std::sync::Arc;
use std::time::Instant;

use hemicube::engines::{Draw, Engine};
use hemicube::form_factors::FormFactors;
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Progress;
use hemicube::refine::factor::{FactorRule, RefineError};
use hemicube::scene::Geometry;

use super::Folder;
use super::conditions::Conditions;
use super::fit::gain;
use super::measure::{assembly_failure, best, hemicube, scene};
use super::plot::{Panel, Series, Style, figure};
use super::published::{SCENES, TABLE2, TOLERANCE, of};
use super::stretch::Stretch;
use super::table::{Table, count, percent, short};
use crate::failure::Failure;
use crate::terminal::Bar;

/// One scene at one size.
struct Cell {
    scene: usize,
    size: f64,
    /// Patches of the uniform mesh, which are rows made too.
    uniform: usize,
    uniform_s: f64,
    adaptive: Made,
    paper: [f64; 5],
}

impl Cell {
    fn gain(&self) -> f64 {
        gain(self.uniform_s, self.adaptive.seconds)
    }
}

/// What adaptive subdivision took.
#[derive(Debug, Clone, Copy)]
pub struct Made {
    /// Patches of the adaptive mesh.
    pub patches: usize,
    /// Rows made, all passes together.
    pub rows: usize,
    /// Seconds.
    pub seconds: f64,
}

/// Adaptive form factors, from whole source triangles to patches of `finest`, sources drawn.
pub fn adaptive(
    geometry: &Geometry,
    finest: &Arc<Patches>,
    size: f64,
    tolerance: f64,
    conditions: &Conditions,
    progress: &Stretch<'_>,
) -> Result<Made, Failure> {
    let rule =
        FactorRule { max_factor: tolerance, min_area: size, start_area: None, balance: false };
    let start = Instant::now();
    let mut engine = hemicube(geometry, finest, conditions, Draw::Sources)?;
    let refined = rule
        .refine(geometry, finest.clone(), &mut engine, conditions.memory, progress)
        .map_err(|e| match e {
        RefineError::Assemble(e) => assembly_failure(e),
        e => Failure::failed(e),
    })?;
    let seconds = start.elapsed().as_secs_f64();
    Ok(Made { patches: refined.patches.len(), rows: refined.rows_made, seconds })
}

/// Seconds for the form factors of a uniform mesh, kept as the adaptive ones are.
fn uniform(
    geometry: &Geometry,
    patches: &Patches,
    conditions: &Conditions,
    progress: &Stretch<'_>,
) -> Result<f64, Failure> {
    let ids: Vec<PatchId> = patches.ids().collect();
    let start = Instant::now();
    let mut engine = hemicube(geometry, patches, conditions, Draw::Sources)?;
    let mut rows = FormFactors::new(patches.len(), conditions.memory);
    engine.make(&ids, &mut rows, progress).map_err(assembly_failure)?;
    Ok(start.elapsed().as_secs_f64())
}

/// Measures, writes `table2.csv` and a plot, and returns the section of the document.
pub fn run(conditions: &Conditions, folder: &Folder<'_>) -> Result<String, Failure> {
    let mut meshes = Vec::new();
    for number in 1..=SCENES.len() {
        let scene = scene(number)?;
        for &size in &conditions.sizes {
            let patches = Patches::uniform(&scene.geometry, size).map_err(Failure::failed)?;
            meshes.push((number, size, Arc::new(patches)));
        }
    }
    let bar = Bar::new(false);
    let rows = |n: usize| (n * conditions.repeats) as u64;
    bar.stage("table 2", meshes.iter().map(|m| 2 * rows(m.2.len())).sum());
    let mut cells = Vec::new();
    for (number, size, patches) in meshes {
        let geometry = scene(number)?.geometry;
        let n = patches.len();
        let part = Stretch::new(&bar, 2 * rows(n), 2 * n * conditions.repeats);
        let mut adaptive = Made { patches: 0, rows: 0, seconds: 0.0 };
        let [uniform_s, seconds] = best(conditions, || {
            let uniform_s = uniform(&geometry, &patches, conditions, &part)?;
            adaptive = self::adaptive(&geometry, &patches, size, TOLERANCE, conditions, &part)?;
            Ok([uniform_s, adaptive.seconds])
        })?;
        adaptive.seconds = seconds;
        part.finish()?;
        let paper = of(TABLE2, number, size);
        cells.push(Cell { scene: number, size, uniform: n, uniform_s, adaptive, paper });
    }
    bar.finish();
    folder.write("table2.csv", csv(&cells).as_bytes())?;
    folder.write("images/paper-table2-gain.svg", plot(&cells)?.as_bytes())?;
    Ok(section(&cells))
}

fn deviation(ours: usize, paper: f64) -> f64 {
    (ours as f64 / paper - 1.0) * 100.0
}

fn csv(cells: &[Cell]) -> String {
    let mut table = Table::new([
        "scene",
        "fragment_size",
        "fragments_uniform",
        "fragments_adaptive",
        "rows_uniform",
        "rows_adaptive",
        "uniform_s",
        "adaptive_s",
        "gain_percent",
        "uniform_deviation_percent",
        "adaptive_deviation_percent",
        "paper_fragments_uniform",
        "paper_fragments_adaptive",
        "paper_uniform_s",
        "paper_adaptive_s",
        "paper_gain_percent",
    ]);
    for c in cells {
        let ours = [c.uniform, c.adaptive.patches, c.uniform, c.adaptive.rows];
        let measured = [c.uniform_s, c.adaptive.seconds].map(|s| format!("{s:.5}"));
        let derived =
            [c.gain(), deviation(c.uniform, c.paper[0]), deviation(c.adaptive.patches, c.paper[1])];
        table.push(
            [c.scene.to_string(), c.size.to_string()]
                .into_iter()
                .chain(ours.map(|n| n.to_string()))
                .chain(measured)
                .chain(derived.map(|x| format!("{x:.2}")))
                .chain(c.paper.map(|x| x.to_string())),
        );
    }
    table.csv()
}

fn section(cells: &[Cell]) -> String {
    let mut table = Table::new([
        "scene, size (m²)",
        "uniform: rows",
        "adaptive: patches",
        "rows made",
        "uniform s",
        "adaptive s",
        "T",
        "paper: uniform",
        "adaptive",
        "uniform s",
        "adaptive s",
        "T",
    ]);
    for c in cells {
        let [uniform, adaptive, uniform_s, adaptive_s, gain] = c.paper;
        let named =
            |n: f64, ours: usize| format!("{} ({:+.0} %)", count(n as usize), deviation(ours, n));
        table.push([
            format!("{}, {}", c.scene, c.size),
            count(c.uniform),
            count(c.adaptive.patches),
            count(c.adaptive.rows),
            short(c.uniform_s),
            short(c.adaptive.seconds),
            percent(c.gain()),
            named(uniform, c.uniform),
            named(adaptive, c.adaptive.patches),
            short(uniform_s),
            short(adaptive_s),
            percent(gain),
        ]);
    }
    format!(
        "{}\nIn brackets: by how much our count exceeds the paper's.\n\n\
         ![Gain of adaptive subdivision](images/paper-table2-gain.svg)\n",
        table.markdown()
    )
}

fn plot(cells: &[Cell]) -> Result<String, Failure> {
    let panels = (1..=SCENES.len()).map(|number| {
        let of_scene = || cells.iter().filter(|c| c.scene == number);
        let ours = of_scene().map(|c| (c.uniform as f64, c.gain())).collect();
        let rows = of_scene()
            .map(|c| (c.uniform as f64, gain(c.uniform as f64, c.adaptive.rows as f64)))
            .collect();
        let paper = of_scene().map(|c| (c.paper[0], c.paper[4])).collect();
        let series = vec![
            Series::new("ours, seconds", ours, 0, Style::Ours),
            Series::new("ours, rows", rows, 2, Style::Ours),
            Series::new("paper, seconds", paper, 0, Style::Paper),
        ];
        Panel::new(format!("scene {number}"), "patches, uniform", "gain over uniform, %", series)
    });
    figure(&panels.collect::<Vec<_>>())
}
