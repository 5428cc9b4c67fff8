//! Rows by the names of their surfaces.

use std::collections::BTreeMap;

use super::error::MatrixError;
use super::layout::Layout;
use super::report::{ClosureReport, MODEST, NamedRow};
use crate::form_factors::{Closure, ClosureError};
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;

/// Name of the surface of row `i`.
pub fn name_of<'a>(geometry: &'a Geometry, layout: &Layout, i: usize) -> &'a str {
    let surface = geometry.surface_of[layout.faces[i].triangle.index()];
    geometry.surfaces.get(surface as usize).map_or("", |s| &s.name)
}

/// Says which rows and surfaces patches are.
pub struct Names<'a> {
    pub geometry: &'a Geometry,
    pub patches: &'a Patches,
    pub layout: &'a Layout,
}

impl Names<'_> {
    /// The row of a patch, with what is said of it.
    pub fn row(&self, patch: PatchId, value: f64) -> NamedRow {
        let row = self.layout.row_of(patch) as usize;
        let surface = name_of(self.geometry, self.layout, row).to_owned();
        NamedRow { row, surface, value }
    }

    /// What closing the matrix took.
    pub fn closure(&self, closure: &Closure) -> ClosureReport {
        let scales = || self.patches.ids().zip(closure.right.iter().copied());
        ClosureReport {
            steps: closure.steps,
            residual: closure.residual,
            asymmetry: closure.asymmetry,
            smallest_scale: scales().map(|s| s.1).fold(1.0, f64::min),
            largest_scale: scales().map(|s| s.1).fold(1.0, f64::max),
            outside: scales()
                .filter(|s| !(MODEST.contains(&s.1)))
                .map(|(i, d)| self.row(i, d))
                .collect(),
        }
    }

    /// Why the matrix cannot be closed, by the names of surfaces.
    pub fn failure(&self, error: ClosureError) -> MatrixError {
        match error {
            ClosureError::Open(rows) => {
                MatrixError::Open(self.surfaces(&rows, |share| share, "up to"))
            }
            ClosureError::Stalled(rows) => {
                MatrixError::Stalled(self.surfaces(&rows, |sum| (sum - 1.0).abs(), "off by up to"))
            }
            ClosureError::Sink(e) => e.into(),
            ClosureError::Cancelled(cancelled) => cancelled.into(),
        }
    }

    /// The surfaces of rows, the worst first: how many rows of each and how bad they are.
    fn surfaces(
        &self,
        rows: &[(PatchId, f64)],
        badness: impl Fn(f64) -> f64,
        word: &str,
    ) -> String {
        /// So many are named.
        const NAMED: usize = 5;
        let mut worst: BTreeMap<String, (usize, f64)> = BTreeMap::new();
        for &(patch, value) in rows {
            let entry = worst.entry(self.row(patch, value).surface).or_default();
            *entry = (entry.0 + 1, entry.1.max(badness(value)));
        }
        let mut worst: Vec<(String, (usize, f64))> = worst.into_iter().collect();
        worst.sort_by(|a, b| b.1.1.total_cmp(&a.1.1));
        let more = worst.len().saturating_sub(NAMED);
        let mut text: Vec<String> = worst
            .iter()
            .take(NAMED)
            .map(|(name, (n, worst))| {
                format!("{n} patches of surface {name} ({word} {:.1} %)", 100.0 * worst)
            })
            .collect();
        if more > 0 {
            text.push(format!("{more} more surfaces"));
        }
        text.join(", ")
    }
}
