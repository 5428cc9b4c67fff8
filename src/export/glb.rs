//! Models with their light, as binary glTF 2.0 (`.glb`).

mod buffers;
mod materials;
mod mode;
mod model;

use std::path::Path;

use serde_json::{Map, Value, json};

use super::ExportError;
use super::png::encode_png;
use super::target::write_whole;
use crate::bake::{Bake, Facet};
use crate::scene::original::Original;
use crate::scene::reread::original;
use crate::scene::{Scene, luminance};
use crate::tone::srgb;
use buffers::Buffers;
use materials::Variants;
pub use mode::BakeMode;

/// What was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baked {
    /// Triangles of the model.
    pub triangles: usize,
    /// What a colour of 1 at vertices stands for: radiance in W/(m² sr) or cd/m².
    pub scale: f64,
}

/// Writes the model of a scene with its light.
///
/// # Errors
/// If the model cannot be read once more, or the file not be written.
pub fn write_glb(
    path: &Path,
    scene: &Scene,
    bake: &Bake<'_>,
    mode: BakeMode,
) -> Result<Baked, ExportError> {
    let encode = |message: String| ExportError::Encode { path: path.to_path_buf(), message };
    let original = original(scene).map_err(|e| encode(e.to_string()))?;
    let facets = match mode {
        BakeMode::Vertex => bake.refined(),
        _ => bake.facets(),
    };
    let mut buffers = Buffers::default();
    let mut intensities = vec![1.0_f64; bake.charts()];
    let (texture, scale) = match mode {
        BakeMode::Unlit => {
            let bytes = bake.shown().iter().flatten().map(|&c| srgb(c)).collect();
            (Some(bytes), 1.0)
        }
        BakeMode::Vertex => (None, brightest(scene, &facets)),
        BakeMode::Lightmap { .. } => {
            let mut bytes = vec![0_u8; 3 * bake.irradiance().len()];
            for (chart, intensity) in intensities.iter_mut().enumerate() {
                *intensity = intensity_of(bake, chart);
                for texel in bake.texels_of(chart) {
                    for (c, e) in bake.irradiance()[texel].into_iter().enumerate() {
                        let share = f64::from(e) / *intensity;
                        bytes[3 * texel + c] = (share.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                    }
                }
            }
            (Some(bytes), 1.0)
        }
    };
    // Writing into memory does not fail.
    let texture = texture.map(|bytes: Vec<u8>| encode_png(bake.size(), &bytes).unwrap_or_default());
    let triangles = facets.len();
    let Original { mut json, surfaces, images } = original;
    let mut variants = Variants::default();
    let scale_of = |facet: &Facet| match mode {
        BakeMode::Lightmap { .. } => intensities[facet.chart as usize],
        _ => scale,
    };
    let written =
        model::meshes(scene, &surfaces, &facets, (mode, scale_of), &mut variants, &mut buffers);
    model::place(&mut json, written);
    materials::light(&mut json, (mode, model::lightmap_set(&surfaces)), &variants);
    let mut all: Vec<Option<Vec<u8>>> = match mode {
        BakeMode::Lightmap { .. } => images.into_iter().map(|i| i.map(|i| i.to_vec())).collect(),
        _ => Vec::new(),
    };
    all.extend(texture.map(Some));
    materials::images(&mut json, all, mode, &mut buffers);
    json.insert("asset".into(), asset(&json));
    materials::extensions(&mut json);
    let glb = buffers.finish(json).map_err(encode)?;
    write_whole(path, &glb)?;
    Ok(Baked { triangles, scale })
}

/// Radiance beyond all but the brightest that surfaces reflect, W/(m² sr) or cd/m².
fn brightest(scene: &Scene, facets: &[Facet]) -> f64 {
    /// Of the area this share may be too bright for a colour.
    const CLIPPED: f64 = 0.005;
    let mut all: Vec<(f32, f64)> = facets
        .iter()
        .filter(|f| luminance(scene.optics.emission(f.triangle, f.side)) <= 0.0)
        .map(|f| {
            let [a, b, c] = f.corners;
            let area = scene.geometry.area(f.triangle) * (b - a).perp_dot(c - a);
            (f.radiance.into_iter().flatten().fold(0.0, f32::max), area)
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left = CLIPPED * all.iter().map(|f| f.1).sum::<f64>();
    let most = all.iter().find(|f| {
        left -= f.1;
        left < 0.0
    });
    most.map_or(1.0, |f| f64::from(f.0)).max(f64::MIN_POSITIVE)
}

/// The irradiance that a texel of 1 stands for in a chart: the next power of the fourth root of two
/// beyond all but its brightest texels, so that eight bits are enough for the others.
fn intensity_of(bake: &Bake<'_>, chart: usize) -> f64 {
    /// Of the texels of a chart this share may be too bright.
    const CLIPPED: f64 = 0.002;
    let most = |e: [f32; 3]| e.into_iter().fold(0.0, f32::max);
    let mut all: Vec<f32> = bake.texels_of(chart).map(|t| most(bake.irradiance()[t])).collect();
    let last = all.len().saturating_sub(1);
    let at = ((1.0 - CLIPPED) * last as f64).round() as usize;
    let (_, most, _) = all.select_nth_unstable_by(at.min(last), f32::total_cmp);
    let most = f64::from(*most);
    if most > 0.0 { ((4.0 * most.log2()).ceil() / 4.0).clamp(-60.0, 60.0).exp2() } else { 1.0 }
}

fn asset(json: &Map<String, Value>) -> Value {
    let own = json.get("asset").filter(|asset| asset.is_object());
    let mut asset = own.cloned().unwrap_or_else(|| json!({ "version": "2.0" }));
    asset["generator"] = json!(concat!("hemicube ", env!("CARGO_PKG_VERSION")));
    asset
}
