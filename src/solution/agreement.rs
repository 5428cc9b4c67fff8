//! Whether all ranks are about to do the same work.

use super::options::LightOptions;
use crate::ranks::{Ranks, RanksError};
use crate::scene::{Rgb, Scene};

/// The options of all ranks, whose scenes and options must be the same; each may take the memory
/// that all of them have.
///
/// # Errors
/// If a rank is about to do other work, or they cannot reach each other.
pub(super) fn agreed(
    scene: &Scene,
    options: &LightOptions,
    ranks: &Ranks,
) -> Result<LightOptions, RanksError> {
    if ranks.is_alone() {
        return Ok(*options);
    }
    let memory = ranks.every(options.memory)?.into_iter().min().unwrap_or_default();
    let options = LightOptions { memory, ..*options };
    let sums = ranks.every(checksum(scene, &options))?;
    match sums.iter().position(|sum| *sum != sums[0]) {
        Some(rank) => Err(RanksError::Different { rank }),
        None => Ok(options),
    }
}

/// A checksum of all that light depends on.
fn checksum(scene: &Scene, options: &LightOptions) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&scene.geometry.fingerprint());
    let optics = &scene.optics;
    let mut add = |values: &[Rgb]| {
        values.iter().flat_map(|v| v.to_array()).for_each(|x| {
            hasher.update(&x.to_le_bytes());
        });
    };
    add(&optics.reflectance);
    add(&optics.emission);
    add(&[scene.sky, scene.up]);
    hasher.update(format!("{:?}{:?}{options:?}", optics.materials, scene.lamps).as_bytes());
    let sum = hasher.finalize();
    sum.as_bytes().first_chunk().map_or(0, |first| u64::from_le_bytes(*first))
}
