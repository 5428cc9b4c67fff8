//! From a scene to the irradiance of its patches: subdivide, make form factors, solve.

use std::sync::Arc;
use std::time::Instant;

use thiserror::Error;

use crate::direct::{self, ApartOptions, DirectLight};
use crate::engines::{
    AssembleError, Classical, Draw, Engine, EngineError, Exact, ExactOptions, Hemicube,
    HemicubeError, HemicubeOptions, ROWS_AT_ONCE, Rays, RaysOptions, assemble_lit,
};
#[cfg(feature = "gpu")]
use crate::engines::{GpuError, HemicubeGpu};
use crate::form_factors::{FormFactors, Row, entry_bytes};
use crate::patches::{PatchId, Patches, PatchesError};
use crate::progress::Progress;
use crate::reconstruct::Field;
use crate::refine::factor::{FactorRule, RefineError};
use crate::report::{EngineReport, Report, RowsReport, Stage};
use crate::scene::{Geometry, Rgb, Scene, Side};
use crate::solve::{EnergyBalance, SolveError, SolveOptions, System, solve, solve_near};
use crate::visibility::{Bvh, COVERED, uncover};

/// How a scene is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightOptions {
    /// Largest area of a patch, m². Default: what adds about [`DEFAULT_PATCHES`] patches to the
    /// source triangles.
    pub patch_size: Option<f64>,
    /// Whether small source triangles are joined to larger patches.
    pub cluster: Clustering,
    /// Split further where form factors demand it.
    pub adaptive: Option<Adaptive>,
    /// Who makes the form factors.
    pub engine: EngineOptions,
    /// The solver.
    pub solve: SolveOptions,
    /// Bytes that the work may take.
    pub memory: u64,
}

/// Whether small source triangles are joined to larger patches ([`Patches::clustered`]) where they
/// have one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Clustering {
    /// If more than [`MANY_SIDES`] sides exchange light, those are more than twice as many as the
    /// clusters would be, and neither adaptive subdivision nor the classical engine is asked for.
    #[default]
    Auto,
    /// Wherever it is possible; an error with adaptive subdivision and with the classical engine.
    On,
    /// Never.
    Off,
}

/// Models with more exchanging sides of source triangles than this are clustered unless the user
/// says otherwise.
pub const MANY_SIDES: u64 = 100_000;

/// Who makes the form factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EngineOptions {
    /// Hemicubes on the CPU.
    Hemicube(HemicubeOptions),
    /// Hemicubes on the graphics device.
    #[cfg(feature = "gpu")]
    HemicubeGpu(HemicubeOptions),
    /// One visibility ray a pair against every patch: the paper's baseline.
    Classical,
    /// Each pair in closed form, times its visible share.
    Exact(ExactOptions),
    /// Sampled rows, and direct light apart from them.
    Rays {
        /// How rows are sampled.
        rows: RaysOptions,
        /// How direct light is set apart.
        direct: ApartOptions,
    },
}

impl EngineOptions {
    /// The engine for these patches.
    pub fn engine<'a>(
        &self,
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        memory: u64,
    ) -> Result<Box<dyn Engine + 'a>, LightError> {
        #[cfg(not(feature = "gpu"))]
        let _ = memory;
        Ok(match *self {
            Self::Hemicube(options) => Box::new(Hemicube::new(geometry, patches, options)?),
            #[cfg(feature = "gpu")]
            Self::HemicubeGpu(options) => {
                /// Rows under way on the device take at most this, and a quarter of what is allowed.
                const UNDER_WAY: u64 = 1 << 30;
                let memory = UNDER_WAY.min(memory / 4);
                Box::new(HemicubeGpu::new(geometry, patches, options, memory)?)
            }
            Self::Classical => Box::new(Classical::new(geometry, patches)),
            Self::Exact(options) => Box::new(Exact::new(geometry, patches, bvh, options)),
            Self::Rays { rows, .. } => Box::new(Rays::new(geometry, patches, bvh, rows)),
        })
    }

    /// Number of patches aimed at where no size is given.
    fn default_patches(&self) -> u64 {
        if let Self::Rays { .. } = self { SAMPLED_PATCHES } else { DEFAULT_PATCHES }
    }

    /// What the report says of it.
    pub(crate) fn report(&self, engine: &dyn Engine) -> EngineReport {
        let hemicube = match self {
            Self::Hemicube(options) => Some(options),
            #[cfg(feature = "gpu")]
            Self::HemicubeGpu(options) => Some(options),
            Self::Classical | Self::Exact(_) | Self::Rays { .. } => None,
        };
        EngineReport {
            samples: match self {
                Self::Rays { rows, .. } => Some(rows.samples),
                _ => None,
            },
            error: match self {
                Self::Exact(options) => Some(options.error),
                _ => None,
            },
            name: engine.name(),
            device: engine.device(),
            resolution: hemicube.map(|o| o.resolution),
            draw: hemicube.map(|o| match o.draw {
                Draw::Sources => "sources",
                Draw::Patches => "patches",
            }),
        }
    }
}

