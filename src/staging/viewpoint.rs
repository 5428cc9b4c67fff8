//! A point of view for a scene that has none.

use glam::DVec3;

use super::framing::Lens;
use super::kind::Kind;
use super::model::Model;
use super::{indoors, outdoors};
use crate::scene::Camera;

/// A camera that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Viewpoint {
    /// The camera.
    pub camera: Camera,
    /// What it looks at, in metres.
    pub target: DVec3,
    /// Whether it stands within the bounds of the model.
    pub inside: bool,
}

/// Chooses a camera: before an object, three-quarter from above; in a room, at eye height where the
/// longest view is, or before its open side.
#[must_use]
pub fn viewpoint(model: &Model<'_>, kind: Kind, lens: &Lens) -> Viewpoint {
    let camera = match kind {
        Kind::Object => outdoors::look(model, lens),
        Kind::Room => indoors::look(model, lens),
    };
    let (low, high) = model.bounds;
    let inside = camera.eye.cmpge(low).all() && camera.eye.cmple(high).all();
    let ahead = (model.centre() - camera.eye).dot(camera.forward);
    let target = camera.eye + camera.forward * ahead.max(1e-2 * model.size());
    Viewpoint { camera, target, inside }
}
