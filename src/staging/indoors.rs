//! The point of view of a room: at eye height, where the longest view is.

use glam::DVec3;

use super::framing::{ASPECT, Lens, camera, fit};
use super::model::{Inner, Model};
use super::rays::{Hit, cast, horizon};
use crate::scene::Camera;

/// Eyes are this high above the floor of a room of ordinary height, in metres.
const EYE_HEIGHT: f64 = 1.6;

/// Rooms of these heights have an eye height, in metres.
const ROOM_HEIGHTS: std::ops::Range<f64> = 2.0..12.0;

/// In others, eyes are at this share of the height.
const EYE_SHARE: f64 = 0.55;

/// Vertical angle of view within a room, and before its open side, in degrees.
const VFOV: f64 = 60.0;
const VFOV_BEFORE: f64 = 40.0;

/// The camera looks down by this angle in degrees: floors and furniture show more than ceilings.
const DOWN: f64 = 7.0;

/// Directions tried.
const DIRECTIONS: usize = 16;

/// Rays across and down the frame of a view that is tried.
const FRAME: [usize; 2] = [16, 12];

/// Share of the way to the wall behind that the camera stands back.
const BACK: f64 = 0.9;

/// What is nearer than this multiple of the eye height stands right before the lens.
const LENS: f64 = 0.5;

/// What one sees through openings is as good as this share of the model's size, up to so much of
/// the frame.
const SKY: f64 = 0.5;
const MOST_SKY: f64 = 0.3;

/// A side is open if more than this share of the rays straight towards it meets nothing; things in
/// the room are in the way of the rest.
const OPEN: f64 = 0.6;

/// A room that is deeper than this multiple of its width is a corridor, and seen from within.
const DEEPEST: f64 = 2.5;

/// The camera that shows a room.
pub(super) fn look(model: &Model<'_>, lens: &Lens) -> Camera {
    if let Some(out) = open_side(model) {
        return look_in(model, out, lens);
    }
    let aspect = lens.aspect.unwrap_or(ASPECT);
    let stands = stands(model);
    let views = stands.iter().flat_map(|s| horizon(model.up, DIRECTIONS).map(move |d| (s, d)));
    let mut best: Option<(f64, Camera)> = None;
    for (stand, forward) in views {
        let view = step_back(model, stand, forward, lens.vfov_or(VFOV));
        let worth = worth(model, &view, aspect, stand.height);
        if best.as_ref().is_none_or(|b| worth > b.0) {
            best = Some((worth, view));
        }
    }
    let found = best.map(|(_, c)| Camera {
        forward: (c.forward - model.up * DOWN.to_radians().tan()).normalize(),
        ..c
    });
    found.unwrap_or_else(|| fit(model.corners(), DVec3::Z, model.up, 1.0, aspect, 1.0))
}

/// The camera before the open side of a room; a picture of any shape takes that of the side.
fn look_in(model: &Model<'_>, out: DVec3, lens: &Lens) -> Camera {
    let size = model.bounds.1 - model.bounds.0;
    let across = size.dot(out.cross(model.up).abs()) / size.dot(model.up.abs());
    let aspect = lens.aspect.unwrap_or(across.clamp(0.75, 2.0));
    let vfov = lens.vfov_or(VFOV_BEFORE);
    let camera = fit(model.corners(), -out, model.up, vfov, aspect, 0.98);
    Camera { aspect: Some(aspect), ..camera }
}

/// A place where one can stand.
struct Stand {
    /// Where the eyes are, m.
    eye: DVec3,
    /// How high they are above the floor, m.
    height: f64,
}

/// The horizontal direction out of the room through a side that is open, if there is one: from
/// nearly everywhere within, one looks straight out there.
fn open_side(model: &Model<'_>) -> Option<DVec3> {
    let size = model.bounds.1 - model.bounds.0;
    let shallow = |out: &DVec3| {
        let across = size.dot(out.cross(model.up).abs()).max(size.dot(model.up.abs()));
        size.dot(out.abs()) < DEEPEST * across
    };
    let missed = |out: DVec3| {
        let rays: Vec<_> = model.free().map(|p| (p.at, out)).collect();
        let met = cast(&model.bvh, &rays);
        met.iter().filter(|h| h.is_none()).count() as f64 / rays.len().max(1) as f64
    };
    let outs = horizon(model.up, DIRECTIONS).filter(shallow);
    let shares = outs.map(|out| (missed(out), out));
    // Of equals the first is taken, which is nearest to the front.
    let best = shares.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    (best.0 > OPEN).then_some(best.1)
}