/// The paper's adaptive subdivision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Largest form factor allowed, 0..1.
    pub max_factor: f64,
    /// Patches are split only while their area exceeds this, m².
    pub min_area: f64,
}

/// Number of patches aimed at where no size is given, beyond one a side of each source triangle.
pub const DEFAULT_PATCHES: u64 = 5_000;

/// The same where rows are sampled.
pub const SAMPLED_PATCHES: u64 = 20_000;

/// Number of patches aimed at where source triangles are clustered and no size is given.
pub const CLUSTERED_PATCHES: f64 = 10_000.0;

/// Why a scene could not be lit.
#[derive(Debug, Error)]
pub enum LightError {
    /// It could not be subdivided.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// The adaptive subdivision failed.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The hemicubes' options are wrong.
    #[error(transparent)]
    Hemicube(#[from] HemicubeError),
    /// The graphics device cannot be used.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The matrix could not be made.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// The system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The engine does not know how much of the sky a patch sees.
    #[error(
        "--engine classical knows no sky: use --engine hemicube, or --sky 0,0,0 and an emitter"
    )]
    NoSky,
    /// It would not fit in memory.
    #[error(
        "{patches} patches take about {}, {} are allowed; use {}fewer --samples or a lower --resolution, or more --memory", amount(*needed), amount(*allowed), proposal.map_or(String::new(), |p| format!("--patch-size {p:.3} (m²) or more, "))
    )]
    Memory {
        /// Number of patches.
        patches: usize,
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
        /// A patch size that should fit, m², where a larger one helps.
        proposal: Option<f64>,
    },
}

/// Bytes as people say them.
pub(crate) fn amount(bytes: u64) -> String {
    match bytes {
        0..1_048_576 => format!("{} KiB", bytes.div_ceil(1 << 10)),
        _ => format!("{} MiB", bytes.div_ceil(1 << 20)),
    }
}

/// A lit scene: patches and their irradiance.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The patches.
    pub patches: Patches,
    /// Irradiance H of each, W/m² or lx.
    pub irradiance: Vec<Rgb>,
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
}

/// Lights a scene.
pub fn light(
    scene: &Scene,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let geometry = &scene.geometry;
    if options.engine == EngineOptions::Classical && scene.sky != Rgb::ZERO {
        return Err(LightError::NoSky);
    }
    let mut clock = Clock::start();
    let cluster = clusters(geometry, options);
    let patch_size = match (options.patch_size, options.adaptive) {
        (Some(size), _) => size,
        (None, None) if cluster => Patches::clustered_area(geometry, CLUSTERED_PATCHES),
        (None, None) => Patches::area_adding(geometry, options.engine.default_patches()),
        // Adaptive subdivision begins with whole source triangles.
        (None, Some(_)) => f64::INFINITY,
    };
    let finest = options.adaptive.map_or(patch_size, |a| a.min_area.min(patch_size));
    let finest = if cluster {
        Patches::clustered(geometry, finest, &scene.optics.material_of)?
    } else {
        Patches::uniform(geometry, finest)?
    };
    let bvh = Bvh::new(geometry);
    let finest = uncover(geometry, finest, &bvh);
    clock.lap("subdivide");

    let mut engine = options.engine.engine(geometry, &finest, &bvh, options.memory)?;
    let engine_report = options.engine.report(&*engine);
    check_memory(&mut *engine, &finest, patch_size, options.memory)?;
    let refined = match options.adaptive {
        None => None,
        Some(Adaptive { max_factor, min_area }) => {
            let start_area = Some(patch_size);
            let rule = FactorRule { max_factor, min_area, start_area, balance: true };
            progress.stage("form factors", 0);
            let shared = Arc::new(finest.clone());
            Some(rule.refine(geometry, shared, &mut *engine, options.memory, progress)?)
        }
    };
    drop(engine);
    let all_over = matches!(options.engine, EngineOptions::Rays { .. } | EngineOptions::Exact(_));
    let (patches, made) = match refined {
        // Rows from the centres of patches serve every mesh that has the same centres; rows from all
        // over a patch do not.
        Some(refined) => (refined.patches, (!all_over).then_some(refined.factors)),
        None => (finest, None),
    };
    let lamps = direct::from_lamps(scene, &patches, &bvh);
    let factors = match (made, options.engine) {
        (Some(factors), _) => factors,
        // Each pair once is faster than rows of the lit sides alone: sides that face emptiness or
        // their neighbours in the dark cost little.
        (None, EngineOptions::Exact(exact)) => {
            progress.stage("form factors", patches.len() as u64);
            Exact::new(geometry, &patches, &bvh, exact).matrix(options.memory, progress)?
        }
        (None, _) => {
            let mut engine = options.engine.engine(geometry, &patches, &bvh, options.memory)?;
            let lit = |i: PatchId| lamps[i.index()].max_element() > 0.0;
            lit_rows(scene, &patches, lit, &mut *engine, options.memory, progress)?
        }
    };
    clock.lap("form factors");
    let apart = match options.engine {
        EngineOptions::Rays { direct, .. } => Some(direct),
        _ => None,
    };
    let made = Made { patches, factors, bvh, apart, patch_size, engine: engine_report };
    lit_by(scene, made, &lamps, options, clock, progress)
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
    let bvh = Bvh::new(&scene.geometry);
    let lamps = direct::from_lamps(scene, &patches, &bvh);
    let patch_size = patches.ids().map(|i| patches.area(i)).fold(0.0, f64::max);
    let engine = EngineReport {
        name: "stored",
        device: None,
        resolution: None,
        draw: None,
        samples: None,
        error: None,
    };
    let made = Made { patches, factors, bvh, apart: None, patch_size, engine };
    lit_by(scene, made, &lamps, options, clock, progress)
}

