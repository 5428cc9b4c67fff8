//! Meshes of a baked model: what the original's vertices have, on the baked triangles.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;
use serde_json::{Map, Value, json};

use super::buffers::Buffers;
use super::materials::Variants;
use super::mode::BakeMode;
use crate::bake::Facet;
use crate::patches::at_barycentric;
use crate::scene::original::{FirstFace, Mesh, SurfaceMesh};
use crate::scene::{Geometry, Scene, Side};

/// Primitives by node.
pub(super) type Written = BTreeMap<usize, Vec<Value>>;

/// A vertex of the new mesh: the weights of three of the original's.
struct Corner {
    vertices: [u32; 3],
    weights: DVec3,
    side: Side,
    atlas: [f32; 2],
    radiance: [f32; 3],
}

/// What tells vertices apart: those of a corner, in bits.
type Key = ([u32; 3], [u64; 3], Side, [u32; 2], [u32; 3]);

/// Writes the vertices and triangles of all surfaces; `scale` is what a value of 1 stands for on a
/// facet.
pub(super) fn meshes(
    scene: &Scene,
    surfaces: &[SurfaceMesh],
    facets: &[Facet],
    (mode, scale): (BakeMode, impl Fn(&Facet) -> f64),
    variants: &mut Variants,
    buffers: &mut Buffers,
) -> Written {
    let g = &scene.geometry;
    // By surface, material and scale.
    let mut parts: BTreeMap<(usize, usize), (f64, Vec<&Facet>)> = BTreeMap::new();
    for facet in facets {
        let surface = g.surface_of[facet.triangle.index()] as usize;
        let Some(mesh) = surfaces.get(surface) else { continue };
        let made = matches!(mesh.first_face, FirstFace::Listed(_));
        let own = scene.optics.material_of[facet.triangle.index()] as usize;
        let scale = scale(facet);
        let material = variants.number(if made { Some(own) } else { mesh.material }, scale);
        parts.entry((surface, material)).or_insert((scale, Vec::new())).1.push(facet);
    }
    let set = lightmap_set(surfaces);
    let mut written = Written::new();
    for ((surface, material), (scale, facets)) in parts {
        let surface = &surfaces[surface];
        let (corners, indices) = corners(g, surface, &facets);
        if indices.is_empty() {
            continue;
        }
        let mut attributes = attributes(&surface.mesh, &corners, (mode, set), buffers);
        if matches!(mode, BakeMode::Vertex) {
            let colours: Vec<[f32; 3]> =
                corners.iter().map(|c| c.radiance.map(|r| r / scale as f32)).collect();
            attributes.insert("COLOR_0".into(), json!(buffers.colours(&colours)));
        }
        written.entry(surface.node).or_default().push(json!({
            "attributes": attributes,
            "indices": buffers.indices(&indices),
            "material": material,
        }));
    }
    written
}

/// Vertices and indices of a surface's facets.
fn corners(g: &Geometry, surface: &SurfaceMesh, facets: &[&Facet]) -> (Vec<Corner>, Vec<u32>) {
    let mut corners = Vec::new();
    let mut indices = Vec::new();
    let mut known: HashMap<Key, u32> = HashMap::new();
    for facet in facets {
        let face = g.face(facet.triangle);
        let Some(vertices) = surface.corners(face) else { continue };
        let whole = g.cut_faces.get(&face).map(|c| c.map(|v| g.vertices[v as usize]));
        let mut triangle = [0, 1, 2].map(|k| {
            let uv = facet.corners[k];
            let own = DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y);
            let weights = match whole {
                None => own,
                Some(whole) => weights_in(whole, at_barycentric(g.corners(facet.triangle), own)),
            };
            let atlas = facet.atlas[k].as_vec2().to_array();
            let radiance = facet.radiance[k];
            // A corner of the original is the same vertex in all triangles.
            let at = (0..3).find(|&c| weights[c] == 1.0);
            let vertices = at.map_or(vertices, |c| [vertices[c]; 3]);
            let weights = at.map_or(weights, |_| DVec3::X);
            let key = (
                vertices,
                weights.to_array().map(f64::to_bits),
                facet.side,
                atlas.map(f32::to_bits),
                radiance.map(f32::to_bits),
            );
            *known.entry(key).or_insert_with(|| {
                corners.push(Corner { vertices, weights, side: facet.side, atlas, radiance });
                (corners.len() - 1) as u32
            })
        });
        if triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0] {
            continue;
        }
        if (facet.side == Side::Back) != surface.mirrored {
            triangle.swap(1, 2);
        }
        indices.extend(triangle);
    }
    (corners, indices)
}

