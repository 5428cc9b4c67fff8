//! glTF 2.0, as `.gltf` with external or embedded buffers, and as `.glb`.
//!
//! The `gltf` crate supplies the JSON schema. Nothing that the file says is trusted: indices,
//! lengths and offsets are checked here, so that a broken file is an error with a place.

mod accessor;
#[cfg(test)]
mod broken_tests;
mod container;
mod document;
mod material;
#[cfg(test)]
mod material_tests;
mod mesh;
mod node;
mod original;
#[cfg(test)]
mod tests;
mod uri;

use super::Severity;
use super::builder::SceneBuilder;
use super::source::{ImportError, Source};
use document::Document;
pub(super) use original::of_file;

/// Reads a glTF file and the buffers and images that it names.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let document = container::open(source)?;
    check_required_extensions(&document)?;
    node::add_scene(&document, builder)?;
    if document.root.extensions_used.iter().any(|e| e == "EXT_mesh_gpu_instancing") {
        builder.finding(
            Severity::Warning,
            "EXT_mesh_gpu_instancing",
            "is not supported: of each group of instances only one is there",
            "export the instances as nodes",
        );
    }
    if !document.root.animations.is_empty() {
        builder.finding(
            Severity::Note,
            "animations",
            "are ignored: nodes stay where the file puts them",
            "",
        );
    }
    Ok(())
}

fn check_required_extensions(document: &Document<'_>) -> Result<(), ImportError> {
    const READ: [&str; 4] = [
        "KHR_lights_punctual",
        "KHR_texture_transform",
        "KHR_mesh_quantization",
        "EXT_texture_webp",
    ];
    for extension in &document.root.extensions_required {
        // Further properties of a material do not change its diffuse part.
        if READ.contains(&extension.as_str()) || extension.starts_with("KHR_materials_") {
            continue;
        }
        let remedy = match extension.as_str() {
            "KHR_draco_mesh_compression" => {
                "export without it (Blender: untick Compression in the glTF export dialog)"
            }
            "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
                "export without meshopt compression (gltfpack: leave out -c, -cc and -cz)"
            }
            "KHR_texture_basisu" | "MSFT_texture_dds" => {
                "export the textures as PNG or JPEG (gltfpack: leave out -tc)"
            }
            "EXT_mesh_gpu_instancing" => "export the instances as nodes (gltfpack: leave out -mi)",
            _ => "export without it",
        };
        return Err(ImportError::Extension {
            path: document.source.path.into(),
            extension: extension.clone(),
            remedy: remedy.into(),
        });
    }
    Ok(())
}
