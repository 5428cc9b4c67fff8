//! The conductor: from a scene to its solution.

use std::f64::consts::PI;
use std::sync::Arc;

use rayon::prelude::*;

use super::dark::Rough;
use super::error::LightError;
use super::halves::solve_halves;
use super::memory::{Mesh, check_memory};
use super::options::{Adaptive, CLUSTERED_PATCHES, LightOptions};
use crate::direct::{self, DirectLight, DirectOptions};
use crate::engines::{AssembleError, Engine, EngineOptions, EngineReport, assemble_lit};
use crate::form_factors::{Account, FormFactors, RowsReport};
use crate::patches::{PatchId, Patches, side_index, warn_of_contacts};
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::Field;
use crate::refine::factor::FactorRule;
use crate::report::{Clock, Report, STORED};
use crate::scene::{Rgb, Scene};
use crate::solve::{EnergyBalance, System, solve};
use crate::visibility::{Bvh, COVERED, uncover};

/// A lit scene: patches and their irradiance.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The patches.
    pub patches: Patches,
    /// Irradiance H of each, W/m² or lx.
    pub irradiance: Vec<Rgb>,
    /// Of that, what arrives by way of other surfaces, less an estimate of what lamp-like emitters
    /// reflect, and from the sky.
    pub reflected: Vec<Rgb>,
    /// The same as each of two independent halves of the rays gives it, where rows are sampled.
    pub reflected_halves: Option<[Vec<Rgb>; 2]>,
    /// Whether a patch's value stands for what is seen of it: it has a row and is not covered.
    pub usable: Vec<bool>,
    /// Irradiance as each of two independent halves of the rays alone gives it, where rows are
    /// sampled.
    pub halves: Option<[Vec<Rgb>; 2]>,
    /// How it came about.
    pub report: Report,
}

impl Solution {
    /// Irradiance as a smooth field over the surfaces.
    #[must_use]
    pub fn field<'a>(&'a self, scene: &Scene) -> Field<'a> {
        Field::new(&scene.geometry, &self.patches, &self.irradiance, |i| self.usable[i.index()])
    }

    /// [`field`](Self::field), which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn field_heard<'a>(
        &'a self,
        scene: &Scene,
        progress: &dyn Progress,
    ) -> Result<Field<'a>, Cancelled> {
        let usable = |i: PatchId| self.usable[i.index()];
        Field::new_heard(&scene.geometry, &self.patches, &self.irradiance, usable, progress)
    }

    /// What arrives by way of other surfaces as a smooth field, which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn reflected_field_heard<'a>(
        &'a self,
        scene: &Scene,
        progress: &dyn Progress,
    ) -> Result<Field<'a>, Cancelled> {
        let usable = |i: PatchId| self.usable[i.index()];
        Field::new_heard(&scene.geometry, &self.patches, &self.reflected, usable, progress)
    }
}

/// Lights a scene once, as the options say ([`LightOptions::error`] is for
/// [`Scene::light`](crate::Scene::light)).
///
/// # Errors
/// If the options do not suit the scene or each other, or the work does not fit in memory.
pub fn light(
    scene: &Scene,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    if !options.engine.knows_environment() && scene.sky != Rgb::ZERO {
        return Err(LightError::NoSky);
    }
    let mut clock = Clock::start();
    let bvh = Bvh::new(&scene.geometry);
    progress.advance(0)?;
    let (finest, patch_size) = subdivide(scene, options, progress)?;
    warn_of_contacts(&finest, progress);
    let finest = uncover(&scene.geometry, finest, &bvh, progress)?;
    clock.lap("subdivide");
    let Meshed { patches, factors, lamps, engine, foretold } =
        form_factors(scene, finest, patch_size, &bvh, options, progress)?;
    clock.lap("form factors");
    let analytic = matches!(options.engine, EngineOptions::Rays(_)).then_some(options.direct);
    let made = Made { patches, factors, bvh, analytic, patch_size, engine };
    let mut solution = lit_by(scene, made, &lamps, options, clock, progress)?;
    solution.report.foretold_memory_bytes = Some(foretold);
    Ok(solution)
}

