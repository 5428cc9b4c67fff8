//! The whole matrix, each pair evaluated once.
//!
//! Pairs of tiles are evaluated column by column of tiles and kept, upper half only. Then rows are
//! written tile by tile from both their own pairs and mirrored ones; a pair of tiles is dropped
//! once both have been written. So what is kept never takes more than the finished matrix will.
//! Pairs that were evaluated elsewhere are read when rows need them, each pair of tiles twice.

use rayon::prelude::*;

use super::pairs::Pairs;
use super::places::{TileId, Wanted};
use super::rows::{Accounts, entries};
use super::tally::PairsTally;
use super::tile_pairs::{FoundPairs, TilePairs, fits, number, tiles_of};
use crate::engines::engine::{AssembleError, EngineError};
use crate::form_factors::{Row, RowBlock, RowSink, SinkError, Weights, entry_bytes, sum};
use crate::progress::{Cancelled, Progress};

/// The exchange between a tile and itself and those before it: in a few large allocations, which go
/// back to the system when they are dropped.
#[derive(Debug, Default)]
struct Column {
    /// Where the entries of each tile begin, and where the last end.
    starts: Vec<usize>,
    pairs: TilePairs,
}

impl Column {
    fn new(tiles: &[TilePairs]) -> Self {
        let count = tiles.iter().map(TilePairs::len).sum();
        let mut me = Self { starts: vec![0], pairs: TilePairs::with_capacity(count) };
        for TilePairs { rows, columns, exchange } in tiles {
            me.pairs.rows.extend_from_slice(rows);
            me.pairs.columns.extend_from_slice(columns);
            me.pairs.exchange.extend_from_slice(exchange);
            me.starts.push(me.pairs.len());
        }
        me
    }

    /// The entries of a tile.
    fn tile(&self, tile: TileId) -> impl Iterator<Item = (u8, u8, f32)> {
        self.pairs.entries(self.starts[tile.index()]..self.starts[tile.index() + 1])
    }
}

/// Where the upper half of the matrix is.
#[derive(Clone, Copy)]
enum Upper<'a> {
    Kept(&'a [Column]),
    Found(&'a dyn FoundPairs),
}

impl Upper<'_> {
    /// Hands over what the patches of two tiles exchange.
    fn each(
        self,
        pairs: &Pairs<'_>,
        [a, b]: [TileId; 2],
        each: impl FnMut((u8, u8, f32)),
    ) -> Result<(), EngineError> {
        match self {
            Self::Kept(columns) => columns[b.index()].tile(a).for_each(each),
            Self::Found(found) => {
                let tiles = found.pairs(number([a, b]));
                let tiles = tiles.map_err(|e| EngineError::Found(e.to_string()))?;
                if !fits(&pairs.model, [a, b], &tiles) {
                    let problem = "what patches are said to exchange is out of bounds";
                    return Err(EngineError::Found(problem.into()));
                }
                tiles.entries(0..tiles.len()).for_each(each);
            }
        }
        Ok(())
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
        let made = evaluated(pairs, &of_wave, 0, progress)?;
        entries += 2 * made.iter().map(|tiles| tiles.len() as u64).sum::<u64>();
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
        write(pairs, accounts, wave, Upper::Kept(&upper), sink)?;
        wave.iter().for_each(|tile| upper[tile.index()] = Column::default());
        progress.advance(0)?;
    }
    Ok(())
}

/// The same from pairs that were found elsewhere: nothing is evaluated.
pub(super) fn join(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    found: &dyn FoundPairs,
    sink: &mut dyn RowSink,
    progress: &dyn Progress,
) -> Result<(), AssembleError> {
    pairs.add_tally(found.tally());
    let tree = &pairs.model.tree;
    let tiles: Vec<TileId> = tree.tiles().collect();
    for wave in tiles.chunks(WAVE) {
        write(pairs, accounts, wave, Upper::Found(found), sink)?;
        let done = wave.iter().map(|&t| tree.tile(t).len()).sum::<usize>();
        progress.advance(done as u64)?;
    }
    Ok(())
}

