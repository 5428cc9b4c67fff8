//! The model of a scene once more, as its file has it.

use super::as_gltf::made;
use super::gltf;
use super::model::Scene;
use super::original::Original;
use super::source::ImportError;

/// The model of a scene: its file's, if that is glTF, and else one made of the scene, in metres and
/// with y upwards.
pub(crate) fn original(scene: &Scene) -> Result<Original, ImportError> {
    let is_gltf = |path: &&std::path::PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
    };
    let held = scene.held.iter().map(|h| &h.0);
    match held.chain(&scene.files).find(is_gltf) {
        Some(path) => gltf::of_file(path, scene),
        None => Ok(made(scene)),
    }
}
