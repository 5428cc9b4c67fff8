//! A matrix in parts, made by several processes: the plan that they share, and one part.

use serde::{Deserialize, Serialize};

use super::error::MatrixError;
use super::forecast::PATCH_BYTES;
use super::options::MatrixOptions;
use super::stored::{hexadecimal, same_with, subdivide};
use crate::engines::{
    Engine, EngineError, EngineOptions, Exact, ExactOptions, PairsTally, SampleOfRows, TilePairs,
    Tiling,
};
use crate::patches::Patches;
use crate::progress::Progress;
use crate::scene::Geometry;
use crate::visibility::Bvh;

/// How a matrix is made in parts. It depends on the model and on what is asked for alone: not on
/// how many parts there will be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the scene.
    pub scene: String,
    /// [Fingerprint](Geometry::fingerprint) of its geometry, in hexadecimal.
    pub fingerprint: String,
    /// Largest area of a patch, m²; none if every triangle is one.
    pub patch_size: Option<f64>,
    /// Number of patches.
    pub patches: u64,
    /// Fingerprint of the patches, in hexadecimal.
    pub mesh: String,
    /// [`ExactOptions::error`].
    pub error: f64,
    /// [`ExactOptions::seed`].
    pub seed: u32,
    /// How pairs are cut into pairs of tiles, and how much work they get.
    pub tiling: Tiling,
}

/// Some pairs of tiles of a matrix: those whose number leaves the remainder `number - 1` when it is
/// divided by `of`.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Which part, 1..=of.
    pub number: u32,
    /// Number of parts, 1 or more.
    pub of: u32,
    /// What was done.
    pub tally: PairsTally,
    /// The pairs of tiles, by number.
    pub tiles: Vec<TilePairs>,
}

impl Plan {
    /// Plans the matrix of a model. `options` are of the exact engine; closure and threshold are
    /// for later.
    ///
    /// # Errors
    /// If the options do not suit the model, or `progress` stops it.
    pub fn new(
        geometry: &Geometry,
        options: &MatrixOptions,
        progress: &dyn Progress,
    ) -> Result<Self, MatrixError> {
        let EngineOptions::Exact(exact) = options.engine else { return Err(MatrixError::Parts) };
        progress.stage("plan", 0);
        let (bvh, patches) = subdivide(geometry, options.patch_size, progress)?;
        let engine = exact_engine(geometry, (&patches, &bvh), exact, progress)?;
        Ok(Self {
            scene: String::new(),
            fingerprint: hexadecimal(&geometry.fingerprint()),
            patch_size: options.patch_size,
            patches: patches.len() as u64,
            mesh: patches.fingerprint(),
            error: exact.error,
            seed: exact.seed,
            tiling: engine.tiling(),
        })
    }

    /// The engine's options.
    #[must_use]
    pub fn exact(&self) -> ExactOptions {
        let ray_scale = Some(self.tiling.ray_scale);
        ExactOptions { error: self.error, seed: self.seed, ray_scale }
    }

    /// Checksum of all that it says, and of the version of the library, in hexadecimal.
    #[must_use]
    pub fn checksum(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        // Another version may evaluate pairs in another way.
        hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
        let texts = [&self.fingerprint, &self.mesh, &self.tiling.order];
        texts.iter().for_each(|text| {
            hasher.update(text.as_bytes());
        });
        let area = self.patch_size.unwrap_or(f64::INFINITY);
        for number in [area, self.error, self.tiling.ray_scale] {
            hasher.update(&number.to_le_bytes());
        }
        for number in [self.patches, self.seed.into(), self.tiling.tiles.into()] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Makes part `number` (1..=of) of a matrix that is made in `of` parts, within `memory` bytes.
    ///
    /// # Errors
    /// If the model is not the plan's, there is not enough memory, or `progress` stops it.
    pub fn part(
        &self,
        geometry: &Geometry,
        (number, of): (u32, u32),
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Part, MatrixError> {
        self.check_geometry(geometry)?;
        let (bvh, patches) = subdivide(geometry, self.patch_size, progress)?;
        let mut engine = exact_engine(geometry, (&patches, &bvh), self.exact(), progress)?;
        self.check(&patches, &engine)?;
        let beside = PATCH_BYTES * self.patches + engine.bytes(0);
        let part = bytes_of_pairs(&mut engine, &patches)? / u64::from(of.max(1));
        if beside + part > memory {
            let (patches, needed) = (patches.len(), beside + part);
            let can_go_to_a_store = false;
            let allowed = memory;
            return Err(MatrixError::Memory { patches, needed, allowed, can_go_to_a_store });
        }
        let numbers: Vec<u64> = self.numbers((number, of)).collect();
        progress.stage("pairs of tiles", numbers.len() as u64);
        let (tiles, tally) = engine.evaluate(&numbers, memory - beside, progress)?;
        Ok(Part { number, of, tally, tiles })
    }

    /// The numbers of the pairs of tiles that a part consists of.
    pub fn numbers(&self, (number, of): (u32, u32)) -> impl Iterator<Item = u64> + use<> {
        (u64::from(number.saturating_sub(1))..self.tiling.pairs()).step_by(of.max(1) as usize)
    }

    /// Refuses another model.
    ///
    /// # Errors
    /// If the geometry is not the one that was planned for.
    pub fn check_geometry(&self, geometry: &Geometry) -> Result<(), MatrixError> {
        if hexadecimal(&geometry.fingerprint()) != self.fingerprint {
            let (scene, same_with) = (self.scene.clone(), same_with(geometry, &self.fingerprint));
            return Err(MatrixError::Foreign { scene, same_with });
        }
        // What a file claims may be a billion patches.
        let patch_size = self.patch_size.unwrap_or(f64::INFINITY);
        match Patches::uniform_count(geometry, patch_size)? > self.patches {
            true => Err(MatrixError::Replan),
            false => Ok(()),
        }
    }

    /// Refuses other patches, and other tiles.
    pub(super) fn check(&self, patches: &Patches, engine: &Exact<'_>) -> Result<(), MatrixError> {
        let same = patches.len() as u64 == self.patches
            && patches.fingerprint() == self.mesh
            && engine.tiling() == self.tiling;
        if same { Ok(()) } else { Err(MatrixError::Replan) }
    }
}

/// Bytes that all pairs take before they are rows, nearly.
fn bytes_of_pairs(engine: &mut Exact<'_>, patches: &Patches) -> Result<u64, EngineError> {
    /// So little fits anywhere.
    const EASILY: f64 = (1_u64 << 28) as f64;
    /// Both places and what they exchange, of a pair that stands for two entries.
    const ENTRY: f64 = 3.0;
    let bytes = |sample: SampleOfRows| ENTRY * sample.distinct * patches.len() as f64;
    let most = SampleOfRows::at_most(engine).map(bytes).filter(|most| *most <= EASILY);
    Ok(match most {
        Some(most) => most as u64,
        None => bytes(SampleOfRows::of(engine, patches)?) as u64,
    })
}

/// The exact engine for these patches.
pub(super) fn exact_engine<'a>(
    geometry: &'a Geometry,
    (patches, bvh): (&'a Patches, &'a Bvh),
    options: ExactOptions,
    progress: &'a dyn Progress,
) -> Result<Exact<'a>, MatrixError> {
    patches.find_fragments(progress)?;
    Ok(Exact::new(geometry, patches, bvh, options, progress)?)
}
