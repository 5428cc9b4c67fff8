//! Primitives of a mesh, placed by a node.

use std::collections::HashSet;

use glam::{DMat4, DVec2, DVec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::document::{Document, label};
use super::material::Materials;
use crate::scene::builder::SceneBuilder;
use crate::scene::geometry::Surface;
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place};
use crate::scene::{Rgb, Severity};

/// What has been placed so far.
#[derive(Default)]
pub struct Placed {
    pub vertices: usize,
    pub triangles: usize,
    /// Primitives that are points or lines.
    pub curves: usize,
    /// Mesh and primitive of those whose doubts are already named: instances share them.
    pub named: HashSet<(usize, usize)>,
    /// Names of objects: nodes with a mesh.
    pub objects: HashSet<String>,
}

impl Placed {
    /// What a node is called as an object: by its own name, with its number if another node has
    /// that name.
    pub fn object(&mut self, node: usize, name: &str) -> String {
        let plain = self.objects.insert(name.to_owned());
        if plain { name.to_owned() } else { format!("{name} (node {node})") }
    }
}

/// A mesh of a node: where messages say it is, and how it gets into the world.
pub struct Instance<'a> {
    pub node: usize,
    pub name: &'a str,
    pub object: &'a str,
    pub mesh: usize,
    pub world_from_mesh: DMat4,
}

/// Adds the triangles of a node's mesh.
pub fn add(
    document: &Document<'_>,
    instance: &Instance<'_>,
    materials: &mut Materials,
    placed: &mut Placed,
    builder: &mut SceneBuilder,
) -> Result<(), ImportError> {
    let Some(mesh) = document.root.meshes.get(instance.mesh) else {
        return Err(document.malformed(
            label("node", instance.node, Some(instance.name)),
            format!("its mesh {} does not exist", instance.mesh),
            EXPORT_AGAIN,
        ));
    };
    for (i, primitive) in mesh.primitives.iter().enumerate() {
        add_primitive(document, instance, i, primitive, materials, placed, builder)?;
    }
    Ok(())
}

fn add_primitive(
    document: &Document<'_>,
    instance: &Instance<'_>,
    number: usize,
    primitive: &Primitive,
    materials: &mut Materials,
    placed: &mut Placed,
    builder: &mut SceneBuilder,
) -> Result<(), ImportError> {
    let place =
        || format!("{}, primitive {number}", label("node", instance.node, Some(instance.name)));
    let fail = |problem: String| document.malformed(place(), problem, EXPORT_AGAIN);
    let mode = match primitive.mode {
        Checked::Valid(Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) => {
            placed.curves += 1;
            return Ok(());
        }
        Checked::Valid(mode) => mode,
        Checked::Invalid => return Err(fail("has an unknown mode".into())),
    };
    let attribute = |semantic: Semantic| {
        primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value())
    };
    let Some(positions) = attribute(Semantic::Positions) else {
        return Err(fail("has no POSITION".into()));
    };
    let positions = document.components(positions, Type::Vec3)?;
    let count = positions.len() / 3;
    let indices = match primitive.indices {
        Some(accessor) => document.indices(accessor.value())?,
        None => (0..count as u32).collect(),
    };
    if let Some(i) = indices.iter().find(|&&i| i as usize >= count) {
        return Err(fail(format!("index {i} is out of range: it has {count} vertices")));
    }
    let mut triangles = triangles(mode, &indices);
    if instance.world_from_mesh.determinant() < 0.0 {
        // A mirrored mesh keeps its outside outside.
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    placed.vertices += count;
    placed.triangles += triangles.len();
    document.source.check_size(placed.vertices, "vertices", || Place::Element(place()))?;
    document.source.check_size(placed.triangles, "triangles", || Place::Element(place()))?;

    let material = materials.get(document, primitive.material.map(|m| m.value()), builder)?;
    let uvs = match material.uv_set.and_then(|set| attribute(Semantic::TexCoords(set))) {
        Some(accessor) => Some(document.components(accessor, Type::Vec2)?),
        None => None,
    };
    if uvs.as_ref().is_some_and(|uvs| uvs.len() / 2 != count) {
        return Err(fail("has more or fewer texture coordinates than vertices".into()));
    }
    let colours = match attribute(Semantic::Colors(0)) {
        Some(accessor) => document.colours(accessor)?,
        None => Vec::new(),
    };
    if placed.named.insert((instance.mesh, number)) {
        let untextured = material.uv_set.is_some() && uvs.is_none();
        name_doubts(primitive, untextured, &place(), builder);
    }

    let mut base = 0;
    for (i, p) in positions.chunks_exact(3).enumerate() {
        let p = instance.world_from_mesh.transform_point3(DVec3::new(p[0], p[1], p[2]));
        if !p.is_finite() {
            return Err(fail(format!("vertex {i} is not finite")));
        }
        let index = builder.vertex(p);
        if i == 0 {
            base = index;
        }
    }
    let surface = Surface {
        name: instance.name.into(),
        node: instance.node as u32,
        primitive: number as u32,
    };
    let surface = builder.surface_in(surface, instance.object);
    let uv = |i: u32| {
        uvs.as_ref().map_or(DVec2::ZERO, |uvs| {
            let i = 2 * i as usize;
            material.uv_transform.transform_point2(DVec2::new(uvs[i], uvs[i + 1]))
        })
    };
    for triangle in triangles {
        builder.triangle(
            triangle.map(|i| base + i),
            uvs.is_some().then(|| triangle.map(uv)),
            surface,
            material.index,
            material.sides,
        );
        if !colours.is_empty() {
            let of = |&i: &u32| colours.get(i as usize).copied().unwrap_or(Rgb::ONE);
            builder.tint(triangle.iter().map(of).sum::<Rgb>() / 3.0);
        }
    }
    Ok(())
}

fn name_doubts(primitive: &Primitive, untextured: bool, place: &str, builder: &mut SceneBuilder) {
    if untextured {
        builder.finding(
            Severity::Warning,
            place,
            "its material has a texture, but it has no texture coordinates; one texel is taken",
            "unwrap the mesh, or remove the texture",
        );
    }
    if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
        builder.finding(Severity::Note, place, "its morph targets are ignored", "");
    }
}

/// Vertex triples, counter-clockwise; incomplete ones at the end are left out.
pub fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => match indices.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|w| [hub, w[0], w[1]]).collect(),
            None => Vec::new(),
        },
        _ => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
