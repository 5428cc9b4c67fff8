//! What to do about an error: the library says what is wrong and by how much; here stands the flag
//! that helps. Each text begins with `; `, or is empty.

use std::collections::BTreeSet;
use std::path::Path;

use hemicube::engines::{AssembleError, EngineError};
use hemicube::export::ReadError;
use hemicube::form_factors::SinkError;
use hemicube::heat::HeatError;
use hemicube::matrix::{MatrixError, SameWith, StoredError};
use hemicube::patches::PatchesError;
use hemicube::refine::factor::RefineError;
use hemicube::render::RenderError;
use hemicube::scene::{Finding, ImportError, Scene, Setting, Sides};
use hemicube::solution::LightError;
use hemicube::solve::SolveError;
use hemicube::store::{GroupError, MixError, emitters};

use crate::failure::Failure;

/// About a model that cannot be read.
pub fn of_import(error: &ImportError) -> &'static str {
    match error {
        ImportError::TooFar { .. } => "; or give another --unit",
        ImportError::Unit(_) => "; give another --unit",
        ImportError::MaxReflectance(_) => "; give another --max-reflectance",
        ImportError::Up(_) => "; give another --up",
        _ => "",
    }
}

/// About a finding: what can be done about it in the model, and the flag that settles it.
pub fn of_finding(finding: &Finding) -> String {
    let flag = finding.setting.map(|setting| match setting {
        Setting::Unit(likely) => format!("use --unit {}", likely.join(", ")),
        Setting::MaxReflectance => "or raise --max-reflectance".to_owned(),
        Setting::Camera => "or give --eye and --target".to_owned(),
    });
    let remedies = [Some(finding.remedy.clone()), flag];
    let remedies = remedies.into_iter().flatten().filter(|text| !text.is_empty());
    remedies.map(|text| format!("; {text}")).collect()
}

/// About a scene that could not be lit; `direct` if by the direct solver.
pub fn of_light(error: &LightError, direct: bool) -> String {
    match error {
        LightError::Patches(e) => of_patches(e),
        LightError::Refine(RefineError::Tolerance(_)) => "; give another --max-factor".to_owned(),
        LightError::Refine(RefineError::Clusters) => "; use --cluster off".to_owned(),
        LightError::Refine(RefineError::Assemble(AssembleError::Sink(e))) => of_sink(e),
        LightError::Refine(RefineError::Assemble(AssembleError::Engine(e))) => of_engine(e),
        LightError::Engine(e) => of_engine(e),
        LightError::Sink(e) => of_sink(e),
        LightError::Solve(e) => of_solve(e),
        LightError::NoSky => "; use --engine hemicube, or --sky 0,0,0 and an emitter".to_owned(),
        LightError::Memory { proposal, needed, .. } => {
            let larger = proposal.map(|size| format!("--patch-size {size} (m²) or more, "));
            let (solver, rows) = match direct {
                true => ("--solver gauss-seidel, ", ""),
                false => ("", ", or fewer --samples or a lower --resolution"),
            };
            let (larger, enough) = (larger.unwrap_or_default(), needed.div_ceil(1 << 20));
            format!("; use {solver}{larger}--memory {enough}M{rows}")
        }
        _ => String::new(),
    }
}

/// Why the matrix of a scene was not made, with what `remedy` says of that.
pub fn matrix_failure(
    scene: &Path,
    error: MatrixError,
    remedy: impl FnOnce(&MatrixError) -> String,
) -> Failure {
    Failure::of(error, |error| {
        let text = format!("{error}{}", remedy(&error));
        match error {
            MatrixError::Engine(EngineError::Device(_) | EngineError::Found(_)) => {
                Failure::Failed(text)
            }
            MatrixError::Sink(SinkError::Store(_)) => Failure::Failed(text),
            MatrixError::Engine(_) | MatrixError::NoAccount | MatrixError::Unwanted(_) => {
                Failure::Input(text)
            }
            _ => Failure::Input(format!("{}: {text}", scene.display())),
        }
    })
}

