//! The exchange of all pairs between two tiles.

use super::blockers::BlockerId;
use super::effort::{EACH_PART, Effort, left_to_rays};
use super::far::{CLOSELY, exchange_with};
use super::model::Model;
use super::pair::{Pair, Part};
use super::pair_rays::visible_by_few_rays;
use super::places::{Place, Places, TileId, Wanted};
use super::polygon::facing;
use super::samples::pair_seed;
use super::shadow_rays::{SampledPair, ShadowRays};
use super::sight::{Sight, Sights, Sorting};
use super::tally::{PairsTally, TileSums};
use super::tree::TILE;
use super::unoccluded::exchange;
use super::visible::{PairBuffers, visible};
use crate::simd::LANES;
use crate::visibility::Lanes;

/// What pairs exchange with nothing in the way may err by this fraction of the error asked for and
/// of the smaller area, but not by more than the latter.
const TOLERANCE: f64 = 1e-4;
const MOST_TOLERANCE: f64 = 1e-7;

/// Buffers for a pair of tiles, and what was done; reused.
pub(super) struct TileBuffers {
    sights: Sights,
    row: [Lanes; TILE / LANES],
    rays: ShadowRays,
    pair: PairBuffers,
    pub tally: PairsTally,
}

impl Default for TileBuffers {
    fn default() -> Self {
        Self {
            sights: Sights::default(),
            row: [[0.0; LANES]; TILE / LANES],
            rays: ShadowRays::default(),
            pair: PairBuffers::default(),
            tally: PairsTally::default(),
        }
    }
}

/// What a pair exchanges.
struct Exchanged {
    /// S in m², 0 if nothing.
    s: f64,
    /// The square of its error, if something hides a part of it.
    square_error: Option<f64>,
    /// Whether few rays tell, whose number follows from the error asked for.
    by_rays: bool,
}

/// How pairs are evaluated.
pub(super) struct Task<'a> {
    pub model: &'a Model<'a>,
    pub effort: Effort,
    pub seed: u32,
    pub wanted: Wanted<'a>,
}

