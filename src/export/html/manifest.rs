//! What a page's data says of itself; `web/src/page.ts` reads it.

use std::f64::consts::PI;

use glam::DVec3;
use serde::Serialize;

use super::layers::{OCTAVES, STEPS};
use super::mesh::{Run, frame};
use super::view::PageView;
use crate::bake::Layers;
use crate::patches::PatchId;
use crate::scene::{Camera, Rgb, Scene, Texture, luminance};
use crate::store::{Emitter, MixError, Source, Store};
use crate::tone::{FalseColour, Map, Tone};

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Manifest {
    scene: String,
    unit: Unit,
    exposure: f64,
    tone: Tone,
    range: f64,
    error: Option<f64>,
    patches: usize,
    inside: bool,
    /// What is to be added to positions for those of the model, m.
    origin: DVec3,
    bounds: [DVec3; 2],
    most_reflectance: f64,
    cameras: Vec<CameraHead>,
    sky: Option<Glow>,
    sources: Vec<SourceHead>,
    materials: Vec<MaterialHead>,
    textures: Vec<TextureHead>,
    atlas: AtlasHead,
}

#[derive(Debug, Serialize)]
struct Unit {
    illuminance: String,
}

#[derive(Debug, Serialize)]
struct CameraHead {
    name: String,
    eye: DVec3,
    target: DVec3,
    up: DVec3,
    vfov: f64,
    /// Width over height of what one should see.
    aspect: f64,
}

#[derive(Debug, Serialize)]
struct Glow {
    source: usize,
    /// Radiance at unit weight.
    emission: Rgb,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct SourceHead {
    name: String,
    weight: Rgb,
    keeps_colour: bool,
    /// Irradiance that the largest code stands for.
    peak: f64,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct MaterialHead {
    name: String,
    first: usize,
    count: usize,
    reflectance: Rgb,
    texture: Option<u32>,
    source: Option<usize>,
    emission: Rgb,
    emission_texture: Option<u32>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct TextureHead {
    file: String,
    wrap: [String; 2],
    v_up: bool,
}

#[derive(Debug, Serialize)]
struct AtlasHead {
    width: usize,
    height: usize,
    steps: u16,
    octaves: u16,
}

/// The name of a texture in the archive.
pub fn texture_file(index: usize) -> String {
    format!("textures/{index}")
}

/// Says what a page shows; `peaks` are those of the layers.
pub fn of(
    scene: &Scene,
    store: &Store,
    layers: &Layers,
    view: &PageView,
    (runs, peaks): (&[Run], &[f64]),
) -> Result<Manifest, MixError> {
    let optics = &scene.optics;
    let (origin, half) = frame(scene);
    let weights: Vec<Rgb> =
        store.sources.iter().map(|s| s.weight(scene)).collect::<Result<_, _>>()?;
    // Of which source an emitter is, and its radiance at unit weight.
    let glow = |emitter: Emitter| {
        let members = store.sources.iter().enumerate();
        let mut members = members.flat_map(|(k, s)| s.members.iter().map(move |m| (k, m)));
        let (source, member) = members.find(|(_, m)| m.emitter == emitter)?;
        Some(Glow { source, emission: member.emission })
    };
    let material = |run: &Run| {
        let m = &optics.materials[run.material];
        let glow = glow(Emitter::Material(run.material)).filter(|_| run.emits);
        MaterialHead {
            name: m.name.clone(),
            first: run.first,
            count: run.count,
            reflectance: m.reflectance,
            texture: m.reflectance_texture,
            source: glow.as_ref().map(|g| g.source),
            emission: glow.map_or(Rgb::ZERO, |g| g.emission),
            emission_texture: m.radiance_texture,
        }
    };
    let texture = |(i, t): (usize, &Texture)| TextureHead {
        file: texture_file(i),
        wrap: t.wrap.map(|w| format!("{w:?}").to_lowercase()),
        v_up: t.v_up,
    };
    let source = |((s, weight), peak): ((&Source, &Rgb), &f64)| SourceHead {
        name: s.name.clone(),
        weight: *weight,
        keeps_colour: s.keeps_its_colour(),
        peak: *peak,
    };
    let is_own = |p: PatchId| !scene.geometry.is_whole(store.patches.cell(p).triangle);
    let is_within = |p: DVec3| p.abs().cmple(half).all();
    let [width, height] = layers.size();
    Ok(Manifest {
        scene: scene.name.clone(),
        unit: Unit { illuminance: view.unit.clone() },
        exposure: view.exposure,
        tone: view.tone,
        range: range(layers, &weights),
        error: view.error,
        patches: store.patches.ids().filter(|&p| is_own(p)).count(),
        inside: view.cameras.first().is_some_and(|c| is_within(c.eye - origin)),
        origin,
        bounds: [-half, half],
        most_reflectance: optics.max_reflectance,
        cameras: view.cameras.iter().map(|c| camera(c, origin, half)).collect(),
        sky: glow(Emitter::Sky),
        sources: store.sources.iter().zip(&weights).zip(peaks).map(source).collect(),
        materials: runs.iter().map(material).collect(),
        textures: optics.textures.iter().enumerate().map(texture).collect(),
        atlas: AtlasHead { width, height, steps: STEPS, octaves: OCTAVES },
    })
}

/// A camera, and the point that one turns around: beside the middle of the model.
fn camera(c: &Camera, origin: DVec3, half: DVec3) -> CameraHead {
    /// Of cameras without an opinion.
    const ASPECT: f64 = 4.0 / 3.0;
    let eye = c.eye - origin;
    let least = half.length() / 10.0;
    let ahead = (-eye).dot(c.forward).max(least);
    CameraHead {
        name: c.name.clone(),
        eye,
        target: eye + ahead * c.forward,
        up: c.up,
        vfov: c.vfov.clamp(0.01, PI - 0.01),
        aspect: c.aspect.unwrap_or(ASPECT),
    }
}

/// The illuminance of the brightest colour: beyond all but the brightest 1 %.
fn range(layers: &Layers, weights: &[Rgb]) -> f64 {
    let texels = layers.irradiance.first().map_or(0, Vec::len);
    let light = |i: usize| {
        let parts = layers.irradiance.iter().zip(weights);
        let sum: Rgb = parts.map(|(l, w)| DVec3::from(l[i].map(f64::from)) * *w).sum();
        luminance(sum) as f32
    };
    let values: Vec<f32> = (0..texels).map(light).filter(|v| *v > 0.0).collect();
    FalseColour::default().range_of(&Map { width: values.len(), height: 1, values })[1]
}
