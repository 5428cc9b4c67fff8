//! Direct light: the irradiance D that arrives straight from emitters, lamps and the sky, and the
//! optics of patches that it starts from.

mod analytic;
mod emitters;
mod lamps;
mod light;
mod optics;
mod options;
mod reflected;
mod rows;

pub use analytic::analytic;
pub use emitters::{Emitters, Receiver, ReceiverPoint, Workspace};
pub use lamps::from_lamps;
pub(crate) use lamps::{lamps_on, lamps_over};
pub use light::DirectLight;
pub use optics::{emission, reflectance};
pub use options::{Analytic, DirectOptions, MOST_SHADOW};
pub(crate) use reflected::reflected_by_emitters;
pub use rows::through_rows;
