//! `hemicube view`.

use clap::Args;

use super::values::length;
use super::{Look, UnitArg};

/// Shown below the long help.
pub const EXAMPLES: &str = "Examples:
  hemicube view room
  hemicube view house.hemi --emission 'desk lamp=50%'
  hemicube view hall.glb --no-open --port 8017

The page is served on this machine alone, under an address that holds a secret; Ctrl-C ends it.
Through a tunnel: ssh -L 8017:127.0.0.1:8017 host, then open the address that it says.";

/// `hemicube view`.
#[derive(Debug, Args)]
pub struct View {
    /// The port to listen on [default: one that is free]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,

    /// Do not open a browser
    #[arg(long)]
    pub no_open: bool,

    /// Width of a texel on surfaces, in metres [default: one of about 260000 texels in all]
    #[arg(long, value_name = "SIZE", value_parser = length)]
    pub texel: Option<f64>,

    /// The unit of illuminances
    #[arg(
        long, visible_alias = "false-color", value_name = "UNIT", value_enum,
        default_value_t = UnitArg::Lux
    )]
    pub false_colour: UnitArg,

    /// Of what.
    #[command(flatten)]
    pub look: Look,
}
