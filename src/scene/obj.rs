//! Wavefront OBJ and MTL.
//!
//! OBJ carries no sidedness: both sides reflect, and the front alone emits.

mod labels;
mod mtl;
mod parse;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::builder::SceneBuilder;
use super::files::read_regular;
use super::geometry::{Sides, Surface};
use super::optics::{ASSUMED_TEXTURE, Material};
use super::polygon;
use super::shortened::shortened;
use super::source::{ImportError, Place, Source};
use super::texture::{Texture, Wrap, linear_from_srgb};
use super::{Rgb, Severity};
use mtl::{Map, MtlMaterial, UvTransform};
use parse::{Face, Obj};

/// Reads an OBJ file and the material libraries and textures that it names.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let obj = parse::parse(source)?;
    let corners = obj.faces.iter().map(|f| f.corners.len().saturating_sub(2)).sum();
    let last = || Place::Line(obj.faces.last().map_or(1, |f| f.line));
    source.check_size(corners, "triangles", last)?;
    source.check_size(obj.positions.len(), "vertices", last)?;
    let library = libraries(source, &obj, builder)?;
    let tints = tints(&obj);
    let materials = Materials::add(source, &obj, &library, builder);
    for &position in &obj.positions {
        builder.vertex(position);
    }
    for surface in &obj.surfaces {
        let named = Surface { name: surface.name.clone(), node: 0, primitive: 0 };
        builder.surface_in(named, &surface.object);
    }
    for face in &obj.faces {
        add_face(source, &obj, face, &materials, &tints, builder)?;
    }
    if obj.curves > 0 {
        builder.finding(
            Severity::Note,
            format!("line {}", obj.first_curve),
            format!("{} points, lines, curves or patches are left out", obj.curves),
            "convert them to meshes if they should take part",
        );
    }
    if let Some((line, _)) = obj.labelled.first() {
        let names: Vec<&str> = obj.labelled.iter().map(|l| l.1.as_str()).collect();
        builder.finding(
            Severity::Note,
            format!("line {line}"),
            format!(
                "groups that are named after their faces, which have the material of that name: \
                 {}",
                names.join(", ")
            ),
            "put each `g` before its faces",
        );
    }
    Ok(())
}

fn add_face(
    source: &Source<'_>,
    obj: &Obj,
    face: &Face,
    materials: &Materials,
    tints: &[Rgb],
    builder: &mut SceneBuilder,
) -> Result<(), ImportError> {
    let corners = &obj.corners[face.corners.clone()];
    let check = |index: u32, count: usize, what: &str| {
        if (index as usize) < count {
            return Ok(());
        }
        Err(source.malformed(
            Place::Line(face.line),
            format!("{what} {} does not exist: the file has {count}", u64::from(index) + 1),
            "export the model again",
        ))
    };
    for corner in corners {
        check(corner.position, obj.positions.len(), "vertex")?;
        if let Some(uv) = corner.uv {
            check(uv, obj.uvs.len(), "texture coordinate")?;
        }
    }
    let (material, transform) = &materials.entries[&face.material];
    let positions: Vec<DVec3> =
        corners.iter().map(|c| obj.positions[c.position as usize]).collect();
    let (triangles, tiled) = polygon::triangulate(&positions);
    if !tiled {
        builder.finding(
            Severity::Warning,
            format!("line {}", face.line),
            format!("a face of {} corners that is not convex was fanned", corners.len()),
            "triangulate the model when exporting it",
        );
    }
    let has_uv = corners.iter().all(|c| c.uv.is_some());
    let uv = |i: usize| corners[i].uv.map_or(DVec2::ZERO, |t| transform.apply(obj.uvs[t as usize]));
    for triangle in triangles {
        builder.triangle(
            triangle.map(|i| corners[i].position),
            has_uv.then(|| triangle.map(uv)),
            face.surface,
            *material,
            Sides::Two,
        );
        if !tints.is_empty() {
            let of = |i: usize| tints.get(corners[i].position as usize).copied();
            let tint: Rgb = triangle.iter().map(|&i| of(i).unwrap_or(Rgb::ONE)).sum();
            builder.tint(tint / 3.0);
        }
    }
    Ok(())
}

