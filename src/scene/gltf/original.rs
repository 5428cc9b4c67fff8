//! The document of a file, and what its meshes hold, for results that keep the model.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use serde_json::{Map, Value};

use super::container;
use super::document::Document;
use super::material::image_bytes;
use super::mesh::triangles;
use crate::scene::Scene;
use crate::scene::original::{Attribute, FirstFace, Mesh, Original, SurfaceMesh};
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// Reads the file that a scene came from once more.
pub(in crate::scene) fn of_file(path: &Path, scene: &Scene) -> Result<Original, ImportError> {
    let bytes = Source::held(path, &[], &scene.held)
        .read(path)
        .map_err(|source| ImportError::Unreadable { path: path.into(), source })?;
    let source = Source::held(path, &bytes, &scene.held);
    let document = container::open(&source)?;
    let fail = |problem: &str| {
        source.malformed(Place::Element("JSON".into()), problem.to_owned(), EXPORT_AGAIN)
    };
    let Ok(Value::Object(mut json)) = serde_json::from_slice(document.text) else {
        return Err(fail("is no object"));
    };
    let g = &scene.geometry;
    let mut meshes: HashMap<(usize, usize), Arc<Mesh>> = HashMap::new();
    let mut surfaces = Vec::new();
    let mut first = 0_u32;
    // The first triangle of each surface tells whether it is mirrored.
    let mut sample: BTreeMap<u32, [u32; 3]> = BTreeMap::new();
    for t in g.ids() {
        let corners = g.cut_faces.get(&g.face(t)).unwrap_or(&g.triangles[t.index()]);
        sample.entry(g.face(t)).or_insert(*corners);
    }
    for surface in &g.surfaces {
        let (node, number) = (surface.node as usize, surface.primitive as usize);
        let mesh_of = document.root.nodes.get(node).and_then(|n| n.mesh).map(|m| m.value());
        let primitive = mesh_of
            .and_then(|m| document.root.meshes.get(m))
            .and_then(|m| m.primitives.get(number));
        let (Some(mesh_number), Some(primitive)) = (mesh_of, primitive) else {
            // A stage's.
            break;
        };
        let key = (mesh_number, number);
        let mesh = match meshes.get(&key) {
            Some(mesh) => Arc::clone(mesh),
            None => {
                let mesh = Arc::new(read_mesh(&document, primitive)?);
                meshes.insert(key, Arc::clone(&mesh));
                mesh
            }
        };
        let end = first.saturating_add(mesh.triangles.len() as u32);
        let mirrored = sample.range(first..end).find_map(|(face, scene)| {
            let [a, b, _] = *mesh.triangles.get((face - first) as usize)?;
            let step = i64::from(scene[1]) - i64::from(scene[0]);
            (a != b).then_some(step != i64::from(b) - i64::from(a))
        });
        surfaces.push(SurfaceMesh {
            node,
            mesh,
            material: primitive.material.map(|m| m.value()),
            first_face: FirstFace::At(first),
            mirrored: mirrored.unwrap_or(false),
        });
        first = end;
    }
    let images =
        document.root.images.iter().map(|i| image_bytes(&document, Some(i)).ok()).collect();
    strip(&mut json);
    Ok(Original { json, surfaces, images })
}

/// Takes out what is written anew, and what light that stands still knows nothing of.
fn strip(json: &mut Map<String, Value>) {
    for key in ["buffers", "bufferViews", "accessors", "animations", "skins"] {
        json.remove(key);
    }
    for node in json.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(node) = node.as_object_mut() {
            node.remove("skin");
            node.remove("weights");
        }
    }
}

fn read_mesh(
    document: &Document<'_>,
    primitive: &gltf::json::mesh::Primitive,
) -> Result<Mesh, ImportError> {
    let mut mesh = Mesh::default();
    let mut count = 0;
    let mut names = HashSet::new();
    for (semantic, accessor) in &primitive.attributes {
        let Checked::Valid(semantic) = semantic else { continue };
        let index = accessor.value();
        let kind = document.root.accessors.get(index).map(|a| a.type_);
        let Some(Checked::Valid(kind)) = kind else { continue };
        let suits = match semantic {
            Semantic::Positions | Semantic::Normals => kind == Type::Vec3,
            Semantic::Tangents => kind == Type::Vec4,
            Semantic::TexCoords(_) => kind == Type::Vec2,
            Semantic::Colors(_) => matches!(kind, Type::Vec3 | Type::Vec4),
            // Skins are at rest.
            _ => false,
        };
        if !suits || !names.insert(semantic.to_string()) {
            continue;
        }
        let values = document.components(index, kind)?.into_iter().map(|v| v as f32).collect();
        if matches!(semantic, Semantic::Positions) {
            count = document.root.accessors[index].count.0 as usize;
        }
        let width = kind.multiplicity();
        mesh.attributes.push(Attribute { name: semantic.to_string(), width, values });
    }
    mesh.attributes.retain(|a| a.values.len() == count * a.width);
    mesh.attributes.sort_by(|a, b| a.name.cmp(&b.name));
    let indices = match primitive.indices {
        Some(accessor) => document.indices(accessor.value())?,
        None => (0..count as u32).collect(),
    };
    let mode = match primitive.mode {
        Checked::Valid(mode) => mode,
        Checked::Invalid => Mode::Triangles,
    };
    mesh.triangles = triangles(mode, &indices);
    mesh.triangles.retain(|t| t.iter().all(|i| (*i as usize) < count));
    Ok(mesh)
}
