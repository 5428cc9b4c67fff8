//! The visible fraction of a pair, weighted by the kernel:
//!
//! ```text
//! v = ∫∫ K V dA dA / ∫∫ K dA dA
//! ```
//!
//! Where no two blockers overlap, as seen from points of one polygon, the fraction of the other
//! that is hidden from each has a closed form (`closed_form`). Otherwise shadow rays tell
//! (`pair_rays`).

use super::clip::{ClipBuffers, ClippedBlocker, clip};
use super::closed_form::{OVERLAP, ViewBuffers, hidden};
use super::model::Model;
use super::pair::{Pair, Visible};
use super::pair_rays::{RayBuffers, visible_by_rays};

/// A pair with more blockers is left to rays.
const MANY: usize = 24;

/// Buffers for a pair; reused.
#[derive(Default)]
pub(super) struct PairBuffers {
    blockers: Vec<ClippedBlocker>,
    clip: ClipBuffers,
    view: ViewBuffers,
    pub rays: RayBuffers,
}

/// The visible fraction of a pair.
pub(super) fn visible(pair: &Pair<'_>, model: &Model<'_>, buffers: &mut PairBuffers) -> Visible {
    let PairBuffers { blockers, clip: clipped, view, rays } = buffers;
    blockers.clear();
    let Some(ids) = pair.blockers else { return visible_by_rays(pair, 1.0, model, rays) };
    blockers.extend(ids.iter().filter_map(|&id| clip(pair, id, model, clipped)));
    match blockers.len() {
        0 => return Visible::ALL,
        1..=MANY => {}
        _ => return visible_by_rays(pair, 1.0, model, rays),
    }
    blockers.sort_by_key(|c| c.group);
    let hidden = hidden(pair, blockers, view);
    if !hidden.all.is_finite() {
        return visible_by_rays(pair, 1.0, model, rays);
    }
    if hidden.all <= 0.0 {
        return Visible::ALL;
    }
    if hidden.gap() > OVERLAP {
        let least = (1.0 - hidden.most / hidden.all).clamp(0.0, 1.0);
        let most = (1.0 - hidden.least / hidden.all).clamp(0.0, 1.0);
        let by_rays = visible_by_rays(pair, hidden.gap(), model, rays);
        return Visible { fraction: by_rays.fraction.clamp(least, most), ..by_rays };
    }
    let fraction = (1.0 - hidden.hidden / hidden.all).clamp(0.0, 1.0);
    let error = 0.5 * hidden.spread() / f64::from(hidden.points);
    Visible { fraction, square_error: error.powi(2) }
}
