//! What a heat balance is made of, and what it says.

use super::exchange::Exchange;
use super::sunlight::Sunlight;

/// What is known of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Condition {
    /// Its temperature, K.
    Temperature(f64),
    /// The heat that is supplied to it from elsewhere than radiation, W; 0 if it is adiabatic.
    Heat(f64),
}

/// What a heat balance is made of. A row is a side of a face, or of what faces are lumped to.
#[derive(Debug, Clone, Copy)]
pub struct HeatInput<'a> {
    /// Exchange areas between the rows.
    pub exchange: &'a Exchange,
    /// Of each row, 0..1.
    pub emissivity: &'a [f64],
    /// The node of each row: rows of one node have one temperature.
    pub node_of: &'a [u32],
    /// What is known of each node.
    pub conditions: &'a [Condition],
    /// The temperature of what surrounds the model, K; `None` for 0 K.
    pub environment: Option<f64>,
    /// Sunlight, if there is any.
    pub sunlight: Option<Sunlight<'a>>,
    /// The surface of each row, of `surfaces`, for sums.
    pub surface_of: &'a [u32],
    /// How many surfaces there are.
    pub surfaces: usize,
    /// Root-mean-square error of the form factors over their own, 0 or more.
    pub error: f64,
}

/// One side of a face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SideHeat {
    /// K; `None` where nothing says which.
    pub temperature: Option<f64>,
    /// Infrared radiosity J, W/m².
    pub radiosity: f64,
    /// Infrared irradiance H, W/m².
    pub irradiance: f64,
    /// Net infrared flux that leaves, W/m².
    pub flux: f64,
    /// Sunlight absorbed, W/m².
    pub sunlight: f64,
    /// Half the width of the 95 % interval of the temperature, K.
    pub temperature_error: f64,
    /// Half the width of the 95 % interval of the net flux `flux - sunlight`, W/m².
    pub flux_error: f64,
}

impl SideHeat {
    /// Net flux that leaves in both bands, W/m²: the heat that is supplied to it.
    #[must_use]
    pub fn net(&self) -> f64 {
        self.flux - self.sunlight
    }
}

/// Several sides together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceHeat {
    /// m².
    pub area: f64,
    /// The mean over the area, lowest and highest temperature, K; `None` where no side has one.
    pub temperature: Option<[f64; 3]>,
    /// Heat that is supplied and leaves by radiation, W.
    pub net: f64,
    /// Sunlight absorbed, W.
    pub sunlight: f64,
    /// Half the width of the 95 % interval of the mean temperature, K.
    pub temperature_error: f64,
    /// Half the width of the 95 % interval of `net`, W.
    pub net_error: f64,
}

/// All of them, and what they add up to.
#[derive(Debug, Clone)]
pub struct HeatBalance {
    /// One a row.
    pub sides: Vec<SideHeat>,
    /// One a surface.
    pub surfaces: Vec<SurfaceHeat>,
    /// Heat that was to be supplied to sides that exchange with nothing, as they lie on something;
    /// it is left out. W, and the number of rows.
    pub left_out: (f64, usize),
    /// Heat that is supplied to surfaces, W: the sum of what is positive.
    pub supplied: f64,
    /// Heat that is taken from surfaces, W: the sum of what is negative, as a positive number.
    pub removed: f64,
    /// Net infrared heat that leaves to the environment, W.
    pub to_environment: f64,
    /// Sunlight that comes in, leaves again, and is absorbed, W.
    pub sunlight: [f64; 3],
    /// What all this leaves unaccounted for, over what is exchanged, 0 or more.
    pub imbalance: f64,
    /// Iterations.
    pub iterations: u32,
}

/// A quotient; 0 by 0 is 0.
pub(super) fn over(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}
