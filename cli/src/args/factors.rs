//! `hemicube factors` on the command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hemicube::export::MOST_PARTS;
use hemicube::scene::SidesChoice;

use super::run::Run;
use super::values::{percent, samples};
use super::{ClusterArg, DeviceArg, DrawChoice, EngineArg, Light, Model, SolverChoice};

pub const EXAMPLES: &str = "Examples:
  hemicube factors oven.stl --unit mm -o F.npz --surfaces surfaces.csv
  hemicube factors room.glb --group --enclosure > factors.csv
  hemicube factors house.obj --group material -o F.csv
  hemicube factors room.obj --group --enclosure -o zone.idf --zone \"Zone 1\"
  hemicube factors room.obj --patch-size 0.01 -o F.npz --surfaces room.vtu --row ceiling
  hemicube factors satellite.obj --sides two --threshold 1e-6 -o F.mtx
  hemicube factors furnace.stl --patch-size 0.01 --error .01% -o F.npz
  hemicube factors hall.ply --engine hemicube --resolution 512 -o F.npz
  hemicube render room.glb --sides one --factors F.npz
  hemicube factors city.obj --plan plan.json
  hemicube factors city.obj --plan plan.json --part 3/16 -o parts

F_ij is the share of what patch i sends out that arrives at patch j; row i is face i of the file,
from 0. Formats: .npz (scipy.sparse.load_npz), .npy (dense), .mtx (Matrix Market), .csv (dense, with
labels), .idf (ZoneProperty:UserViewFactors:BySurfaceName of EnergyPlus, of lumped rows). With
--sides two the backs of all faces follow as rows n to 2n. Degenerate, duplicate and transparent
faces keep a row of zeros. Parts are made by as many processes as you like, and joined by hemicube
merge.";

pub const MERGE_EXAMPLES: &str = "Examples:
  hemicube merge city.obj parts --plan plan.json -o F.npz
  hemicube merge room.glb parts --plan plan.json --group --enclosure > factors.csv

Parts are made by hemicube factors --plan, --part K/N. The matrix is the one that hemicube factors
makes at once, to the last byte. Parts that are missing or damaged are named by number: make them
again, and merge again.";

/// `hemicube factors`.
#[derive(Debug, Args)]
pub struct Factors {
    /// Which model.
    #[command(flatten)]
    pub model: Model,

    /// What becomes of the matrix.
    #[command(flatten)]
    pub outcome: Outcome,

    /// Which sides have rows
    #[arg(long, value_enum, default_value_t = FaceSides::One)]
    pub sides: FaceSides,

    /// Largest area of a patch in m² [default: every face is one patch]
    #[arg(long, value_name = "AREA", allow_negative_numbers = true)]
    pub patch_size: Option<f64>,

    /// Who makes the form factors [default: exact; rays with --samples, hemicube with its own
    /// flags]
    #[arg(long, value_enum)]
    pub engine: Option<EngineArg>,

    /// Error aimed at in per cent, like .1 or .1%: RMS of the form factors' errors over their own,
    /// with --engine exact [default: .1]
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    pub error: Option<f64>,

    /// Where hemicubes are made [default: cpu]
    #[arg(long, value_enum, hide_short_help = true)]
    pub device: Option<DeviceArg>,

    /// Pixels along a hemicube's top, even, 16 to 1024 [default: 128]
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub resolution: Option<usize>,

    /// What is projected on the hemicubes [default: sources]
    #[arg(long, value_enum, hide_short_help = true)]
    pub draw: Option<DrawChoice>,

    /// Rays a row, 32 to 65536, with --engine rays [default: 4096]
    #[arg(long, value_name = "N", value_parser = samples)]
    pub samples: Option<usize>,

    /// Another seed gives other rays
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub seed: Option<u32>,

    /// Plan the matrix for several processes, and write the plan there; with --part, read it
    #[arg(long, value_name = "FILE.json", conflicts_with_all = [
        "surfaces", "row", "zone", "group", "enclosure", "threshold", "strict"
    ])]
    pub plan: Option<PathBuf>,

    /// Make part K of N of a planned matrix, 1 to N, into the folder of -o
    #[arg(long, value_name = "K/N", value_parser = part, requires_all = ["plan", "output"],
        conflicts_with_all = [
            "patch_size", "error", "seed", "engine", "samples", "resolution", "draw", "device"
        ])]
    pub part: Option<(u32, u32)>,

    /// The parts that are joined, with their plan: of [`Merge`] alone.
    #[arg(skip)]
    pub parts: Option<PathBuf>,

    /// How it is run.
    #[command(flatten)]
    pub run: Run,
}

/// `hemicube merge`.
#[derive(Debug, Args)]
pub struct Merge {
    /// Which model.
    #[command(flatten)]
    pub model: Model,

    /// The folder of the parts
    pub parts: PathBuf,

    /// The plan that they were made by
    #[arg(long, value_name = "FILE.json")]
    pub plan: PathBuf,

    /// What becomes of the matrix.
    #[command(flatten)]
    pub outcome: Outcome,

    /// Which sides have rows
    #[arg(long, value_enum, default_value_t = FaceSides::One)]
    pub sides: FaceSides,

