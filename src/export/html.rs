//! Pages that show a lit model in a browser (`.html`): one file, which asks the network for
//! nothing. Its lamps are under sliders: the graphics card adds up the light of each.
//!
//! The page is `web/page.html` with the script that `web/` builds. Its data is a zip archive of
//! arrays in base64, with `manifest.json`:
//!
//! | array | shape | holds |
//! |---|---|---|
//! | `mesh/position` | 3 f × 3 | corners of triangles, m |
//! | `mesh/atlas` | 3 f × 2 | where they lie in the atlas, 0..65535 |
//! | `mesh/uv`, `mesh/tint` | 3 f × 2, 3 f × 3 | texture coordinates, colours of vertices, if any |
//! | `mesh/outlines` | 2 e × 3 | edges of patches, 0..65535 in the model's box |
//! | `light/patches` | texels | the patch of each, and 1; 0 for none; in pages that are served |
//! | `light/K_low`, `light/K_high` | 3 × texels | light of source K in logarithms (`layers.rs`) |

mod layers;
mod manifest;
mod mesh;
mod view;

use std::io::{self, Cursor, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::ExportError;
use super::archive_writer::Writer;
use super::members::{Members, Packing};
use super::target::write_with;
use crate::bake::Layers;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::store::Store;
pub use mesh::page_facets;
pub use view::{MOST_LAYERS, PageView};

const PAGE: &str = include_str!("../../web/page.html");
const SCRIPT: &str = include_str!("../../web/dist/page.js");

/// Writes a page that shows a solved scene, lit as it is now.
///
/// # Errors
/// If the solutions are of another scene, the file cannot be written, or the caller cancelled.
pub fn write_html(
    path: &Path,
    scene: &Scene,
    store: &Store,
    layers: &Layers,
    view: &PageView,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let (before, after) = PAGE.split_once("{{data}}").unwrap_or((PAGE, ""));
    let before = before.replace("{{title}}", &escaped(&scene.name)).replace("{{own}}", "");
    write_with(path, |file| {
        let data = page_data(scene, store, layers, view, progress)?;
        file.write_all(before.as_bytes())?;
        file.write_all(STANDARD.encode(data).as_bytes())?;
        file.write_all(after.replace("{{script}}", SCRIPT).as_bytes())
    })
}

/// A page without data, for a program that serves it: the page asks it for `state` and `data`.
#[must_use]
pub fn live_page(title: &str) -> String {
    PAGE.replace("{{title}}", &escaped(title))
        .replace("{{own}}", "'self'")
        .replace("{{data}}", "")
        .replace("{{script}}", SCRIPT)
}

/// The data of a page: a zip archive.
///
/// # Errors
/// If the solutions are of another scene, or of the kind `Interrupted` if the caller cancelled.
pub fn page_data(
    scene: &Scene,
    store: &Store,
    layers: &Layers,
    view: &PageView,
    progress: &dyn Progress,
) -> io::Result<Vec<u8>> {
    let mut data = Cursor::new(Vec::new());
    write_data(&mut data, scene, store, layers, view, progress)?;
    Ok(data.into_inner())
}

/// Writes the archive of a page.
fn write_data(
    file: &mut Cursor<Vec<u8>>,
    scene: &Scene,
    store: &Store,
    layers: &Layers,
    view: &PageView,
    progress: &dyn Progress,
) -> io::Result<()> {
    let mut members = Members { zip: Writer::new(file), progress };
    let packing = if view.served { Packing::Packed } else { Packing::Smallest };
    let runs = mesh::write(&mut members, scene, &page_facets(scene, layers), packing)?;
    mesh::write_outlines(&mut members, scene, &store.patches, packing)?;
    let mut peaks = Vec::new();
    for (k, light) in layers.irradiance.iter().enumerate() {
        let name = format!("light/{k}");
        peaks.push(layers::write(&mut members, &name, layers.size(), light, packing)?);
    }
    if view.served {
        let [width, height] = layers.size();
        let numbers = layers.patches(&store.patches);
        let numbers = numbers.into_iter().map(|p| p.map_or(0, |p| p.0 + 1));
        members.array("light/patches", &[height, width], packing, numbers)?;
    }
    for (i, texture) in scene.optics.textures.iter().enumerate() {
        members.bytes(&manifest::texture_file(i), Packing::Plain, &texture.encoded)?;
    }
    let manifest = manifest::of(scene, store, layers, view, (&runs, &peaks))
        .map_err(|e| io::Error::other(e.to_string()))?;
    members.bytes("manifest.json", Packing::Smallest, &serde_json::to_vec(&manifest)?)?;
    members.zip.finish()
}

/// Text within an element or an attribute of a page.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_has_a_place_for_all_and_the_script_does_not_end_early() {
        assert_eq!(PAGE.matches("{{title}}").count(), 2);
        assert_eq!(PAGE.matches("{{data}}").count(), 1);
        assert_eq!(PAGE.matches("{{script}}").count(), 1);
        assert!(!SCRIPT.contains("</script") && !SCRIPT.contains("<!--"));
        let (before, after) = PAGE.split_once("{{data}}").unwrap();
        assert!(before.contains("{{title}}") && after.contains("{{script}}"));
        assert!(before.contains("default-src 'none'"), "nothing comes from the network");
    }

    #[test]
    fn names_stay_text() {
        assert_eq!(escaped("<b>\"a\" & b"), "&lt;b&gt;&quot;a&quot; &amp; b");
    }
}
