//! What all shadow rays share: the sequence that their ends follow, and how well they are trusted.

use super::places::Place;

/// Spreads the bits of a seed over those of pairs.
const SEED: u64 = 0xd134_2543_de82_ef95;

/// Most shadow rays of a pair.
pub(super) const MOST_RAYS: usize = 4096;

/// Square of the error of all rays of a pair over that of the difference of its two halves: a
/// quarter if rays were independent; they are stratified.
const TOGETHER: f64 = 0.21;

/// [`MOST_RAYS`] points of a four-dimensional Sobol' sequence, scrambled as Owen (1995) does.
pub(super) fn sobol() -> Vec<[f32; 4]> {
    (0..MOST_RAYS as u32).map(|i| sobol_burley::sample_4d(i, 0, 0)).collect()
}

/// What the random numbers of a pair begin with. No two pairs have the same, and another `seed`
/// gives others.
pub(super) fn pair_seed(seed: u32, [i, j]: [Place; 2]) -> u64 {
    u64::from(seed).wrapping_mul(SEED) ^ u64::from(i.0) << 32 ^ u64::from(j.0)
}

/// The square of the error of the visible fraction that rays found: `all` is the kernel along their
/// even and odd ones, `clear` that along those that nothing blocks. `None` if a half has no rays.
pub(super) fn square_error(all: [f64; 2], clear: [f64; 2]) -> Option<f64> {
    let [a, b] = all;
    let [p, q] = clear;
    (a > 0.0 && b > 0.0).then(|| TOGETHER * (p / a - q / b).powi(2))
}

/// The square of the error of a visible fraction that so many rays agree about: half a ray more
/// would not (Jeffreys 1946).
pub(super) fn unseen(rays: f64) -> f64 {
    let other = 0.5 / (rays + 1.0);
    other * (1.0 - other) / rays.max(1.0)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn no_two_pairs_have_one_seed_beyond_65536_patches() {
        let places = [0, 1, 2, 3, 65_535, 65_536, 65_537, 131_072, 196_608, 1 << 29].map(Place);
        let mut seeds = HashSet::new();
        for seed in 0..4 {
            for i in places {
                assert!(places.iter().all(|&j| seeds.insert(pair_seed(seed, [i, j]))));
            }
        }
    }
}
