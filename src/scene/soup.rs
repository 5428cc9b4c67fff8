//! Triangles of a format that knows neither materials nor sidedness.

use std::collections::HashMap;

use glam::DVec3;

use super::builder::SceneBuilder;
use super::geometry::{Sides, Surface, position_key};
use super::hash::Mixed;
use super::optics::Material;
use super::{Rgb, Severity};

/// Reflectance of what has no material.
const ASSUMED_REFLECTANCE: f64 = 0.5;

/// Adds triangles to a scene: one material, both sides reflect, equal corners are one vertex.
pub(super) struct Soup<'a> {
    pub builder: &'a mut SceneBuilder,
    material: u32,
    vertices: HashMap<[u64; 3], u32, Mixed>,
    surfaces: HashMap<String, u32>,
    triangles: usize,
}

impl<'a> Soup<'a> {
    /// `coloured`: triangles will have colours of their own, which are all of their reflectance.
    pub fn new(builder: &'a mut SceneBuilder, format: &str, coloured: bool) -> Self {
        let reflectance = if coloured { 1.0 } else { ASSUMED_REFLECTANCE };
        let material = builder.material(Material {
            name: "(none)".into(),
            reflectance: Rgb::splat(reflectance),
            ..Material::default()
        });
        let assumed = match coloured {
            true => "the colours of vertices, taken as sRGB, are their reflectance".to_owned(),
            false => format!("reflectance {ASSUMED_REFLECTANCE} is assumed"),
        };
        builder.finding(
            Severity::Note,
            "whole model",
            format!("{format} has no materials; {assumed}"),
            "use glTF or OBJ where materials matter",
        );
        let (vertices, surfaces) = (HashMap::default(), HashMap::new());
        Self { builder, material, vertices, surfaces, triangles: 0 }
    }

    /// The surface of that name, which is an object of its own.
    pub fn surface(&mut self, name: &str) -> u32 {
        if let Some(&known) = self.surfaces.get(name) {
            return known;
        }
        let surface = Surface { name: name.into(), node: 0, primitive: 0 };
        let surface = self.builder.surface_in(surface, name);
        self.surfaces.insert(name.into(), surface);
        surface
    }

    /// The vertex at a position in metres.
    pub fn vertex(&mut self, position: DVec3) -> u32 {
        let builder = &mut self.builder;
        *self.vertices.entry(position_key(position)).or_insert_with(|| builder.vertex(position))
    }

    pub fn triangle(&mut self, vertices: [u32; 3], surface: u32) {
        self.builder.triangle(vertices, None, surface, self.material, Sides::Two);
        self.triangles += 1;
    }

    /// Triangles so far.
    pub fn triangles(&self) -> usize {
        self.triangles
    }
}
