//! What gathering needs of a lit scene.

use glam::Vec3;

use super::options::{FEWEST_RAYS, GatherOptions, MOST_RAYS, SETS};
use super::surfaces::Surfaces;
use crate::direct::{self, Analytic, DirectOptions, Emitters};
use crate::engines::sampling::Table;
use crate::patches::{Cell, PatchId, Patches, SurfacePoint, side_index};
use crate::reconstruct::Field;
use crate::scene::{Geometry, Rgb, Scene, Side, TriangleId, luminance};
use crate::solution::Solution;
use crate::uncertainty::Uncertainty;
use crate::visibility::Bvh;

/// Rays begin this far along the normal, in radii of the scene: ten times its rounding, so that a
/// point on a surface, given to six digits, is not in the shadow of that surface or its neighbours.
/// What is thinner than this over a surface does not shade it.
pub const CLEARANCE: f64 = 1e-5;

/// Fraction of the mean irradiance of lit patches below which a place that sees backs is inside a
/// solid that reflects on both sides; the field lets a little in at contacts.
const DARK: f64 = 1e-3;

/// Sets the sequences of points apart from those of rows.
pub(super) const GATHER: u32 = 0x6a74_0000;

/// Measures irradiance at points of a lit scene.
pub struct Gatherer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) patches: &'a Patches,
    pub(super) field: &'a Field<'a>,
    pub(super) bvh: &'a Bvh,
    pub(super) emitters: Emitters<'a>,
    surfaces: Surfaces,
    /// An estimate of what each analytic emitter reflects; of all other sides nothing.
    pub(super) reflected: Vec<Rgb>,
    /// Of each solid triangle: its front's unit normal, whether it exchanges light on its front and
    /// back, and whether it emits.
    pub(super) solids: Vec<Solid>,
    /// Of each patch, from its centre to its farthest corner, m.
    pub(super) radii: Vec<f32>,
    pub(super) table: Table,
    /// Half of what two halves differ in at each patch, and what its size blurs.
    pub(super) doubt: Vec<(Rgb, Rgb)>,
    /// Irradiance below this is darkness.
    pub(super) dark: f64,
    pub(super) seed: u32,
}

/// What rays ask of a triangle that they meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solid {
    /// Unit normal of its front.
    pub normal: Vec3,
    /// Of front and back: whether it exchanges light.
    pub exchanges: [bool; 2],
    /// Whether a side of it emits.
    pub emits: bool,
    pub id: TriangleId,
}

impl Solid {
    fn of(scene: &Scene, id: TriangleId) -> Self {
        Self {
            normal: scene.geometry.normal(id, Side::Front).as_vec3(),
            exchanges: Side::BOTH.map(|s| scene.geometry.exchanges(id, s)),
            emits: Side::BOTH.iter().any(|&s| scene.optics.emission(id, s) != Rgb::ZERO),
            id,
        }
    }
}

impl<'a> Gatherer<'a> {
    /// For a solution of `scene`: `field` is its [`Solution::field`], `bvh` the hierarchy of the
    /// same geometry.
    #[must_use]
    pub fn new(
        scene: &'a Scene,
        solution: &'a Solution,
        field: &'a Field<'a>,
        bvh: &'a Bvh,
        options: GatherOptions,
    ) -> Self {
        let rays = options.samples.clamp(FEWEST_RAYS, MOST_RAYS);
        let seed = options.seed;
        let table = Table::new(rays.div_ceil(SETS), GATHER ^ seed, SETS);
        let shadow = options.shadow.div_ceil(SETS / 2);
        let direct = DirectOptions { analytic: Analytic::Suitable, shadow, seed };
        let patches = &solution.patches;
        let reflected = reflected_by_emitters(scene, patches, field);
        let emitters =
            Emitters::new(&scene.geometry, &scene.optics, patches, bvh, direct, |s| reflected[s]);
        let blurred = Uncertainty::of(&scene.geometry, solution, field).refinement;
        let half = |i: usize| match &solution.halves {
            Some([a, b]) => (a[i] - b[i]) * 0.5,
            None => Rgb::ZERO,
        };
        let doubt = blurred.into_iter().enumerate().map(|(i, b)| (half(i), b)).collect();
        let lit: Vec<Rgb> = patches
            .ids()
            .filter(|i| solution.usable[i.index()])
            .map(|i| field.of_patches()[i.index()])
            .collect();
        let mean = luminance(lit.iter().sum::<Rgb>() / lit.len().max(1) as f64);
        Self {
            scene,
            patches,
            field,
            bvh,
            emitters,
            surfaces: Surfaces::new(scene),
            solids: bvh.ids().iter().map(|&t| Solid::of(scene, t)).collect(),
            reflected,
            radii: patches.ids().map(|id| radius(&scene.geometry, patches, id)).collect(),
            table,
            doubt,
            dark: DARK * mean,
            seed,
        }
    }

    /// Textures, decoded.
    pub(crate) fn surfaces(&self) -> &Surfaces {
        &self.surfaces
    }

    /// Reflectance at a point, textures included.
    pub(super) fn reflectance(&self, p: SurfacePoint) -> Rgb {
        self.surfaces.reflectance(self.scene, p)
    }

    /// Sets rays of pictures apart from those of points.
    pub(super) fn seed(&self) -> u32 {
        GATHER ^ self.seed
    }

    /// Rays a point.
    #[must_use]
    pub fn samples(&self) -> usize {
        SETS * self.table.points()
    }
}

/// From the centre of a patch to its farthest corner, m.
fn radius(geometry: &Geometry, patches: &Patches, id: PatchId) -> f32 {
    let centre = patches.center(id).position(geometry);
    let corners = patches.pieces(id).flat_map(|cell| cell.corners(geometry));
    corners.map(|c| c.distance_squared(centre)).fold(0.0, f64::max).sqrt() as f32
}

/// Mean radiosity that each emitting side reflects, as far as it is like a lamp.
fn reflected_by_emitters(scene: &Scene, patches: &Patches, field: &Field<'_>) -> Vec<Rgb> {
    let mut sums = vec![(Rgb::ZERO, 0.0); 2 * scene.geometry.len()];
    for i in patches.ids() {
        let Cell { triangle, side, .. } = patches.cell(i);
        if scene.optics.emission(triangle, side) != Rgb::ZERO {
            let (sum, area) = &mut sums[side_index(triangle, side)];
            let rho = scene.optics.reflectance[triangle.index()];
            *sum += rho * field.of_patches()[i.index()] * patches.own_area(i);
            *area += patches.own_area(i);
        }
    }
    for t in scene.geometry.ids() {
        for side in Side::BOTH {
            let (sum, area) = &mut sums[side_index(t, side)];
            if *area > 0.0 {
                *sum = direct::like_a_lamp(*sum / *area, scene.optics.emission(t, side));
            }
        }
    }
    sums.into_iter().map(|s| s.0).collect()
}