/// About a heat balance that does not come about.
pub fn of_heat(error: &HeatError) -> &'static str {
    match error {
        HeatError::Open { .. } => "; give it with --environment K, or close the model",
        HeatError::Unbounded { .. } => "; give a --temperature to one of them, or an --environment",
        HeatError::White { .. } => "; give it a larger --emissivity",
        HeatError::BelowZero { .. } => "; give a larger --flux",
        HeatError::Singular | HeatError::Stalled { .. } => {
            "; give a larger --emissivity to what reflects nearly everything"
        }
        HeatError::Memory { .. } => "; allow more with --memory, or use fewer rows (--group)",
        _ => "",
    }
}

/// About the matrix of a heat balance that was not made.
pub fn of_heat_matrix(error: &MatrixError) -> String {
    match error {
        MatrixError::Patches(_) => "; give a larger --patch-size".to_owned(),
        MatrixError::Memory { .. } | MatrixError::Sink(_) => {
            "; allow more with --memory, or give a larger --patch-size".to_owned()
        }
        other => of_matrix(other, false),
    }
}

/// About a matrix that was not made; `closed` if it was to be closed.
pub fn of_matrix(error: &MatrixError, closed: bool) -> String {
    match error {
        MatrixError::Patches(e) => of_patches(e),
        MatrixError::Engine(e) => of_engine(e),
        MatrixError::Sink(SinkError::Memory { .. }) => {
            "; allow more with --memory, or use fewer patches".to_owned()
        }
        MatrixError::Foreign { same_with: Some(same), .. } => same_as(*same),
        MatrixError::Foreign { same_with: None, .. } => {
            "; check --unit, or plan it anew with hemicube factors --plan".to_owned()
        }
        MatrixError::InsideOut => {
            "; turn them round with --flip, or leave --enclosure out for bodies seen from outside"
                .to_owned()
        }
        MatrixError::Open(_) => "; close the gaps or turn the faces round that they see, or \
             leave --enclosure out"
            .to_owned(),
        MatrixError::Stalled(_) => {
            "; give more --samples or --resolution, or a lower --threshold".to_owned()
        }
        MatrixError::NoAccount => {
            "; use --engine exact, hemicube or rays, or leave --enclosure out".to_owned()
        }
        MatrixError::Memory { can_go_to_a_store: true, .. } => {
            "; allow more with --memory, use fewer patches, or write them to a file with -o, \
             which need not fit"
                .to_owned()
        }
        MatrixError::Memory { .. } if closed => {
            "; allow more with --memory, or use fewer patches; without --enclosure they can go \
             through a file"
                .to_owned()
        }
        MatrixError::Memory { .. } => "; allow more with --memory, or use fewer patches".to_owned(),
        _ => String::new(),
    }
}

/// About the matrix of a View3D file that was not made.
pub fn of_view3d(error: &MatrixError) -> &'static str {
    match error {
        MatrixError::InsideOut => {
            "; write vertices counter-clockwise as seen from inside, or encl=0"
        }
        MatrixError::Open(_) => {
            "; close the gaps, turn the surfaces round that are seen from behind, or write encl=0"
        }
        MatrixError::Stalled(_) => "; write encl=0",
        MatrixError::Memory { .. }
        | MatrixError::Sink(SinkError::Memory { .. } | SinkError::Allocation(_)) => {
            "; allow more with --memory, or use fewer surfaces"
        }
        MatrixError::Patches(PatchesError::TooMany { .. }) => "; use fewer surfaces",
        _ => "",
    }
}

/// About part of a matrix that was not made.
pub fn of_part(error: &MatrixError) -> String {
    match error {
        MatrixError::Memory { .. } | MatrixError::Sink(SinkError::Memory { .. }) => {
            "; allow more with --memory, or make more parts".to_owned()
        }
        other => of_matrix(other, false),
    }
}

/// What would make a geometry that of a matrix.
fn same_as(SameWith { sides, flipped }: SameWith) -> String {
    let sides = match sides {
        Some(Sides::One) => " --sides one",
        Some(Sides::Two) => " --sides two",
        Some(Sides::None) | None => "",
    };
    let flip = if flipped { " --flip, which one of both has" } else { "" };
    format!("; it is the same with{sides}{flip}")
}

