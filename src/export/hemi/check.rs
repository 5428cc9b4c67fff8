//! Whether what a file says of a scene fits together.

use glam::DVec3;

use crate::scene::geometry::MAX_COORDINATE;
use crate::scene::optics::MOST_RADIANCE;
use crate::scene::{Camera, Geometry, Lamp, Optics, Rgb};

/// Refuses what would lead out of an array, and numbers that no importer lets in.
pub fn check(g: &Geometry, o: &Optics, lamps: &[Lamp], cameras: &[Camera]) -> Result<(), String> {
    let vertex = |v: &u32| (*v as usize) < g.vertices.len();
    let texture = |t: Option<u32>| t.is_none_or(|t| (t as usize) < o.textures.len());
    let position = |p: DVec3| p.abs().max_element() <= MAX_COORDINATE;
    let light = |e: Rgb| e.min_element() >= 0.0 && e.max_element() <= MOST_RADIANCE;
    let direction = |d: DVec3| d.is_finite() && d.length_squared() > 0.0;
    let tests = [
        ("vertices", g.vertices.iter().all(|v| position(*v))),
        ("triangles", g.triangles.iter().flatten().all(vertex)),
        ("surface", g.surface_of.iter().all(|&s| (s as usize) < g.surfaces.len())),
        ("face", g.face_of.is_sorted()),
        ("cut_faces", g.cut_faces.values().flatten().all(vertex)),
        ("material", o.material_of.iter().all(|&m| (m as usize) < o.materials.len())),
        ("reflectance", o.reflectance.iter().all(|r| r.min_element() >= 0.0)),
        ("reflectance", o.reflectance.iter().all(|r| r.max_element() < 1.0)),
        ("emission", o.emission.iter().all(|e| light(*e))),
        (
            "materials",
            o.materials.iter().all(|m| {
                let textures = [m.reflectance_texture, m.radiance_texture, m.alpha_texture];
                textures.into_iter().all(texture) && light(m.radiance)
            }),
        ),
        ("textures", !o.uv.is_empty() || !o.materials.iter().any(|m| m.is_textured())),
        (
            "lamps",
            lamps.iter().all(|l| {
                light(l.emission())
                    && l.position().is_none_or(position)
                    && l.photometry().is_none_or(|p| p.is_sound())
            }),
        ),
        (
            "cameras",
            cameras.iter().all(|c| position(c.eye) && direction(c.forward) && c.vfov.is_finite()),
        ),
    ];
    match tests.iter().find(|t| !t.1) {
        Some((name, _)) => Err(format!("its {name} do not fit the rest of the scene")),
        None => Ok(()),
    }
}
