//! `hemicube solve`.

use std::path::PathBuf;

use clap::Args;
use hemicube::store::Group;

use super::values::group;
use super::{Input, Light};

/// Shown below the long help.
pub const EXAMPLES: &str = "Examples:
  hemicube solve house.glb -o house.hemi
  hemicube render house.hemi --emission 'ceiling lamp=50%' -o dimmed.png
  hemicube render house.hemi --emission 'desk lamp=400,300,200' --emission sky=0% -o night.png
  hemicube solve hall.glb --group front=spot-1,spot-2 --group back=spot-3 -o hall.hemi
  hemicube render house.hemi --reflectance wall=.2,.2,.3 -o dark-walls.png
  hemicube solve house.hemi --reflectance wall=.2,.2,.3 -o dark-walls.hemi

There is a solution for each emitting material, each lamp and the sky, at unit white; what has one
name is solved together. The file is a zip archive of arrays for numpy.load, with manifest.json.
render, probe, bake and info take it for a scene. --emission then mixes solutions; --reflectance
solves again by the form factors in the file.";

/// `hemicube solve`.
#[derive(Debug, Args)]
pub struct Solve {
    /// The solutions (.hemi) [default: the scene's name with .hemi]
    #[arg(short, long, value_name = "FILE.hemi")]
    pub output: Option<PathBuf>,

    /// Solve materials and lamps together, lit or not yet: they can then only change together; may
    /// be repeated
    #[arg(long, value_name = "NAME=A,B,...", value_parser = group)]
    pub group: Vec<Group>,

    /// Which scene.
    #[command(flatten)]
    pub input: Input,

    /// How it is lit.
    #[command(flatten)]
    pub light: Light,
}
