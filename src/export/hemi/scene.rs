//! A scene as arrays.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::check::check;
use super::manifest::{SceneHead, TextureHead};
use crate::export::archive::{Archive, finite, float, integer, word};
use crate::export::members::{Members, Packing};
use crate::scene::files::read_regular;
use crate::scene::geometry::MAX_ELEMENTS;
use crate::scene::{Geometry, Optics, Rgb, Scene, Sides, Texture, TriangleId, TriangleState};

/// Most bytes of a texture, or of a file of the model.
const MOST_BYTES: u64 = 1 << 33;

/// Writes the arrays of a scene.
pub fn write<W: Write + Seek>(to: &mut Members<'_, W>, scene: &Scene) -> io::Result<SceneHead> {
    const PACKED: Packing = Packing::Packed;
    let Scene { geometry: g, optics: o, .. } = scene;
    let n = g.len();
    let rgb = |all: &[Rgb]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f64>>();
    to.array("scene/vertices", &[g.vertices.len(), 3], PACKED, rgb(&g.vertices).into_iter())?;
    to.array("scene/triangles", &[n, 3], PACKED, g.triangles.iter().flatten().copied())?;
    to.array("scene/sides", &[n], PACKED, g.sides.iter().map(|s| *s as u8))?;
    to.array("scene/state", &[n], PACKED, g.state.iter().map(|s| *s as u8))?;
    to.array("scene/surface", &[n], PACKED, g.surface_of.iter().copied())?;
    to.array("scene/face", &[g.face_of.len()], PACKED, g.face_of.iter().copied())?;
    let cut = g.cut_faces.iter().flat_map(|(face, c)| [*face, c[0], c[1], c[2]]);
    to.array("scene/cut_faces", &[g.cut_faces.len(), 4], PACKED, cut)?;
    to.array("scene/material", &[n], PACKED, o.material_of.iter().copied())?;
    to.array("scene/reflectance", &[n, 3], PACKED, rgb(&o.reflectance).into_iter())?;
    to.array("scene/emission", &[n, 3], PACKED, rgb(&o.emission).into_iter())?;
    to.array("scene/tint", &[o.tint.len(), 3], PACKED, rgb(&o.tint).into_iter())?;
    let uv = o.uv.iter().flatten().flat_map(|uv| uv.to_array());
    to.array("scene/uv", &[o.uv.len(), 3, 2], PACKED, uv)?;
    for (k, texture) in o.textures.iter().enumerate() {
        to.bytes(&format!("scene/texture/{k}"), Packing::Plain, &texture.encoded)?;
    }
    let files = files_of(scene)?;
    for (k, (_, bytes)) in files.iter().enumerate() {
        to.bytes(&format!("scene/file/{k}"), PACKED, bytes)?;
    }
    let texture = |t: &Texture| TextureHead {
        name: t.name.clone(),
        wrap: t.wrap,
        v_up: t.v_up,
        opacity: t.opacity,
    };
    Ok(SceneHead {
        name: scene.name.clone(),
        vertices: g.vertices.len() as u64,
        triangles: n as u64,
        uv: !o.uv.is_empty(),
        tint: !o.tint.is_empty(),
        cut_faces: g.cut_faces.len() as u64,
        faces: !g.face_of.is_empty(),
        whole_from: g.whole_from.map(|t| t.0),
        surfaces: g.surfaces.clone(),
        object_of: scene.object_of.clone(),
        materials: o.materials.clone(),
        textures: o.textures.iter().map(texture).collect(),
        max_reflectance: o.max_reflectance,
        lamps: scene.lamps.clone(),
        sky: scene.sky,
        up: scene.up,
        cameras: scene.cameras.clone(),
        files: files.into_iter().map(|f| f.0).collect(),
    })
}

/// The files of a glTF model, by their paths beside it; none of other models.
fn files_of(scene: &Scene) -> io::Result<Vec<(PathBuf, Arc<[u8]>)>> {
    if !scene.held.is_empty() {
        return Ok(scene.held.clone());
    }
    let extension = |p: &Path| p.extension().map(|e| e.to_ascii_lowercase());
    let is_gltf = |p: &&PathBuf| extension(p).is_some_and(|e| e == "gltf" || e == "glb");
    let Some(model) = scene.files.iter().find(is_gltf) else { return Ok(Vec::new()) };
    let folder = model.parent().unwrap_or(Path::new(""));
    let held = |path: &PathBuf| {
        let name = path.strip_prefix(folder).unwrap_or(path).to_path_buf();
        Ok((name, read_regular(path)?.into()))
    };
    scene.files.iter().map(held).collect()
}

