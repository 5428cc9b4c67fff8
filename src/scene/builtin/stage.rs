//! Puts meshes into a scene: paints, names, cameras.

use glam::DVec3;

use super::mesh::Mesh;
use crate::scene::{Camera, Material, Rgb, Scene, SceneBuilder, Sides, Surface};

/// Index of a material of a [`Stage`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Paint(u32);

/// A scene in the making whose surfaces are all one-sided: closed solids, and rooms that face
/// inwards.
pub(super) struct Stage {
    builder: SceneBuilder,
}

impl Stage {
    pub(super) fn new(name: &str) -> Self {
        Self { builder: SceneBuilder::new(name) }
    }

    /// A material that reflects.
    pub(super) fn paint(&mut self, name: &str, reflectance: [f64; 3]) -> Paint {
        self.glow(name, reflectance, [0.0; 3])
    }

    /// A material that reflects, and emits a radiance in W/(m² sr).
    pub(super) fn glow(&mut self, name: &str, reflectance: [f64; 3], radiance: [f64; 3]) -> Paint {
        Paint(self.builder.material(Material {
            name: name.into(),
            reflectance: Rgb::from_array(reflectance),
            radiance: Rgb::from_array(radiance),
            ..Material::default()
        }))
    }

    /// Adds a mesh as one named surface.
    pub(super) fn add(&mut self, name: &str, paint: Paint, mesh: &Mesh) {
        self.add_parts(mesh, &[(name, paint, mesh.triangles.len())]);
    }

    /// Adds a mesh as several named surfaces that share its vertices: each takes the given number
    /// of triangles, in order. Triangles that no part takes are left out.
    pub(super) fn add_parts(&mut self, mesh: &Mesh, parts: &[(&str, Paint, usize)]) {
        let vertices: Vec<u32> = mesh.vertices.iter().map(|&v| self.builder.vertex(v)).collect();
        let mut triangles = mesh.triangles.iter();
        for &(name, Paint(material), count) in parts {
            let surface =
                self.builder.surface(Surface { name: name.into(), node: 0, primitive: 0 });
            for t in triangles.by_ref().take(count) {
                let t = t.map(|v| vertices[v as usize]);
                self.builder.triangle(t, None, surface, material, Sides::One);
            }
        }
    }

    /// Adds a camera: vertical angle of view in degrees, width over height.
    pub(super) fn camera(
        &mut self,
        name: &str,
        eye: DVec3,
        target: DVec3,
        vfov_degrees: f64,
        aspect: f64,
    ) {
        self.builder.camera(Camera {
            name: name.into(),
            eye,
            forward: (target - eye).normalize(),
            up: DVec3::Y,
            vfov: vfov_degrees.to_radians(),
            aspect: Some(aspect),
        });
    }

    pub(super) fn finish(self) -> Scene {
        self.builder.finish()
    }
}
