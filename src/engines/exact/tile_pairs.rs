//! What the patches of two tiles exchange, as it is kept until rows are written.

use std::io;
use std::ops::Range;

use super::model::Model;
use super::places::TileId;
use super::tally::PairsTally;

/// What the patches of two tiles exchange: one entry a pair that exchanges anything, in the order
/// in which they were evaluated. Of a tile with itself each pair stands once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TilePairs {
    /// The place of the first patch in its tile.
    pub rows: Vec<u8>,
    /// The place of the second patch in its tile.
    pub columns: Vec<u8>,
    /// S = A_i F_ij = A_j F_ji, m².
    pub exchange: Vec<f32>,
}

impl TilePairs {
    /// With room for so many pairs.
    pub(super) fn with_capacity(count: usize) -> Self {
        let bytes = || Vec::with_capacity(count);
        Self { rows: bytes(), columns: bytes(), exchange: Vec::with_capacity(count) }
    }

    /// Number of pairs that exchange anything.
    #[must_use]
    pub fn len(&self) -> usize {
        self.exchange.len()
    }

    /// Whether no pair exchanges anything.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.exchange.is_empty()
    }

    /// Bytes of memory that the pairs take.
    pub(super) fn bytes(&self) -> u64 {
        const ENTRY: usize = 2 * size_of::<u8>() + size_of::<f32>();
        (size_of::<Self>() + self.len() * ENTRY) as u64
    }

    /// Some of the pairs: places in both tiles, and S.
    pub(super) fn entries(&self, range: Range<usize>) -> impl Iterator<Item = (u8, u8, f32)> {
        let [rows, columns] = [&self.rows, &self.columns].map(|of| of[range.clone()].iter());
        rows.zip(columns).zip(&self.exchange[range]).map(|((&row, &column), &s)| (row, column, s))
    }

    pub(super) fn shrink_to_fit(&mut self) {
        self.rows.shrink_to_fit();
        self.columns.shrink_to_fit();
        self.exchange.shrink_to_fit();
    }
}

/// Pairs that were evaluated elsewhere, by the same [`Tiling`](super::Tiling).
pub trait FoundPairs: Sync {
    /// The pairs of two tiles, by their number: column by column of the upper triangle.
    ///
    /// # Errors
    /// If they cannot be had any more.
    fn pairs(&self, number: u64) -> io::Result<TilePairs>;

    /// The sums over all pairs.
    fn tally(&self) -> PairsTally;
}

/// The number of a pair of tiles, the first not after the second: column by column of the upper
/// triangle.
pub(super) fn number([a, b]: [TileId; 2]) -> u64 {
    let [a, b] = [a, b].map(|tile| u64::from(tile.0));
    b * (b + 1) / 2 + a
}

/// The pair of tiles of that number.
pub(super) fn tiles_of(number: u64) -> [TileId; 2] {
    let about = ((2.0 * number as f64 + 0.25).sqrt() - 0.5) as u64;
    // Rounding may be off by one.
    let first = |b: u64| b * (b + 1) / 2;
    let b = (about.saturating_sub(1)..).take_while(|&b| first(b) <= number).last().unwrap_or(0);
    [number - first(b), b].map(|tile| TileId(tile as u32))
}

/// Whether pairs that were found elsewhere may be those of two tiles.
pub(super) fn fits(model: &Model<'_>, [a, b]: [TileId; 2], pairs: &TilePairs) -> bool {
    let [rows, columns] = [a, b].map(|tile| model.tree.tile(tile));
    let TilePairs { rows: of_rows, columns: of_columns, exchange } = pairs;
    let may_be = |((&r, &c), &s): ((&u8, &u8), &f32)| {
        let (r, c) = (usize::from(r), usize::from(c));
        let there = r < rows.len() && c < columns.len() && (a != b || r < c);
        there && s > 0.0 && {
            let least = model.area(rows.at(r)).min(model.area(columns.at(c)));
            f64::from(s) <= least
        }
    };
    of_rows.len() == exchange.len()
        && of_columns.len() == exchange.len()
        && of_rows.iter().zip(of_columns).zip(exchange).all(may_be)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_pairs_of_tiles_are_counted_column_by_column() {
        let mut next = 0;
        for b in 0..200 {
            for a in 0..=b {
                let tiles = [a, b].map(TileId);
                assert_eq!((number(tiles), tiles_of(next)), (next, tiles));
                next += 1;
            }
        }
        for b in [1_u32 << 20, (1 << 26) - 1, 1 << 26] {
            for a in [0, 1, b - 1, b] {
                let tiles = [a, b].map(TileId);
                assert_eq!(tiles_of(number(tiles)), tiles);
            }
        }
    }
}
