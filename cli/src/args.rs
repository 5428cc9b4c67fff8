//! The command line.

mod factors;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use hemicube::engines::rays::MOST_SAMPLES;
use hemicube::gather::{FEWEST_RAYS, MOST_RAYS};

pub use factors::{FaceSides, Factors, GroupArg, with_group};

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
    /// Measure irradiance at points or on a work plane, as CSV
    #[command(after_long_help = PROBE_EXAMPLES)]
    Probe(Box<Probe>),
    /// Make the matrix of form factors (view factors) of a model
    #[command(after_long_help = factors::EXAMPLES)]
    Factors(Box<Factors>),
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
  hemicube render hall.glb --error 1% -v
  hemicube render statue.glb --sky 1,1,1.2 --exposure -1 --tone linear --report run.json";

const PROBE_EXAMPLES: &str = "Examples:
  hemicube probe cornell-box --points points.csv -o out.csv
  hemicube probe office.glb --grid 0.25,0.75,0.25 0,0,3.5 5.5,0,0 7x11 -o desk.csv -v
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
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, hide_default_value = true)]
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

/// Which model, and how its geometry is read.
#[derive(Debug, Args)]
pub struct Model {
    /// A model (.gltf .glb .obj .stl .ply) or the name of a built-in scene
    pub scene: String,

    /// Unit of the model's coordinates
    #[arg(long, value_enum, default_value_t = Unit::M)]
    pub unit: Unit,

    /// What is upwards, in the scene and in the picture, like 0,0,1 [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
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
        long, value_name = "RHO", default_value_t = 0.9, value_parser = reflectance,
        hide_short_help = true
    )]
    pub max_reflectance: f64,

    /// Let a material emit this radiance, or a share of its own (NAME=50%); may be repeated
    #[arg(long, value_name = "NAME=R,G,B", value_parser = emission)]
    pub emission: Vec<(String, Emission)>,

    /// Let a point or spot lamp shine as a photometric file says (IES LM-63, type C); may be
    /// repeated
    #[arg(long, value_name = "LAMP=FILE", value_parser = photometry)]
    pub ies: Vec<(String, PathBuf)>,

    /// Uniform radiance of the surroundings
    #[arg(long, value_name = "R,G,B", value_parser = vector)]
    pub sky: Option<DVec3>,
}

/// `--emission`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Emission {
    /// This radiance.
    Radiance(DVec3),
    /// This multiple of the material's own.
    Share(f64),
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

/// How a scene is lit.
#[derive(Debug, Clone, Args)]
pub struct Light {
    /// Largest area of a patch in m² [default: the area that yields about 20,000 patches, 5,000
    /// without rays, 40,000 for probe, 10,000 if source triangles are joined]
    #[arg(long, value_name = "AREA", allow_negative_numbers = true)]
    pub patch_size: Option<f64>,

    /// Join source triangles that are smaller than a patch: auto from 100,000 of them
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

    /// Rays a row, 32 to 65536 [default: 1024; 512 for probe]
    #[arg(long, value_name = "N", value_parser = samples)]
    pub samples: Option<usize>,

    /// Choose rays and patches so that irradiance is known this well on 80 % of the surface, like
    /// 1%; with --engine exact the error of form factors [default there: .1%]
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

    /// Memory that the work may take, like 800M or 4G [default: what is free]
    #[arg(long, value_name = "SIZE", value_parser = bytes, hide_short_help = true)]
    pub memory: Option<u64>,

    /// Number of threads [default: one a core]
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub threads: usize,

    /// Write what happened, with timings, as JSON
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub report: Option<PathBuf>,

    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Say how long each stage took and where the light went
    #[arg(short, long)]
    pub verbose: bool,
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
}

/// `hemicube render`.
#[derive(Debug, Args)]
pub struct Render {
    /// Which scene.
    #[command(flatten)]
    pub input: Input,

    /// The picture [default: the scene's name with .png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// One of the scene's cameras [default: its first]
    #[arg(long, value_name = "NAME", conflicts_with = "eye")]
    pub camera: Option<String>,

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

    /// Vertical angle of view in degrees
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub vfov: Option<f64>,

    /// Pixels of the picture [default: 720 high]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(usize, usize)>,

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

