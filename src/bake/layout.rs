//! Where surfaces lie in an atlas, for programs that read it as it is.

use std::collections::BTreeMap;

use serde::Serialize;

use super::baked::Bake;

/// Where surfaces lie in an atlas, and what its values mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layout {
    /// Texels across and down.
    pub texels: [usize; 2],
    /// Width of a texel on surfaces, m.
    pub texel_m: f64,
    /// What the picture of floats holds.
    pub exr: &'static str,
    /// What the texture in the model holds.
    pub glb: &'static str,
    /// By node.
    pub nodes: Vec<NodeLayout>,
}

/// The rectangle around all that a node has in an atlas; others may lie in it too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NodeLayout {
    /// Of the node, or of the surface.
    pub name: String,
    /// Left and top, 0..1.
    pub uv_min: [f64; 2],
    /// Right and bottom, 0..1.
    pub uv_max: [f64; 2],
}

impl Bake<'_> {
    /// Where surfaces lie in the atlas, and what its values mean.
    #[must_use]
    pub fn layout(&self) -> Layout {
        let g = &self.scene.geometry;
        let mut nodes: BTreeMap<(u32, u32), NodeLayout> = BTreeMap::new();
        for facet in self.facets() {
            let number = g.surface_of[facet.triangle.index()];
            let surface = &g.surfaces[number as usize];
            // Nodes of glTF have numbers; elsewhere each surface is a node.
            let key = if surface.node > 0 { (0, surface.node) } else { (1, number) };
            let node = nodes.entry(key).or_insert_with(|| NodeLayout {
                name: surface.name.clone(),
                uv_min: [1.0; 2],
                uv_max: [0.0; 2],
            });
            for corner in facet.atlas {
                for (k, c) in corner.to_array().into_iter().enumerate() {
                    node.uv_min[k] = node.uv_min[k].min(c);
                    node.uv_max[k] = node.uv_max[k].max(c);
                }
            }
        }
        Layout {
            texels: self.atlas.size,
            texel_m: self.atlas.texel,
            exr: "irradiance / pi, W/(m2 sr) or cd/m2, linear; rows from the top",
            glb: "irradiance / MOZ_lightmap.intensity of the material, linear",
            nodes: nodes.into_values().collect(),
        }
    }
}