/// What the vertices' colours multiply reflectance with. Files write them from 0 to 1, or to 255.
fn tints(obj: &Obj) -> Vec<Rgb> {
    let largest = obj.colours.iter().flatten().fold(0.0_f64, |most, c| most.max(c.max_element()));
    let scale = if largest > 1.0 { 255.0 } else { 1.0 };
    let tint = |colour: &Option<Rgb>| colour.map_or(Rgb::ONE, |c| linear_from_srgb(c / scale));
    obj.colours.iter().map(tint).collect()
}

/// All material libraries that the file names, the later of two equal names winning.
fn libraries(
    source: &Source<'_>,
    obj: &Obj,
    builder: &mut SceneBuilder,
) -> Result<HashMap<String, MtlMaterial>, ImportError> {
    let mut library = HashMap::new();
    for (line, names) in &obj.libraries {
        for name in library_names(source, names) {
            let place = format!("line {line}");
            let Some(path) = source.beside(&name) else {
                builder.finding(
                    Severity::Warning,
                    place,
                    format!(
                        "material library {name} is missing; reflectance {} is assumed",
                        ASSUMED_REFLECTANCE
                    ),
                    "put it beside the OBJ file",
                );
                continue;
            };
            let bytes = read_regular(&path)
                .map_err(|error| ImportError::Unreadable { path: path.clone(), source: error })?;
            if mtl::parse(&Source::new(&path, &bytes), &mut library)? {
                builder.finding(
                    Severity::Note,
                    place,
                    format!("all materials of {} say Tr 1, taken as opaque", shortened(&name)),
                    "write d 0 for a material that lets all light through",
                );
            }
        }
    }
    Ok(library)
}

