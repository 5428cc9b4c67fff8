//! The account of a whole matrix, taken row by row as rows pass.

use crate::form_factors::RowAccount;
use crate::patches::PatchId;
use crate::report::RowsReport;
use crate::visibility::COVERED;

/// Rows in the sample that reciprocity is measured on.
const SAMPLE: usize = 64;

/// Bytes of an entry in memory.
pub(super) const ENTRY_BYTES: u64 = 8;

/// Adds up rows of shares.
pub(super) struct Ledger<'a> {
    areas: &'a [f64],
    /// Every so manieth row is in the sample.
    step: usize,
    /// Of each row i in the sample the factors F_ij, and the factors F_ji.
    sample: Vec<[Vec<f32>; 2]>,
    /// Sum of each row's entries.
    pub sums: Vec<f64>,
    /// Rows that lose more than half to backs.
    pub covered: Vec<PatchId>,
    rows: usize,
    entries: u64,
    area: f64,
    shares: [f64; 4],
    lost: f64,
    worst: Option<(PatchId, f64)>,
}

impl<'a> Ledger<'a> {
    /// No row yet, of patches of these areas.
    pub fn new(areas: &'a [f64]) -> Self {
        let (n, step) = (areas.len(), areas.len().div_ceil(SAMPLE).max(1));
        Self {
            areas,
            step,
            sample: (0..n).step_by(step).map(|_| [vec![0.0; n], vec![0.0; n]]).collect(),
            sums: vec![0.0; n],
            covered: Vec::new(),
            rows: 0,
            entries: 0,
            area: 0.0,
            shares: [0.0; 4],
            lost: 0.0,
            worst: None,
        }
    }

    /// Takes the row of a patch: columns, ascending, their factors, and the rest.
    pub fn add(&mut self, id: PatchId, columns: &[u32], factors: &[f32], account: RowAccount) {
        let (i, area) = (id.index(), self.areas[id.index()]);
        if i.is_multiple_of(self.step) {
            let dense = &mut self.sample[i / self.step][0];
            columns.iter().zip(factors).for_each(|(&j, &f)| dense[j as usize] = f);
        }
        for (k, [_, back]) in self.sample.iter_mut().enumerate() {
            if let Ok(at) = columns.binary_search(&((k * self.step) as u32)) {
                back[i] = factors[at];
            }
        }
        self.sums[i] = factors.iter().map(|&f| f64::from(f)).sum();
        self.rows += 1;
        self.entries += columns.len() as u64;
        self.area += area;
        let lost = [account.environment, account.back, account.lost];
        self.shares[0] += area * (1.0 - lost.iter().sum::<f64>());
        for (sum, share) in self.shares[1..].iter_mut().zip(lost) {
            *sum += area * share;
        }
        self.lost += area * account.lost.abs();
        if self.worst.is_none_or(|(_, worst)| account.lost.abs() > worst.abs()) {
            self.worst = Some((id, account.lost));
        }
        if account.back > COVERED {
            self.covered.push(id);
        }
    }

    /// What it comes to.
    pub fn report(&self) -> RowsReport {
        let (mut difference, mut size) = (0.0, 0.0);
        for (k, [there, back]) in self.sample.iter().enumerate() {
            let area = self.areas[k * self.step];
            for ((&f, &g), a) in there.iter().zip(back).zip(self.areas).filter(|e| *e.0.0 > 0.0) {
                let (there, back) = (area * f64::from(f), a * f64::from(g));
                difference += (there - back) * (there - back);
                size += there * there;
            }
        }
        let mean = self.shares.map(|s| if self.area > 0.0 { s / self.area } else { 0.0 });
        RowsReport {
            rows: self.rows,
            entries: self.entries,
            bytes: ENTRY_BYTES * self.entries,
            entries_share: mean[0],
            environment: mean[1],
            back: mean[2],
            lost: mean[3],
            covered: self.covered.len(),
            reciprocity_rms: (size > 0.0).then(|| f64::sqrt(difference / size)),
        }
    }

    /// Area-weighted mean of what rows lose in size, and the row that loses most, with what it loses.
    pub fn lost(&self) -> Option<(f64, (PatchId, f64))> {
        self.worst.map(|worst| (self.lost / self.area.max(f64::MIN_POSITIVE), worst))
    }
}
