//! The account of a whole matrix, taken row by row as rows pass.

use serde::Serialize;

use super::block::RowView;
use super::rows::RowAccount;
use super::stored::FormFactors;
use crate::patches::PatchId;
use crate::visibility::COVERED;

/// Rows in the sample that reciprocity is measured on, and bytes that it may take.
const SAMPLE: (usize, usize) = (64, 64 << 20);

/// What all rows come to.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct RowsReport {
    /// Rows made; patches that no light can reach have none.
    pub rows: usize,
    /// Form factors stored.
    pub entries: u64,
    /// Bytes that they take.
    pub bytes: u64,
    /// Area-weighted mean share of entries.
    pub entries_share: f64,
    /// Area-weighted mean share that escapes.
    pub environment: f64,
    /// Area-weighted mean share that ends on backs which do not reflect.
    pub back: f64,
    /// Area-weighted mean share lost numerically.
    pub lost: f64,
    /// Patches most of whose view is the back of something: covered.
    pub covered: usize,
    /// RMS of `A_i F_ij - A_j F_ji` over RMS of `A_i F_ij`, over a sample of rows; `None` where
    /// rows are themselves samples.
    pub reciprocity_rms: Option<f64>,
}

/// Adds up rows.
pub struct Account<'a> {
    areas: &'a [f64],
    /// Patches in the sample, ascending.
    sample: Vec<PatchId>,
    /// The factors F_ij of each row i in the sample, and the factors F_ji to it.
    factors: Vec<[Vec<f32>; 2]>,
    /// Sum of each patch's row.
    pub sums: Vec<f64>,
    /// Patches whose rows lose more than half to backs.
    pub covered: Vec<PatchId>,
    rows: usize,
    entries: u64,
    bytes: u64,
    area: f64,
    shares: [f64; 4],
    lost: f64,
    worst: Option<(PatchId, f64)>,
}

impl<'a> Account<'a> {
    /// No row yet, of patches of these areas (m²). Reciprocity is measured on some of the patches
    /// `tried`.
    #[must_use]
    pub fn new(areas: &'a [f64], tried: &[PatchId]) -> Self {
        let n = areas.len();
        let most = (SAMPLE.1 / (2 * size_of::<f32>() * n.max(1))).clamp(1, SAMPLE.0);
        let step = tried.len().div_ceil(most).max(1);
        let sample: Vec<PatchId> = tried.iter().copied().step_by(step).collect();
        Self {
            areas,
            factors: sample.iter().map(|_| [vec![0.0; n], vec![0.0; n]]).collect(),
            sample,
            sums: vec![0.0; n],
            covered: Vec::new(),
            rows: 0,
            entries: 0,
            bytes: 0,
            area: 0.0,
            shares: [0.0; 4],
            lost: 0.0,
            worst: None,
        }
    }

    /// Takes the row of a patch, and what it holds beside its entries.
    pub fn add(&mut self, id: PatchId, row: RowView<'_>, account: RowAccount) {
        let (i, area) = (id.index(), self.areas[id.index()]);
        if let Ok(k) = self.sample.binary_search(&id) {
            row.entries().for_each(|(j, f)| self.factors[k][0][j.index()] = f as f32);
        }
        for (&j, [_, back]) in self.sample.iter().zip(&mut self.factors) {
            back[i] = row.factor_to(j) as f32;
        }
        self.sums[i] = row.sum();
        self.rows += 1;
        self.entries += row.columns.len() as u64;
        self.bytes += row.bytes();
        self.area += area;
        let beside = [account.environment, account.back, account.lost];
        self.shares[0] += area * (1.0 - beside.iter().sum::<f64>());
        for (sum, share) in self.shares[1..].iter_mut().zip(beside) {
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

    /// Takes all rows of a matrix, in the order of patches.
    pub fn add_all(&mut self, factors: &FormFactors) {
        for id in (0..factors.len() as u32).map(PatchId) {
            if let Some(row) = factors.row(id) {
                self.add(id, row, factors.account(id));
            }
        }
    }

    /// What it comes to.
    #[must_use]
    pub fn report(&self) -> RowsReport {
        let (mut difference, mut size) = (0.0, 0.0);
        for (&i, [there, back]) in self.sample.iter().zip(&self.factors) {
            let area = self.areas[i.index()];
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
            bytes: self.bytes,
            entries_share: mean[0],
            environment: mean[1],
            back: mean[2],
            lost: mean[3],
            covered: self.covered.len(),
            reciprocity_rms: (size > 0.0).then(|| f64::sqrt(difference / size)),
        }
    }

    /// Area-weighted mean of what rows lose in size, and the row that loses most, with what it
    /// loses.
    #[must_use]
    pub fn lost(&self) -> Option<(f64, (PatchId, f64))> {
        self.worst.map(|worst| (self.lost / self.area.max(f64::MIN_POSITIVE), worst))
    }
}
