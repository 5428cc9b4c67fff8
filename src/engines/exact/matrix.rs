//! The whole matrix, each pair evaluated once.
//!
//! Pairs of tiles are evaluated column by column of tiles and kept, upper half only. Then rows are
//! written tile by tile from both their own pairs and mirrored ones; a pair of tiles is dropped
//! once both have been written. So what is kept never takes more than the finished matrix will.

use rayon::prelude::*;

use super::pairs::Pairs;
use super::places::{Place, TileId, Wanted};
use super::rows::{Accounts, entries};
use super::tree::TILE;
use crate::engines::engine::AssembleError;
use crate::form_factors::{Row, RowBlock, RowSink, SinkError, Weights, entry_bytes, sum};
use crate::progress::{Cancelled, Progress};

/// The exchange of the pairs of two tiles, by rows.
#[derive(Debug, Default)]
struct Upper {
    starts: Vec<u16>,
    columns: Vec<u8>,
    exchange: Vec<f32>,
}

/// The exchange between a tile and itself and those before it: in a few large allocations, which go
/// back to the system when they are dropped.
#[derive(Debug, Default)]
struct Column {
    /// Where the rows of each tile begin, and where its last ends: [`TILE`] + 1 a tile, about its
    /// own first entry.
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
    fn len(&self, tile: TileId) -> usize {
        usize::from(self.starts[(tile.index() + 1) * (TILE + 1) - 1])
    }

    /// Columns and exchange of row `k` of a tile.
    fn row(&self, tile: TileId, k: usize) -> impl Iterator<Item = (u8, f32)> {
        let tile = tile.index();
        let starts = &self.starts[tile * (TILE + 1) + k..][..2];
        let [from, to] = [0, 1].map(|n| self.tiles[tile] + usize::from(starts[n]));
        self.columns[from..to].iter().copied().zip(self.exchange[from..to].iter().copied())
    }
}

/// Tiles whose columns are evaluated, or whose rows are written, together.
const WAVE: usize = 8;

/// Makes the rows of all patches, the same to the last bit as rows made one by one, in the `room`
/// that the sink has, and hands them over tile by tile. Advances `progress` by one a row.
pub(super) fn make(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    room: u64,
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    let tree = &pairs.model.tree;
    let tiles: Vec<TileId> = tree.tiles().collect();
    let mut upper: Vec<Column> = Vec::with_capacity(tiles.len());
    let mut entries = 0;
    for wave in tiles.chunks(WAVE) {
        let of_wave: Vec<[TileId; 2]> =
            wave.iter().flat_map(|&b| tiles[..=b.index()].iter().map(move |&a| [a, b])).collect();
        let upper_half = |&tiles| {
            progress.advance(0)?;
            Ok(upper_half(pairs, tiles))
        };
        let made: Result<Vec<Upper>, Cancelled> =
            of_wave.par_iter().with_max_len(4).map(upper_half).collect();
        let made = made?;
        entries += 2 * made.iter().map(|u| u.exchange.len() as u64).sum::<u64>();
        if entries * entry_bytes(&Weights::Each(Vec::new())) > room {
            return Err(SinkError::Memory { allowed: room }.into());
        }
        let mut made = made.into_iter();
        for b in wave {
            upper.push(Column::new(&made.by_ref().take(b.index() + 1).collect::<Vec<_>>()));
        }
        let done = wave.iter().map(|&t| tree.tile(t).len()).sum::<usize>();
        progress.advance(done as u64)?;
    }
    for wave in tiles.chunks(WAVE) {
        let made: Vec<RowBlock> = wave
            .par_iter()
            .with_max_len(1)
            .map(|&tile| rows(pairs, accounts, tile, &upper))
            .collect();
        made.into_iter().try_for_each(|block| sink.take(block))?;
        wave.iter().for_each(|tile| upper[tile.index()] = Column::default());
        progress.advance(0)?;
    }
    Ok(())
}

/// Evaluates the pairs of two tiles.
fn upper_half(pairs: &Pairs<'_>, tiles: [TileId; 2]) -> Upper {
    let [rows, columns] = tiles.map(|tile| pairs.model.tree.tile(tile));
    let mut upper = Upper { starts: vec![0], ..Upper::default() };
    pairs.tile(&pairs.task(Wanted::All), tiles, |i, j, s| {
        upper.starts.resize(rows.offset(i) + 1, upper.columns.len() as u16);
        upper.columns.push(columns.offset(j) as u8);
        upper.exchange.push(s);
    });
    upper.starts.resize(rows.len() + 1, upper.columns.len() as u16);
    upper.columns.shrink_to_fit();
    upper.exchange.shrink_to_fit();
    upper
}

/// The rows of a tile.
fn rows(pairs: &Pairs<'_>, accounts: &Accounts<'_>, tile: TileId, upper: &[Column]) -> RowBlock {
    let model = &pairs.model;
    let tree = &model.tree;
    let own = tree.tile(tile);
    let n = model.len();
    let mut dense = vec![0.0_f32; own.len() * n];
    let at = |row: Place, column: Place| own.offset(row) * n + tree.order[column.index()].index();
    let mut count = 0;
    for other in tree.tiles() {
        let (a, b) = (tile.min(other), tile.max(other));
        let (rows, columns) = (tree.tile(a), tree.tile(b));
        let pairs = &upper[b.index()];
        count += pairs.len(a) * if a == b { 2 } else { 1 };
        for i in rows.iter() {
            for (c, s) in pairs.row(a, rows.offset(i)) {
                let j = Place(columns.first().0 + u32::from(c));
                if a == tile {
                    dense[at(i, j)] = s;
                }
                if b == tile {
                    dense[at(j, i)] = s;
                }
            }
        }
    }
    let ids = tree.patches(own).to_vec();
    let mut block = RowBlock { ids, starts: vec![0], ..RowBlock::default() };
    // One more, as `entries` writes one beyond the last.
    block.columns.reserve_exact(count + 1);
    let mut weights = Vec::with_capacity(count + 1);
    let mut rays = Row::default();
    for (&id, exchange) in block.ids.iter().zip(dense.chunks_exact(n)) {
        let from = block.columns.len();
        entries(model, id, exchange, &mut block.columns, &mut weights);
        block.starts.push(block.columns.len());
        let sum = sum(&weights[from..]);
        block.accounts.push(accounts.of(model, id, sum, &mut rays));
    }
    block.weights = Weights::Each(weights);
    block
}