    /// How it is run.
    #[command(flatten)]
    pub run: Run,
}

/// What becomes of a matrix.
#[derive(Debug, Clone, Args)]
pub struct Outcome {
    /// The matrix (.npz .npy .mtx .csv, .idf for EnergyPlus) [default: CSV on stdout]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// A table (.csv) of what each row stands for: surface, area, place, normal, account; or the
    /// same drawn on the model (.vtu, for ParaView)
    #[arg(long, value_name = "FILE")]
    pub surfaces: Vec<PathBuf>,

    /// Form factors to draw in the .vtu: those from a row, or from all rows of a surface together
    #[arg(long, value_name = "NAME|INDEX")]
    pub row: Vec<String>,

    /// The zone in the .idf [default: the model's name]
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub zone: Option<String>,

    /// Lump rows and columns to what the file names [default without a value: surface]
    #[arg(
        long, value_enum, value_name = "BY", num_args = 0..=1, require_equals = true,
        default_missing_value = "surface"
    )]
    pub group: Option<GroupArg>,

    /// Close the matrix of an enclosure: rows sum to 1 and A_i F_ij = A_j F_ji
    #[arg(long)]
    pub enclosure: bool,

    /// Drop form factors below this (0..1), and restore what each row sums to
    #[arg(long, value_name = "EPS", value_parser = share, allow_negative_numbers = true)]
    pub threshold: Option<f64>,

    /// Exit with code 1 if the error that the result states exceeds --error; it is written all the
    /// same
    #[arg(long)]
    pub strict: bool,
}

/// What rows are lumped by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GroupArg {
    /// OBJ g, glTF node, STL solid
    Surface,
    /// The materials' names
    Material,
    /// OBJ o, glTF node, STL solid; else the whole model
    Object,
}

/// Joins `--group` with a value after it, which may also be the model: `--group material` is
/// `--group=material`, and `--group room.obj` lumps the surfaces of room.obj.
pub fn with_group(args: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let known = |word: &OsString| {
        GroupArg::value_variants()
            .iter()
            .any(|v| v.to_possible_value().is_some_and(|v| word.to_str() == Some(v.get_name())))
    };
    let mut args = args.peekable();
    let mut joined = Vec::new();
    while let Some(mut arg) = args.next() {
        if arg == "--group"
            && let Some(value) = args.next_if(known)
        {
            arg.push("=");
            arg.push(value);
        }
        joined.push(arg);
    }
    joined
}

/// Which sides of triangles have rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FaceSides {
    /// Fronts alone; backs absorb
    One,
    /// Fronts, and backs after them
    Two,
}

impl FaceSides {
    /// As importers have it.
    pub fn choice(self) -> SidesChoice {
        match self {
            Self::One => SidesChoice::One,
            Self::Two => SidesChoice::Two,
        }
    }
}

fn part(text: &str) -> Result<(u32, u32), String> {
    let numbers = text.split_once('/');
    let numbers = numbers.and_then(|(k, n)| Some((k.parse::<u32>().ok()?, n.parse().ok()?)));
    match numbers {
        Some((k, n)) if (1..=n).contains(&k) && n <= MOST_PARTS => Ok((k, n)),
        Some((_, n)) if n > MOST_PARTS => {
            Err(format!("{n} parts are too many: {MOST_PARTS} at most"))
        }
        _ => Err(format!("'{text}' is no part; write it like 3/16, from 1/16 to 16/16")),
    }
}

impl Merge {
    /// The same as what makes a matrix.
    pub fn as_factors(&self) -> Factors {
        Factors {
            model: self.model.clone(),
            outcome: self.outcome.clone(),
            sides: self.sides,
            patch_size: None,
            engine: None,
            error: None,
            device: None,
            resolution: None,
            draw: None,
            samples: None,
            seed: None,
            plan: Some(self.plan.clone()),
            part: None,
            parts: Some(self.parts.clone()),
            run: self.run.clone(),
        }
    }
}

/// Rays a row where the matrix itself is the result.
const SAMPLES: usize = 4096;

impl Factors {
    /// The engine's flags, as those of a scene that is lit.
    pub fn light(&self) -> Light {
        let mut light = Light {
            patch_size: self.patch_size,
            cluster: ClusterArg::Off,
            max_factor: None,
            min_patch: None,
            engine: self.engine,
            error: self.error,
            device: self.device,
            resolution: self.resolution,
            draw: self.draw,
            samples: self.samples,
            seed: self.seed,
            factors: None,
            solver: SolverChoice::GaussSeidel,
            run: self.run.clone(),
        };
        // What has flags of its own is meant by them; a matrix is made exactly otherwise.
        if light.engine() == EngineArg::Rays && self.samples.is_none() {
            light.engine.get_or_insert(EngineArg::Exact);
        }
        if light.engine() == EngineArg::Rays {
            light.samples.get_or_insert(SAMPLES);
        }
        light
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..1.0).contains(&share) => Ok(share),
        _ => Err(format!("'{text}' is not a form factor from 0 to below 1; write it like 1e-6")),
    }
}
