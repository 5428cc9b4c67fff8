//! What all shadow rays share: the sequence that their ends follow, and how well they are trusted.

/// Most shadow rays of a pair.
pub(super) const MOST_RAYS: usize = 1024;

/// Square of the error of all rays of a pair over that of the difference of its two halves: a
/// quarter if rays were independent; they are stratified.
const TOGETHER: f64 = 0.21;

/// [`MOST_RAYS`] points of a four-dimensional Sobol' sequence, scrambled as Owen (1995) does.
pub(super) fn sobol() -> Vec<[f32; 4]> {
    (0..MOST_RAYS as u32).map(|i| sobol_burley::sample_4d(i, 0, 0)).collect()
}

/// The square of the error of the visible fraction that rays found: `all` is the kernel along their
/// even and odd ones, `clear` that along those that nothing blocks. `None` if a half has no rays.
pub(super) fn square_error(all: [f64; 2], clear: [f64; 2]) -> Option<f64> {
    let [a, b] = all;
    let [p, q] = clear;
    (a > 0.0 && b > 0.0).then(|| TOGETHER * (p / a - q / b).powi(2))
}