impl Task<'_> {
    /// Hands over `(i, j, S)` of all pairs i < j of tiles `a` and `b` (a not after b), by rows, S >
    /// 0 in m².
    pub fn tile(
        &self,
        [a, b]: [TileId; 2],
        buffers: &mut TileBuffers,
        mut each: impl FnMut(Place, Place, f32),
    ) {
        let tree = &self.model.tree;
        let tiles = [a, b].map(|tile| tree.tile(tile));
        let Task { model, effort, wanted, .. } = *self;
        let sorting = Sorting { model, effort, wanted, tiles };
        buffers.sights.find(&sorting, [a, b].map(|tile| tree.tile_node(tile)));
        let mut sums = TileSums::new(model);
        let [rows, columns] = tiles;
        for row in rows.iter() {
            let first = if a == b { Place(row.0 + 1) } else { columns.first() };
            let sights = &buffers.sights.row(rows.offset(row))[columns.offset(first)..];
            let columns = columns.since(first);
            if columns.len() == 0 || sights.iter().all(|&s| s == Sight::HIDDEN) {
                continue;
            }
            if wanted.has(Places::one(row), columns) {
                self.row(row, columns, tiles, buffers, &mut sums, &mut each);
            }
        }
        buffers.tally = buffers.tally.and(sums.tally());
        buffers.tally.rays += std::mem::take(&mut buffers.pair.rays.count);
        buffers.tally.rays += std::mem::take(&mut buffers.rays.count);
    }

    /// Evaluates the pairs of the patch at `row` with those at `columns`.
    fn row(
        &self,
        row: Place,
        columns: Places,
        tiles: [Places; 2],
        buffers: &mut TileBuffers,
        sums: &mut TileSums<'_>,
        each: &mut impl FnMut(Place, Place, f32),
    ) {
        let model = self.model;
        let scale2 = model.bvh.scale().powi(2);
        let TileBuffers { sights, row: far, rays, pair: pair_buffers, .. } = buffers;
        exchange_with(&model.far, row, columns.first(), &mut far[..columns.len().div_ceil(LANES)]);
        rays.pairs.clear();
        let of_row = &sights.row(tiles[0].offset(row))[tiles[1].offset(columns.first())..];
        for ((column, &s), &sight) in columns.iter().zip(far.as_flattened()).zip(of_row) {
            let asked = || self.wanted.has(Places::one(row), Places::one(column));
            if s == 0.0 || sight == Sight::HIDDEN || !asked() {
                continue;
            }
            let pair = [row, column];
            let far = f64::from(s.abs()) * scale2;
            if s > 0.0 && sight == Sight::CLEAR {
                sums.add(pair, far, None, each);
                continue;
            }
            let factor = model.relative_factor(pair, far);
            let good = s > 0.0 || s != CLOSELY && self.effort.may_straddle(factor);
            if good && sight == Sight::CLEAR {
                sums.add(pair, far, None, each);
                continue;
            }
            let blockers = sights.blockers(sight);
            let usual = self.effort.usual_rays(factor);
            let simple = pair.iter().all(|&at| model.is_simple(at));
            let parts = pair.map(|at| model.pieces(at).len() as u32);
            let parts = parts[0].saturating_mul(parts[1]).max(1);
            let sampled = left_to_rays(blockers.map(<[_]>::len), usual / parts)
                || good && !simple && usual / EACH_PART < parts;
            if s != CLOSELY && sampled {
                rays.pairs.push(SampledPair::new(column, far, self.effort.rays(usual)));
                continue;
            }
            let known = (s > 0.0 && simple).then_some(far);
            let found = self.closely(pair, known, blockers, pair_buffers);
            let before = sums.error;
            sums.add(pair, found.s, found.square_error, each);
            sums.ray_error += if found.by_rays { sums.error - before } else { 0.0 };
        }
        rays.trace(model, row, self.seed);
        let before = sums.error;
        for (pair, visible) in rays.visible() {
            let s = pair.exchange;
            let error = visible.is_doubtful().then_some(s * s * visible.square_error);
            sums.add([row, pair.column], s * visible.fraction, error, each);
        }
        sums.ray_error += sums.error - before;
    }

    /// What one pair exchanges. `known` is S with nothing in the way, if it is known.
    fn closely(
        &self,
        [i, j]: [Place; 2],
        known: Option<f64>,
        blockers: Option<&[BlockerId]>,
        buffers: &mut PairBuffers,
    ) -> Exchanged {
        let model = self.model;
        let tolerance =
            (TOLERANCE * self.effort.error).min(MOST_TOLERANCE) * model.area(i).min(model.area(j));
        let mut parts = std::mem::take(&mut buffers.parts);
        parts.clear();
        for (k, p) in (0..).zip(model.pieces(i)) {
            for (l, q) in (0..).zip(model.pieces(j)) {
                let polygons = match known {
                    Some(_) => (p.polygon, q.polygon),
                    None => match facing(&p.polygon, &q.polygon, model.coplanar) {
                        Some(fronts) => fronts,
                        None => continue,
                    },
                };
                let s = known.unwrap_or_else(|| exchange(&polygons.0, &polygons.1, tolerance));
                if s > 0.0 {
                    parts.push(Part { pieces: [k, l], polygons: polygons.into(), exchange: s });
                }
            }
        }
        let all: f64 = parts.iter().map(|part| part.exchange).sum();
        let mut found = Exchanged { s: all, square_error: None, by_rays: false };
        if all > 0.0 && !blockers.is_some_and(<[_]>::is_empty) {
            found = self.partly([i, j], &parts, all, blockers, buffers);
        }
        buffers.parts = parts;
        found
    }

    /// What a pair of such parts exchanges, which is `all` with nothing in the way.
    fn partly(
        &self,
        [i, j]: [Place; 2],
        parts: &[Part],
        all: f64,
        blockers: Option<&[BlockerId]>,
        buffers: &mut PairBuffers,
    ) -> Exchanged {
        let model = self.model;
        let pair = |part: &Part| {
            let [k, l] = part.pieces;
            let factor = model.relative_factor([i, j], part.exchange);
            Pair {
                pieces: [&model.pieces(i)[k as usize], &model.pieces(j)[l as usize]],
                polygons: part.polygons,
                blockers,
                tolerance: self.effort.tolerance(factor),
                work: self.effort.work(factor),
                exchange: part.exchange,
                seed: pair_seed(self.seed, [i, j]),
            }
        };
        let usual = self.effort.usual_rays(model.relative_factor([i, j], all));
        if let Some(rays) = self.effort.rays_of_parts(usual, parts.len()) {
            let v = visible_by_few_rays(parts, pair, model, rays, &mut buffers.rays);
            let square_error = v.is_doubtful().then_some(all * all * v.square_error);
            return Exchanged { s: all * v.fraction, square_error, by_rays: true };
        }
        let (mut sum, mut error) = (0.0, None);
        for part in parts {
            let (s, v) = (part.exchange, visible(&pair(part), model, buffers));
            sum += s * v.fraction;
            if v.is_doubtful() {
                *error.get_or_insert(0.0) += s * s * v.square_error;
            }
        }
        Exchanged { s: sum, square_error: error, by_rays: false }
    }
}
