//! What light goes by: a mesh, its form factors, and how emitters light it.

use std::sync::Arc;

use super::agreement::agreed;
use super::dark::Rough;
use super::error::LightError;
use super::memory::{Mesh, check_memory};
use super::options::{Adaptive, CLUSTERED_PATCHES, LightOptions, Work};
use crate::direct::{self, DirectOptions};
use crate::engines::{AssembleError, Engine, EngineOptions, EngineReport, assemble_lit};
use crate::form_factors::FormFactors;
use crate::patches::{PatchId, Patches, PatchesError, warn_of_contacts};
use crate::progress::Progress;
use crate::ranks::{Ranks, RanksError};
use crate::refine::factor::FactorRule;
use crate::report::{Clock, STORED};
use crate::scene::{Geometry, Rgb, Scene};
use crate::visibility::{Bvh, COVERED, uncover};

/// A mesh, its form factors, and how emitters light it. Of the scene it knows where surfaces are,
/// and from which of them and to which light may go at all.
pub(crate) struct Transport {
    pub patches: Arc<Patches>,
    pub factors: FormFactors,
    /// The hierarchy of the scene's geometry.
    pub bvh: Bvh,
    /// Irradiance of each patch from the scene's lamps.
    pub lamps: Vec<Rgb>,
    /// How emitters are analytic, unless all light goes through the rows.
    pub analytic: Option<DirectOptions>,
    /// How the mesh was made.
    pub mesh: MeshOptions,
    pub engine: EngineReport,
    /// Bytes that it was foretold to take.
    pub foretold: Option<u64>,
}

/// How a mesh is made of a geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeshOptions {
    /// Largest area of a patch at first, m².
    pub patch_size: f64,
    /// Whether source triangles are joined.
    pub cluster: bool,
    /// Smallest area of a patch, m², where adaptive subdivision goes on.
    pub min_area: Option<f64>,
}

impl MeshOptions {
    /// Those that `options` mean for a scene.
    fn of(scene: &Scene, options: &LightOptions) -> Self {
        let geometry = &scene.geometry;
        let cluster = options.clusters(geometry);
        let patch_size = match (options.patch_size, options.adaptive) {
            (Some(size), _) => size,
            (None, None) if cluster => Patches::clustered_area(geometry, CLUSTERED_PATCHES),
            (None, None) => Patches::area_adding(geometry, options.default_patches(geometry)),
            // Adaptive subdivision begins with whole source triangles.
            (None, Some(_)) => f64::INFINITY,
        };
        Self { patch_size, cluster, min_area: options.adaptive.map(|a| a.min_area) }
    }

    /// How many patches [`subdivide`](Self::subdivide) makes, before it joins any.
    pub fn count(&self, scene: &Scene) -> Result<u64, PatchesError> {
        Patches::uniform_count(&scene.geometry, self.finest_size())
    }

    /// Largest area of a patch of the finest mesh, m².
    fn finest_size(&self) -> f64 {
        self.min_area.map_or(self.patch_size, |area| area.min(self.patch_size))
    }

    /// The finest mesh, each patch's origin its centroid.
    pub fn subdivide(&self, scene: &Scene, progress: &dyn Progress) -> Result<Patches, LightError> {
        let geometry = &scene.geometry;
        let finest = self.finest_size();
        Ok(if self.cluster {
            Patches::clustered_heard(geometry, finest, &scene.optics.material_of, progress)?
        } else {
            Patches::uniform_heard(geometry, finest, progress)?
        })
    }

    /// The same, with origins that see what is about them.
    fn finest(
        &self,
        scene: &Scene,
        bvh: &Bvh,
        progress: &dyn Progress,
    ) -> Result<Patches, LightError> {
        let finest = self.subdivide(scene, progress)?;
        warn_of_contacts(&finest, progress);
        Ok(uncover(&scene.geometry, finest, bvh, progress)?)
    }
}

impl Transport {
    /// That of a scene: it is subdivided, and rows are made.
    pub fn of(
        scene: &Scene,
        options: &LightOptions,
        work: &Work<'_>,
        clock: &mut Clock,
        progress: &dyn Progress,
    ) -> Result<Self, LightError> {
        if !work.ranks.is_alone() && !options.can_be_shared() {
            return Err(LightError::Alone);
        }
        if !options.engine.knows_environment() && scene.sky != Rgb::ZERO {
            return Err(LightError::NoSky);
        }
        let options = &agreed(scene, options, &work.ranks)?;
        let bvh = Bvh::new(&scene.geometry);
        progress.advance(0)?;
        let mesh = MeshOptions::of(scene, options);
        let finest = mesh.finest(scene, &bvh, progress)?;
        clock.lap("subdivide");
        let made = form_factors(scene, finest, mesh, bvh, (options, work), progress)?;
        clock.lap("form factors");
        Ok(made)
    }

    /// That of patches whose form factors are there already.
    pub fn stored(
        scene: &Scene,
        patches: Patches,
        factors: FormFactors,
        progress: &dyn Progress,
    ) -> Self {
        warn_of_contacts(&patches, progress);
        let bvh = Bvh::new(&scene.geometry);
        let patch_size = patches.ids().map(|i| patches.area(i)).fold(0.0, f64::max);
        Self {
            lamps: direct::from_lamps(scene, &patches, &bvh),
            patches: Arc::new(patches),
            factors,
            bvh,
            analytic: None,
            mesh: MeshOptions { patch_size, cluster: false, min_area: None },
            engine: EngineReport::named(STORED),
            foretold: None,
        }
    }

