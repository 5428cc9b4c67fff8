//! What the arrays of a file are.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::engines::EngineReport;
use crate::scene::optics::MOST_RADIANCE;
use crate::scene::texture::Wrap;
use crate::scene::{Camera, Lamp, Material, Rgb, Surface};
use crate::solve::EnergyBalance;
use crate::store::{Member, Source};

/// What the manifest begins with.
pub const FORMAT: &str = "hemicube solution";

/// Of the format; others are refused.
pub const VERSION: u32 = 1;

/// `manifest.json`.
#[derive(Serialize, Deserialize)]
pub struct Manifest {
    pub format: String,
    pub version: u32,
    /// Version of the program that wrote it.
    pub program: String,
    pub scene: SceneHead,
    pub light: LightHead,
    /// Rows with what may emit alone.
    pub to_emitters: RowsHead,
    /// All rows.
    pub factors: RowsHead,
    pub checksums: Checksums,
}

/// The format of a manifest, whatever else it holds.
#[derive(Deserialize)]
pub struct Format {
    pub format: String,
    pub version: u32,
    pub program: String,
}

/// Of the parts.
#[derive(Serialize, Deserialize)]
pub struct Checksums {
    pub scene: String,
    pub light: String,
    pub factors: String,
}

/// What a scene has beside arrays.
#[derive(Serialize, Deserialize)]
pub struct SceneHead {
    pub name: String,
    pub vertices: u64,
    pub triangles: u64,
    /// Whether triangles have a place in textures, and colours of their own.
    pub uv: bool,
    pub tint: bool,
    /// How many triangles there are of which masks cut out pieces, and whether any.
    pub cut_faces: u64,
    pub faces: bool,
    /// The first triangle of a stage.
    pub whole_from: Option<u32>,
    pub surfaces: Vec<Surface>,
    pub object_of: Vec<String>,
    pub materials: Vec<Material>,
    pub textures: Vec<TextureHead>,
    pub max_reflectance: f64,
    pub lamps: Vec<Lamp>,
    pub sky: Rgb,
    pub up: Rgb,
    pub cameras: Vec<Camera>,
    /// The files of the model, by their paths beside it.
    pub files: Vec<PathBuf>,
}

/// What a texture is beside its bytes.
#[derive(Serialize, Deserialize)]
pub struct TextureHead {
    pub name: String,
    pub wrap: [Wrap; 2],
    pub v_up: bool,
    pub opacity: bool,
}

/// What light has beside arrays.
#[derive(Serialize, Deserialize)]
pub struct LightHead {
    pub patches: u64,
    /// Largest area of a patch, m²; none without a limit.
    pub patch_size: Option<f64>,
    /// Whether source triangles are joined.
    pub cluster: bool,
    /// Smallest area of a patch of an adaptive mesh, m².
    pub min_area: Option<f64>,
    /// How many patches have an origin that is not their centroid.
    pub moved: u64,
    /// Fingerprint of the patches.
    pub mesh: String,
    pub engine: EngineReport,
    /// Whether rows were sampled.
    pub sampled: bool,
    pub sources: Vec<Source>,
    /// Where the light of each source goes, W or lm.
    pub energy: Vec<EnergyBalance>,
}

impl LightHead {
    /// Whether what sources emit is light, and energy is a number that can be multiplied by it.
    pub fn is_sound(&self) -> bool {
        /// The light of all that is bright from all that is large (W or lm).
        const MOST_FLUX: f64 = 1e100;
        let emission = |m: &Member| {
            m.emission.min_element() >= 0.0 && m.emission.max_element() <= MOST_RADIANCE
        };
        self.sources.iter().flat_map(|s| &s.members).all(emission)
            && self.energy.iter().flat_map(|e| e.terms()).flatten().all(|x| x.abs() <= MOST_FLUX)
    }
}

/// How many rows there are, and how they are stored.
#[derive(Serialize, Deserialize)]
pub struct RowsHead {
    pub rows: u64,
    pub entries: u64,
    pub blocks: Vec<BlockHead>,
}

/// Consecutive rows that are stored in one way.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BlockHead {
    pub rows: u64,
    pub weights: WeightsHead,
}

/// How form factors are stored.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WeightsHead {
    /// In units of 1 / (2³² - 1).
    Fixed,
    /// As they are.
    Each,
    /// Each is the share of one of so many rays.
    Equal(u32),
}
