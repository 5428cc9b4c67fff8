//! The visible fraction of a pair, weighted by the kernel:
//!
//! ```text
//! v = ∫∫ K V dA dA / ∫∫ K dA dA
//! ```
//!
//! From points of one polygon, what blockers hide of the other has a closed form (`closed_form`).
//! Where there are very many of them, shadow rays tell (`pair_rays`).

use super::clip::{ClipBuffers, ClippedBlocker, Hull, clip};
use super::closed_form::{ViewBuffers, hidden};
use super::culling::Region;
use super::model::Model;
use super::pair::{Pair, Part, Visible};
use super::pair_rays::{RayBuffers, visible_by_rays};

/// A pair with more blockers is left to rays.
const MANY: usize = 64;

/// Lists of no more blockers than this are gone through one by one.
const LISTED: usize = 12;

/// What is seen less than this fraction of what a pair may err by, within bounds, is not seen:
/// where blockers meet and where they are cut off along the horizon, rounding leaves slits.
const SLIT: f64 = 0.5;
const LEAST_SLIT: f64 = 1e-4;
const MOST_SLIT: f64 = 1e-3;

/// Planes about a pair may cut off this fraction of the distance at which blockers touch.
const HULL: f64 = 1e-3;

/// Fractions that are nothing in single precision.
const NOISE: f64 = 2e-6;

/// Where points are less sure than so many times what the fraction may err by, rays tell.
const UNSURE: f64 = 2.0;

/// Rays err by this at most, about.
const BY_RAYS: f64 = 2e-3;

/// Buffers for a pair; reused.
#[derive(Default)]
pub(super) struct PairBuffers {
    blockers: Vec<ClippedBlocker>,
    hull: Hull,
    region: Region,
    clip: ClipBuffers,
    view: ViewBuffers,
    pub rays: RayBuffers,
    pub parts: Vec<Part>,
}

/// The visible fraction of a pair.
pub(super) fn visible(pair: &Pair<'_>, model: &Model<'_>, buffers: &mut PairBuffers) -> Visible {
    let PairBuffers { blockers, hull, region, clip: clipped, view, rays, .. } = buffers;
    blockers.clear();
    hull.about(&pair.polygons, HULL * model.touching);
    let mut take = |id| blockers.extend(clip(pair, id, hull, model, clipped));
    match pair.blockers {
        Some(ids) if ids.len() <= LISTED => ids.iter().for_each(|&id| take(id)),
        _ => {
            hull.set(region, pair, model.bvh);
            let culling = &model.culling;
            culling.between(region, |some| culling.members(some).for_each(|(_, q)| take(q)));
        }
    }
    match blockers.len() {
        0 => return Visible::ALL,
        1..=MANY => {}
        _ => return visible_by_rays(pair, model, rays),
    }
    let hidden = hidden(pair, blockers, (&model.blockers, model.touching), view);
    if !hidden.all.is_finite() {
        return visible_by_rays(pair, model, rays);
    }
    if hidden.all <= 0.0 {
        return Visible::ALL;
    }
    let seen = 1.0 - hidden.hidden / hidden.all;
    if seen > 1.0 - NOISE {
        return Visible::ALL;
    }
    let slit = (SLIT * pair.tolerance).clamp(LEAST_SLIT, MOST_SLIT);
    let mut found =
        Visible { fraction: seen, square_error: hidden.square_error / (hidden.all * hidden.all) };
    if seen < slit {
        found = Visible { fraction: 0.0, square_error: found.square_error + seen * seen };
    }
    if found.square_error <= (UNSURE * pair.tolerance.max(BY_RAYS)).powi(2) {
        return found;
    }
    visible_by_rays(pair, model, rays)
}