/// About a stored matrix that does not serve a scene.
pub fn of_stored(error: &StoredError) -> String {
    match error {
        StoredError::Foreign { same_with: Some(same), .. } => same_as(*same),
        StoredError::Foreign { same_with: None, .. } => {
            "; check --unit, or make it again with hemicube factors".to_owned()
        }
        StoredError::Rows { .. } => "; make it again with hemicube factors".to_owned(),
        StoredError::Lumped => {
            "; make it without --group, and with --patch-size if a mask cuts faces".to_owned()
        }
        StoredError::Sink(e) => of_sink(e),
        _ => String::new(),
    }
}

/// About a file of form factors that cannot be read.
pub fn of_stored_file(error: &ReadError) -> &'static str {
    match error {
        ReadError::Unreadable { .. } | ReadError::Cancelled(_) => "",
        ReadError::Broken { .. } => "; make it again with hemicube factors -o F.npz",
        ReadError::Memory { .. } => "; allow more with --memory",
    }
}

/// About a file of solutions that cannot be read.
pub fn of_solutions(error: &ReadError) -> &'static str {
    match error {
        ReadError::Unreadable { .. } | ReadError::Cancelled(_) => "",
        ReadError::Broken { .. } => "; make it again with hemicube solve",
        ReadError::Memory { .. } => "; allow more with --memory",
    }
}

/// About solutions that do not add up to the light asked for.
pub fn of_mix(error: &MixError) -> String {
    match error {
        MixError::Foreign | MixError::Reflectance => "; make it again with hemicube solve".into(),
        MixError::Unsolved(name) => {
            format!("; solve the model again with --group '{name}={name}'")
        }
        MixError::Texture(name) | MixError::Colour(name) => {
            format!("; give --emission '{name}=50%' or another share")
        }
        MixError::Apart(_) => "; solve the model again without that group".into(),
        MixError::Ranks(_) => String::new(),
    }
}

/// About a group of sources that cannot be.
pub fn of_group(error: &GroupError, scene: &Scene) -> String {
    match error {
        GroupError::Unknown { .. } => {
            let names: BTreeSet<String> = emitters(scene).into_iter().map(|e| e.0).collect();
            format!("; it has {}", names.into_iter().collect::<Vec<_>>().join(", "))
        }
        GroupError::Twice { .. } => "; name it once".into(),
        GroupError::Name(_) => "; choose another name".into(),
        GroupError::Dark { .. } => "; give it light with --emission".into(),
    }
}

/// About a picture that cannot be made.
pub fn of_picture(error: &RenderError) -> &'static str {
    match error {
        RenderError::Size(..) => "; give another --size WxH",
        _ => "",
    }
}

fn of_patches(error: &PatchesError) -> String {
    match error {
        PatchesError::TooMany { .. } => "; use a larger --patch-size or --min-patch".to_owned(),
        PatchesError::BadArea | PatchesError::Cancelled(_) => String::new(),
    }
}

fn of_solve(error: &SolveError) -> String {
    match error {
        SolveError::NoConvergence { .. } => {
            "; lower --max-reflectance, or use --solver gauss-seidel".to_owned()
        }
        SolveError::TooLarge { .. } => {
            "; use --solver gauss-seidel, a larger --patch-size or more --memory".to_owned()
        }
        SolveError::Ranks(_) | SolveError::Cancelled(_) => String::new(),
    }
}

/// About an engine that cannot be had, or failed.
pub fn of_engine(error: &EngineError) -> String {
    match error {
        EngineError::Clusters(_) => "; use --cluster off".to_owned(),
        #[cfg(feature = "gpu")]
        EngineError::Gpu(e) => of_gpu(e),
        _ => String::new(),
    }
}

/// About a graphics device.
#[cfg(feature = "gpu")]
pub fn of_gpu(error: &hemicube::engines::GpuError) -> String {
    use hemicube::engines::GpuError;
    match error {
        GpuError::Options(_) => String::new(),
        GpuError::OutOfMemory => "; use less --memory, or --device cpu".to_owned(),
        _ => "; use --device cpu".to_owned(),
    }
}

fn of_sink(error: &SinkError) -> String {
    match error {
        SinkError::Memory { .. } | SinkError::Allocation(_) => {
            "; use a larger --patch-size, fewer --samples or a lower --resolution, or more \
             --memory"
                .to_owned()
        }
        SinkError::Store(_) | SinkError::Ranks(_) => String::new(),
    }
}
