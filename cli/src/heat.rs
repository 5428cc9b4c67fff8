//! `hemicube heat`: temperatures and net fluxes by radiation.

mod given;
mod picture;
mod say;
mod write;

use std::time::Instant;

use hemicube::direct::from_lamps;
use hemicube::engines::{EngineOptions, ExactOptions};
use hemicube::heat::{Exchange, HeatBalance, HeatError, HeatInput, Sunlight, balance, gebhart};
use hemicube::matrix::{Lumped, Matrix, MatrixOptions, Rows, SurfaceRow, make};
use hemicube::progress::Progress;
use hemicube::report::Stage;
use hemicube::scene::Scene;
use hemicube::visibility::Bvh;

use crate::args::Heat;
use crate::failure::Failure;
use crate::input;
use crate::machine;
use crate::outputs;
use crate::remedy;
use crate::render::set_threads;
use crate::terminal::{Bar, hear_interrupts};
use given::Given;

/// What the balance is of: rows of form factors, lumped or not.
struct Model<'a> {
    scene: &'a Scene,
    matrix: &'a Matrix,
    /// None where rows are the matrix's own.
    lumped: Option<&'a Lumped>,
    /// What rows stand for.
    rows: Vec<SurfaceRow>,
}

impl Model<'_> {
    fn factors(&self) -> &dyn Rows {
        match self.lumped {
            Some(lumped) => lumped,
            None => self.matrix,
        }
    }

    /// The row of row `i` of the matrix.
    fn row_of(&self, i: usize) -> usize {
        self.lumped.map_or(i, |lumped| lumped.group_of(i))
    }
}

/// Runs the command.
pub fn run(args: &Heat) -> Result<(), Failure> {
    hear_interrupts();
    set_threads(args.run.threads)?;
    write::check(args)?;
    let mut scene = input::read_model(&args.model, args.sides.choice(), 0.9)?;
    let files = [
        ("-o", args.output.as_ref()),
        ("--surfaces", args.surfaces.as_ref()),
        ("--gebhart", args.gebhart.as_ref()),
        ("--conductors", args.conductors.as_ref()),
        ("--picture", args.picture.as_ref()),
        ("--report", args.run.report.as_ref()),
    ];
    outputs::check(&files, &scene.files)?;
    // Reflectances are of light, and not used.
    scene.findings.retain(|f| !f.message.contains("reflectance"));
    input::say_findings(&scene, args.run.quiet);
    let grouping = args.group.map(|group| scene.grouping(group.by().0));
    let given = Given::new(args, &scene, grouping.as_ref())?;
    let view = picture::view(args, &scene)?;
    scene.lamps = args.sun.map(|sun| input::sunlight(&scene, sun)).into_iter().collect();
    let memory = args.run.memory.unwrap_or_else(machine::available_memory);
    let exact = match args.error {
        Some(percent) => ExactOptions { error: percent / 100.0, ..ExactOptions::default() },
        None => ExactOptions::default(),
    };
    let options = MatrixOptions {
        patch_size: args.patch_size,
        engine: EngineOptions::Exact(exact),
        memory,
        ..MatrixOptions::default()
    };
    let bar = Bar::new(args.run.quiet);
    let mut matrix = make(&scene.geometry, &options, &bar)
        .map_err(|e| remedy::matrix_failure(&args.model.scene, e, remedy::of_heat_matrix))?;
    matrix.report.scene.clone_from(&scene.name);
    let start = Instant::now();
    let by_face = args.patch_size.is_none() && !scene.geometry.face_of.is_empty();
    let lumped = match &grouping {
        Some(grouping) => Some(Lumped::new(&matrix, &scene.geometry, grouping)),
        None => by_face.then(|| Lumped::by_face(&matrix, &scene.geometry)),
    };
    let lumped = lumped.transpose().map_err(Failure::failed)?;
    let rows = match &lumped {
        Some(lumped) => lumped.surfaces(&scene.geometry),
        None => matrix.surfaces(&scene.geometry),
    };
    let model = Model { scene: &scene, matrix: &matrix, lumped: lumped.as_ref(), rows };
    let of_rows = given.of_rows(&model);
    let failure = |e: HeatError| {
        Failure::of(e, |e| {
            let place = given::place(&e, &model, &of_rows);
            let text = format!("{}: {place}{e}{}", scene.name, remedy::of_heat(&e));
            match e {
                HeatError::Stalled { .. } | HeatError::Singular | HeatError::Row(_) => {
                    Failure::Failed(text)
                }
                _ => Failure::Input(text),
            }
        })
    };
    let areas: Vec<f64> = model.rows.iter().map(|r| r.area).collect();
    let environment = args.environment.is_some();
    // Column and factor of each entry.
    let left = memory.saturating_sub(8 * matrix.entries());
    let exchange =
        Exchange::new(model.factors(), &areas, environment, left, &bar).map_err(failure)?;
    let direct = sunshine(&model, &bar);
    let sunny = args.sun.is_some() || args.diffuse_sun.is_some();
    let input = HeatInput {
        exchange: &exchange,
        emissivity: &of_rows.emissivity,
        node_of: &of_rows.node_of,
        conditions: &of_rows.conditions,
        environment: args.environment,
        sunlight: sunny.then(|| Sunlight {
            absorptance: &of_rows.absorptance,
            direct: &direct,
            diffuse: args.diffuse_sun.unwrap_or(0.0),
        }),
        surface_of: &of_rows.surface_of,
        surfaces: of_rows.surfaces.len(),
        error: matrix.report.pairs.map_or(0.0, |p| p.error),
    };
    let found: HeatBalance = balance(&input, &bar).map_err(failure)?;
    let seconds = start.elapsed().as_secs_f64();
    let left = left.saturating_sub(exchange.bytes());
    let factors = match args.gebhart.is_some() || args.conductors.is_some() {
        true => {
            let rows = model.rows.clone();
            Some(gebhart(&exchange, &of_rows.emissivity, rows, left, &bar).map_err(failure)?)
        }
        false => None,
    };
    write::all(args, &model, &of_rows, &found, factors.as_ref(), &bar)?;
    if let (Some(path), Some(view)) = (&args.picture, view) {
        picture::draw(args, path, &view, &model, &found, &bar)?;
    }
    bar.finish();
    let mut report = matrix.report.clone();
    report.stages.push(Stage { name: "heat", seconds });
    report.peak_memory_bytes = machine::peak_memory();
    if !args.run.quiet {
        say::summary(args, &report, &of_rows, &found);
    }
    write::report(args, &report, &found)?;
    write::print(args, &of_rows, &found);
    Ok(())
}

/// Irradiance of each row straight from the sun, W/m².
fn sunshine(model: &Model<'_>, bar: &Bar) -> Vec<f64> {
    let mut sum = vec![0.0; model.rows.len()];
    if model.scene.lamps.is_empty() {
        return sum;
    }
    bar.stage("sunlight", 0);
    let bvh = Bvh::new(&model.scene.geometry);
    let patches = &model.matrix.patches;
    let direct = from_lamps(model.scene, patches, &bvh);
    let mut areas = vec![0.0; model.rows.len()];
    for (i, face) in model.matrix.layout.faces.iter().enumerate() {
        let (Some(patch), row) = (face.patch, model.row_of(i)) else { continue };
        let area = patches.own_area(patch);
        sum[row] += area * direct[patch.index()].x;
        areas[row] += area;
    }
    sum.iter_mut().zip(areas).filter(|s| s.1 > 0.0).for_each(|(s, a)| *s /= a);
    sum
}
