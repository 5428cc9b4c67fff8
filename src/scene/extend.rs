//! Surfaces that join a finished scene.

use std::f64::consts::PI;

use glam::DVec3;

use super::geometry::{Sides, Surface, TriangleId, TriangleState};
use super::model::Scene;
use super::optics::Material;

impl Scene {
    /// Adds one-sided triangles (indices of `vertices`, in metres) of one material without a
    /// texture, as a surface of the material's name; returns the first.
    pub(crate) fn extend(
        &mut self,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        material: Material,
    ) -> TriangleId {
        let (g, o) = (&mut self.geometry, &mut self.optics);
        let first = TriangleId(g.len() as u32);
        let base = g.vertices.len() as u32;
        let surface = g.surfaces.len() as u32;
        let (name, n) = (material.name.clone(), first.index() + triangles.len());
        g.surfaces.push(Surface { name, node: 0, primitive: 0 });
        self.object_of.push(String::new());
        g.vertices.extend(vertices);
        g.triangles.extend(triangles.iter().map(|t| t.map(|v| base + v)));
        if !g.face_of.is_empty() {
            let next = g.face_of.last().map_or(0, |face| face + 1);
            g.face_of.extend((next..).take(triangles.len()));
        }
        g.sides.resize(n, Sides::One);
        g.state.resize(n, TriangleState::Solid);
        g.surface_of.resize(n, surface);
        o.reflectance.resize(n, material.reflectance);
        o.emission.resize(n, material.radiance * PI);
        o.material_of.resize(n, o.materials.len() as u32);
        if !o.uv.is_empty() {
            o.uv.resize(n, Default::default());
        }
        o.materials.push(material);
        first
    }
}
