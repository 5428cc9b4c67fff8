//! A check of visible fractions that does not depend on how they were found: some pairs, drawn by
//! the squares of their factors, are traced by many rays.

use rayon::prelude::*;

use super::model::Model;
use super::pair::Pair;
use super::pair_rays::{RayBuffers, trace};
use super::pairs::Pairs;
use super::places::{Place, Wanted};
use super::polygon::facing;
use super::samples::{pair_seed, square_error};
use super::tile::TileBuffers;
use super::unoccluded::exchange;
use crate::engines::sampling::Random;
use crate::simd::LANES;

/// Pairs drawn: one for so many rows, but at least and at most so many.
const ROWS_A_PAIR: usize = 16;
const LEAST_PAIRS: usize = 16;
const MOST_PAIRS: usize = 96;

/// Rays of each, shared out among the pieces of its patches, with some for each.
const RAYS: usize = 1024;
const LEAST_RAYS: usize = 2 * LANES;

/// What pieces exchange with nothing in the way may err by this fraction of the smaller patch.
const TOLERANCE: f64 = 1e-9;

/// What is more than this many standard errors above nothing is no chance.
const SIGNIFICANT: f64 = 2.0;

/// Keeps these random numbers apart from all others.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// The root-mean-square error of factors over their root-mean-square that rays prove; 0 if they
/// agree.
pub(super) fn disagreement(pairs: &Pairs<'_>) -> f64 {
    let drawn = draw(&pairs.model);
    let found: Vec<[f64; 2]> = drawn
        .par_iter()
        .enumerate()
        .filter_map(|(k, &pair)| compared(pairs, pair, k as u64))
        .collect();
    let n = found.len() as f64;
    let squares: f64 = found.iter().map(|f| f[1]).sum();
    if n < 2.0 || squares <= 0.0 {
        return 0.0;
    }
    let mean = found.iter().map(|f| f[0]).sum::<f64>() / n;
    let variance = found.iter().map(|f| (f[0] - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
    let proven = mean - SIGNIFICANT * variance.sqrt();
    (proven.max(0.0) * n / squares).sqrt()
}

/// Pairs, and about what they exchange with nothing in the way: each is drawn with a probability
/// proportional to the square of that factor.
fn draw(model: &Model<'_>) -> Vec<([Place; 2], f64)> {
    let rows = &model.sampled_rows;
    let total: f64 = rows.iter().map(|row| row.1).sum();
    let count = (model.len() / ROWS_A_PAIR).clamp(LEAST_PAIRS, MOST_PAIRS);
    if total <= 0.0 {
        return Vec::new();
    }
    let one = |k: usize| {
        let [mut u, mut v] = Random::new(SEED ^ k as u64).numbers::<2>();
        u *= total;
        let row = rows.iter().find(|row| {
            u -= row.1;
            u < 0.0
        });
        let i = row.or(rows.last())?.0;
        let mut row = Vec::new();
        let exchange = model.unoccluded_row(i, &mut row).map(Option::unwrap_or_default);
        let squares: Vec<f64> = exchange.map(|s| s * s).collect();
        v *= squares.iter().sum::<f64>();
        let column = squares.iter().position(|&square| {
            v -= square;
            square > 0.0 && v < 0.0
        });
        let column = column?;
        Some(([i, Place(column as u32)], squares[column].sqrt()))
    };
    (0..count).into_par_iter().filter_map(one).collect()
}

/// The square of the difference between what a pair exchanges as found and as traced, less what
/// rays err by, and the square of what was found: both over the square that it was drawn by. Where
/// a pair is drawn again, another `seed` gives other rays.
fn compared(
    pairs: &Pairs<'_>,
    ([i, j], drawn_by): ([Place; 2], f64),
    seed: u64,
) -> Option<[f64; 2]> {
    let model = &pairs.model;
    let both = if i < j { [i, j] } else { [j, i] };
    let mut found = 0.0;
    let tiles = both.map(|at| model.tree.tile_of(at));
    pairs.task(Wanted::Pair(both)).tile(tiles, &mut TileBuffers::default(), |x, y, s| {
        found = if [x, y] == both { f64::from(s) } else { found };
    });
    let [a, b] = both.map(|at| model.pieces(at));
    let tolerance = TOLERANCE * model.area(i).min(model.area(j));
    let rays = (RAYS / (a.len() * b.len()).max(1)).next_multiple_of(LANES).max(LEAST_RAYS);
    let mut buffers = RayBuffers::default();
    let (mut all, mut traced, mut noise) = (0.0, 0.0, 0.0);
    for (p, q) in a.iter().flat_map(|p| b.iter().map(move |q| (p, q))) {
        let Some(polygons) = facing(&p.polygon, &q.polygon, model.coplanar) else { continue };
        let exchange = exchange(&polygons.0, &polygons.1, tolerance);
        let pair = Pair {
            pieces: [p, q],
            polygons: polygons.into(),
            blockers: None,
            tolerance: 0.0,
            work: 0,
            exchange,
            seed: pair_seed(0, both) ^ SEED.wrapping_mul(2 * seed + 1),
        };
        let [(even, clear), (odd, odd_clear)] = trace(&pair, model, rays, &mut buffers);
        let Some(error) = square_error([even, odd], [clear, odd_clear]) else { continue };
        all += exchange;
        traced += exchange * (clear + odd_clear) / (even + odd);
        noise += exchange * exchange * error;
    }
    let unit = 1.0 / (drawn_by * drawn_by);
    (all > 0.0).then(|| [unit * ((found - traced).powi(2) - noise), unit * found * found])
}
