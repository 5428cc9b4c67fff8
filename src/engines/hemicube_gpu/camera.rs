//! Where hemicubes stand and which way their five faces look.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, TriangleId};
use crate::visibility::{Frame, turn};

/// Distance of the near plane over the scene's radius: near enough for contacts, and well above the
/// rounding of single precision.
const NEAR: f64 = 1.0 / 262_144.0;

/// One face of one hemicube: `Camera` of the shaders.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Camera {
    right: [f32; 4],
    up: [f32; 4],
    forward: [f32; 4],
    eye: [f32; 4],
}

/// The hemicubes of all patches, as cameras.
#[derive(Debug)]
pub(super) struct Cameras<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) patches: &'a Patches,
    /// Origin of single-precision coordinates.
    pub(super) centre: DVec3,
    /// Distance of the near plane in metres.
    near: f32,
}

impl<'a> Cameras<'a> {
    pub(super) fn new(geometry: &'a Geometry, patches: &'a Patches) -> Self {
        let (low, high) = geometry.bounds().unwrap_or_default();
        let radius = (0.5 * (high - low).length()).max(f64::from(f32::MIN_POSITIVE) / NEAR);
        Self { geometry, patches, centre: 0.5 * (low + high), near: (radius * NEAR) as f32 }
    }

    /// The source triangle that a hemicube stands on.
    pub(super) fn own(&self, id: PatchId) -> TriangleId {
        self.patches.cell(id).triangle
    }

    /// The five cameras of a patch's hemicube.
    pub(super) fn of(&self, id: PatchId) -> [Camera; 5] {
        let cell = self.patches.cell(id);
        let normal = self.geometry.normal(cell.triangle, cell.side);
        let frame = Frame::on_surface(self.patches.origin(id).position(self.geometry), normal);
        let eye = (frame.origin - self.centre).as_vec3().extend(self.near).to_array();
        let axes = frame.axes.map(|a| a.as_vec3());
        let turns = [turn::<0>, turn::<1>, turn::<2>, turn::<3>, turn::<4>];
        std::array::from_fn(|face| {
            // What each axis of the frame contributes to right, up and forward.
            let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(turns[face]);
            let axis = |k: usize| axes[0] * x[k] + axes[1] * y[k] + axes[2] * z[k];
            let (up, forward) = if face == 0 { (1.0, 0.0) } else { (2.0, -1.0) };
            Camera {
                right: axis(0).extend(0.0).to_array(),
                up: axis(1).extend(up).to_array(),
                forward: axis(2).extend(forward).to_array(),
                eye,
            }
        })
    }
}
