//! What an error of the library is called in Python, and what to do about it: the library says what
//! is wrong and by how much; here stands the argument that helps.

use hemicube::bake::BakeError;
use hemicube::engines::EngineError;
use hemicube::export::ExportError;
use hemicube::form_factors::SinkError;
use hemicube::heat::HeatError;
use hemicube::matrix::{MatrixError, MatrixOptions};
use hemicube::patches::PatchesError;
use hemicube::render::RenderError;
use hemicube::scene::{Finding, ImportError, Scene, Setting};
use hemicube::solution::LightError;
use hemicube::solve::SolveError;

use crate::failure::Failure;

/// About a model that cannot be read.
pub fn of_import(error: &ImportError) -> Failure {
    let remedy = match error {
        ImportError::TooFar { .. } => "; or give another unit=",
        ImportError::Unit(_) => "; give another unit=",
        ImportError::MaxReflectance(_) => "; give another max_reflectance=",
        ImportError::Up(_) => "; give another up=",
        _ => "",
    };
    let text = format!("{error}{remedy}");
    match error {
        ImportError::Unit(_) | ImportError::MaxReflectance(_) | ImportError::Up(_) => {
            Failure::Input(text)
        }
        _ => Failure::File(text),
    }
}

/// What is doubtful about a model, and what can be done about it.
pub fn of_finding(finding: &Finding) -> String {
    let argument = finding.setting.and_then(|setting| match setting {
        Setting::Unit(likely) => Some(format!("give unit= {}", likely.join(", "))),
        Setting::MaxReflectance => Some("or raise max_reflectance=".to_owned()),
        Setting::Camera => None,
    });
    let remedies = [Some(finding.remedy.clone()), argument];
    let remedies = remedies.into_iter().flatten().filter(|text| !text.is_empty());
    let remedies: String = remedies.map(|text| format!("; {text}")).collect();
    format!("{}: {}{remedies}", finding.place, finding.message)
}

/// About a matrix that was not made.
pub fn of_matrix(error: MatrixError, options: &MatrixOptions) -> Failure {
    let fewer = match options.patch_size {
        Some(_) => "give a larger patch_size=",
        None => "use fewer faces",
    };
    let some = if options.enclosure { "" } else { ", or make some rows= at a time" };
    let too_much = format!(", half of memory=, as arrays take as much again; {fewer}{some}");
    Failure::of(error, |error| {
        let remedy = match &error {
            MatrixError::Patches(e) => of_patches(e),
            MatrixError::InsideOut => {
                "; turn them round (faces[:, ::-1]), or leave enclosure= out for bodies seen from \
                 outside"
            }
            MatrixError::Open(_) => {
                "; close the gaps or turn the faces round that they see, or leave enclosure= out"
            }
            MatrixError::Stalled(_) => "; give a lower threshold=",
            MatrixError::Memory { .. } | MatrixError::Sink(SinkError::Memory { .. }) => {
                too_much.as_str()
            }
            _ => "",
        };
        let text = format!("{error}{remedy}");
        match error {
            MatrixError::Memory { .. }
            | MatrixError::Sink(SinkError::Memory { .. })
            | MatrixError::Sink(SinkError::Allocation(_)) => Failure::Memory(text),
            MatrixError::Sink(_) | MatrixError::Engine(EngineError::Device(_)) => {
                Failure::Failed(text)
            }
            _ => Failure::Input(text),
        }
    })
}

fn of_patches(error: &PatchesError) -> &'static str {
    match error {
        PatchesError::TooMany { .. } => "; give a larger patch_size=",
        PatchesError::BadArea | PatchesError::Cancelled(_) => "",
    }
}

/// About a heat balance that does not come about; `node_of` is that of the rows.
pub fn of_heat(error: &HeatError, node_of: &[u32]) -> Failure {
    let row = match error {
        HeatError::Share { row, .. }
        | HeatError::Unbounded { row, .. }
        | HeatError::BelowZero { row, .. } => Some(*row),
        HeatError::White { node } => node_of.iter().position(|k| *k as usize == *node),
        _ => None,
    };
    let remedy = match error {
        HeatError::Open { .. } => "; give it as environment=, or close the model",
        HeatError::Unbounded { .. } => "; give one of them a temperature, or an environment=",
        HeatError::White { .. } => "; give it a larger emissivity=",
        HeatError::BelowZero { .. } => "; give a larger flux=",
        HeatError::Singular | HeatError::Stalled { .. } => {
            "; give a larger emissivity= to what reflects nearly everything"
        }
        HeatError::Memory { .. } => "; use fewer rows: F.lump(labels)",
        _ => "",
    };
    let place = row.map_or(String::new(), |row| format!("row {row}: "));
    let text = format!("{place}{error}{remedy}");
    match error {
        HeatError::Stalled { .. } | HeatError::Singular | HeatError::Row(_) => {
            Failure::Failed(text)
        }
        HeatError::Memory { .. } => Failure::Memory(text),
        _ => Failure::Input(text),
    }
}

/// About a scene that nothing lights.
pub fn of_darkness(scene: &Scene) -> Failure {
    let name = &scene.name;
    Failure::Input(format!(
        "{name}: nothing emits light; give it scene.sky, scene.add_lamp(position, flux), or a \
         material that emits: scene.set_emission(name, radiance)"
    ))
}

/// About a scene that could not be lit.
pub fn of_light(error: LightError) -> Failure {
    Failure::of(error, |error| match &error {
        LightError::Memory { proposal, .. } => {
            let size = proposal.map(|size| format!("patch_size={size} (m²) or more, "));
            let size = size.unwrap_or_default();
            Failure::Memory(format!("{error}; use {size}fewer samples=, or more memory="))
        }
        LightError::Sink(SinkError::Memory { .. } | SinkError::Allocation(_)) => Failure::Memory(
            format!("{error}; use a larger patch_size=, fewer samples=, or more memory="),
        ),
        LightError::Patches(e) => Failure::Input(format!("{error}{}", of_patches(e))),
        LightError::NoSky | LightError::Engine(EngineError::Clusters(_)) => {
            Failure::Input(error.to_string())
        }
        LightError::Solve(SolveError::NoConvergence { .. }) => {
            Failure::Failed(format!("{error}; lower max_reflectance="))
        }
        _ => Failure::Failed(error.to_string()),
    })
}

/// About a picture that cannot be made.
pub fn of_picture(error: RenderError) -> Failure {
    Failure::of(error, |error| {
        let remedy = match error {
            RenderError::Size(..) => "; give another size=",
            RenderError::Camera(_) => "; give another eye= or target=",
            _ => "",
        };
        Failure::Input(format!("{error}{remedy}"))
    })
}

/// About a model that was not baked.
pub fn of_bake(error: BakeError) -> Failure {
    Failure::of(error, |error| match error {
        BakeError::Atlas(_) => Failure::Input(format!("{error}; give a larger texel=")),
        BakeError::Memory { .. } => Failure::Memory(format!("{error}; give a larger texel=")),
        BakeError::Nothing => {
            Failure::Input(format!("{error}; does the model face inwards? Try flip=True"))
        }
        _ => Failure::Failed(error.to_string()),
    })
}

/// About a file that was not written.
pub fn of_export(error: ExportError) -> Failure {
    Failure::of(error, |error| Failure::File(error.to_string()))
}
