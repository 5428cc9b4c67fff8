//! Light at the texels of an atlas.

use rayon::prelude::*;

use super::atlas::{Atlas, BakeError, Texels};
use super::fill;
use crate::patches::SurfacePoint;
use crate::progress::Progress;
use crate::reconstruct::Field;
use crate::render::raster::BAND;
use crate::render::{Renderer, Sight};
use crate::scene::Geometry;

/// A value of each texel, row by row from the top.
type Values = Vec<[f32; 3]>;

/// What a texel holds of what a place shows.
type Map<'a> = dyn Fn(&Sight) -> [f32; 3] + Sync + 'a;

/// The irradiance of each texel (W/m² or lx), and the mean of what `map` makes of what its places
/// show; zeros without a map.
pub(super) fn light_texels(
    atlas: &Atlas,
    renderer: &Renderer<'_>,
    map: Option<&Map<'_>>,
    progress: &dyn Progress,
) -> Result<[Values; 2], BakeError> {
    let Some(gathered) = renderer.gathered_light() else { return Err(BakeError::Nothing) };
    let [w, h] = atlas.size;
    let mut irradiance = vec![[0.0_f32; 3]; w * h];
    let mut shown = vec![[0.0_f32; 3]; w * h];
    let mut covered = vec![false; w * h];
    progress.stage("texels", h as u64);
    let texels = Texels { atlas, gathered };
    gathered.light(&texels, progress, |rows, lit| {
        let of_rows = rows.start * w..rows.end * w;
        irradiance[of_rows.clone()]
            .par_chunks_mut(w * BAND)
            .zip(shown[of_rows.clone()].par_chunks_mut(w * BAND))
            .zip(covered[of_rows].par_chunks_mut(w * BAND))
            .enumerate()
            .for_each(|(band, ((irradiance, shown), covered))| {
                let first = rows.start + band * BAND;
                let places = atlas.places(&(first..first + irradiance.len() / w));
                for (cell, samples) in places.iter().enumerate() {
                    let mut count = 0.0;
                    for (sample, at) in samples.iter().enumerate() {
                        let (_, light) = lit.of(band * BAND * w + cell, sample);
                        let Some((at, light)) = at.zip(light) else { continue };
                        let e = light.irradiance.as_vec3().to_array();
                        (0..3).for_each(|c| irradiance[cell][c] += e[c]);
                        if let Some(map) = map {
                            let value = map(&renderer.sight(at, light.irradiance));
                            (0..3).for_each(|c| shown[cell][c] += value[c]);
                        }
                        count += 1.0;
                    }
                    covered[cell] = count > 0.0;
                    if count > 0.0 {
                        irradiance[cell] = irradiance[cell].map(|c| c / count);
                        shown[cell] = shown[cell].map(|c| c / count);
                    }
                }
            });
    })?;
    let g = gathered.geometry();
    fill::fill(atlas, &covered, &mut [&mut irradiance, &mut shown]);
    fill::lend(atlas, g, &covered, &mut [&mut irradiance, &mut shown]);
    Ok([irradiance, shown])
}

/// The irradiance of each texel (W/m² or lx) as a field over patches has it.
pub(super) fn field_texels(atlas: &Atlas, field: &Field<'_>, g: &Geometry) -> Values {
    let [w, h] = atlas.size;
    let mut irradiance = vec![[0.0_f32; 3]; w * h];
    let mut covered = vec![false; w * h];
    let bands = irradiance.par_chunks_mut(w * BAND).zip(covered.par_chunks_mut(w * BAND));
    bands.enumerate().for_each(|(band, (irradiance, covered))| {
        let first = band * BAND;
        let places = atlas.places(&(first..first + irradiance.len() / w));
        for (cell, samples) in places.iter().enumerate() {
            if let Some(place) = middle_of(samples) {
                irradiance[cell] = field.at(place).as_vec3().to_array();
                covered[cell] = true;
            }
        }
    });
    fill::fill(atlas, &covered, &mut [&mut irradiance]);
    fill::lend(atlas, g, &covered, &mut [&mut irradiance]);
    irradiance
}

/// The place of the sample in the middle of a texel, or else of any.
pub(super) fn middle_of(samples: &[Option<SurfacePoint>]) -> Option<SurfacePoint> {
    let middle = samples.len() / 2;
    samples[middle].or_else(|| samples.iter().flatten().next().copied())
}
