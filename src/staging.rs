//! What a first picture needs and the model lacks: a decision what it is, a point of view, a stage.
//!
//! [`Model::of`] looks at a model from outside and from points within it; [`Model::kind`] decides
//! whether it is an object to be looked at or a room to stand in. A [`Viewpoint`] shows it: an
//! object three-quarter from above, a room from as far back as it allows. A [`Stage`] lights what
//! has no light: an object stands on the sweep of a studio, under a large soft key light and a
//! dimmer sky; a closed room gets lights under its ceiling, an open one sky and sun from outside.
//!
//! A stage joins a scene that is to be looked at, never one that is to be measured.

mod ceiling;
mod framing;
mod indoors;
mod kind;
mod lit;
mod model;
mod outdoors;
mod pendant;
mod rays;
mod stage;
mod studio;
mod viewpoint;

pub use framing::Lens;
pub use kind::Kind;
pub use model::Model;
pub use pendant::Pendant;
pub use stage::Stage;
pub use viewpoint::{Viewpoint, viewpoint};
