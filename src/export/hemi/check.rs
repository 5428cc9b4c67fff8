//! Whether what a file says of a scene fits together.

use std::f64::consts::PI;

use glam::DVec3;

use super::manifest::SceneHead;
use crate::scene::geometry::MAX_COORDINATE;
use crate::scene::optics::MOST_RADIANCE;
use crate::scene::{Camera, Geometry, Lamp, Material, Optics, Rgb};

/// Refuses what would lead out of an array, and numbers that no importer lets in. `head` says the
/// rest of the scene.
pub fn check(g: &Geometry, o: &Optics, head: &SceneHead) -> Result<(), String> {
    let vertex = |v: &u32| (*v as usize) < g.vertices.len();
    let shares = |all: &[Rgb]| all.iter().all(|r| r.min_element() >= 0.0 && r.max_element() < 1.0);
    let textures = o.textures.len();
    let tests = [
        ("vertices", g.vertices.iter().all(|v| position(*v))),
        ("triangles", g.triangles.iter().flatten().all(vertex)),
        ("surface", g.surface_of.iter().all(|&s| (s as usize) < g.surfaces.len())),
        ("surfaces", head.object_of.len() == g.surfaces.len()),
        // Each face has a piece, or is one that was cut.
        ("face", g.face_of.is_sorted() && g.faces() <= g.len() + g.cut_faces.len()),
        ("cut_faces", g.cut_faces.values().flatten().all(vertex)),
        ("stage", g.whole_from.is_none_or(|first| first.index() <= g.len())),
        ("material", o.material_of.iter().all(|&m| (m as usize) < o.materials.len())),
        ("reflectance", shares(&o.reflectance) && (0.0..1.0).contains(&o.max_reflectance)),
        ("emission", o.emission.iter().all(|e| light(*e))),
        ("tint", o.tint.iter().all(|t| light(*t))),
        ("materials", o.materials.iter().all(|m| is_material(m, textures))),
        ("textures", !o.uv.is_empty() || !o.materials.iter().any(|m| m.is_textured())),
        ("lamps", head.lamps.iter().all(is_lamp)),
        ("sky", light(head.sky)),
        ("upward direction", direction(head.up)),
        ("cameras", head.cameras.iter().all(is_camera)),
    ];
    match tests.iter().find(|t| !t.1) {
        Some((name, _)) => Err(format!("its {name} do not fit the rest of the scene")),
        None => Ok(()),
    }
}

fn position(p: DVec3) -> bool {
    p.abs().max_element() <= MAX_COORDINATE
}

/// Whether a vector, which should be of length 1, says where something points.
fn direction(d: DVec3) -> bool {
    (1e-6..1e6).contains(&d.length())
}

/// Radiance, intensity, irradiance, or what colours are multiplied with.
fn light(e: Rgb) -> bool {
    e.min_element() >= 0.0 && e.max_element() <= MOST_RADIANCE
}

fn is_material(m: &Material, textures: usize) -> bool {
    let all = [m.reflectance_texture, m.radiance_texture, m.alpha_texture];
    all.into_iter().flatten().all(|t| (t as usize) < textures)
        && light(m.reflectance)
        && light(m.radiance)
}

fn is_lamp(lamp: &Lamp) -> bool {
    let aims = match lamp {
        Lamp::Point { .. } => true,
        Lamp::Spot { direction: aim, inner, outer, .. } => {
            let cone = 0.0 <= *inner && inner <= outer && *outer <= PI;
            direction(*aim) && cone
        }
        Lamp::Directional { direction: aim, .. } => direction(*aim),
    };
    aims && light(lamp.emission())
        && lamp.position().is_none_or(position)
        && lamp.photometry().is_none_or(|p| p.is_sound())
}

fn is_camera(c: &Camera) -> bool {
    position(c.eye)
        && direction(c.forward)
        && c.vfov > 0.0
        && c.vfov < PI
        && c.aspect.is_none_or(|a| a.is_finite() && a > 0.0)
}
