//! A check of visible fractions that does not depend on how they were found: some pairs, drawn by
//! the squares of their factors, are traced by many rays.

use rayon::prelude::*;

use super::far::{CLOSELY, exchange_with};
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

/// Rays of each.
const RAYS: usize = 1024;

/// What is more than this many standard errors above nothing is no chance.
const SIGNIFICANT: f64 = 2.0;

/// Keeps these random numbers apart from all others.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// The root-mean-square error of factors over their root-mean-square that rays prove; 0 if they
/// agree.
pub(super) fn disagreement(pairs: &Pairs<'_>) -> f64 {
    let drawn = draw(&pairs.model);
    let found: Vec<[f64; 2]> = drawn.par_iter().filter_map(|&pair| compared(pairs, pair)).collect();
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

/// Pairs, each with a probability proportional to the square of its factor with nothing in the way.
fn draw(model: &Model<'_>) -> Vec<[Place; 2]> {
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
        let squares = squares_of(model, i);
        v *= squares.iter().sum::<f64>();
        let column = squares.iter().position(|&square| {
            v -= square;
            square > 0.0 && v < 0.0
        });
        Some([i, Place(column? as u32)])
    };
    (0..count).into_par_iter().filter_map(one).collect()
}

/// The squares of what a patch exchanges with each, with nothing in the way, up to a factor.
fn squares_of(model: &Model<'_>, i: Place) -> Vec<f64> {
    let n = model.len();
    let mut row = vec![[0.0; LANES]; n.div_ceil(LANES)];
    exchange_with(&model.far, i, Place(0), &mut row);
    let scale2 = model.bvh.scale().powi(2);
    let square = |(j, &s): (u32, &f32)| match s {
        CLOSELY => model.unoccluded(i, Place(j)).powi(2),
        s => (f64::from(s) * scale2).powi(2),
    };
    (0..).zip(&row.as_flattened()[..n]).map(square).collect()
}

/// The square of the difference between a visible fraction as found and as traced, less what rays
/// err by, and the square of the fraction.
fn compared(pairs: &Pairs<'_>, [i, j]: [Place; 2]) -> Option<[f64; 2]> {
    let model = &pairs.model;
    let [a, b] = if i < j { [i, j] } else { [j, i] };
    let (Some(p), Some(q)) = (model.pieces(a).first(), model.pieces(b).first()) else {
        return None;
    };
    if a == b || !model.is_simple(a) || !model.is_simple(b) {
        return None;
    }
    let polygons = facing(&p.polygon, &q.polygon, model.coplanar)?;
    let unoccluded = exchange(&polygons.0, &polygons.1, 1e-9 * model.area(a).min(model.area(b)));
    if unoccluded <= 0.0 {
        return None;
    }
    let mut buffers = TileBuffers::default();
    let mut found = 0.0;
    let tiles = [a, b].map(|at| model.tree.tile_of(at));
    pairs.task(Wanted::Pair([a, b])).tile(tiles, &mut buffers, |x, y, s| {
        found = if [x, y] == [a, b] { f64::from(s) } else { found };
    });
    let fraction = found / unoccluded;
    let pair = Pair {
        pieces: [p, q],
        polygons: polygons.into(),
        blockers: None,
        tolerance: 0.0,
        work: 0,
        exchange: unoccluded,
        seed: pair_seed(0, [a, b]) ^ SEED,
    };
    let [(all, clear), (other, other_clear)] =
        trace(&pair, model, RAYS, &mut RayBuffers::default());
    let noise = square_error([all, other], [clear, other_clear])?;
    let traced = (clear + other_clear) / (all + other);
    Some([(fraction - traced).powi(2) - noise, fraction * fraction])
}
