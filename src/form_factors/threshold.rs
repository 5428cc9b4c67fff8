//! Tiny form factors left out, so that the matrix takes less room.

use rayon::prelude::*;

use super::sink::SinkError;
use super::stored::FormFactors;
use crate::patches::PatchId;

/// Drops form factors below `threshold` (0..1), except the largest of each row. Returns for each
/// patch the factor that restores the sum that its row had before; 1 where nothing was dropped.
///
/// Rows are changed one by one: reciprocity suffers by as much as sums are restored. Where a matrix
/// is to be [closed](super::close) too, that drops pairs instead.
pub fn drop_below(factors: &mut FormFactors, threshold: f64) -> Result<Vec<f64>, SinkError> {
    let sums = |factors: &FormFactors| -> Vec<f64> {
        let sum = |(_, w): (&[PatchId], &[f32])| w.iter().map(|&w| f64::from(w)).sum();
        factors.plain_rows().into_par_iter().map(sum).collect()
    };
    let before = sums(factors);
    factors.rewrite(|_, columns, weights, kept_columns, kept| {
        let least = weights.iter().copied().fold(0.0, f32::max).min(threshold as f32);
        let entries = columns.iter().zip(weights).filter(|e| *e.1 >= least);
        for (&column, &weight) in entries {
            kept_columns.push(column);
            kept.push(weight);
        }
    })?;
    let restore = |(before, after)| if before > after { before / after } else { 1.0 };
    Ok(before.into_iter().zip(sums(factors)).map(restore).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{Row, RowBlock, RowSink, Weights};

    #[test]
    fn sums_are_restored_and_the_largest_factor_stays() {
        let row = |w: &[f32]| Row {
            columns: (0..w.len() as u32).map(PatchId).collect(),
            weights: Weights::Each(w.to_vec()),
            ..Row::default()
        };
        let rows = [row(&[0.0, 0.01, 0.3, 0.5]), row(&[0.02, 0.03, 0.01]), row(&[])];
        let mut f = FormFactors::new(4, 1 << 10);
        let ids = [0, 2, 1].map(PatchId);
        f.take(RowBlock::of(&ids, &rows).unwrap()).unwrap();
        let restore = drop_below(&mut f, 0.05).unwrap();
        assert_eq!(f.plain_rows()[0].0, [2, 3].map(PatchId));
        assert_eq!(f.plain_rows()[2].0, [PatchId(1)]);
        assert_eq!(f.entries(), 3);
        for (i, sum) in [(0, 0.81), (2, 0.06)] {
            let restored = f.row_sum(PatchId(i)) * restore[i as usize];
            assert!((restored - sum).abs() < 1e-7, "{restored}");
        }
        assert_eq!((restore[1], restore[3]), (1.0, 1.0));
    }
}
