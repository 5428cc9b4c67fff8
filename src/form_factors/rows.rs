//! A row of the matrix and its account.

use std::collections::TryReserveError;

use crate::patches::PatchId;

/// One, in the fixed point of [`Weights::Fixed`]: the weights of a whole hemicube sum to exactly
/// this.
pub const ONE: u32 = u32::MAX;

/// The form factors of a row, in one of the forms that engines make.
#[derive(Debug, Clone, PartialEq)]
pub enum Weights {
    /// In units of 1 / [`ONE`], as hemicubes count them: sums are exact.
    Fixed(Vec<u32>),
    /// As shares of 1, rounded to single precision.
    Each(Vec<f32>),
    /// All alike, as sampled rays have them: a patch stands in the row as often as it was hit.
    Equal {
        /// Number of entries.
        entries: usize,
        /// Rays of the row, those that hit no patch included: each entry is the share of one.
        rays: u32,
    },
}

impl Weights {
    /// Number of entries.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Fixed(w) => w.len(),
            Self::Each(w) => w.len(),
            Self::Equal { entries, .. } => *entries,
        }
    }

    /// Bytes of one weight.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Fixed(_) | Self::Each(_) => 4,
            Self::Equal { .. } => 0,
        }
    }

    /// Room for `more` entries.
    pub(super) fn try_reserve_exact(&mut self, more: usize) -> Result<(), TryReserveError> {
        match self {
            Self::Fixed(w) => w.try_reserve_exact(more),
            Self::Each(w) => w.try_reserve_exact(more),
            Self::Equal { .. } => Ok(()),
        }
    }

    /// Appends entries, of another form too: different forms together are kept as
    /// [`Each`](Self::Each).
    pub(super) fn append(&mut self, other: &Self) {
        if self.is_empty() && matches!(other, Self::Equal { .. }) {
            *self = other.clone();
            return;
        }
        match (&mut *self, other) {
            (Self::Fixed(all), Self::Fixed(w)) => all.extend_from_slice(w),
            (Self::Each(all), Self::Each(w)) => all.extend_from_slice(w),
            (Self::Equal { entries, rays }, Self::Equal { entries: more, rays: of })
                if rays == of =>
            {
                *entries += more;
            }
            (all, other) => {
                let shares =
                    |w: &Self| -> Vec<f32> { (0..w.len()).map(|i| w.get(i) as f32).collect() };
                *self = Self::Each([shares(all), shares(other)].concat());
            }
        }
    }

    /// Those of some entries.
    pub(super) fn of(&self, entries: &[usize]) -> Self {
        match self {
            Self::Fixed(w) => Self::Fixed(entries.iter().map(|&k| w[k]).collect()),
            Self::Each(w) => Self::Each(entries.iter().map(|&k| w[k]).collect()),
            Self::Equal { rays, .. } => Self::Equal { entries: entries.len(), rays: *rays },
        }
    }

    /// Whether there is no entry.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entry `i` as a share of 1.
    #[must_use]
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::Fixed(w) => f64::from(w[i]) / f64::from(ONE),
            Self::Each(w) => f64::from(w[i]),
            Self::Equal { rays, .. } => 1.0 / f64::from(*rays),
        }
    }

    /// Sum of the entries. Of fixed-point weights it is exact until the final division.
    #[must_use]
    pub fn sum(&self) -> f64 {
        match self {
            Self::Fixed(w) => w.iter().map(|&w| u64::from(w)).sum::<u64>() as f64 / f64::from(ONE),
            Self::Each(w) => sum(w),
            Self::Equal { entries, rays } => *entries as f64 / f64::from(*rays),
        }
    }
}

/// The sum of numbers, several at a time.
pub(crate) fn sum(numbers: &[f32]) -> f64 {
    let chunks = numbers.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|&x| f64::from(x)).sum();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, &x) in sums.iter_mut().zip(chunk) {
            *sum += f64::from(x);
        }
    }
    sums.iter().sum::<f64>() + rest
}

impl Default for Weights {
    /// No entry.
    fn default() -> Self {
        Self::Fixed(Vec::new())
    }
}

/// One row of the matrix of form factors with its full account.
///
/// `Σ weights + environment + back + lost = 1`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// The patches seen, ascending; with [`Weights::Equal`] one for each hit, in any order.
    pub columns: Vec<PatchId>,
    /// The form factor of each.
    pub weights: Weights,
    /// Number of leading columns that come from the first of two independent samples of equal size;
    /// 0 if rows are not sampled.
    pub half: usize,
    /// Share that escapes.
    pub environment: f64,
    /// Share that ends on backs which do not reflect.
    pub back: f64,
    /// Share lost numerically.
    pub lost: f64,
}

/// What a row holds beside its entries.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RowAccount {
    /// Share that escapes.
    pub environment: f64,
    /// Share that ends on backs which do not reflect.
    pub back: f64,
    /// Share lost numerically.
    pub lost: f64,
}

impl Row {
    /// A row without entries.
    #[must_use]
    pub fn of_account(account: RowAccount) -> Self {
        let RowAccount { environment, back, lost } = account;
        Self { environment, back, lost, ..Self::default() }
    }

    /// What it holds beside its entries.
    #[must_use]
    pub fn account(&self) -> RowAccount {
        let Self { environment, back, lost, .. } = *self;
        RowAccount { environment, back, lost }
    }

    /// Entries and account together: 1 but for rounding.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.weights.sum() + self.environment + self.back + self.lost
    }

    /// The form factor to one patch.
    #[must_use]
    pub fn factor_to(&self, j: PatchId) -> f64 {
        factor_to(&self.columns, j, |k| self.weights.get(k), &self.weights)
    }

    /// Patches and form factors in turn.
    pub fn entries(&self) -> impl Iterator<Item = (PatchId, f64)> + '_ {
        self.columns.iter().enumerate().map(|(k, &j)| (j, self.weights.get(k)))
    }
}

/// The form factor to one patch in a row of `columns` and the weight of each.
pub(super) fn factor_to(
    columns: &[PatchId],
    j: PatchId,
    weight: impl Fn(usize) -> f64,
    form: &Weights,
) -> f64 {
    match form {
        Weights::Fixed(_) | Weights::Each(_) => columns.binary_search(&j).map_or(0.0, weight),
        Weights::Equal { rays, .. } => {
            columns.iter().filter(|&&k| k == j).count() as f64 / f64::from(*rays)
        }
    }
}