/// `mtllib` takes several names, which may contain spaces: the rest of the line is one name if
/// there is such a file, and is else split after each `.mtl`.
fn library_names(source: &Source<'_>, rest: &str) -> Vec<String> {
    if source.beside(rest).is_some() {
        return vec![rest.to_owned()];
    }
    let mut names = vec![String::new()];
    for word in rest.split_whitespace() {
        if let Some(name) = names.last_mut() {
            if !name.is_empty() {
                name.push(' ');
            }
            name.push_str(word);
            if word.to_lowercase().ends_with(".mtl") {
                names.push(String::new());
            }
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

/// What faces without a material, and materials without a name, are called.
const UNNAMED: &str = "(none)";

/// Reflectance of what has no material, or one that says nothing about it.
const ASSUMED_REFLECTANCE: f64 = 0.5;

/// The materials in use, by index in [`Obj::materials`] (`None`: faces before any `usemtl`).
struct Materials {
    entries: HashMap<Option<u32>, (u32, UvTransform)>,
}

impl Materials {
    fn add(
        source: &Source<'_>,
        obj: &Obj,
        library: &HashMap<String, MtlMaterial>,
        builder: &mut SceneBuilder,
    ) -> Self {
        let mut entries = HashMap::new();
        let mut textures = HashMap::new();
        for face in &obj.faces {
            if entries.contains_key(&face.material) {
                continue;
            }
            let name = face.material.map(|m| obj.materials[m as usize].as_str());
            let found = name.and_then(|n| library.get(n));
            let entry = match (name, found) {
                (Some(name), Some(found)) => {
                    add_material(source, name, found, &mut textures, builder)
                }
                (name, _) => {
                    let (place, message) = match name {
                        Some(name) => (format!("material {name}"), "is not defined"),
                        None => (format!("line {}", face.line), "faces have no material"),
                    };
                    let coloured = name.is_none() && !obj.colours.is_empty();
                    let rho = if coloured { 1.0 } else { ASSUMED_REFLECTANCE };
                    let assumed = match coloured {
                        true => "the colours of their vertices are their reflectance".to_owned(),
                        false => format!("reflectance {ASSUMED_REFLECTANCE} is assumed"),
                    };
                    builder.finding(
                        if coloured { Severity::Note } else { Severity::Warning },
                        place,
                        format!("{message}; {assumed}"),
                        "define it in a material library beside the OBJ file",
                    );
                    let material = Material {
                        name: name.filter(|n| !n.is_empty()).unwrap_or(UNNAMED).into(),
                        reflectance: Rgb::splat(rho),
                        ..Material::default()
                    };
                    (builder.material(material), mtl::NO_TRANSFORM)
                }
            };
            entries.insert(face.material, entry);
        }
        Self { entries }
    }
}

/// Textures by file, and whether they hold the border's value and are opacity.
type Textures = HashMap<(std::path::PathBuf, bool, bool), u32>;

fn add_material(
    source: &Source<'_>,
    name: &str,
    given: &MtlMaterial,
    textures: &mut Textures,
    builder: &mut SceneBuilder,
) -> (u32, UvTransform) {
    let name = if name.is_empty() { UNNAMED } else { name };
    let mut material = Material { name: name.into(), alpha: given.alpha(), ..Material::default() };
    let place = format!("material {name}");
    material.reflectance = given.kd.unwrap_or_else(|| {
        if given.map_kd.is_some() { Rgb::ONE } else { Rgb::splat(ASSUMED_REFLECTANCE) }
    });
    let ks = given.ks.unwrap_or(Rgb::ZERO);
    let no_kd = given.kd.is_none_or(|kd| kd == Rgb::ZERO) && given.map_kd.is_none();
    if given.is_specular() || (given.kd == Some(Rgb::ZERO) && no_kd && ks != Rgb::ZERO) {
        let diffuse = if no_kd { Rgb::ZERO } else { material.reflectance };
        if (diffuse + ks).max_element() > 0.0 {
            material.reflectance = (diffuse + ks).min(Rgb::ONE.max(diffuse));
        }
        material.specular = true;
        builder.finding(
            Severity::Note,
            place.clone(),
            "is a mirror, glass or gloss; its specular colour (Ks) counts as diffuse reflectance",
            "give it a Kd of the same mean reflectance, and no Ks, if that matters",
        );
    } else if given.kd.is_none() && given.map_kd.is_none() {
        builder.finding(
            Severity::Note,
            place.clone(),
            format!("has no Kd; reflectance {ASSUMED_REFLECTANCE} is assumed"),
            "give it a Kd",
        );
    }
    if given.map_kd.is_some() && given.kd == Some(Rgb::ZERO) {
        builder.finding(
            Severity::Warning,
            place.clone(),
            "Kd is black beside a map_Kd; the texture alone is taken",
            "set Kd to 1 1 1, or remove map_Kd if the material is black",
        );
        material.reflectance = Rgb::ONE;
    }
    material.radiance =
        given.ke.unwrap_or(if given.map_ke.is_some() { Rgb::ONE } else { Rgb::ZERO });
    let mut add = |map: &Option<Map>, opacity: bool, builder: &mut SceneBuilder| {
        map.as_ref().map(|map| texture(source, &place, map, opacity, textures, builder))
    };
    let (kd, ke) = (add(&given.map_kd, false, builder), add(&given.map_ke, false, builder));
    material.alpha_texture = add(&given.map_d, true, builder).flatten();
    if kd == Some(None) {
        material.reflectance *= ASSUMED_TEXTURE;
    }
    if ke == Some(None) {
        material.radiance *= ASSUMED_TEXTURE;
    }
    material.reflectance_texture = kd.flatten();
    material.radiance_texture = ke.flatten();
    let map = given.map_kd.as_ref().or(given.map_ke.as_ref()).or(given.map_d.as_ref());
    let transform = map.map_or(mtl::NO_TRANSFORM, |m| m.transform);
    (builder.material(material), transform)
}

/// The texture's index, or `None` with a finding if there is no such file.
fn texture(
    source: &Source<'_>,
    place: &str,
    map: &Map,
    opacity: bool,
    textures: &mut Textures,
    builder: &mut SceneBuilder,
) -> Option<u32> {
    let path = source.beside(&map.file);
    let known = path.as_ref().and_then(|p| textures.get(&(p.clone(), map.clamp, opacity)));
    if let Some(known) = known {
        return Some(*known);
    }
    let encoded = path.as_ref().and_then(|p| read_regular(p).ok());
    let (Some(path), Some(encoded)) = (path, encoded) else {
        builder.finding(
            Severity::Warning,
            place,
            match opacity {
                true => format!("opacity map {} is missing; it blocks light everywhere", map.file),
                false => format!(
                    "texture {} is missing; a mid-grey of {ASSUMED_TEXTURE} is assumed",
                    map.file
                ),
            },
            "put it beside the OBJ file",
        );
        return None;
    };
    let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
    let texture = builder.texture(Texture {
        name: map.file.clone(),
        encoded: encoded.into(),
        wrap: [wrap; 2],
        v_up: true,
        opacity,
    });
    textures.insert((path, map.clamp, opacity), texture);
    Some(texture)
}
