//! The command line.

mod bake;
mod factors;
mod heat;
mod input;
mod light;
mod run;
mod solve;
mod values;
mod view;
mod view3d;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;

pub use bake::{Bake, ModeArg};
pub use factors::{FaceSides, Factors, GroupArg, Merge, with_group};
pub use heat::{Heat, Named};
pub use input::{Emission, Input, LampArg, Model, SidesArg, SunArg, Unit};
pub use light::{ClusterArg, DeviceArg, DrawChoice, EngineArg, Light, SolverChoice};
pub use solve::Solve;
pub use values::{MOST_RADIANCE, size, vector};
use values::{camera, exposure, point_rays, range, threads};
pub use view::View;
pub use view3d::View3d;

/// Reads the command line; ends the program where it says what is wrong or shows help.
pub fn read(arguments: &[OsString]) -> Result<Arguments, String> {
    let read = match view3d::called_view3d(arguments) {
        Some(read) => read.map(|v| Arguments { command: Command::View3d(Box::new(v)) }),
        None => Arguments::try_parse_from(arguments),
    };
    match read {
        Ok(arguments) => Ok(arguments),
        Err(error) if error.kind() == ErrorKind::InvalidUtf8 => {
            let no_text = arguments.iter().find(|a| a.to_str().is_none());
            let name = no_text.map_or(String::new(), |a| a.to_string_lossy().into_owned());
            Err(format!("{name}: is not in UTF-8; rename the file, or write the argument anew"))
        }
        Err(error) => error.exit(),
    }
}

/// Radiosity: pictures of scenes lit by the exchange of diffuse light.
#[derive(Debug, Parser)]
#[command(name = "hemicube", version, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Light a scene and make its picture
    #[command(after_long_help = RENDER_EXAMPLES)]
    Render(Box<Render>),
    /// Write the model with its light baked into it, as binary glTF
    #[command(after_long_help = bake::EXAMPLES)]
    Bake(Box<Bake>),
    /// Solve for each lamp on its own: new lamps, views and reflectances then cost next to nothing
    #[command(after_long_help = solve::EXAMPLES)]
    Solve(Box<Solve>),
    /// Look at a scene in a browser, while it is lit and after
    #[command(after_long_help = view::EXAMPLES)]
    View(Box<View>),
    /// Measure irradiance at points or on a work plane, as CSV
    #[command(after_long_help = PROBE_EXAMPLES)]
    Probe(Box<Probe>),
    /// Make the matrix of form factors (view factors) of a model
    #[command(after_long_help = factors::EXAMPLES)]
    Factors(Box<Factors>),
    /// Join a matrix that was made in parts
    #[command(after_long_help = factors::MERGE_EXAMPLES)]
    Merge(Box<Merge>),
    /// Find temperatures and net heat fluxes by radiation between grey diffuse surfaces
    #[command(after_long_help = heat::EXAMPLES)]
    Heat(Box<Heat>),
    /// Do what View3D does: factors of its .vs3 file, in its formats
    #[command(after_long_help = view3d::EXAMPLES)]
    View3d(Box<View3d>),
    /// Say what a model holds, and what is wrong or doubtful with it
    #[command(after_long_help = INFO_EXAMPLES)]
    Info(Box<Info>),
    /// List the built-in scenes
    Scenes,
    /// Repeat the experiments of Kulyasov & Nikulin (2012): classical, hemicube, adaptive
    #[command(after_long_help = PAPER_EXAMPLES)]
    Paper(Paper),
}

const RENDER_EXAMPLES: &str = "Examples:
  hemicube render cornell-box -o cornell.png
  hemicube render house.glb --eye 1,1.6,-2 --target 4,1,3 --size 1280x720
  hemicube render model.obj --unit mm --emission lamp=20,18,15 --patch-size 0.01
  hemicube render hall.glb --ies pendant=pendant.ies
  hemicube render office.glb --false-colour lux -o lux.png
  hemicube render statue.glb --camera orbit:12 -o 'view-{camera}.jpg' --contact-sheet sheet.png
  hemicube render hall.glb --error 1% -v
  hemicube render statue.glb --sky 1,1,1.2 --exposure -1 --tone linear --report run.json";

