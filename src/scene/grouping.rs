//! Triangles grouped by what the file names: surfaces, materials or objects.

use std::collections::HashMap;

use super::model::Scene;

/// What triangles of one group have in common: a name in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupBy {
    /// The surface: an OBJ group, a glTF node, an STL solid.
    Surface,
    /// The material.
    Material,
    /// The object: OBJ `o`, a glTF node, an STL solid. Where a file has none, all is one.
    Object,
}

/// Named groups of triangles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grouping {
    /// Distinct names, in the order of their first triangle.
    pub names: Vec<String>,
    /// Index in [`names`](Self::names) of each triangle's group.
    pub of: Vec<u32>,
}

/// Name of what the file does not name.
const UNNAMED: &str = "default";

impl Scene {
    /// The triangles grouped by the names of what they are of. What has no name is `default`.
    #[must_use]
    pub fn grouping(&self, by: GroupBy) -> Grouping {
        let surface = |t: usize| self.geometry.surface_of.get(t).map(|&s| s as usize);
        let material = |t: usize| self.optics.material_of.get(t).map(|&m| m as usize);
        let name = |t: usize| match by {
            GroupBy::Surface => self.geometry.surfaces.get(surface(t)?).map(|s| &s.name),
            GroupBy::Material => self.optics.materials.get(material(t)?).map(|m| &m.name),
            GroupBy::Object => self.object_of.get(surface(t)?),
        };
        let mut number: HashMap<&str, u32> = HashMap::new();
        let mut names = Vec::new();
        let of = (0..self.geometry.len())
            .map(|t| {
                let name = name(t).filter(|n| !n.is_empty()).map_or(UNNAMED, String::as_str);
                *number.entry(name).or_insert_with(|| {
                    names.push(name.to_owned());
                    names.len() as u32 - 1
                })
            })
            .collect();
        Grouping { names, of }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides, Surface};

    #[test]
    fn names_part_triangles_in_the_order_of_the_file() {
        let mut b = SceneBuilder::new("test");
        for z in 0..4 {
            for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
                b.vertex(glam::DVec3::new(corner[0], corner[1], f64::from(z)));
            }
        }
        let material = |name: &str| Material { name: name.into(), ..Material::default() };
        let (wood, steel) = (b.material(material("wood")), b.material(material("steel")));
        let mut triangle = 0;
        for (name, object, material) in
            [("leg", "chair", wood), ("seat", "chair", steel), ("leg", "table", wood), ("", "", 1)]
        {
            let surface = Surface { name: name.into(), node: 0, primitive: 0 };
            let surface = b.surface_in(surface, object);
            b.triangle([0, 1, 2].map(|v| triangle + v), None, surface, material, Sides::One);
            triangle += 3;
        }
        let scene = b.finish();
        for (by, names, of) in [
            (GroupBy::Surface, &["leg", "seat", "default"][..], [0, 1, 0, 2]),
            (GroupBy::Material, &["wood", "steel"], [0, 1, 0, 1]),
            (GroupBy::Object, &["chair", "table", "default"], [0, 0, 1, 2]),
        ] {
            let grouping = scene.grouping(by);
            assert_eq!(grouping.names, names, "{by:?}");
            assert_eq!(grouping.of, of, "{by:?}");
        }
    }
}
