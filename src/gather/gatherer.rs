//! What gathering needs of a lit scene.

use glam::Vec3;

use super::options::{FEWEST_RAYS, GatherOptions, MOST_RAYS, SETS};
use super::outlook::Outlook;
use super::surfaces::Surfaces;
use crate::direct::{self, Analytic, DirectOptions, Emitters};
use crate::engines::sampling::Table;
use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::progress::{Cancelled, Progress, Silent};
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

/// Of the rays of a patch that is plain this share meets something near by at most: less than under
/// things or between them, more than beside a wall.
const MOST_NEAR: f32 = 0.3;

/// What the size of a plain patch blurs is this share of its light at most.
const MOST_BLURRED: f64 = 0.05;

/// Looks at a point, each of four times the rays of the one before, for an error asked for.
const LOOKS: usize = 4;

/// Turns after which rays that bring little are thinned out.
const TURNS: usize = 3;
const TURNS_OF_PICTURES: usize = 1;

/// Sets the sequences of points apart from those of rows.
pub(super) const GATHER: u32 = 0x6a74_0000;

/// Measures irradiance at points of a lit scene.
pub struct Gatherer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) patches: &'a Patches,
    pub(super) solution: &'a Solution,
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
    /// What rays from all over each patch meet; empty where pictures are not made.
    pub(super) outlooks: Vec<Outlook>,
    /// Rays of points: the first, and four times as many again and again for an error asked for.
    pub(super) tables: Vec<Table>,
    /// Half of what two halves differ in at each patch, and what its size blurs.
    pub(super) doubt: Vec<(Rgb, Rgb)>,
    pub(super) options: GatherOptions,
    /// Irradiance below this is darkness.
    pub(super) dark: f64,
    pub(super) seed: u32,
    /// Of each patch: hits nearer than this, m, are gathered once more, those beyond twice as many
    /// far.
    pub(super) near: Vec<f32>,
    /// Of rays that land near by again and again all go on for so many turns, and some after them.
    pub(super) turns: usize,
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
        let me = Self::blind(scene, solution, field, bvh, options);
        let outlooks = me.outlooks(&Silent).unwrap_or_default();
        me.seeing(outlooks)
    }

    /// [`new`](Self::new), which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn new_heard(
        scene: &'a Scene,
        solution: &'a Solution,
        field: &'a Field<'a>,
        bvh: &'a Bvh,
        options: GatherOptions,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let me = Self::blind(scene, solution, field, bvh, options);
        let outlooks = me.outlooks(progress)?;
        Ok(me.seeing(outlooks))
    }

    /// One that has not looked around from patches yet.
    fn blind(
        scene: &'a Scene,
        solution: &'a Solution,
        field: &'a Field<'a>,
        bvh: &'a Bvh,
        options: GatherOptions,
    ) -> Self {
        let rays = options.samples.clamp(FEWEST_RAYS, MOST_RAYS);
        let seed = options.seed;
        let looks = if options.error.is_some() && !options.of_pictures { LOOKS } else { 1 };
        let tables = (0..looks)
            .map(|k| rays << (2 * k))
            .take_while(|&all| all == rays || all <= MOST_RAYS)
            .map(|rays| Table::new(rays.div_ceil(SETS), GATHER ^ seed, SETS))
            .collect();
        let shadow = options.shadow();
        let direct = DirectOptions { analytic: Analytic::Suitable, shadow, seed };
        let patches = &solution.patches;
        let reflected = direct::reflected_by_emitters(scene, patches, &solution.irradiance);
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
        let radii = patches.ids().map(|id| radius(&scene.geometry, patches, id)).collect();
        Self {
            scene,
            patches,
            solution,
            field,
            bvh,
            emitters,
            surfaces: Surfaces::new(scene),
            solids: bvh.ids().iter().map(|&t| Solid::of(scene, t)).collect(),
            reflected,
            radii,
            outlooks: Vec::new(),
            tables,
            options,
            doubt,
            dark: DARK * mean,
            seed,
            near: Vec::new(),
            turns: if options.of_pictures { TURNS_OF_PICTURES } else { TURNS },
        }
    }

    /// The same with what rays from each patch meet, or nothing of that.
    fn seeing(mut self, outlooks: Vec<Outlook>) -> Self {
        self.outlooks = outlooks;
        self.near = self.patches.ids().map(|id| self.near(id, &self.options)).collect();
        self
    }

    /// Hits of a patch nearer than this, m, are gathered once more.
    fn near(&self, id: PatchId, options: &GatherOptions) -> f32 {
        let near = options.near as f32 * self.radii[id.index()];
        let plain = self.outlooks.get(id.index()).is_some_and(|o| {
            let light = luminance(self.solution.irradiance[id.index()]);
            let blurred = luminance(self.doubt[id.index()].1);
            let is_open = o.near <= MOST_NEAR && !self.patches.is_fragmented(id);
            is_open && blurred <= MOST_BLURRED * light
        });
        if plain { 0.0 } else { near }
    }

    /// Textures, decoded.
    pub(crate) fn surfaces(&self) -> &Surfaces {
        &self.surfaces
    }

    /// Reflectance at a point, textures included.
    pub(super) fn reflectance(&self, p: SurfacePoint) -> Rgb {
        self.surfaces.reflectance(self.scene, p)
    }

    /// Mean irradiance of lit patches, in luminance, W/m² or lx.
    pub(crate) fn mean(&self) -> f64 {
        self.dark / DARK
    }

    /// Noise of reflected light in pictures, a standard error as a share of all light.
    pub(crate) fn noise(&self) -> f64 {
        self.options.noise()
    }

    /// Sets rays of pictures apart from those of points.
    pub(super) fn seed(&self) -> u32 {
        GATHER ^ self.seed
    }

    /// Rays a point.
    #[must_use]
    pub fn samples(&self) -> usize {
        SETS * self.tables[0].points()
    }
}

/// From the centre of a patch to its farthest corner, m.
fn radius(geometry: &Geometry, patches: &Patches, id: PatchId) -> f32 {
    let centre = patches.center(id).position(geometry);
    let corners = patches.pieces(id).flat_map(|cell| cell.corners(geometry));
    corners.map(|c| c.distance_squared(centre)).fold(0.0, f64::max).sqrt() as f32
}