    /// Rays a point, 256 to 1048576 [default: 4096; more with --error below 1%]
    #[arg(long, value_name = "N", value_parser = point_rays)]
    pub rays: Option<usize>,

    /// How it is lit.
    #[command(flatten)]
    pub light: Light,
}

/// Brightness of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// From what is in view.
    Auto,
    /// Radiance is multiplied by two to this power.
    Stops(f64),
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
    /// In models of more than 100,000 sides that exchange light, and more than twice the patches
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

/// Three numbers with commas between.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> = text
        .split(',')
        .map(str::trim)
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|_| format!("'{text}' is not three numbers; write them like 1.5,-2,0"))?;
    match parts[..] {
        [x, y, z] if parts.iter().all(|p| p.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("'{text}' is not three numbers; write them like 1.5,-2,0")),
    }
}

fn emission(text: &str) -> Result<(String, Emission), String> {
    let wrong = || format!("'{text}' is not an emission; write it like lamp=10,10,8 or lamp=50%");
    let (name, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    let emission = match value.strip_suffix('%') {
        Some(percent) => {
            let percent: f64 = percent.trim().parse().map_err(|_| wrong())?;
            Emission::Share(percent / 100.0)
        }
        None => Emission::Radiance(vector(value).map_err(|_| wrong())?),
    };
    let valid = match emission {
        Emission::Share(s) => (0.0..MOST_RADIANCE).contains(&s),
        Emission::Radiance(r) => r.min_element() >= 0.0 && r.max_element() < MOST_RADIANCE,
    };
    if valid && !name.is_empty() { Ok((name.to_owned(), emission)) } else { Err(wrong()) }
}

fn photometry(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((lamp, file)) if !lamp.is_empty() && !file.is_empty() => {
            Ok((lamp.to_owned(), PathBuf::from(file)))
        }
        _ => Err(format!("'{text}' is no lamp and file; write it like bulb=bulb.ies")),
    }
}

/// Radiances beyond this overflow when they are squared for a residual.
pub const MOST_RADIANCE: f64 = 1e30;

fn reflectance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rho) if (0.0..1.0).contains(&rho) => Ok(rho),
        _ => Err(format!("'{text}' is not a reflectance from 0 to below 1")),
    }
}

/// Two whole numbers with an x between.
pub fn size(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("'{text}' is not a size; write it like 800x600");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    Ok((w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?))
}

fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    match text.parse() {
        Ok(stops) if (-100.0..=100.0).contains(&stops) => Ok(Exposure::Stops(stops)),
        _ => Err(format!("'{text}' is neither auto nor a number of stops from -100 to 100")),
    }
}

/// Per cent, with or without the sign, as a share of 1.
pub fn percent(text: &str) -> Result<f64, String> {
    /// Below it are the limits of single precision.
    const LEAST: f64 = 1e-4;
    match text.trim().trim_end_matches('%').trim_end().parse::<f64>() {
        Ok(percent) if (LEAST..=100.0).contains(&percent) => Ok(percent / 100.0),
        _ => Err(format!(
            "'{text}' is not an error in per cent from {LEAST} to 100; write it like .1 or .1%, \
             which both \
             mean one in a thousand"
        )),
    }
}

fn samples(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (32..=MOST_SAMPLES).contains(&n) => Ok(n),
        _ => Err(format!("'{text}' is not a number of rays from 32 to {MOST_SAMPLES}")),
    }
}

fn point_rays(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (FEWEST_RAYS..=MOST_RAYS).contains(&n) => Ok(n),
        _ => Err(format!("'{text}' is not a number of rays from {FEWEST_RAYS} to {MOST_RAYS}")),
    }
}

fn bytes(text: &str) -> Result<u64, String> {
    let wrong = || format!("'{text}' is not an amount of memory; write it like 800M or 4G");
    let (number, shift) = match text.trim_end_matches(['b', 'B', 'i']).char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 10),
        Some((at, 'm' | 'M')) => (&text[..at], 20),
        Some((at, 'g' | 'G')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    if number.is_finite() && number > 0.0 {
        Ok((number * f64::from(1_u32 << shift)) as u64)
    } else {
        Err(wrong())
    }
}
