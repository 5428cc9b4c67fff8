//! What emitters reflect, taken with what they emit.

use super::analytic::like_a_lamp;
use crate::patches::{Cell, Patches, side_index};
use crate::scene::{Rgb, Scene, Side};

/// Mean radiosity (W/m² or lm/m²) that each emitting side reflects, as far as it is like a lamp; of
/// all other sides nothing. `irradiance` is one value a patch.
pub(crate) fn reflected_by_emitters(
    scene: &Scene,
    patches: &Patches,
    irradiance: &[Rgb],
) -> Vec<Rgb> {
    let mut sums = vec![(Rgb::ZERO, 0.0); 2 * scene.geometry.len()];
    for i in patches.ids() {
        let Cell { triangle, side, .. } = patches.cell(i);
        if scene.optics.emission(triangle, side) != Rgb::ZERO {
            let (sum, area) = &mut sums[side_index(triangle, side)];
            let rho = scene.optics.reflectance[triangle.index()];
            *sum += rho * irradiance[i.index()] * patches.own_area(i);
            *area += patches.own_area(i);
        }
    }
    for t in scene.geometry.ids() {
        for side in Side::BOTH {
            let (sum, area) = &mut sums[side_index(t, side)];
            if *area > 0.0 {
                *sum = like_a_lamp(*sum / *area, scene.optics.emission(t, side));
            }
        }
    }
    sums.into_iter().map(|s| s.0).collect()
}
