//! Direct light through rows of form factors.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::form_factors::FormFactors;
use crate::patches::PatchId;
use crate::scene::Rgb;

/// Direct irradiance of each patch (W/m² or lx) through its stored row:
///
/// ```text
/// D = F E + π L F_environment
/// ```
///
/// with the sky's uniform radiance L.
#[must_use]
pub fn through_rows(factors: &FormFactors, emission: &[Rgb], sky: Rgb) -> Vec<Rgb> {
    (0..factors.len() as u32)
        .into_par_iter()
        .map(|i| {
            let id = PatchId(i);
            factors.gather(id, emission) + sky * (PI * factors.account(id).environment)
        })
        .collect()
}
