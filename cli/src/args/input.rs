//! Which scene is read, and how.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use hemicube::scene::MAX_REFLECTANCE;

use super::values::{
    direction, emission, lamp, photometry, reflectance, reflectances, sun, vector,
};

/// Which model, and how its geometry is read.
#[derive(Debug, Clone, Args)]
pub struct Model {
    /// A model (.gltf .glb .obj .stl .ply .vs3), a solution (.hemi) or the name of a built-in scene
    pub scene: PathBuf,

    /// Unit of the model's coordinates
    #[arg(long, value_enum, default_value_t = Unit::M)]
    pub unit: Unit,

    /// What is upwards, in the scene and in the picture: y, z or a vector like 0,0,1 [default: y
    /// in glTF, else as the model stands]
    #[arg(long, value_name = "y|z|X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<DVec3>,

    /// Turn every triangle round: for a room exported with its faces outwards
    #[arg(long, hide_short_help = true)]
    pub flip: bool,
}

/// Which scene, and how it is read.
#[derive(Debug, Args)]
pub struct Input {
    /// Its geometry.
    #[command(flatten)]
    pub model: Model,

    /// Which sides of surfaces reflect
    #[arg(long, value_enum, default_value_t = SidesArg::File, hide_short_help = true)]
    pub sides: SidesArg,

    /// Brighter reflectances are clamped to this
    #[arg(
        long, value_name = "RHO", default_value_t = MAX_REFLECTANCE, value_parser = reflectance,
        hide_short_help = true
    )]
    pub max_reflectance: f64,

    /// Let a material emit this radiance, a lamp with this intensity (cd), or either a share of its
    /// own (NAME=50%); may be repeated
    #[arg(long, value_name = "NAME=R,G,B", value_parser = emission)]
    pub emission: Vec<(String, Emission)>,

    /// Let a material reflect this share of red, green and blue, 0 to below 1; may be repeated
    #[arg(long, value_name = "NAME=R,G,B", value_parser = reflectances)]
    pub reflectance: Vec<(String, DVec3)>,

    /// Let a point or spot lamp shine as a photometric file says (IES LM-63); may be repeated
    #[arg(long, value_name = "LAMP=FILE", value_parser = photometry)]
    pub ies: Vec<(String, PathBuf)>,

    /// Hang a lamp that sends out that flux (lm or W) alike in all directions, or in the shape of a
    /// photometric file, whose own flux counts if none is given; may be repeated
    #[arg(
        long, value_name = "NAME=X,Y,Z[,FLUX][,FILE]", value_parser = lamp,
        allow_hyphen_values = true
    )]
    pub lamp: Vec<LampArg>,

    /// Let the sun shine from that azimuth (degrees clockwise from north, which is -z, or +y if z
    /// is up) and elevation (degrees), with that irradiance on what faces it (lx) [default: 100000]
    #[arg(
        long, value_name = "AZIMUTH,ELEVATION[,LUX]", value_parser = sun, allow_hyphen_values = true
    )]
    pub sun: Option<SunArg>,

    /// Uniform radiance of the surroundings
    #[arg(long, value_name = "R,G,B", value_parser = vector)]
    pub sky: Option<DVec3>,
}

/// `--emission`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Emission {
    /// This radiance, or intensity of a lamp.
    Radiance(DVec3),
    /// This multiple of the material's own.
    Share(f64),
}

/// `--lamp`.
#[derive(Debug, Clone, PartialEq)]
pub struct LampArg {
    /// Its name.
    pub name: String,
    /// Metres.
    pub position: DVec3,
    /// lm or W; that of its file if there is none.
    pub flux: Option<f64>,
    /// Its photometric file; always there without a flux.
    pub file: Option<PathBuf>,
}

/// `--sun`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunArg {
    /// Degrees clockwise from north.
    pub azimuth: f64,
    /// Degrees above the horizon.
    pub elevation: f64,
    /// Irradiance on what faces it.
    pub irradiance: f64,
}

/// `--unit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Metres
    M,
    /// Millimetres
    Mm,
    /// Centimetres
    Cm,
    /// Inches
    In,
    /// Feet
    Ft,
}

impl Unit {
    /// Metres a unit.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 0.001,
            Self::Cm => 0.01,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}

/// `--sides`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SidesArg {
    /// As the file says
    File,
    /// Fronts alone; backs absorb
    One,
    /// Fronts and backs
    Two,
}
