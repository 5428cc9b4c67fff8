//! Reads solutions back, part by part.

use std::path::Path;

use super::light::{self, SOURCE_BYTES};
use super::manifest::{FORMAT, Format, Manifest, SceneHead, VERSION};
use super::{rows, scene};
use crate::export::archive::{Archive, float, most};
use crate::export::npz::read::ReadError;
use crate::form_factors::FormFactors;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::scene::files::open_regular;
use crate::store::{Emitter, Member, Source, Store};

/// Bytes that a row and an entry of it take.
const ROW_BYTES: u64 = 64;
const ENTRY_BYTES: u64 = 8;

/// The scene of a file of solutions, as it was solved.
///
/// # Errors
/// If the file cannot be read, or is no whole file of solutions.
pub fn read_scene(path: &Path) -> Result<Scene, ReadError> {
    let (mut archive, manifest) = open(path)?;
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let scene = scene::read(&mut archive, manifest.scene, path).map_err(broken)?;
    compare(&mut archive, &manifest.checksums.scene).map_err(broken)?;
    Ok(scene)
}

/// The sources that a file has solutions of.
///
/// # Errors
/// As [`read_scene`].
pub fn read_sources(path: &Path) -> Result<Vec<Source>, ReadError> {
    Ok(open(path)?.1.light.sources)
}

/// The solutions of a file, in at most `memory` bytes. `scene` is the one of the file, as
/// [`read_scene`] reads it; how it emits and reflects does not matter.
///
/// # Errors
/// If the file cannot be read, or is no whole file of solutions of the scene.
pub fn read_store(
    path: &Path,
    scene: &Scene,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Store, ReadError> {
    let (mut archive, manifest) = open(path)?;
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let Manifest { scene: head, light, to_emitters, checksums, .. } = manifest;
    let sources = light.sources.len() as u64;
    let needed = light
        .patches
        .saturating_mul(SOURCE_BYTES)
        .saturating_mul(sources)
        .saturating_add(to_emitters.entries.saturating_mul(ENTRY_BYTES));
    if needed > memory {
        let what = format!("solutions of {sources} sources");
        return Err(ReadError::Memory { path: path.into(), what, needed, allowed: memory });
    }
    let t = head.triangles.saturating_mul(3);
    let reflectance = archive.numbers("scene/reflectance", t, float).map_err(broken)?;
    archive.checksum();
    let arrays = light::read(&mut archive, &light, &to_emitters, memory).map_err(broken)?;
    compare(&mut archive, &checksums.light).map_err(broken)?;
    light::store(path, scene, light, arrays, &reflectance, memory, progress)
}

/// The form factors of a file, in at most `memory` bytes.
///
/// # Errors
/// If the file cannot be read, or is no whole file of solutions.
pub fn read_factors(path: &Path, memory: u64) -> Result<FormFactors, ReadError> {
    let (mut archive, Manifest { light, factors, checksums, .. }) = open(path)?;
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let rows = factors.rows.saturating_mul(ROW_BYTES);
    let needed = factors.entries.saturating_mul(ENTRY_BYTES).saturating_add(rows);
    if needed > memory {
        let what = format!("{} form factors", factors.entries);
        return Err(ReadError::Memory { path: path.into(), what, needed, allowed: memory });
    }
    let found = rows::read(&mut archive, "factors", &factors, light.patches, memory);
    let found = found.map_err(broken)?;
    compare(&mut archive, &checksums.factors).map_err(broken)?;
    Ok(found)
}

/// Opens a file and reads what it says of itself.
fn open(path: &Path) -> Result<(Archive, Manifest), ReadError> {
    /// Most bytes of a manifest, and those that any may have.
    const MOST: u64 = 1 << 30;
    const LEAST: u64 = 1 << 24;
    let broken = |problem: String| ReadError::Broken { path: path.into(), problem };
    let unreadable = |source| ReadError::Unreadable { path: path.into(), source };
    let file = open_regular(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let mut archive =
        Archive::new(file).map_err(|e| broken(format!("is no whole file of solutions ({e})")))?;
    let text = archive
        .bytes("manifest.json", MOST.min(most(LEAST, length)))
        .map_err(|_| broken("was not written by hemicube solve".into()))?;
    archive.checksum();
    let format = serde_json::from_slice::<Format>(&text);
    let Format { format, version, program } =
        format.map_err(|_| broken("was not written by hemicube solve".into()))?;
    if format != FORMAT {
        return Err(broken("was not written by hemicube solve".into()));
    }
    if version != VERSION {
        let problem = format!(
            "is of version {version} of the format, by hemicube {program}; version {VERSION} is \
             read"
        );
        return Err(broken(problem));
    }
    let manifest = serde_json::from_slice(&text);
    let manifest: Manifest = manifest.map_err(|e| broken(format!("manifest.json: {e}")))?;
    let SceneHead { materials, lamps, .. } = &manifest.scene;
    let is_there = |member: &Member| match member.emitter {
        Emitter::Material(m) => m < materials.len(),
        Emitter::Lamp(l) => l < lamps.len(),
        Emitter::Sky => true,
    };
    if !manifest.light.sources.iter().flat_map(|s| &s.members).all(is_there) {
        return Err(broken("manifest.json names a source that the scene does not have".into()));
    }
    if !manifest.light.is_sound() {
        return Err(broken("manifest.json tells of light that cannot be".into()));
    }
    Ok((archive, manifest))
}

/// Refuses arrays that are not those that were written.
fn compare(archive: &mut Archive, checksum: &str) -> Result<(), String> {
    match archive.checksum() == checksum {
        true => Ok(()),
        false => Err("its arrays are not those that were written: their checksum differs".into()),
    }
}