/// The finest mesh asked for, and the largest area of a patch to begin with, m².
fn subdivide(
    scene: &Scene,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<(Patches, f64), LightError> {
    let geometry = &scene.geometry;
    let cluster = options.clusters(geometry);
    let patch_size = match (options.patch_size, options.adaptive) {
        (Some(size), _) => size,
        (None, None) if cluster => Patches::clustered_area(geometry, CLUSTERED_PATCHES),
        (None, None) => Patches::area_adding(geometry, options.default_patches(geometry)),
        // Adaptive subdivision begins with whole source triangles.
        (None, Some(_)) => f64::INFINITY,
    };
    let finest = options.adaptive.map_or(patch_size, |a| a.min_area.min(patch_size));
    let patches = if cluster {
        Patches::clustered_heard(geometry, finest, &scene.optics.material_of, progress)?
    } else {
        Patches::uniform_heard(geometry, finest, progress)?
    };
    Ok((patches, patch_size))
}

/// A mesh, its form factors, and what each patch receives from lamps.
struct Meshed {
    patches: Patches,
    factors: FormFactors,
    lamps: Vec<Rgb>,
    engine: EngineReport,
    /// Bytes that it was foretold to take.
    foretold: u64,
}

/// The form factors of the finest mesh, or of the adaptive one that coarsens it.
fn form_factors(
    scene: &Scene,
    finest: Patches,
    patch_size: f64,
    bvh: &Bvh,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Meshed, LightError> {
    let geometry = &scene.geometry;
    let mut engine = options.engine.engine(geometry, &finest, bvh, options.memory, progress)?;
    let report = options.engine.report(&*engine);
    let count = |size| {
        let options = LightOptions { patch_size: Some(size), ..*options };
        subdivide(scene, &options, progress).ok().map(|(patches, _)| patches.len())
    };
    let count: Option<&dyn Fn(f64) -> Option<usize>> =
        if options.adaptive.is_none() { Some(&count) } else { None };
    let mesh = Mesh { patches: &finest, patch_size, count };
    let foretold = check_memory(&mut *engine, &mesh, options.method, options.memory)?;
    let Some(Adaptive { max_factor, min_area }) = options.adaptive else {
        let lamps = direct::from_lamps(scene, &finest, bvh);
        let factors = rows(scene, (&finest, bvh), &lamps, &mut *engine, options, progress)?;
        drop(engine);
        return Ok(Meshed { patches: finest, factors, lamps, engine: report, foretold });
    };
    let rule = FactorRule { max_factor, min_area, start_area: Some(patch_size), balance: true };
    progress.stage("form factors", 0);
    let shared = Arc::new(finest.clone());
    let refined = rule.refine(geometry, shared, &mut *engine, options.memory, progress)?;
    let centres = engine.sees_from_centres();
    drop(engine);
    let patches = refined.patches;
    let lamps = direct::from_lamps(scene, &patches, bvh);
    // Rows from the centres of patches serve every mesh that has the same centres; rows from all
    // over a patch do not.
    let factors = if centres {
        refined.factors
    } else {
        drop(refined.factors);
        let mut engine =
            options.engine.engine(geometry, &patches, bvh, options.memory, progress)?;
        rows(scene, (&patches, bvh), &lamps, &mut *engine, options, progress)?
    };
    Ok(Meshed { patches, factors, lamps, engine: report, foretold })
}

/// Lights a scene by the form factors of patches that are there already.
pub fn light_by(
    scene: &Scene,
    patches: Patches,
    factors: FormFactors,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let clock = Clock::start();
    warn_of_contacts(&patches, progress);
    let bvh = Bvh::new(&scene.geometry);
    let lamps = direct::from_lamps(scene, &patches, &bvh);
    let patch_size = patches.ids().map(|i| patches.area(i)).fold(0.0, f64::max);
    let engine = EngineReport::named(STORED);
    let made = Made { patches, factors, bvh, analytic: None, patch_size, engine };
    lit_by(scene, made, &lamps, options, clock, progress)
}

/// What light goes by.
struct Made {
    patches: Patches,
    factors: FormFactors,
    bvh: Bvh,
    /// How emitters are analytic, unless all light goes through the rows.
    analytic: Option<DirectOptions>,
    patch_size: f64,
    engine: EngineReport,
}

/// Solves the balance of light by the form factors made.
fn lit_by(
    scene: &Scene,
    made: Made,
    lamps: &[Rgb],
    options: &LightOptions,
    mut clock: Clock,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let geometry = &scene.geometry;
    let Made { patches, factors, bvh, analytic, patch_size, engine } = made;
    let rho = direct::reflectance(&scene.optics, &patches);
    let emission = direct::emission(&scene.optics, &patches);
    let mut direct = match analytic {
        Some(options) => {
            progress.stage("direct light", 0);
            let found = direct::analytic(scene, &patches, &factors, &bvh, options);
            clock.lap("direct light");
            found
        }
        None => direct::through_rows(&factors, &emission, scene.sky)
            .into_iter()
            .map(DirectLight::from)
            .collect(),
    };
    for (direct, lamps) in direct.iter_mut().zip(lamps) {
        *direct += *lamps;
    }
    let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
    let all: Vec<Rgb> = direct.iter().map(|d| d.irradiance).collect();
    let system = System { factors: &factors, rho: &rho, direct: &all, areas: &areas };
    progress.stage("solve", 0);
    let halves = factors.halves();
    let solving = options.solve(halves.is_some());
    let (irradiance, solved) = solve(&system, &solving, progress)?;
    let halves = match halves {
        Some(halves) => {
            Some(solve_halves(&system, &irradiance, &halves, &direct, options, progress)?)
        }
        None => None,
    };
    let reflected = reflected(scene, &patches, &factors, &rho, &irradiance);
    let reflected_halves = halves.as_ref().map(|halves| {
        // What halves differ in, but for what arrives straight.
        [0, 1].map(|k| {
            let straight = |d: &DirectLight| (d.halves[k] - d.halves[1 - k]) * 0.5;
            let all = |i: usize| halves[k][i] - irradiance[i];
            let found = reflected.iter().zip(&direct).enumerate();
            found.map(|(i, (r, d))| *r + all(i) - straight(d)).collect()
        })
    });
    clock.lap("solve");

    let usable: Vec<bool> =
        patches.ids().map(|i| factors.has_row(i) && factors.account(i).back <= COVERED).collect();
    let report = Report {
        scene: scene.name.clone(),
        source_triangles: geometry.len(),
        patches: patches.len(),
        clusters: patches.ids().filter(|&i| patches.is_cluster(i)).count(),
        patch_size,
        contacts_left_out: patches.contacts_left_out(),
        engine: Some(engine),
        rows: Some(rows_report(&factors, &areas)),
        solve: Some(solved),
        error: None,
        picture_error: None,
        energy: Some(EnergyBalance::of(&system, &emission, scene.sky, Some(lamps), &irradiance)),
        stages: clock.stages,
        foretold_memory_bytes: None,
        peak_memory_bytes: None,
    };
    Ok(Solution { patches, irradiance, reflected, reflected_halves, usable, halves, report })
}

/// What arrives at each patch by way of other surfaces and from the sky.
fn reflected(
    scene: &Scene,
    patches: &Patches,
    factors: &FormFactors,
    rho: &[Rgb],
    irradiance: &[Rgb],
) -> Vec<Rgb> {
    let lamps = direct::reflected_by_emitters(scene, patches, irradiance);
    let sent = |i: PatchId| {
        let cell = patches.cell(i);
        rho[i.index()] * irradiance[i.index()] - lamps[side_index(cell.triangle, cell.side)]
    };
    let sent: Vec<Rgb> = patches.ids().map(sent).collect();
    let ids: Vec<PatchId> = patches.ids().filter(|i| factors.has_row(*i)).collect();
    let found: Vec<Rgb> = ids
        .par_iter()
        .map(|&i| factors.gather(i, &sent) + scene.sky * (PI * factors.account(i).environment))
        .collect();
    let mut all = vec![Rgb::ZERO; patches.len()];
    for (i, found) in ids.into_iter().zip(found) {
        all[i.index()] = found;
    }
    all
}

/// The rows of all patches that light can reach; `lamps` is what each receives from lamps.
fn rows(
    scene: &Scene,
    (patches, bvh): (&Patches, &Bvh),
    lamps: &[Rgb],
    engine: &mut dyn Engine,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<FormFactors, AssembleError> {
    let mut factors = FormFactors::new(patches.len(), options.memory);
    progress.stage("form factors", patches.len() as u64);
    if engine.pairs().is_some() {
        // Each pair once is faster than rows of the lit sides alone: sides that face emptiness or
        // their neighbours in the dark cost little.
        let ids: Vec<PatchId> = patches.ids().collect();
        engine.make(&ids, &mut factors, progress)?;
        return Ok(factors);
    }
    let rho = direct::reflectance(&scene.optics, patches);
    let emission = direct::emission(&scene.optics, patches);
    let rough = Rough { scene, patches, rho: &rho, emission: &emission, lamps };
    if let Some(ids) = rough.lit(bvh, progress)? {
        engine.make(&ids, &mut factors, progress)?;
        return Ok(factors);
    }
    let has_sky = scene.sky.max_element() > 0.0;
    let bright = |values: &[Rgb], i: PatchId| values[i.index()].max_element() > 0.0;
    let seeds = patches.ids().filter(|&i| has_sky || bright(&emission, i) || bright(lamps, i));
    let shines = |i: PatchId| (rho[i.index()] + emission[i.index()]).max_element() > 0.0;
    assemble_lit(engine, patches, seeds, shines, &mut factors, progress)?;
    Ok(factors)
}

/// The account of all rows. `areas` (m²) are those of the patches.
fn rows_report(factors: &FormFactors, areas: &[f64]) -> RowsReport {
    let with_row: Vec<PatchId> =
        (0..factors.len() as u32).map(PatchId).filter(|&i| factors.has_row(i)).collect();
    let sampled = factors.halves().is_some();
    let mut account = Account::new(areas, if sampled { &[] } else { &with_row });
    account.add_all(factors);
    account.report()
}
