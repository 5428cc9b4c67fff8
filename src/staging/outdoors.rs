//! The point of view of an object: three-quarter from the front and a little above.

use glam::DVec3;

use super::framing::{ASPECT, Lens, fit};
use super::model::Model;
use super::rays::{Hit, bearings, cast, horizon};
use crate::scene::{Camera, Side};

/// Vertical angle of view in degrees: a long lens, which distorts little.
const VFOV: f64 = 30.0;

/// Share of the frame that the object fills along the direction that limits it.
const FILL: f64 = 0.78;

/// How high the camera stands, in degrees above the horizon.
const ELEVATION: f64 = 22.0;

/// The same over a model that lies flat.
const ELEVATION_FLAT: f64 = 38.0;

/// A model is flat if it is lower than this share of its width.
const FLAT: f64 = 0.12;

/// How far to the side of the front the camera stands, in degrees.
const ASIDE: f64 = 32.0;

/// Bearings tried, beginning with the front.
const BEARINGS: usize = 8;

/// Rays along each side of the square through which a direction is tried.
const TRIED: usize = 32;

/// The front is looked at unless another side shows this much more.
const FAVOUR: f64 = 1.35;

/// The camera that shows an object.
pub(super) fn look(model: &Model<'_>, lens: &Lens) -> Camera {
    let up = model.up;
    let (low, high) = model.bounds;
    let (height, (right, front)) = ((high - low).dot(up.abs()), bearings(up));
    let width = (high - low).dot(right.abs()).max((high - low).dot(front.abs()));
    let elevation = if height < FLAT * width { ELEVATION_FLAT } else { ELEVATION };
    let (rise, level) = elevation.to_radians().sin_cos();
    let aside = ASIDE.to_radians().tan();
    let from = |ahead: DVec3| {
        let side = up.cross(ahead);
        (ahead + side * aside).normalize() * level + up * rise
    };
    let mut best = (0.0, from(front));
    for (k, ahead) in horizon(up, BEARINGS).enumerate() {
        let direction = from(ahead);
        let favour = if k == 0 { FAVOUR } else { 1.0 };
        let shown = favour * shown(model, direction);
        if shown > best.0 {
            best = (shown, direction);
        }
    }
    let aspect = lens.aspect.unwrap_or(ASPECT);
    fit(model.corners(), -best.1, up, lens.vfov_or(VFOV), aspect, FILL)
}

/// How much of what is met from that direction shows a side that exchanges light, fronts counting
/// more, as a share of the bounding sphere's outline.
fn shown(model: &Model<'_>, direction: DVec3) -> f64 {
    let radius = 0.5 * model.size();
    let x = direction.any_orthonormal_vector();
    let y = direction.cross(x);
    let at = |k: usize| radius * ((2 * k + 1) as f64 / TRIED as f64 - 1.0);
    let rays: Vec<(DVec3, DVec3)> = (0..TRIED * TRIED)
        .map(|k| (model.centre() + x * at(k % TRIED) + y * at(k / TRIED), direction))
        .map(|(p, d)| (p + d * (2.0 * radius), -d))
        .collect();
    let worth = |hit: &Hit| match (model.is_lit_side(hit), hit.side) {
        (true, Side::Front) => 1.0,
        (true, Side::Back) => 0.9,
        (false, _) => -0.5,
    };
    let met = cast(&model.bvh, &rays);
    met.iter().flatten().map(worth).sum::<f64>() / rays.len() as f64
}
