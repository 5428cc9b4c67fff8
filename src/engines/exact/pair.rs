//! Two pieces in front of each other, and how much of each other they see.

use super::blockers::BlockerId;
use super::pieces::Piece;
use super::polygon::Polygon;

/// A pair of pieces in front of each other, and what is known of it.
pub(super) struct Pair<'a> {
    pub pieces: [&'a Piece; 2],
    pub polygons: [Polygon; 2],
    /// Blockers that may lie between; `None` if they are not known.
    pub blockers: Option<&'a [BlockerId]>,
    /// The error that the visible fraction may have.
    pub tolerance: f64,
    /// How many times blockers may be projected or subtracted. What then is not sure stays so.
    pub work: usize,
    /// S of the pieces with nothing in the way, m².
    pub exchange: f64,
    pub seed: u64,
}

/// What is visible of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Visible {
    /// Fraction of the exchange, 0..1.
    pub fraction: f64,
    /// Square of its error, as far as the points and rays that it comes from tell.
    pub square_error: f64,
}

impl Visible {
    pub const ALL: Self = Self { fraction: 1.0, square_error: 0.0 };

    /// Whether something hides a part, or may do so.
    pub fn is_doubtful(self) -> bool {
        self.fraction < 1.0 || self.square_error > 0.0
    }
}

/// Two pieces of a pair that face each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Their numbers among the pieces of their patches.
    pub pieces: [u32; 2],
    /// What of them faces the other.
    pub polygons: [Polygon; 2],
    /// S in m² with nothing in the way.
    pub exchange: f64,
}
