//! `hemicube bake`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::length;
use super::{Look, UnitArg};

/// Shown below the long help.
pub const EXAMPLES: &str = "Examples:
  hemicube bake house.glb -o house-lit.glb
  hemicube bake room --mode vertex -o room.glb
  hemicube bake house.glb --mode lightmap --texel 0.05 -o house-lit.glb
  hemicube bake house.glb -o house.html

unlit: what is seen, in one texture (KHR_materials_unlit). vertex: radiance as COLOR_0 times the
scale in extras. lightmap: irradiance as MOZ_lightmap beside all materials; the same as floats in
FILE.exr (E / pi), and where each node lies in it in FILE.json.

A page shows the model in any browser, without a network: each lamp has a slider and a colour.";

/// `hemicube bake`.
#[derive(Debug, Args)]
pub struct Bake {
    /// The model with its light (.glb), or a page that shows it (.html) [default: the scene's name
    /// with -baked.glb]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// How the model carries its light [default: unlit]
    #[arg(long, value_enum)]
    pub mode: Option<ModeArg>,

    /// Width of a texel on surfaces, in metres [default: one of about 260000 texels in all]
    #[arg(long, value_name = "SIZE", value_parser = length)]
    pub texel: Option<f64>,

    /// lightmap: also the direct light of lamps, which are left out then
    #[arg(long)]
    pub direct: bool,

    /// A page: the unit of its illuminances [default: lux]
    #[arg(long, visible_alias = "false-color", value_name = "UNIT", value_enum)]
    pub false_colour: Option<UnitArg>,

    /// Of what.
    #[command(flatten)]
    pub look: Look,
}

/// `--mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModeArg {
    /// One texture that shows what `render` shows
    Unlit,
    /// Colours of vertices, on a mesh that is fine where light changes
    Vertex,
    /// Irradiance in a second set of texture coordinates; materials stay
    Lightmap,
}