/// Reads the scene that [`write`] wrote.
pub fn read(from: &mut Archive, mut head: SceneHead, path: &Path) -> Result<Scene, String> {
    let (v, t) = (head.vertices, head.triangles);
    if v.max(t) > MAX_ELEMENTS as u64 || head.cut_faces > t {
        return Err("holds more triangles or vertices than can be dealt with".into());
    }
    let if_any = |any: bool| if any { t } else { 0 };
    let vertices = threes(from.numbers("scene/vertices", 3 * v, finite)?);
    let triangles = from.numbers("scene/triangles", 3 * t, word)?;
    let sides = from.numbers("scene/sides", t, |kind, b| match integer(kind, b)? {
        s if s == Sides::One as u64 => Some(Sides::One),
        s if s == Sides::Two as u64 => Some(Sides::Two),
        s if s == Sides::None as u64 => Some(Sides::None),
        _ => None,
    })?;
    let state = from.numbers("scene/state", t, |kind, b| {
        let clear = integer(kind, b)? == TriangleState::Transparent as u64;
        // The others follow from where triangles are.
        Some(if clear { TriangleState::Transparent } else { TriangleState::Solid })
    })?;
    let surface_of = from.numbers("scene/surface", t, word)?;
    let face_of = from.numbers("scene/face", if_any(head.faces), word)?;
    let cut = from.numbers("scene/cut_faces", 4 * head.cut_faces, word)?;
    let cut_faces: BTreeMap<u32, [u32; 3]> =
        cut.as_chunks::<4>().0.iter().map(|&[face, a, b, c]| (face, [a, b, c])).collect();
    let material_of = from.numbers("scene/material", t, word)?;
    let reflectance = threes(from.numbers("scene/reflectance", 3 * t, finite)?);
    let emission = threes(from.numbers("scene/emission", 3 * t, finite)?);
    let tint = threes(from.numbers("scene/tint", 3 * if_any(head.tint), finite)?);
    let uv = from.numbers("scene/uv", 6 * if_any(head.uv), float)?;
    let uv = uv.as_chunks::<6>().0.iter();
    let uv = uv.map(|&[a, b, c, d, e, f]| [[a, b], [c, d], [e, f]].map(DVec2::from)).collect();
    let mut textures = Vec::new();
    for (k, t) in std::mem::take(&mut head.textures).into_iter().enumerate() {
        let encoded = from.bytes(&format!("scene/texture/{k}"), MOST_BYTES)?.into();
        let TextureHead { name, wrap, v_up, opacity } = t;
        textures.push(Texture { name, encoded, wrap, v_up, opacity });
    }
    let mut held = Vec::new();
    for (k, name) in std::mem::take(&mut head.files).into_iter().enumerate() {
        held.push((name, from.bytes(&format!("scene/file/{k}"), MOST_BYTES)?.into()));
    }
    let mut geometry = Geometry {
        vertices,
        triangles: triangles.as_chunks::<3>().0.to_vec(),
        sides,
        state,
        surface_of,
        surfaces: std::mem::take(&mut head.surfaces),
        face_of,
        cut_faces,
        whole_from: head.whole_from.map(TriangleId),
    };
    let optics = Optics {
        reflectance,
        tint,
        emission,
        material_of,
        uv,
        materials: std::mem::take(&mut head.materials),
        textures,
        max_reflectance: head.max_reflectance,
    };
    check(&geometry, &optics, &head)?;
    geometry.flag_flaws();
    Ok(Scene {
        name: head.name,
        geometry,
        object_of: head.object_of,
        optics,
        lamps: head.lamps,
        sky: head.sky,
        up: head.up,
        cameras: head.cameras,
        findings: Vec::new(),
        files: vec![path.to_path_buf()],
        held,
    })
}

fn threes(numbers: Vec<f64>) -> Vec<DVec3> {
    numbers.as_chunks::<3>().0.iter().map(|&v| DVec3::from_array(v)).collect()
}
