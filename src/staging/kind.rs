//! Object or room: something to look at, or something to stand in.

use glam::DVec3;

use super::model::{GRID, Inner, Model};
use super::rays::{Hit, bearings, cast};

/// What a model is to be shown as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something to be looked at from outside.
    Object,
    /// Something to be looked at from within.
    Room,
}

/// Fewer points within a model than this, of 216, are a nook of it.
const FEWEST: usize = 11;

/// A room is around the points within it by more than this share; a corner of one is not.
const AROUND: f64 = 0.72;

/// A point from which more than this share of rays meets something is in a closed room; less goes
/// out at windows.
const CLOSED: f64 = 0.92;

/// The same of a room without windows.
const SEALED: f64 = 0.985;

/// What shows fronts to the outside is a room only if it is one for the most part: above this share
/// of its bounds lies within it, and is free. Solid bodies that pass through each other are not.
const SPACIOUS: f64 = 0.4;

/// Behind at most this share of what is seen from within a sealed body there is more of it: nothing
/// stands in it, and faces that look inwards are mistakes.
const EMPTY: f64 = 0.02;

/// Walls, floor and ceiling make up at least this share of what is seen in a room.
const BUILT: f64 = 0.45;

/// The same of a room that shows its fronts to the outside too: a house, a box with things in it.
const STRICTLY_BUILT: f64 = 0.75;

/// Behind at most this share of what is seen from within a hollow body there is more of it: it is
/// round or nearly so, like a sphere.
const SIMPLE: f64 = 0.05;

/// Behind at least this share of what is seen from within a furnished box there is more.
const FURNISHED: f64 = 0.1;

impl Model<'_> {
    /// Decides by what is met from outside and from within.
    ///
    /// A room shows its backs to the outside and its fronts to the inside, and is built of walls,
    /// or hollow and of one piece. What shows fronts to the outside is a room only if it is closed,
    /// built of walls that are at right angles, and holds other surfaces: a house, or a furnished
    /// box whose faces were exported outwards. All else is an object.
    #[must_use]
    pub fn kind(&self) -> Kind {
        let within: Vec<&Inner> = self.inner.iter().filter(|p| p.is_free()).collect();
        if within.len() < FEWEST {
            return Kind::Object;
        }
        let mean = |what: &dyn Fn(&Inner) -> f64| {
            within.iter().map(|p| what(p)).sum::<f64>() / within.len() as f64
        };
        let (built, behind) = (built_share(self, &within), share_with_more_behind(self, &within));
        let inwards = self.outer_fronts < 0.5 && mean(&Inner::fronts) > 0.5;
        let glows = within.iter().any(|p| sees_emission(self, p));
        let enclosure = mean(&|p| p.enclosure);
        let spacious = within.len() as f64 > SPACIOUS * (GRID * GRID * GRID) as f64;
        let is_room = if enclosure < AROUND {
            false
        } else if inwards {
            built > BUILT || behind < SIMPLE
        } else if spacious && enclosure > SEALED {
            built > BUILT && behind > EMPTY
        } else {
            spacious
                && built > STRICTLY_BUILT
                && ((enclosure > CLOSED && behind > FURNISHED) || glows)
        };
        if is_room { Kind::Room } else { Kind::Object }
    }
}

fn sees_emission(model: &Model<'_>, point: &Inner) -> bool {
    let emits = |h: &Hit| model.scene.optics.emission(h.triangle, h.side) != DVec3::ZERO;
    point.met().any(emits)
}

/// Share of horizontal surfaces, and of vertical ones at right angles to each other, in what is
/// seen from within.
fn built_share(model: &Model<'_>, within: &[&Inner]) -> f64 {
    /// Bearings of a quarter turn are counted in bins of 5 degrees.
    const BINS: usize = 18;
    let (right, front) = bearings(model.up);
    let (mut total, mut level, mut bearing) = (0, 0, [0; BINS]);
    for hit in within.iter().flat_map(|p| p.met()) {
        let normal = model.scene.geometry.normal(hit.triangle, hit.side);
        let upwards = normal.dot(model.up).abs();
        total += 1;
        level += usize::from(upwards > 0.97);
        if upwards < 0.25 {
            let angle = normal.dot(front).atan2(normal.dot(right)).to_degrees().rem_euclid(90.0);
            // Bins are centred on multiples of 5 degrees, so that the axes fall into one.
            bearing[((angle / 5.0).round() as usize) % BINS] += 1;
        }
    }
    let most = (0..BINS).map(|b| bearing[b] + bearing[(b + 1) % BINS]).max().unwrap_or(0);
    (level + most) as f64 / total.max(1) as f64
}

/// Share of what is seen from within behind which a ray meets more of the model.
fn share_with_more_behind(model: &Model<'_>, within: &[&Inner]) -> f64 {
    // Past the surface itself, and what coincides with it but for rounding.
    let past = 1e-4 * model.size();
    let rays: Vec<(DVec3, DVec3)> = within
        .iter()
        .flat_map(|p| p.seen.iter().filter_map(|(d, h)| Some((p.at, *d, h.as_ref()?.distance))))
        .map(|(at, d, distance)| (at + d * (distance + past), d))
        .collect();
    let met = cast(&model.bvh, &rays);
    met.iter().flatten().count() as f64 / rays.len().max(1) as f64
}
