//! A scene in the terms of glTF, for models that come from other formats.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde_json::{Map, Value, json};

use super::model::Scene;
use super::optics::Material;
use super::original::{Attribute, FirstFace, Mesh, Original, SurfaceMesh};
use super::texture::Wrap;
use super::{Camera, Lamp};

/// The document, in metres and with y upwards; what is of a stage is left out.
pub(super) fn made(scene: &Scene) -> Original {
    let g = &scene.geometry;
    let mut faces_of: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); g.surfaces.len()];
    let mut corners_of: HashMap<u32, [u32; 3]> = HashMap::new();
    for t in g.ids().filter(|&t| !g.is_whole(t)) {
        let face = g.face(t);
        faces_of[g.surface_of[t.index()] as usize].insert(face);
        corners_of.entry(face).or_insert(g.triangles[t.index()]);
    }
    corners_of.extend(g.cut_faces.iter().map(|(f, c)| (*f, *c)));
    let uv_of: HashMap<u32, _> = if scene.optics.uv.is_empty() {
        HashMap::new()
    } else {
        g.ids().map(|t| (g.face(t), scene.optics.uv[t.index()])).collect()
    };
    let mut nodes: Vec<Value> = Vec::new();
    let mut surfaces = Vec::new();
    for (k, faces) in faces_of.iter().enumerate() {
        let mut mesh = Mesh::default();
        let mut positions = Vec::new();
        let mut uvs = Vec::new();
        let mut vertex_of: HashMap<(u32, [u64; 2]), u32> = HashMap::new();
        let mut listed = HashMap::new();
        for &face in faces {
            let Some(corners) = corners_of.get(&face) else { continue };
            // Of a cut triangle, texture coordinates are those of its pieces.
            let uv = uv_of.get(&face).filter(|_| !g.cut_faces.contains_key(&face));
            let triangle = [0, 1, 2].map(|c| {
                let uv = uv.map_or(glam::DVec2::ZERO, |uv| uv[c]);
                let key = (corners[c], uv.to_array().map(f64::to_bits));
                *vertex_of.entry(key).or_insert_with(|| {
                    let p = g.vertices[corners[c] as usize];
                    positions.extend(p.as_vec3().to_array());
                    uvs.extend([uv.x as f32, 1.0 - uv.y as f32]);
                    (positions.len() / 3 - 1) as u32
                })
            });
            listed.insert(face, mesh.triangles.len() as u32);
            mesh.triangles.push(triangle);
        }
        mesh.attributes.push(Attribute { name: "POSITION".into(), width: 3, values: positions });
        if !uv_of.is_empty() {
            mesh.attributes.push(Attribute { name: "TEXCOORD_0".into(), width: 2, values: uvs });
        }
        surfaces.push(SurfaceMesh {
            node: nodes.len(),
            mesh: Arc::new(mesh),
            material: None,
            first_face: FirstFace::Listed(listed),
            mirrored: false,
        });
        // What is of a stage is no node.
        if !faces.is_empty() {
            nodes.push(json!({ "name": g.surfaces[k].name, "mesh": k }));
        }
    }
    let meshes: Vec<Value> = g.surfaces.iter().map(|s| json!({ "name": s.name })).collect();
    let materials: Vec<Value> = scene.optics.materials.iter().map(material).collect();
    let (textures, samplers) = textures(scene);
    let mut cameras = Vec::new();
    for camera in &scene.cameras {
        nodes.push(camera_node(camera, cameras.len()));
        let mut lens = json!({ "yfov": camera.vfov, "znear": 0.01 });
        if let Some(aspect) = camera.aspect {
            lens["aspectRatio"] = json!(aspect);
        }
        cameras.push(json!({ "name": camera.name, "type": "perspective", "perspective": lens }));
    }
    let mut lights = Vec::new();
    for lamp in &scene.lamps {
        nodes.push(lamp_node(lamp, lights.len()));
        lights.push(light(lamp));
    }
    let children: Vec<usize> = (0..nodes.len()).collect();
    // glTF has y upwards.
    let turn = DQuat::from_rotation_arc(scene.up.normalize_or(DVec3::Y), DVec3::Y);
    let roots = if turn.is_near_identity() {
        children
    } else {
        nodes.push(json!({
            "name": scene.name, "rotation": turn.to_array(), "children": children
        }));
        vec![nodes.len() - 1]
    };
    let mut json = Map::new();
    let mut put = |key: &str, value: Value| {
        if value.as_array().is_none_or(|a| !a.is_empty()) {
            json.insert(key.into(), value);
        }
    };
    put("asset", json!({ "version": "2.0" }));
    put("scene", json!(0));
    put("scenes", json!([{ "name": scene.name, "nodes": roots }]));
    put("nodes", nodes.into());
    put("meshes", meshes.into());
    put("materials", materials.into());
    put("cameras", cameras.into());
    put("textures", textures.into());
    put("samplers", samplers.into());
    let images: Vec<_> =
        scene.optics.textures.iter().map(|t| Some(Arc::clone(&t.encoded))).collect();
    let names = scene.optics.textures.iter().map(|t| json!({ "name": t.name }));
    put("images", Value::Array(names.collect()));
    if !lights.is_empty() {
        put("extensions", json!({ "KHR_lights_punctual": { "lights": lights } }));
    }
    Original { json, surfaces, images }
}

