//! How a model carries its light.

/// How a model carries its light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BakeMode {
    /// What is seen, in one texture (`KHR_materials_unlit`).
    Unlit,
    /// Radiance at vertices, on a mesh that is refined where light asks for it.
    Vertex,
    /// Irradiance in a second set of texture coordinates (`MOZ_lightmap`); materials stay.
    Lightmap {
        /// Whether lamps without extent stay, as their direct light is not in it.
        keeps_lamps: bool,
    },
}
