//! A model as it presents itself: from outside, and from points within it.

use glam::DVec3;

use super::rays::{Hit, cast, sphere};
use crate::scene::{Scene, Side};
use crate::visibility::Bvh;

/// Points are tried on a grid of so many along each axis of the bounds.
pub(super) const GRID: usize = 6;

/// Rays from each of them.
const RAYS: usize = 128;

/// Rays that look at the model from outside.
const OUTSIDE: usize = 4096;

/// A point is within the model if more than this share of its rays meet something.
const ENCLOSED: f64 = 0.6;

/// What is known of a model that is to be shown.
pub struct Model<'a> {
    pub(super) scene: &'a Scene,
    pub(super) bvh: Bvh,
    /// Unit vector upwards.
    pub(super) up: DVec3,
    /// Smallest and largest coordinates, m.
    pub(super) bounds: (DVec3, DVec3),
    /// Points within it and what their rays meet.
    pub(super) inner: Vec<Inner>,
    /// Share of fronts among what is met from outside.
    pub(super) outer_fronts: f64,
}

/// A point within a model, and what is around it.
pub(super) struct Inner {
    pub at: DVec3,
    /// Share of its rays that meet something.
    pub enclosure: f64,
    /// Its rays: direction, and what is met.
    pub seen: Vec<(DVec3, Option<Hit>)>,
}

impl<'a> Model<'a> {
    /// Looks at a model; `None` if no triangle of it blocks light.
    #[must_use]
    pub fn of(scene: &'a Scene) -> Option<Self> {
        let bounds = scene.geometry.bounds()?;
        let bvh = Bvh::new(&scene.geometry);
        let up = scene.up.normalize_or(DVec3::Y);
        let inner = inner_points(&bvh, bounds);
        let outer_fronts = outer_fronts(&bvh, bounds);
        Some(Self { scene, bvh, up, bounds, inner, outer_fronts })
    }

    /// Middle of the bounds, m.
    pub(super) fn centre(&self) -> DVec3 {
        0.5 * (self.bounds.0 + self.bounds.1)
    }

    /// Diagonal of the bounds, m.
    #[must_use]
    pub fn size(&self) -> f64 {
        (self.bounds.1 - self.bounds.0).length()
    }

    /// Positions of the solid triangles' corners.
    pub(super) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.bvh.ids().iter().flat_map(|&t| self.scene.geometry.corners(t))
    }

    /// The points within that lie in no solid body; all points if each lies in one.
    pub(super) fn free(&self) -> impl Iterator<Item = &Inner> {
        let any = self.inner.iter().any(Inner::is_free);
        self.inner.iter().filter(move |p| !any || p.is_free())
    }

    /// Whether what was hit shows a side that exchanges light.
    pub(super) fn is_lit_side(&self, hit: &Hit) -> bool {
        self.scene.geometry.exchanges(hit.triangle, hit.side)
    }
}

impl Inner {
    /// What its rays meet.
    pub fn met(&self) -> impl Iterator<Item = &Hit> {
        self.seen.iter().filter_map(|s| s.1.as_ref())
    }

    /// Whether it lies in no solid body: it meets some fronts.
    pub fn is_free(&self) -> bool {
        /// Below this share of fronts a point lies within a solid body.
        const SOLID: f64 = 0.03;
        self.fronts() > SOLID
    }

    /// Share of fronts among what is met.
    pub fn fronts(&self) -> f64 {
        let fronts = self.met().filter(|h| h.side == Side::Front).count();
        fronts as f64 / self.met().count().max(1) as f64
    }
}

/// The points of a grid that are within the model.
fn inner_points(bvh: &Bvh, (low, high): (DVec3, DVec3)) -> Vec<Inner> {
    let at = |k: usize| (k as f64 + 0.5) / GRID as f64;
    let points: Vec<DVec3> = (0..GRID.pow(3))
        .map(|k| DVec3::new(at(k % GRID), at(k / GRID % GRID), at(k / GRID / GRID)))
        .map(|share| low + (high - low) * share)
        .collect();
    let around = look_around(bvh, &points);
    around.into_iter().filter(|p| p.enclosure > ENCLOSED).collect()
}

/// What rays from these points meet.
pub(super) fn look_around(bvh: &Bvh, points: &[DVec3]) -> Vec<Inner> {
    let rays: Vec<(DVec3, DVec3)> =
        points.iter().flat_map(|&p| sphere(RAYS).map(move |d| (p, d))).collect();
    let met = cast(bvh, &rays);
    let around = rays.chunks(RAYS).zip(met.chunks(RAYS));
    let inner = points.iter().zip(around).map(|(&at, (rays, met))| Inner {
        at,
        enclosure: met.iter().flatten().count() as f64 / RAYS as f64,
        seen: rays.iter().map(|r| r.1).zip(met.iter().copied()).collect(),
    });
    inner.collect()
}

/// Share of fronts among what parallel rays from all sides meet first.
fn outer_fronts(bvh: &Bvh, (low, high): (DVec3, DVec3)) -> f64 {
    let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    // Fractions of the plastic number's powers fill the square evenly (Roberts 2018).
    const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let rays: Vec<(DVec3, DVec3)> = sphere(OUTSIDE)
        .enumerate()
        .map(|(k, d)| {
            let [u, v] = STEP.map(|s| (s * k as f64).fract() * 2.0 - 1.0);
            let x = d.any_orthonormal_vector();
            (centre + radius * (u * x + v * d.cross(x) - 2.0 * d), d)
        })
        .collect();
    let met = cast(bvh, &rays);
    let hits = met.iter().flatten().count().max(1);
    met.iter().flatten().filter(|h| h.side == Side::Front).count() as f64 / hits as f64
}