fn material(m: &Material) -> Value {
    let mut pbr = json!({
        "baseColorFactor": [m.reflectance.x, m.reflectance.y, m.reflectance.z, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    });
    if let Some(texture) = m.reflectance_texture {
        pbr["baseColorTexture"] = json!({ "index": texture });
    }
    // Lambert's law alone: readers would take the share of highlights off.
    let mut extensions = json!({ "KHR_materials_specular": { "specularFactor": 0.0 } });
    let mut material = json!({ "name": m.name, "pbrMetallicRoughness": pbr });
    let strength = m.radiance.max_element();
    if strength > 0.0 {
        let factor = m.radiance / strength.max(1.0);
        material["emissiveFactor"] = json!(factor.to_array());
        if let Some(texture) = m.radiance_texture {
            material["emissiveTexture"] = json!({ "index": texture });
        }
        if strength > 1.0 {
            extensions["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
        }
    }
    material["extensions"] = extensions;
    material
}

fn textures(scene: &Scene) -> (Vec<Value>, Vec<Value>) {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    };
    let all = scene.optics.textures.iter().enumerate();
    all.map(|(i, t)| {
        let sampler = json!({ "wrapS": wrap(t.wrap[0]), "wrapT": wrap(t.wrap[1]) });
        (json!({ "source": i, "sampler": i }), sampler)
    })
    .unzip()
}

/// Where something stands that looks along `forward`.
fn placed(name: &str, at: DVec3, forward: DVec3, up: DVec3) -> Value {
    let z = -forward.normalize_or(DVec3::NEG_Z);
    let x = up.cross(z).normalize_or(z.any_orthonormal_vector());
    let turn = DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z)).normalize();
    json!({ "name": name, "translation": at.to_array(), "rotation": turn.to_array() })
}

fn camera_node(camera: &Camera, number: usize) -> Value {
    let mut node = placed(&camera.name, camera.eye, camera.forward, camera.up);
    node["camera"] = json!(number);
    node
}

fn lamp_node(lamp: &Lamp, number: usize) -> Value {
    let (at, way) = match lamp {
        Lamp::Point { position, .. } => (*position, DVec3::NEG_Y),
        Lamp::Spot { position, direction, .. } => (*position, *direction),
        Lamp::Directional { direction, .. } => (DVec3::ZERO, *direction),
    };
    let mut node = placed(lamp.name(), at, way, way.any_orthonormal_vector());
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": number } });
    node
}

fn light(lamp: &Lamp) -> Value {
    let (kind, strength) = match lamp {
        Lamp::Point { intensity, .. } => ("point", *intensity),
        Lamp::Spot { intensity, .. } => ("spot", *intensity),
        Lamp::Directional { irradiance, .. } => ("directional", *irradiance),
    };
    let most = strength.max_element();
    let colour = if most > 0.0 { strength / most } else { DVec3::ONE };
    let mut light = json!({
        "name": lamp.name(), "type": kind, "color": colour.to_array(), "intensity": most
    });
    if let Lamp::Spot { inner, outer, .. } = lamp {
        light["spot"] =
            json!({ "innerConeAngle": inner.min(0.999 * outer), "outerConeAngle": outer });
    }
    light
}
