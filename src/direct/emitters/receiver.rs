//! Where direct light is wanted: all over a patch, or at a point.

use glam::{DVec2, DVec3, Vec3};

use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::scene::Geometry;
use crate::visibility::Bvh;

/// A receiver that sees an emitter, head on, under a larger form factor leaves it to the rays.
const LARGEST: f32 = 0.15;

/// The same of a point, for which Lambert's formula is exact: it leaves to the rays those emitters
/// of which they find much.
const LARGEST_OF_POINT: f32 = 0.3;

/// Points that stand for a patch.
const POINTS: usize = 4;

/// Where direct light is wanted: all over a patch, or at a point.
#[derive(Debug, Clone)]
pub struct Receiver {
    /// Points that the unoccluded irradiance is averaged over, and their normals.
    points: [(DVec3, DVec3); POINTS],
    count: u8,
    /// Centre and mean normal.
    pub(super) middle: (DVec3, DVec3),
    pub(super) centre: Vec3,
    pub(super) normal: Vec3,
    /// Sine of the largest angle between its normals.
    pub(super) bend: f32,
    /// Farthest point from the centre, and the root of the area.
    pub(super) radius: f32,
    pub(super) size: f32,
    /// Emitters seen under a larger form factor, head on, are left to the rays.
    pub(super) largest: f32,
    /// Tells receivers apart.
    pub(super) seed: u64,
}

impl Receiver {
    /// Points that the unoccluded irradiance is averaged over, and their normals.
    pub(super) fn points(&self) -> &[(DVec3, DVec3)] {
        &self.points[..usize::from(self.count)]
    }

    /// What tells it apart from others.
    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// The same, but leaving to the rays what it sees, head on, under a larger form factor than
    /// that.
    #[must_use]
    pub(crate) fn with_largest(self, largest: f32) -> Self {
        Self { largest, ..self }
    }
}

/// A point of a receiver, its normal, and the solid triangle that it lies on.
pub type ReceiverPoint = (DVec3, DVec3, Option<u32>);

impl Receiver {
    /// A patch.
    pub(super) fn of_patch(g: &Geometry, bvh: &Bvh, patches: &Patches, id: PatchId) -> Self {
        /// Sine of twice the largest angle of a cluster's normals from their mean.
        const BEND: f32 = 0.5;
        let cell = patches.cell(id);
        let points =
            receiving_points(patches, id).map(|p| (p.position(g), g.normal(p.triangle, p.side)));
        let centre = points.iter().map(|p| p.0).sum::<DVec3>() / POINTS as f64;
        let corners = patches.pieces(id).flat_map(|c| c.corners(g));
        let radius = corners.map(|c| (c - centre).length()).fold(0.0, f64::max);
        let scale = bvh.scale();
        let normal = points.iter().map(|p| p.1).sum::<DVec3>().normalize_or_zero();
        Self {
            points,
            count: POINTS as u8,
            middle: (centre, normal),
            centre: bvh.local(centre),
            normal: g.normal(cell.triangle, cell.side).as_vec3(),
            bend: if patches.is_cluster(id) { BEND } else { 0.0 },
            radius: (radius / scale) as f32,
            size: (patches.area(id).sqrt() / scale) as f32,
            largest: LARGEST,
            seed: u64::from(id.0),
        }
    }

    /// A point; `seed` tells points apart.
    pub(super) fn of_point(bvh: &Bvh, at: DVec3, normal: DVec3, seed: u64) -> Self {
        Self {
            points: [(at, normal); POINTS],
            count: 1,
            middle: (at, normal),
            centre: bvh.local(at),
            normal: normal.as_vec3(),
            bend: 0.0,
            radius: 0.0,
            size: 0.0,
            largest: LARGEST_OF_POINT,
            seed: seed ^ 1 << 63,
        }
    }
}

/// Points that stand for a patch: the centroids of its four quarters, or some of a cluster.
fn receiving_points(patches: &Patches, id: PatchId) -> [SurfacePoint; POINTS] {
    if patches.is_cluster(id) {
        let spread = [0.125, 0.375, 0.625, 0.875];
        return spread.map(|x| patches.sample(id, DVec2::new(x, (7.0 * x).fract())));
    }
    let third = DVec3::splat(1.0 / 3.0);
    patches.cell(id).children().map(|quarter| quarter.point(third))
}