const PROBE_EXAMPLES: &str = "Examples:
  hemicube probe cornell-box --points points.csv -o out.csv
  hemicube probe office.glb --grid 0.25,0.75,0.25 0,0,3.5 5.5,0,0 7x11 -o desk.csv -v
  hemicube probe office.glb --grid 0.25,0.75,0.25 0,0,3.5 5.5,0,0 7x11 --plan desk.svg
  printf 'x,y,z,nx,ny,nz\\n2,0.75,1,0,1,0\\n' | hemicube probe office.glb --points -

Points are in metres. The file has a header with x,y,z,nx,ny,nz in any order; other columns pass
through. Added are E_r,E_g,E_b, E = .2126 E_r + .7152 E_g + .0722 E_b in lx (W/m2), error (half the
width of the 95 % interval of E) and place: free, covered (inside a solid) or emitter (on one).
A grid adds i,j too; its normal is U x V.";

const INFO_EXAMPLES: &str = "Examples:
  hemicube info house.glb
  hemicube info model.obj --unit mm --up 0,0,1";

const PAPER_EXAMPLES: &str = "Examples:
  hemicube paper -o paper --quick
  hemicube paper table2 -o paper";

/// `hemicube paper`.
#[derive(Debug, Args)]
pub struct Paper {
    /// Which of its tables; all: with a comparison of quality
    #[arg(value_enum, default_value_t = PaperPart::All)]
    pub part: PaperPart,

    /// The folder for tables (.csv), plots, pictures and paper.md
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Two minutes instead of twenty: two sizes of four, small hemicubes, small samples
    #[arg(long)]
    pub quick: bool,

    /// Number of threads [default: one a core]
    #[arg(
        short = 'j', long, value_name = "N", default_value_t = 0, hide_default_value = true,
        value_parser = threads
    )]
    pub threads: usize,
}

/// Part of the paper's experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PaperPart {
    /// Classical radiosity against hemicubes
    Table1,
    /// Uniform against adaptive subdivision
    Table2,
    /// Adaptive subdivision at eight tolerances
    Table3,
    /// All tables, and what adaptive subdivision loses
    All,
}

/// `hemicube info`.
#[derive(Debug, Args)]
pub struct Info {
    /// Which scene.
    #[command(flatten)]
    pub input: Input,
}

/// A scene, its light, and how it is looked at.
#[derive(Debug, Args)]
pub struct Look {
    /// Which scene.
    #[command(flatten)]
    pub input: Input,

    /// One of the scene's cameras, all of them, or N views around it [default: its first]
    #[arg(long, value_name = "NAME|all|orbit:N", value_parser = camera, conflicts_with = "eye")]
    pub camera: Option<CameraArg>,

    /// Where the camera stands, in metres
    #[arg(
        long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        requires = "target"
    )]
    pub eye: Option<DVec3>,

    /// What the camera looks at, in metres
    #[arg(
        long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        requires = "eye"
    )]
    pub target: Option<DVec3>,

    /// Show the model as an object from outside, or as a room from within [default: by its shape]
    #[arg(long = "as", value_name = "object|room", value_enum)]
    pub kind: Option<KindArg>,

    /// Light what has no light: an object in a studio, a room by ceiling lights or by day; on: a
    /// studio for an object that has light too; off: leave the model alone
    #[arg(long, value_enum, default_value_t = StageArg::Auto)]
    pub stage: StageArg,

    /// Vertical angle of view in degrees
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub vfov: Option<f64>,

    /// auto, or stops: radiance is multiplied by 2^EV
    #[arg(
        long, value_name = "auto|EV", default_value = "auto", value_parser = exposure,
        allow_hyphen_values = true
    )]
    pub exposure: Exposure,

    /// How radiance becomes display light
    #[arg(long, value_enum, default_value_t = ToneChoice::Agx, hide_short_help = true)]
    pub tone: ToneChoice,

    /// How it is lit.
    #[command(flatten)]
    pub light: Light,
}