/// Places to stand: under and over the points within, at eye height.
fn stands(model: &Model<'_>) -> Vec<Stand> {
    let up = model.up;
    let level = |p: &Inner| {
        let heights = || p.seen.iter().filter_map(|(d, h)| Some(d.dot(up) * h.as_ref()?.distance));
        let floor = heights().fold(0.0, f64::min);
        let ceiling = heights().fold(0.0, f64::max);
        let room = ceiling - floor;
        let height = if ROOM_HEIGHTS.contains(&room) { EYE_HEIGHT } else { EYE_SHARE * room };
        Stand { eye: p.at + up * (floor + height), height }
    };
    let mut stands: Vec<Stand> = model.free().map(level).collect();
    if stands.is_empty() {
        let height = 0.5 * (model.bounds.1 - model.bounds.0).dot(up.abs());
        stands.push(Stand { eye: model.centre(), height });
    }
    // Points above each other in one room stand at the same place.
    let near = 1e-3 * model.size();
    stands.sort_by(|a, b| {
        a.eye.to_array().partial_cmp(&b.eye.to_array()).unwrap_or(std::cmp::Ordering::Equal)
    });
    stands.dedup_by(|a, b| (a.eye - b.eye).length() < near);
    stands
}

/// The view from as far back as the room allows.
fn step_back(model: &Model<'_>, stand: &Stand, forward: DVec3, vfov: f64) -> Camera {
    let behind = model.bvh.see(stand.eye, -forward, None).map_or(0.0, |m| m.distance);
    let eye = stand.eye - forward * (BACK * behind);
    Camera { eye, forward, vfov, ..camera(model.up) }
}

/// What a view is worth: how far one sees, and less where much of the frame shows backs, or what
/// stands right before the lens.
fn worth(model: &Model<'_>, view: &Camera, aspect: f64, height: f64) -> f64 {
    let right = view.forward.cross(model.up);
    let edge = (0.5 * view.vfov).tan();
    let [across, down] = FRAME;
    let at = |k: usize, n: usize| (2 * k + 1) as f64 / n as f64 - 1.0;
    let places: Vec<[f64; 2]> =
        (0..across * down).map(|k| [at(k % across, across), at(k / across, down)]).collect();
    let ray = |[x, y]: [f64; 2]| {
        let way = view.forward + edge * (right * (x * aspect) + model.up * y);
        (view.eye, way.normalize())
    };
    let met = cast(&model.bvh, &places.iter().map(|&p| ray(p)).collect::<Vec<_>>());
    let share = |what: &dyn Fn(&Option<Hit>) -> bool| {
        met.iter().filter(|h| what(h)).count() as f64 / met.len() as f64
    };
    let close = share(&|h| h.is_some_and(|h| h.distance < LENS * height));
    let backs = share(&|h| h.is_some_and(|h| !model.is_lit_side(&h)));
    // In a corridor what is in the middle counts most; in a room all that one sees.
    let width = (model.bounds.1 - model.bounds.0).reject_from(model.up).abs();
    let length = width.max_element();
    let long = length.powi(2) > DEEPEST.powi(2) * (width.length_squared() - length.powi(2));
    let narrow = if long { 3.0 } else { 0.0 };
    let weights = places.iter().map(|[x, y]| (-narrow * (x * x + y * y)).exp());
    let (mut far, mut total) = (0.0, 0.0);
    for (weight, hit) in weights.zip(&met) {
        far += weight * hit.as_ref().map_or(0.0, |h| h.distance);
        total += weight;
    }
    far /= total;
    let out = SKY * model.size() * share(&|h| h.is_none()).min(MOST_SKY);
    (far + out) * (1.0 - 1.5 * close).max(0.05) * (1.0 - 2.0 * backs).max(0.01)
}
