//! The triangles that belong to patches where something stands on the surface.

use std::collections::HashMap;

use glam::DVec2;

use super::point::PatchId;

/// The fragments of patches that are not just their cells. One that has no area left stays its
/// cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Fragments(pub(super) HashMap<PatchId, Vec<Fragment>>);

/// A triangle that belongs to a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment {
    /// Corners in the coordinates of the source triangle, in its winding.
    pub uv: [DVec2; 3],
    /// Sum of the areas of the fragments up to this one, in units of twice that of the source
    /// triangle.
    pub up_to: f64,
}
