//! The arguments of all that lights a scene.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::run::Run;
use super::values::{percent, samples};

/// How a scene is lit.
#[derive(Debug, Clone, Args)]
pub struct Light {
    /// Largest area of a patch in m² [default: the area that yields about 20,000 patches, 5,000
    /// without rays, 40,000 for probe, 10,000 if source triangles are joined]
    #[arg(long, value_name = "AREA", allow_negative_numbers = true)]
    pub patch_size: Option<f64>,

    /// Join source triangles that are smaller than a patch: auto from 20,000 of them
    #[arg(long, value_enum, default_value_t = ClusterArg::Auto, hide_short_help = true)]
    pub cluster: ClusterArg,

    /// Split adaptively: patches that any other sees under a larger form factor (0..1) are split
    #[arg(long, value_name = "EPS", requires = "min_patch", allow_negative_numbers = true)]
    pub max_factor: Option<f64>,

    /// Adaptive splitting stops at patches of this area in m²
    #[arg(long, value_name = "AREA", requires = "max_factor", allow_negative_numbers = true)]
    pub min_patch: Option<f64>,

    /// Who makes the form factors [default: rays; hemicube with its own flags or --max-factor]
    #[arg(long, value_enum)]
    pub engine: Option<EngineArg>,

    /// Where hemicubes are made [default: cpu]
    #[arg(long, value_enum)]
    pub device: Option<DeviceArg>,

    /// Pixels along a hemicube's top, even, 16 to 1024 [default: 128]
    #[arg(long, value_name = "N")]
    pub resolution: Option<usize>,

    /// What is projected on the hemicubes [default: sources]
    #[arg(long, value_enum, hide_short_help = true)]
    pub draw: Option<DrawChoice>,

    /// Rays a row, 32 to 65536 [default: 256; 1024 with --draft]
    #[arg(long, value_name = "N", value_parser = samples)]
    pub samples: Option<usize>,

    /// Spend rays, and patches where they are what limits, until light is known this well at points
    /// and on 80 % of a picture, like 1%; with --engine exact the error of form factors [default
    /// there: .1%]
    #[arg(
        long, value_name = "PERCENT", value_parser = percent, conflicts_with = "samples",
        allow_negative_numbers = true
    )]
    pub error: Option<f64>,

    /// Another seed gives other rays
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub seed: Option<u32>,

    /// Light by form factors that hemicube factors stored (.npz)
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub factors: Option<PathBuf>,

    /// How the energy balance is solved
    #[arg(long, value_enum, default_value_t = SolverChoice::GaussSeidel, hide_short_help = true)]
    pub solver: SolverChoice,

    /// How it is run.
    #[command(flatten)]
    pub run: Run,
}

impl Light {
    /// The engine asked for, or the one that its flags belong to.
    pub fn engine(&self) -> EngineArg {
        let hemicubes = self.device.is_some() || self.resolution.is_some() || self.draw.is_some();
        let default = match hemicubes || self.max_factor.is_some() {
            true => EngineArg::Hemicube,
            false => EngineArg::Rays,
        };
        self.engine.unwrap_or(default)
    }

    /// The error asked for, if it is one of light: of exact form factors it is theirs.
    pub fn error_of_light(&self) -> Option<f64> {
        self.error.filter(|_| self.engine() == EngineArg::Rays)
    }
}

/// `--engine`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineArg {
    /// Rays from all over a patch, and direct light apart: fast, and right at contacts
    Rays,
    /// Each pair in closed form, times its visible share: for matrices, and as a reference
    Exact,
    /// A whole row at once from an item buffer
    Hemicube,
    /// One visibility ray a pair against every patch: the paper's baseline, slow
    Classical,
}

/// `--cluster`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ClusterArg {
    /// In models of more than 20,000 sides that exchange light, and more than twice the patches
    /// wanted
    Auto,
    /// Wherever neighbours have one material and lie nearly in one plane
    On,
    /// Never: a patch is at most one source triangle
    Off,
}

/// `--device`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DeviceArg {
    /// The processor
    Cpu,
    /// A graphics card
    Gpu,
}

/// `--draw`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DrawChoice {
    /// Source triangles; the patch under a pixel is looked up
    Sources,
    /// Every patch, as in the paper
    Patches,
}

/// `--solver`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolverChoice {
    /// Gathering with the newest values
    GaussSeidel,
    /// Gathering with the values of the last iteration
    Jacobi,
    /// Distributing the largest unshot flux first
    Shooting,
    /// Exactly, by dense LU: takes memory as the square of the number of patches
    Direct,
}
