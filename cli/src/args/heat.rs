//! `hemicube heat` on the command line.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;

use super::factors::{FaceSides, GroupArg};
use super::run::Run;
use super::values::{percent, range, size, sun, vector};
use super::{Model, SunArg};

pub const EXAMPLES: &str = "Examples:
  hemicube heat oven.obj --temperature heater=1100 --temperature load=300 --emissivity .8
  hemicube heat oven.obj --flux heater=9000 --temperature load=300 --emissivity .8 --emissivity \
    walls=.4 -o faces.vtu --surfaces surfaces.csv
  hemicube heat satellite.obj --sides two --emissivity .85 --absorptance .3 --sun 180,45,1361 \
    --environment 3 --picture satellite.png
  hemicube heat box.obj --group --temperature hot=400 --temperature cold=300 --emissivity .9 \
    --gebhart B.csv --conductors GR.csv

Grey, diffuse net radiation, at rest. NAME is a surface, a material or an object of the model, for
one side alone with ' (back)' or ' (front)' after it; a value without a name is for all that have
none. What has neither a temperature nor a flux is adiabatic. Both sides of a face (--sides two)
have one temperature. Form factors are exact, up to --error.

Columns (K, W/m2, m2; of surfaces W): temperature; net_flux: heat that is supplied and leaves by
radiation, both bands; infrared_flux; sunlight absorbed; radiosity and irradiance (infrared);
errors: half-widths of 95 % intervals, from the error that the form factors state.";

/// `hemicube heat`.
#[derive(Debug, Args)]
pub struct Heat {
    /// Which model.
    #[command(flatten)]
    pub model: Model,

    /// What has this temperature, in K; may be repeated
    #[arg(long, value_name = "NAME=K", value_parser = kelvin, allow_hyphen_values = true)]
    pub temperature: Vec<Named>,

    /// What is supplied with this heat, in W/m2 of one side's area, negative if it is taken away;
    /// may be repeated [default: 0]
    #[arg(long, value_name = "NAME=W/m2", value_parser = watts, allow_hyphen_values = true)]
    pub flux: Vec<Named>,

    /// Infrared emissivity, 0 to 1; may be repeated
    #[arg(long, value_name = "[NAME=]E", value_parser = share, allow_hyphen_values = true)]
    pub emissivity: Vec<Named>,

    /// Temperature of what surrounds the model, in K; only an enclosure needs none
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    pub environment: Option<f64>,

    /// Let the sun shine from that azimuth (degrees clockwise from north, which is -z, or +y if z
    /// is up) and elevation (degrees), with that irradiance on what faces it, in W/m2
    #[arg(
        long, value_name = "AZIMUTH,ELEVATION,W/m2", value_parser = sun_in_watts,
        allow_hyphen_values = true
    )]
    pub sun: Option<SunArg>,

    /// Sunlight from all around, as irradiance of what faces nothing else, in W/m2
    #[arg(long, value_name = "W/m2", allow_negative_numbers = true)]
    pub diffuse_sun: Option<f64>,

    /// Share of sunlight that is absorbed, 0 to 1; may be repeated [default: the emissivity]
    #[arg(long, value_name = "[NAME=]A", value_parser = share, allow_hyphen_values = true)]
    pub absorptance: Vec<Named>,

    /// Take this for a diffuse reflector, although the file says that it is a mirror or metal; all:
    /// whatever is; may be repeated
    #[arg(long, value_name = "NAME|all")]
    pub diffuse: Vec<String>,

    /// The faces (.csv; .vtu for ParaView)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// The surfaces (.csv) [default: stdout]
    #[arg(long, value_name = "FILE")]
    pub surfaces: Option<PathBuf>,

    /// Gebhart factors: the share of what row i emits that row j absorbs (.npz .npy .mtx .csv)
    #[arg(long, value_name = "FILE")]
    pub gebhart: Option<PathBuf>,

    /// Radiative conductors between nodes, and to the environment (.csv): i,j,GR in m2. A node is a
    /// row, or both sides of a face
    #[arg(long, value_name = "FILE.csv")]
    pub conductors: Option<PathBuf>,

    /// A picture of temperatures in colours (.png .jpg)
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,

    /// Temperatures of a picture's darkest and brightest colour, in K
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, requires = "picture")]
    pub range: Option<[f64; 2]>,

    /// Where the camera stands, in metres
    #[arg(
        long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        requires = "target", requires = "picture"
    )]
    pub eye: Option<DVec3>,

    /// What the camera looks at, in metres
    #[arg(
        long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        requires = "eye"
    )]
    pub target: Option<DVec3>,

    /// Vertical angle of view in degrees
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "picture")]
    pub vfov: Option<f64>,

    /// Pixels of the picture, without its legend [default: 720 high]
    #[arg(long, value_name = "WxH", value_parser = size, requires = "picture")]
    pub size: Option<(usize, usize)>,

    /// Lump rows to what the file names, each of one temperature [default without a value: surface]
    #[arg(
        long, value_enum, value_name = "BY", num_args = 0..=1, require_equals = true,
        default_missing_value = "surface"
    )]
    pub group: Option<GroupArg>,

    /// Which sides of faces exchange heat
    #[arg(long, value_enum, default_value_t = FaceSides::One)]
    pub sides: FaceSides,

    /// Largest area of a patch in m² [default: every face is one patch]
    #[arg(long, value_name = "AREA", allow_negative_numbers = true)]
    pub patch_size: Option<f64>,

    /// Error of the form factors aimed at in per cent, like .1 or .1% [default: .1]
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    pub error: Option<f64>,

    /// How it is run.
    #[command(flatten)]
    pub run: Run,
}

/// A number for what has that name; for all that has none without.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Whose.
    pub name: Option<String>,
    /// What.
    pub value: f64,
}

/// Azimuth and elevation in degrees, and an irradiance in W/m².
fn sun_in_watts(text: &str) -> Result<SunArg, String> {
    match text.split(',').count() {
        3 => sun(text).map_err(|e| e.replace(",80000", ",1000").replace("135,40 or ", "")),
        _ => Err(format!("'{text}' is no sun; write it like 135,40,1000 (degrees and W/m2)")),
    }
}

fn kelvin(text: &str) -> Result<Named, String> {
    named(text).ok_or_else(|| format!("'{text}' is no temperature in K; write it like wall=293.15"))
}

fn watts(text: &str) -> Result<Named, String> {
    named(text).ok_or_else(|| format!("'{text}' is no flux in W/m2; write it like heater=500"))
}

fn share(text: &str) -> Result<Named, String> {
    named(text).ok_or_else(|| format!("'{text}' is no share from 0 to 1; write it like wall=0.9"))
}

/// A number, after a name and `=` if it has one.
fn named(text: &str) -> Option<Named> {
    let (name, number) = match text.rsplit_once('=') {
        Some((name, number)) => (Some(name), number),
        None => (None, text),
    };
    let value = number.trim().parse().ok().filter(|value: &f64| value.is_finite())?;
    (name != Some("")).then(|| Named { name: name.map(str::to_owned), value })
}
