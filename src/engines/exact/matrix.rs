//! The whole matrix, each pair evaluated once.
//!
//! Pairs of tiles are evaluated column by column of tiles and kept, upper half only. Then rows are
//! written tile by tile from both their own pairs and mirrored ones; a pair of tiles is dropped
//! once both have been written. So what is kept never takes more than the finished matrix will.

use rayon::prelude::*;

use super::pairs::Pairs;
use super::rows::{Accounts, entries};
use super::tree::TILE;
use crate::engines::engine::AssembleError;
use crate::form_factors::{Row, RowBlock, RowSink, SinkError, Weights, entry_bytes, sum};
use crate::patches::PatchId;
use crate::progress::Progress;

/// The exchange of the pairs of two tiles, by rows.
#[derive(Debug, Default)]
struct Upper {
    starts: Vec<u16>,
    columns: Vec<u8>,
    exchange: Vec<f32>,
}

/// The exchange between a tile and itself and those before it: in few large pieces, which go back to the
/// system when they are dropped.
#[derive(Debug, Default)]
struct Column {
    /// Where the rows of each tile begin, and where its last ends: [`TILE`] + 1 a tile, about its own
    /// first entry.
    starts: Vec<u16>,
    /// Where the entries of each tile begin.
    tiles: Vec<usize>,
    columns: Vec<u8>,
    exchange: Vec<f32>,
}

impl Column {
    fn new(pairs: &[Upper]) -> Self {
        let count = pairs.iter().map(|u| u.exchange.len()).sum();
        let mut me = Self {
            starts: Vec::with_capacity(pairs.len() * (TILE + 1)),
            tiles: Vec::with_capacity(pairs.len()),
            columns: Vec::with_capacity(count),
            exchange: Vec::with_capacity(count),
        };
        for (k, pairs) in pairs.iter().enumerate() {
            me.starts.extend_from_slice(&pairs.starts);
            me.starts.resize((k + 1) * (TILE + 1), pairs.columns.len() as u16);
            me.tiles.push(me.columns.len());
            me.columns.extend_from_slice(&pairs.columns);
            me.exchange.extend_from_slice(&pairs.exchange);
        }
        me
    }

    /// Number of entries of a tile.
    fn len(&self, tile: usize) -> usize {
        usize::from(self.starts[(tile + 1) * (TILE + 1) - 1])
    }

    /// Columns and exchange of row `k` of a tile.
    fn row(&self, tile: usize, k: usize) -> impl Iterator<Item = (u8, f32)> {
        let starts = &self.starts[tile * (TILE + 1) + k..][..2];
        let [from, to] = [0, 1].map(|n| self.tiles[tile] + usize::from(starts[n]));
        self.columns[from..to].iter().copied().zip(self.exchange[from..to].iter().copied())
    }
}

/// Tiles whose columns are evaluated, or whose rows are written, together.
const WAVE: usize = 8;

/// Makes the rows of all patches, the same to the last bit as rows made one by one, in the `room` that
/// the sink has, and hands them over tile by tile. Advances `progress` by one a row.
pub(super) fn make(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    room: u64,
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let tree = &pairs.model.tree;
    let tiles = tree.tiles.len();
    let mut upper: Vec<Column> = Vec::with_capacity(tiles);
    let mut entries = 0;
    for first in (0..tiles).step_by(WAVE) {
        let wave = first..(first + WAVE).min(tiles);
        let both: Vec<(usize, usize)> =
            wave.clone().flat_map(|b| (0..=b).map(move |a| (a, b))).collect();
        let made: Vec<Upper> =
            both.par_iter().with_max_len(4).map(|&(a, b)| upper_half(pairs, a, b)).collect();
        entries += 2 * made.iter().map(|u| u.exchange.len() as u64).sum::<u64>();
        if entries * entry_bytes(&Weights::Each(Vec::new())) > room {
            return Err(SinkError::Memory { allowed: room }.into());
        }
        let mut made = made.into_iter();
        for b in wave.clone() {
            upper.push(Column::new(&made.by_ref().take(b + 1).collect::<Vec<_>>()));
        }
        let done = wave.map(|t| tree.tile(t).len()).sum::<usize>();
        progress.advance(done as u64)?;
    }
    for first in (0..tiles).step_by(WAVE) {
        let wave = first..(first + WAVE).min(tiles);
        let made: Vec<RowBlock> = wave
            .clone()
            .into_par_iter()
            .with_max_len(1)
            .map(|t| rows(pairs, accounts, t, &upper))
            .collect();
        made.into_iter().try_for_each(|block| sink.take(block))?;
        wave.for_each(|t| upper[t] = Column::default());
        progress.advance(0)?;
    }
    Ok(())
}

/// Evaluates the pairs of two tiles.
fn upper_half(pairs: &Pairs<'_>, a: usize, b: usize) -> Upper {
    let tree = &pairs.model.tree;
    let (rows, columns) = (tree.tile(a), tree.tile(b));
    let mut upper = Upper { starts: vec![0], ..Upper::default() };
    pairs.tile(&pairs.task(None), [tree.tiles[a], tree.tiles[b]], |i, j, s| {
        upper.starts.resize(i - rows.start + 1, upper.columns.len() as u16);
        upper.columns.push((j - columns.start) as u8);
        upper.exchange.push(s);
    });
    upper.starts.resize(rows.len() + 1, upper.columns.len() as u16);
    upper.columns.shrink_to_fit();
    upper.exchange.shrink_to_fit();
    upper
}

/// The rows of a tile.
fn rows(pairs: &Pairs<'_>, accounts: &Accounts<'_>, tile: usize, upper: &[Column]) -> RowBlock {
    let model = &pairs.model;
    let own = model.tree.tile(tile);
    let n = model.len();
    let order = &model.tree.order;
    let mut dense = vec![0.0_f32; own.len() * n];
    let mut count = 0;
    for other in 0..upper.len() {
        let (a, b) = (tile.min(other), tile.max(other));
        let (rows, columns) = (model.tree.tile(a), model.tree.tile(b));
        count += upper[b].len(a) * if a == b { 2 } else { 1 };
        for i in rows.clone() {
            for (c, s) in upper[b].row(a, i - rows.start) {
                let j = columns.start + usize::from(c);
                if a == tile {
                    dense[(i - own.start) * n + order[j] as usize] = s;
                }
                if b == tile {
                    dense[(j - own.start) * n + order[i] as usize] = s;
                }
            }
        }
    }
    let ids = order[own].iter().map(|&p| PatchId(p)).collect();
    let mut block = RowBlock { ids, starts: vec![0], ..RowBlock::default() };
    // One more: room to write what is then left out.
    block.columns.reserve_exact(count + 1);
    let mut weights = Vec::with_capacity(count + 1);
    let mut rays = Row::default();
    for (&id, exchange) in block.ids.iter().zip(dense.chunks_exact(n)) {
        let from = block.columns.len();
        entries(model, id, exchange, &mut block.columns, &mut weights);
        block.starts.push(block.columns.len());
        block.accounts.push(accounts.of(id, sum(&weights[from..]), &mut rays));
    }
    block.weights = Weights::Each(weights);
    block
}