/// What light goes by.
struct Made {
    patches: Patches,
    factors: FormFactors,
    bvh: Bvh,
    /// How emitters are set apart from the factors, if they are.
    apart: Option<ApartOptions>,
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
    let Made { patches, factors, bvh, apart, patch_size, engine } = made;
    let rho = direct::reflectance(&scene.optics, &patches);
    let emission = direct::emission(&scene.optics, &patches);
    let mut direct = match apart {
        Some(apart) => {
            progress.stage("direct light", 0);
            let found = direct::apart(scene, &patches, &factors, &bvh, apart);
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
    let (irradiance, solved) = solve(&system, &options.solve, progress)?;
    let halves = match factors.halves() {
        Some(halves) => {
            Some(solve_halves(&system, &irradiance, &halves, &direct, options, progress)?)
        }
        None => None,
    };
    clock.lap("solve");

    let usable: Vec<bool> =
        patches.ids().map(|i| factors.has_row(i) && factors.account(i).back <= COVERED).collect();
    let report = Report {
        scene: scene.name.clone(),
        source_triangles: geometry.len(),
        patches: patches.len(),
        clusters: patches.ids().filter(|&i| patches.is_cluster(i)).count(),
        patch_size,
        engine: Some(engine),
        rows: Some(rows_report(&factors, &areas)),
        solve: Some(solved),
        error: None,
        energy: Some(EnergyBalance::of(&system, &emission, scene.sky, Some(lamps), &irradiance)),
        stages: clock.stages,
        peak_memory_bytes: None,
    };
    Ok(Solution { patches, irradiance, usable, halves, report })
}

/// Irradiance as each half of the rays alone would give it, to the first order of their difference: by
/// what each half finds that the light that it gathers should be, and by where that light then goes.
fn solve_halves(
    system: &System<'_>,
    irradiance: &[Rgb],
    halves: &[FormFactors; 2],
    direct: &[DirectLight],
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<[Vec<Rgb>; 2], SolveError> {
    /// Differences of halves are no better than the noise that they tell of.
    const TOLERANCE: f64 = 1e-2;
    let [a, b] = [0, 1].map(|k| {
        let direct: Vec<Rgb> = direct.iter().map(|d| d.halves[k]).collect();
        System { factors: &halves[k], direct: &direct, ..*system }.gather(irradiance, TOLERANCE)
    });
    let found: Vec<Rgb> = a.iter().zip(&b).map(|(a, b)| (*a - *b) * 0.5).collect();
    let system = System { direct: &found, ..*system };
    let solving = SolveOptions { tolerance: TOLERANCE, ..options.solve };
    let (spread, _) = solve_near(&system, &found, &solving, progress)?;
    let side = |sign: f64| irradiance.iter().zip(&spread).map(|(h, s)| *h + *s * sign).collect();
    Ok([side(1.0), side(-1.0)])
}

/// Whether source triangles are to be clustered.
fn clusters(geometry: &Geometry, options: &LightOptions) -> bool {
    match options.cluster {
        Clustering::On => true,
        Clustering::Off => false,
        Clustering::Auto => {
            let count = |t| Side::BOTH.iter().filter(|&&s| geometry.exchanges(t, s)).count() as u64;
            let sides: u64 = geometry.ids().map(count).sum();
            let wanted = |size| Patches::clustered_count(geometry, size);
            let possible = options.adaptive.is_none() && options.engine != EngineOptions::Classical;
            possible
                && sides > MANY_SIDES
                && sides as f64 > 2.0 * options.patch_size.map_or(CLUSTERED_PATCHES, wanted)
        }
    }
}

/// The rows of all patches that light can reach.
fn lit_rows(
    scene: &Scene,
    patches: &Patches,
    lit: impl Fn(PatchId) -> bool,
    engine: &mut dyn Engine,
    memory: u64,
    progress: &dyn Progress,
) -> Result<FormFactors, AssembleError> {
    let rho = direct::reflectance(&scene.optics, patches);
    let emission = direct::emission(&scene.optics, patches);
    let mut factors = FormFactors::new(patches.len(), memory);
    let has_sky = scene.sky.max_element() > 0.0;
    let emits = |i: PatchId| emission[i.index()].max_element() > 0.0;
    let seeds = patches.ids().filter(|&i| has_sky || emits(i) || lit(i));
    let shines = |i: PatchId| (rho[i.index()] + emission[i.index()]).max_element() > 0.0;
    progress.stage("form factors", patches.len() as u64);
    assemble_lit(engine, patches, seeds, shines, &mut factors, progress)?;
    Ok(factors)
}

/// Rows made beforehand to learn how many entries a row has.
const SAMPLE_ROWS: usize = 32;

/// Predicts what the rows will take and refuses what cannot fit.
fn check_memory(
    engine: &mut dyn Engine,
    patches: &Patches,
    patch_size: f64,
    allowed: u64,
) -> Result<(), LightError> {
    let n = patches.len();
    let step = n.div_ceil(SAMPLE_ROWS).max(1);
    let ids: Vec<PatchId> = patches.ids().step_by(step).collect();
    let mut rows = vec![Row::default(); ids.len()];
    engine.fill(&ids, &mut rows)?;
    let bytes: u64 = rows.iter().map(|r| r.columns.len() as u64 * entry_bytes(&r.weights)).sum();
    let rows_bytes = bytes as f64 / ids.len().max(1) as f64 * n as f64;
    /// Bytes a patch takes beside its row: cells, areas, vectors of the solver, the field.
    const PATCH_BYTES: f64 = 400.0;
    let needed = rows_bytes + PATCH_BYTES * n as f64 + engine.bytes(n.min(ROWS_AT_ONCE)) as f64;
    if needed <= allowed as f64 {
        return Ok(());
    }
    // Entries grow at most as the square of the number of patches, and with it linearly in between.
    let larger = patch_size * (needed / allowed as f64).max(1.1);
    let source = |i| patches.area(i) * f64::from(1_u32 << (2 * u32::from(patches.cell(i).level)));
    let largest = patches.ids().map(source).fold(0.0, f64::max);
    Err(LightError::Memory {
        patches: n,
        needed: needed as u64,
        allowed,
        // Beyond whole source triangles a larger size changes nothing, unless they are joined.
        proposal: Some(larger).filter(|l| *l < largest || patches.has_clusters()),
    })
}

/// Rows in the sample that reciprocity is measured on.
const RECIPROCITY_ROWS: usize = 64;

/// The account of all rows.
fn rows_report(factors: &FormFactors, areas: &[f64]) -> RowsReport {
    let n = factors.len();
    let with_row: Vec<PatchId> =
        (0..n as u32).map(PatchId).filter(|&i| factors.has_row(i)).collect();
    let (mut area, mut sums, mut covered) = (0.0, [0.0; 4], 0);
    for &i in &with_row {
        let (a, account) = (areas[i.index()], factors.account(i));
        area += a;
        let lost = [account.environment, account.back, account.lost];
        sums[0] += a * (1.0 - lost.iter().sum::<f64>());
        for (sum, share) in sums[1..].iter_mut().zip(lost) {
            *sum += a * share;
        }
        covered += usize::from(account.back > COVERED);
    }
    let mean = sums.map(|s| if area > 0.0 { s / area } else { 0.0 });
    let (mut difference, mut size) = (0.0, 0.0);
    let step = with_row.len().div_ceil(RECIPROCITY_ROWS).max(1);
    let sampled = factors.halves().is_some();
    for &i in with_row.iter().step_by(step).filter(|_| !sampled) {
        for (j, f) in factors.row(i).iter().flat_map(|r| r.entries().collect::<Vec<_>>()) {
            let (there, back) = (areas[i.index()] * f, areas[j.index()] * factors.factor(j, i));
            difference += (there - back) * (there - back);
            size += there * there;
        }
    }
    RowsReport {
        rows: with_row.len(),
        entries: factors.entries(),
        bytes: factors.bytes(),
        entries_share: mean[0],
        environment: mean[1],
        back: mean[2],
        lost: mean[3],
        covered,
        reciprocity_rms: (size > 0.0).then(|| (difference / size).sqrt()),
    }
}

/// Seconds of one stage after the other.
pub(crate) struct Clock {
    last: Instant,
    pub(crate) stages: Vec<Stage>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        self.stages.push(Stage { name, seconds: self.last.elapsed().as_secs_f64() });
        self.last = Instant::now();
    }
}
