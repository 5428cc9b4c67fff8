//! Small scenes of which something is known exactly.

use glam::{DVec3, dvec3};
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Material, Rgb, Scene, SceneBuilder, Sides};

/// A material of a grey reflectance, 0..1, and radiance (W/(m² sr)).
pub fn grey(reflectance: f64, radiance: f64) -> Material {
    Material {
        reflectance: Rgb::splat(reflectance),
        radiance: Rgb::splat(radiance),
        ..Material::default()
    }
}

/// A scene of meshes, each a surface of its own material.
pub fn scene_of<'a>(meshes: impl IntoIterator<Item = (&'a Mesh, Material)>, sides: Sides) -> Scene {
    let mut b = SceneBuilder::new("test");
    for (k, (mesh, material)) in meshes.into_iter().enumerate() {
        let material = b.material(material);
        b.mesh(&format!("mesh {k}"), &mesh.vertices, &mesh.triangles, material, sides);
    }
    b.finish()
}

/// A scene of meshes of reflectance .5; the first glows.
pub fn lit_by_first(meshes: &[&Mesh], sides: Sides) -> Scene {
    let glow = |k| if k == 0 { Rgb::new(1.0, 2.0, 3.0) } else { Rgb::ZERO };
    let material = |k| Material { radiance: glow(k), ..grey(0.5, 0.0) };
    scene_of(meshes.iter().enumerate().map(|(k, mesh)| (*mesh, material(k))), sides)
}

/// A quadrangle of two triangles.
pub fn quad(corners: [DVec3; 4]) -> Mesh {
    Mesh::from_quads(corners.to_vec(), &[[0, 1, 2, 3]])
}

/// A rectangle by a corner and two edges; its front is `u` × `v`.
pub fn rectangle([corner, u, v]: [DVec3; 3]) -> Mesh {
    quad([corner, corner + u, corner + u + v, corner + v])
}

/// A closed room 3 × 2 × 2.5 m, its fronts inside.
pub fn room() -> Mesh {
    Mesh::cuboid(dvec3(3.0, 2.0, 2.5), [3, 2, 2]).inverted()
}
