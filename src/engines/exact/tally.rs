//! Sums over pairs: how many, and the squares of their factors and errors. They do not depend on
//! the order of the pairs.

use serde::{Deserialize, Serialize};

use super::model::Model;
use super::places::Place;

/// Sums over pairs of patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PairsTally {
    /// Pairs that exchange anything.
    pub pairs: u64,
    /// Pairs with possible blockers.
    pub partly: u64,
    /// Shadow rays.
    pub rays: u64,
    /// Sum of the squares of the factors both ways, over the square of the root-mean-square factor,
    /// in units of 2⁻³²: sums of integers do not depend on their order.
    pub squares: u128,
    /// Sum of the squares of their errors, in the same unit.
    pub errors: u128,
    /// The part of `errors` that is due to rays packed over neighbouring pairs.
    pub ray_errors: u128,
}

/// A sum of squares as a [`PairsTally`] keeps it.
fn fixed(sum: f64) -> u128 {
    (sum * 4_294_967_296.0) as u128
}

/// The sum that a [`PairsTally`] keeps, over the square of the root-mean-square factor.
pub(super) fn unfixed(sum: u128) -> f64 {
    sum as f64 / 4_294_967_296.0
}

impl PairsTally {
    /// The sums over the pairs of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            pairs: self.pairs.saturating_add(other.pairs),
            partly: self.partly.saturating_add(other.partly),
            rays: self.rays.saturating_add(other.rays),
            squares: self.squares.saturating_add(other.squares),
            errors: self.errors.saturating_add(other.errors),
            ray_errors: self.ray_errors.saturating_add(other.ray_errors),
        }
    }
}

/// What adds up over the pairs of two tiles.
pub(super) struct TileSums<'a> {
    model: &'a Model<'a>,
    pairs: u64,
    partly: u64,
    square: f64,
    pub error: f64,
    pub ray_error: f64,
}

impl<'a> TileSums<'a> {
    pub fn new(model: &'a Model<'a>) -> Self {
        Self { model, pairs: 0, partly: 0, square: 0.0, error: 0.0, ray_error: 0.0 }
    }

    /// Takes in a pair that exchanges `s` m², with the square of the error of that if it is partly
    /// hidden, and hands it on.
    #[inline]
    pub fn add(
        &mut self,
        [i, j]: [Place; 2],
        s: f64,
        error: Option<f64>,
        each: &mut impl FnMut(Place, Place, f32),
    ) {
        let [a, b] = [i, j].map(|at| self.model.area(at));
        let kept = down(s.min(a).min(b).max(0.0));
        let both = 1.0 / (a * a) + 1.0 / (b * b);
        self.square += both * f64::from(kept) * f64::from(kept);
        self.error += both * error.unwrap_or(0.0);
        if kept > 0.0 {
            self.pairs += 1;
            self.partly += u64::from(error.is_some());
            each(i, j, kept);
        }
    }

    pub fn tally(&self) -> PairsTally {
        let unit = self.model.rms_factor * self.model.rms_factor;
        PairsTally {
            pairs: self.pairs,
            partly: self.partly,
            squares: fixed(self.square / unit),
            errors: fixed(self.error / unit),
            ray_errors: fixed(self.ray_error / unit),
            ..PairsTally::default()
        }
    }
}

/// Single precision of what is not negative, rounded towards zero.
pub(super) fn down(x: f64) -> f32 {
    let y = x as f32;
    // The number before a positive one has the bits before its own.
    f32::from_bits(y.to_bits() - u32::from(f64::from(y) > x))
}