/// `hemicube render`.
#[derive(Debug, Args)]
pub struct Render {
    /// The picture (.png .jpg; .exr .hdr: radiance); {camera} stands for the camera's name
    /// [default: the scene's name with .png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// All views on one sheet, with their names
    #[arg(long, value_name = "FILE")]
    pub contact_sheet: Option<PathBuf>,

    /// Show illuminance instead: in colours, with a legend in that unit and lines of equal
    /// illuminance
    #[arg(
        long,
        visible_alias = "false-color",
        value_name = "UNIT",
        value_enum,
        conflicts_with = "draft"
    )]
    pub false_colour: Option<UnitArg>,

    /// Illuminances of the darkest and the brightest colour [default: as the picture asks]
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, requires = "false_colour")]
    pub range: Option<[f64; 2]>,

    /// Pixels of the picture [default: 720 high]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(usize, usize)>,

    /// Show the light of patches alone: a quicker picture whose shadows are as fine as patches
    #[arg(long, conflicts_with = "error_map")]
    pub draft: bool,

    /// Also write how well each pixel is known, as a picture: black exactly, white badly
    #[arg(long, value_name = "FILE.png")]
    pub error_map: Option<PathBuf>,

    /// Of what.
    #[command(flatten)]
    pub look: Look,
}

/// `hemicube probe`.
#[derive(Debug, Args)]
pub struct Probe {
    /// Which scene.
    #[command(flatten)]
    pub input: Input,

    /// A table (.csv) of points and normals: x,y,z,nx,ny,nz; - reads it from stdin
    #[arg(long, value_name = "FILE", required_unless_present = "grid", conflicts_with = "grid")]
    pub points: Option<PathBuf>,

    /// A work plane: its corner, its two edges, and how many cells along each
    #[arg(
        long, num_args = 4, value_names = ["X,Y,Z", "U", "V", "NUxNV"], allow_hyphen_values = true
    )]
    pub grid: Option<Vec<String>>,

    /// The result (.csv) [default: stdout]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Also draw the work plane in colours, as a picture (.png .jpg) or a drawing (.svg)
    #[arg(long, value_name = "FILE", requires = "grid")]
    pub plan: Option<PathBuf>,

    /// The unit of a plan's numbers [default: lux]
    #[arg(long, visible_alias = "false-color", value_name = "UNIT", value_enum, requires = "plan")]
    pub false_colour: Option<UnitArg>,

    /// Illuminances of a plan's darkest and brightest colour [default: as the plane asks]
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, requires = "plan")]
    pub range: Option<[f64; 2]>,

    /// Rays a point, 256 to 1048576 [default: 4096; more with --error below 1%]
    #[arg(long, value_name = "N", value_parser = point_rays)]
    pub rays: Option<usize>,

    /// How it is lit.
    #[command(flatten)]
    pub light: Light,
}

/// `--camera`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraArg {
    /// The one of that name.
    Named(String),
    /// All.
    All,
    /// So many around the model.
    Orbit(usize),
}

/// The unit of `--false-colour`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UnitArg {
    /// lx, of a scene in cd/m2
    Lux,
    /// W/m2, of a scene in W/(m2 sr)
    Watt,
}

impl UnitArg {
    /// As numbers have it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Lux => "lx",
            Self::Watt => "W/m2",
        }
    }
}

/// `--as`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KindArg {
    /// To be looked at from outside
    Object,
    /// To be looked at from within
    Room,
}

/// `--stage`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StageArg {
    /// Where nothing lights the model
    Auto,
    /// In any case
    On,
    /// Never
    Off,
}

/// Brightness of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// From what is in view.
    Auto,
    /// Radiance is multiplied by two to this power.
    Stops(f64),
}

/// `--tone`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ToneChoice {
    /// Film-like
    Agx,
    /// Global operator on luminance
    Reinhard,
    /// Clipped at white
    Linear,
}
