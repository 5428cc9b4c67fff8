//! What the paper only asserts: how little adaptive subdivision loses.

use hemicube::engines::Draw;
use hemicube::engines::EngineOptions;
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Progress;
use hemicube::refine::factor::RefineError;
use hemicube::scene::{Geometry, Rgb, Scene};
use hemicube::solution::{Adaptive, Clustering, LightError, LightOptions, Solution, light};

use super::Folder;
use super::conditions::Conditions;
use super::measure::scene;
use super::picture::Views;
use super::published::{SCENES, TOLERANCE};
use super::stretch::Stretch;
use super::table::{Table, count, short};
use crate::failure::Failure;
use crate::terminal::Bar;

/// One scene at one tolerance.
struct Loss {
    scene: usize,
    tolerance: f64,
    uniform: usize,
    adaptive: usize,
    /// Relative RMS difference of the patches' irradiance.
    of_patches: f64,
    /// The same of the smooth fields that pictures show.
    of_field: f64,
}

/// Measures, writes `quality.csv` and pictures, and returns the section of the document.
pub fn run(conditions: &Conditions, folder: &Folder<'_>) -> Result<String, Failure> {
    let bar = Bar::new(false);
    let tolerances = &conditions.tolerances;
    let mut sizes = Vec::new();
    for number in 1..=SCENES.len() {
        let geometry = scene(number)?.geometry;
        let finest = Patches::uniform(&geometry, conditions.finest).map_err(Failure::failed)?;
        sizes.push(finest.len());
    }
    let solutions = 1 + tolerances.len() as u64;
    bar.stage("quality", sizes.iter().map(|&n| n as u64 * solutions).sum());
    let mut losses = Vec::new();
    for (number, n) in (1..).zip(sizes) {
        let scene = scene(number)?;
        let lit = |max_factor: Option<f64>| {
            let part = Stretch::new(&bar, n as u64, n);
            let solution = lit(&scene, max_factor, conditions, &part)?;
            part.finish().map(|()| solution)
        };
        let uniform = lit(None)?;
        let views = Views::new(&scene, &uniform, conditions, &bar)?;
        for &tolerance in tolerances {
            let adaptive = lit(Some(tolerance))?;
            losses.push(loss(number, tolerance, &scene, &uniform, &adaptive));
            if tolerance == TOLERANCE {
                views.write(number, &adaptive, folder, &bar)?;
            }
        }
    }
    bar.finish();
    folder.write("quality.csv", csv(&losses).as_bytes())?;
    Ok(section(&losses, conditions))
}

/// The lit scene, subdivided uniformly at the finest size or adaptively down to it.
fn lit(
    scene: &Scene,
    max_factor: Option<f64>,
    conditions: &Conditions,
    progress: &dyn Progress,
) -> Result<Solution, Failure> {
    let min_area = conditions.finest;
    let adaptive = max_factor.map(|max_factor| Adaptive { max_factor, min_area });
    let options = LightOptions {
        cluster: Clustering::Off,
        patch_size: if adaptive.is_some() { None } else { Some(min_area) },
        adaptive,
        engine: EngineOptions::Hemicube(conditions.hemicube(Draw::Sources)),
        memory: conditions.memory,
        ..LightOptions::default()
    };
    light(scene, &options, progress).map_err(|e| {
        Failure::of(e, |e| match e {
            LightError::Refine(RefineError::Tolerance(_)) | LightError::Memory { .. } => {
                Failure::input(e)
            }
            e => Failure::failed(e),
        })
    })
}

fn loss(
    number: usize,
    tolerance: f64,
    scene: &Scene,
    uniform: &Solution,
    adaptive: &Solution,
) -> Loss {
    let fields = [uniform.field(scene), adaptive.field(scene)];
    let g = &scene.geometry;
    let coarse = |i: PatchId| {
        let point = uniform.patches.center(i);
        adaptive.patches.at(point).filter(|j| adaptive.usable[j.index()])
    };
    let values = |i: PatchId| {
        let j = coarse(i)?;
        Some([uniform.irradiance[i.index()], adaptive.irradiance[j.index()]])
    };
    let smooth = |i: PatchId| {
        coarse(i)?;
        Some([0, 1].map(|k: usize| fields[k].at(uniform.patches.center(i))))
    };
    let rms = |value: &dyn Fn(PatchId) -> Option<[Rgb; 2]>| relative_rms(g, uniform, value);
    Loss {
        scene: number,
        tolerance,
        uniform: uniform.patches.len(),
        adaptive: adaptive.patches.len(),
        of_patches: rms(&values),
        of_field: rms(&smooth),
    }
}

/// Area-weighted RMS of the difference of two values over the RMS of the first, over all solid
/// surfaces that stand for what is seen of them.
fn relative_rms(
    geometry: &Geometry,
    uniform: &Solution,
    values: impl Fn(PatchId) -> Option<[Rgb; 2]>,
) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    let patches = &uniform.patches;
    for i in patches.ids().filter(|i| uniform.usable[i.index()]) {
        if !geometry.is_solid(patches.cell(i).triangle) {
            continue;
        }
        let Some([a, b]) = values(i) else { continue };
        difference += patches.area(i) * (a - b).length_squared();
        size += patches.area(i) * a.length_squared();
    }
    if size > 0.0 { (difference / size).sqrt() } else { 0.0 }
}

fn csv(losses: &[Loss]) -> String {
    let mut table = Table::new([
        "scene",
        "tolerance",
        "fragments_uniform",
        "fragments_adaptive",
        "rms_patches_percent",
        "rms_field_percent",
    ]);
    for l in losses {
        table.push([
            l.scene.to_string(),
            l.tolerance.to_string(),
            l.uniform.to_string(),
            l.adaptive.to_string(),
            format!("{:.4}", 100.0 * l.of_patches),
            format!("{:.4}", 100.0 * l.of_field),
        ]);
    }
    table.csv()
}

fn section(losses: &[Loss], conditions: &Conditions) -> String {
    let mut table = Table::new([
        "scene",
        "tolerance",
        "patches, uniform",
        "patches, adaptive",
        "RMS difference of patches",
        "RMS difference of pictures' field",
    ]);
    for l in losses {
        table.push([
            l.scene.to_string(),
            l.tolerance.to_string(),
            count(l.uniform),
            count(l.adaptive),
            format!("{} %", short(100.0 * l.of_patches)),
            format!("{} %", short(100.0 * l.of_field)),
        ]);
    }
    let mut text = format!(
        "Irradiance of the adaptive solution against the uniform one of {} m², at the centres of \
         the \
         uniform patches, weighted by area, relative to its RMS:\n\n{}",
        conditions.finest,
        table.markdown()
    );
    for number in 1..=SCENES.len() {
        text += &super::picture::gallery(number);
    }
    text
}