/// Evaluates pairs of tiles by their numbers; see [`Exact::evaluate`](super::Exact::evaluate).
pub(super) fn evaluate(
    pairs: &Pairs<'_>,
    numbers: &[u64],
    room: u64,
    progress: &dyn Progress,
) -> Result<(Vec<TilePairs>, PairsTally), AssembleError> {
    /// Evaluated together.
    const PART: usize = 256;
    let tiles: Vec<[TileId; 2]> = numbers.iter().map(|&number| tiles_of(number)).collect();
    let (mut made, mut bytes) = (Vec::with_capacity(tiles.len()), 0);
    pairs.take_tally();
    for tiles in tiles.chunks(PART) {
        made.extend(evaluated(pairs, tiles, 1, progress)?);
        bytes += made[made.len() - tiles.len()..].iter().map(TilePairs::bytes).sum::<u64>();
        if bytes > room {
            return Err(SinkError::Memory { allowed: room }.into());
        }
    }
    Ok((made, pairs.take_tally()))
}

/// Evaluates pairs of tiles on all threads; advances `progress` by `step` for each.
fn evaluated(
    pairs: &Pairs<'_>,
    tiles: &[[TileId; 2]],
    step: u64,
    progress: &dyn Progress,
) -> Result<Vec<TilePairs>, Cancelled> {
    let one = |&tiles: &[TileId; 2]| {
        progress.advance(0)?;
        let found = tile_pairs(pairs, tiles);
        progress.advance(step)?;
        Ok(found)
    };
    tiles.par_iter().with_max_len(4).map(one).collect()
}

/// Evaluates the pairs of two tiles.
fn tile_pairs(pairs: &Pairs<'_>, tiles: [TileId; 2]) -> TilePairs {
    let [rows, columns] = tiles.map(|tile| pairs.model.tree.tile(tile));
    let mut found = TilePairs::default();
    pairs.tile(&pairs.task(Wanted::All), tiles, |i, j, s| {
        found.rows.push(rows.offset(i) as u8);
        found.columns.push(columns.offset(j) as u8);
        found.exchange.push(s);
    });
    found.shrink_to_fit();
    found
}

/// Hands over the rows of some tiles.
fn write(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    tiles: &[TileId],
    upper: Upper<'_>,
    sink: &mut dyn RowSink,
) -> Result<(), AssembleError> {
    let of_tile = |&tile: &TileId| rows(pairs, accounts, tile, upper);
    let made: Result<Vec<RowBlock>, EngineError> =
        tiles.par_iter().with_max_len(1).map(of_tile).collect();
    made?.into_iter().try_for_each(|block| Ok(sink.take(block)?))
}

/// The rows of a tile.
fn rows(
    pairs: &Pairs<'_>,
    accounts: &Accounts<'_>,
    tile: TileId,
    upper: Upper<'_>,
) -> Result<RowBlock, EngineError> {
    let model = &pairs.model;
    let tree = &model.tree;
    let own = tree.tile(tile);
    let n = model.len();
    let mut dense = vec![0.0_f32; own.len() * n];
    let mut count = 0;
    for other in tree.tiles() {
        let tiles = [tile.min(other), tile.max(other)];
        let [rows, columns] = tiles.map(|tile| tree.tile(tile));
        let [of_rows, of_columns] = [rows, columns].map(|places| tree.patches(places));
        upper.each(pairs, tiles, |(row, column, s)| {
            let (row, column) = (usize::from(row), usize::from(column));
            if tiles[0] == tile {
                dense[row * n + of_columns[column].index()] = s;
                count += 1;
            }
            if tiles[1] == tile {
                dense[column * n + of_rows[row].index()] = s;
                count += 1;
            }
        })?;
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
    Ok(block)
}