/// Barycentric coordinates of a point in a triangle.
fn weights_in([a, b, c]: [DVec3; 3], p: DVec3) -> DVec3 {
    let (e, f, d) = (b - a, c - a, p - a);
    let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
    let determinant = ee * ff - ef * ef;
    let u = (d.dot(e) * ff - d.dot(f) * ef) / determinant;
    let v = (d.dot(f) * ee - d.dot(e) * ef) / determinant;
    DVec3::new(1.0 - u - v, u, v)
}

fn attributes(
    mesh: &Mesh,
    corners: &[Corner],
    (mode, set): (BakeMode, usize),
    buffers: &mut Buffers,
) -> Map<String, Value> {
    let mut all = Map::new();
    let keeps = |name: &str| match mode {
        BakeMode::Lightmap { .. } => true,
        _ => name == "POSITION" || name == "NORMAL",
    };
    for attribute in mesh.attributes.iter().filter(|a| keeps(&a.name)) {
        let width = attribute.width;
        let mut values = Vec::with_capacity(corners.len() * width);
        for corner in corners {
            let mut value: Vec<f32> = (0..width)
                .map(|c| {
                    let of = |k: usize| {
                        f64::from(attribute.values[corner.vertices[k] as usize * width + c])
                    };
                    (of(0) * corner.weights.x + of(1) * corner.weights.y + of(2) * corner.weights.z)
                        as f32
                })
                .collect();
            let back = corner.side == Side::Back;
            match attribute.name.as_str() {
                "NORMAL" => turn_to_unit(&mut value, if back { -1.0 } else { 1.0 }),
                "TANGENT" => {
                    let of = attribute.values[corner.vertices[0] as usize * width + 3];
                    turn_to_unit(&mut value[..3], 1.0);
                    value[3] = if (of < 0.0) != back { -1.0 } else { 1.0 };
                }
                _ => {}
            }
            values.extend(value);
        }
        let index = buffers.floats(&values, width, attribute.name == "POSITION");
        all.insert(attribute.name.clone(), json!(index));
    }
    let atlas = |buffers: &mut Buffers| {
        let values: Vec<f32> = corners.iter().flat_map(|c| c.atlas).collect();
        json!(buffers.floats(&values, 2, false))
    };
    match mode {
        BakeMode::Unlit => {
            all.insert("TEXCOORD_0".into(), atlas(buffers));
        }
        BakeMode::Vertex => {}
        BakeMode::Lightmap { .. } => {
            let coordinates = atlas(buffers);
            // Sets follow each other without a gap.
            for k in 0..=set {
                all.entry(texture_set(k)).or_insert_with(|| coordinates.clone());
            }
        }
    }
    all
}

fn texture_set(number: usize) -> String {
    format!("TEXCOORD_{number}")
}

/// The set of texture coordinates of a lightmap: the second, or the next one that no surface has.
pub(super) fn lightmap_set(surfaces: &[SurfaceMesh]) -> usize {
    let has = |s: &SurfaceMesh, name: &str| s.mesh.attributes.iter().any(|a| a.name == name);
    let is_free = |k: &usize| !surfaces.iter().any(|s| has(s, &texture_set(*k)));
    (1..).find(is_free).unwrap_or(1)
}

fn turn_to_unit(value: &mut [f32], sign: f32) {
    let length = value.iter().map(|v| v * v).sum::<f32>().sqrt();
    let (x, scale) = if length > 0.0 { (None, sign / length) } else { (Some(1.0), 1.0) };
    value.iter_mut().for_each(|v| *v *= scale);
    if let (Some(x), Some(first)) = (x, value.first_mut()) {
        *first = x;
    }
}

/// Gives each node a mesh of its own with its primitives.
pub(super) fn place(json: &mut Map<String, Value>, written: Written) {
    let old = json.remove("meshes").unwrap_or_default();
    let mut meshes = Vec::new();
    let nodes = json.get_mut("nodes").and_then(Value::as_array_mut);
    for (number, node) in nodes.into_iter().flatten().enumerate() {
        let Some(node) = node.as_object_mut() else { continue };
        let own = node.remove("mesh").and_then(|m| m.as_u64());
        let Some(primitives) = written.get(&number) else { continue };
        let mut mesh = own.and_then(|m| old.get(m as usize)).cloned().unwrap_or_default();
        if let Some(mesh) = mesh.as_object_mut() {
            mesh.remove("weights");
        } else {
            mesh = json!({});
        }
        mesh["primitives"] = json!(primitives);
        node.insert("mesh".into(), json!(meshes.len()));
        meshes.push(mesh);
    }
    json.insert("meshes".into(), Value::Array(meshes));
}
