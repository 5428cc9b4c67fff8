//! Solutions in a file (`.hemi`): a zip archive of arrays that `numpy.load` reads, and
//! `manifest.json`, which says what they are.
//!
//! Three parts follow each other, each with a checksum in the manifest: `scene/` is the model with
//! all that was said of it, its textures, and the files of a glTF model, which baking needs once
//! more; `light/` is what mixing needs, of each source (see [`crate::store`]) and patch; `factors/`
//! is what another reflectance needs beside it, and is not read for anything else.
//!
//! | array | shape | holds |
//! |---|---|---|
//! | `scene/vertices` | v × 3 | positions, m |
//! | `scene/triangles` | t × 3 | vertices of each triangle |
//! | `scene/reflectance`, `scene/emission` | t × 3 | ρ, 0..1, and E, W/m² or lm/m² |
//! | `light/irradiance` | s × p × 3 | H of each source at unit white, W/m² or lx |
//! | `light/direct`, `light/arrived` | s × p × 3 | of that, what comes straight, and by surfaces |
//! | `light/usable` | p | whether the value stands for what is seen of the patch |
//! | `factors/columns` | e | the patches that rows see, row after row |

mod check;
mod light;
mod manifest;
mod read;
mod rows;
mod scene;

pub(super) use manifest::RowsHead;
pub use read::{read_factors, read_scene, read_sources, read_store};
pub(super) use rows::{read as read_rows, write_own as write_rows};

use std::io::{self, Seek, Write};
use std::path::Path;

use super::ExportError;
use super::archive_writer::Writer;
use super::members::{Members, Packing};
use super::target::write_with;
use crate::form_factors::FormFactors;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::store::Store;
use manifest::{Checksums, FORMAT, Manifest, VERSION};

/// Writes the solutions of a scene and the form factors that they were made by. Advances `progress`
/// by one for each part. Where ranks share the rows, rank 0 writes the file, and each of the others
/// sends its rows, strip by strip.
///
/// # Errors
/// If the file, or one of the model's, cannot be read or written, the caller cancelled, or ranks
/// cannot reach each other.
pub fn write_hemi(
    path: &Path,
    scene: &Scene,
    store: &Store,
    factors: &FormFactors,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    progress.stage("write", 3);
    if !factors.ranks().is_first() {
        let sent = rows::send(&store.to_emitters).and_then(|()| rows::send(factors));
        return sent
            .map_err(|e| ExportError::Io { path: path.into(), source: io::Error::other(e) });
    }
    write_with(path, |file| write_as(file, scene, store, factors, progress))
}

fn write_as(
    file: &mut (impl Write + Seek),
    scene: &Scene,
    store: &Store,
    factors: &FormFactors,
    progress: &dyn Progress,
) -> io::Result<()> {
    let heard = || progress.advance(1).map_err(|_| io::ErrorKind::Interrupted);
    let mut members = Members { zip: Writer::new(file), progress };
    let head = scene::write(&mut members, scene)?;
    let of_scene = members.zip.checksum();
    heard()?;
    let (light, to_emitters) = light::write(&mut members, store)?;
    let of_light = members.zip.checksum();
    heard()?;
    let rows = rows::write(&mut members, "factors", factors)?;
    let of_factors = members.zip.checksum();
    heard()?;
    let manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        program: env!("CARGO_PKG_VERSION").into(),
        scene: head,
        light,
        to_emitters,
        factors: rows,
        checksums: Checksums { scene: of_scene, light: of_light, factors: of_factors },
    };
    let manifest = serde_json::to_vec_pretty(&manifest)?;
    members.bytes("manifest.json", Packing::Packed, &manifest)?;
    members.zip.finish()
}