    /// Whether each patch's value stands for what is seen of it: it has a row and is not covered.
    pub fn usable(&self) -> Vec<bool> {
        let factors = &self.factors;
        let usable = |i| factors.has_row(i) && factors.account(i).back <= COVERED;
        self.patches.ids().map(usable).collect()
    }
}

/// The form factors of the finest mesh, or of the adaptive one that coarsens it.
fn form_factors(
    scene: &Scene,
    finest: Patches,
    mesh: MeshOptions,
    bvh: Bvh,
    (options, work): (&LightOptions, &Work<'_>),
    progress: &dyn Progress,
) -> Result<Transport, LightError> {
    let geometry = &scene.geometry;
    let mut engine = options.engine.engine(geometry, &finest, &bvh, options.memory, progress)?;
    let report = options.engine.report(&*engine);
    let count = |patch_size| {
        let options = MeshOptions { patch_size, ..mesh };
        options.subdivide(scene, progress).ok().map(|patches| patches.len())
    };
    let count: Option<&dyn Fn(f64) -> Option<usize>> =
        if options.adaptive.is_none() { Some(&count) } else { None };
    let patch_size = mesh.patch_size;
    let sized = Mesh { patches: &finest, patch_size, count, ranks: &work.ranks };
    let foretold = check_memory(&mut *engine, &sized, options.method, options.memory)?;
    let (patches, lamps, factors) = if let Some(Adaptive { max_factor, min_area }) =
        options.adaptive
    {
        let rule = FactorRule { max_factor, min_area, start_area: Some(patch_size), balance: true };
        progress.stage("form factors", 0);
        let shared = Arc::new(finest.clone());
        let refined = rule.refine(geometry, shared, &mut *engine, options.memory, progress)?;
        let centres = engine.sees_from_centres();
        drop(engine);
        let patches = refined.patches;
        let lamps = direct::from_lamps(scene, &patches, &bvh);
        // Rows from the centres of patches serve every mesh that has the same centres; rows from
        // all over a patch do not.
        let factors = if centres {
            refined.factors
        } else {
            drop(refined.factors);
            let mut engine =
                options.engine.engine(geometry, &patches, &bvh, options.memory, progress)?;
            rows(scene, (&patches, &bvh), &lamps, &mut *engine, (options, work), progress)?
        };
        (patches, lamps, factors)
    } else {
        let lamps = lamps(scene, &finest, &bvh, &work.ranks)?;
        let by = (options, work);
        let factors = rows(scene, (&finest, &bvh), &lamps, &mut *engine, by, progress)?;
        drop(engine);
        (finest, lamps, factors)
    };
    Ok(Transport {
        patches: Arc::new(patches),
        factors,
        bvh,
        lamps,
        analytic: matches!(options.engine, EngineOptions::Rays(_)).then_some(options.direct),
        mesh,
        engine: report,
        foretold: Some(foretold),
    })
}

/// The rows of all patches that light can reach; `lamps` is what each receives from lamps.
fn rows(
    scene: &Scene,
    (patches, bvh): (&Patches, &Bvh),
    lamps: &[Rgb],
    engine: &mut dyn Engine,
    (options, work): (&LightOptions, &Work<'_>),
    progress: &dyn Progress,
) -> Result<FormFactors, AssembleError> {
    let mut factors = FormFactors::of_ranks(patches.len(), options.memory, work.ranks.clone());
    progress.stage("form factors", (patches.len() / work.ranks.size()) as u64);
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
    let all = if work.ranks.is_alone() { rough.lit(bvh, progress)? } else { None };
    if let Some(ids) = all {
        engine.make(&ids, &mut factors, progress)?;
        return Ok(factors);
    }
    let has_sky = scene.sky.max_element() > 0.0;
    let bright = |values: &[Rgb], i: PatchId| values[i.index()].max_element() > 0.0;
    let seeds = patches.ids().filter(|&i| has_sky || bright(&emission, i) || bright(lamps, i));
    let shines = |i: PatchId| (rho[i.index()] + emission[i.index()]).max_element() > 0.0;
    let key = key(&scene.geometry, patches, options);
    let kept = work.kept.map(|kept| (kept, key.as_str()));
    assemble_lit(engine, patches, seeds, shines, &mut factors, kept, progress)?;
    Ok(factors)
}

/// Irradiance of each patch from the lamps of a scene, of which each rank finds that of its own.
pub(crate) fn lamps(
    scene: &Scene,
    patches: &Patches,
    bvh: &Bvh,
    ranks: &Ranks,
) -> Result<Vec<Rgb>, RanksError> {
    let nothing = FormFactors::of_ranks(patches.len(), 0, ranks.clone());
    let own = nothing.own(&nothing.ids()).concat();
    nothing.share_exactly(direct::lamps_on(scene, patches, bvh, &own))
}

/// What rows depend on: the program, the geometry, its patches and the engine.
fn key(geometry: &Geometry, patches: &Patches, options: &LightOptions) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&geometry.fingerprint());
    hasher.update(patches.fingerprint().as_bytes());
    hasher.update(format!("{:?}", options.engine).as_bytes());
    hasher.finalize().to_hex().to_string()
}
