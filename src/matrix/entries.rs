//! A matrix that was made: its rows, and what they stand for.

use std::io;

use glam::DVec3;

use super::layout::Layout;
use super::names::name_of;
use super::report::MatrixReport;
use super::rows::{FaceAccount, Precision, Rows, SurfaceRow};
use super::storage::Storage;
use super::stored::{Origin, hexadecimal};
use crate::form_factors::RowAccount;
use crate::patches::{PatchId, Patches};
use crate::scene::Geometry;
use crate::visibility::COVERED;

/// The matrix of form factors of a model.
#[derive(Debug)]
pub struct Matrix {
    /// The patches.
    pub patches: Patches,
    /// Which row is which patch.
    pub layout: Layout,
    pub(super) storage: Storage,
    /// Sum of each patch's row as it was made.
    pub(super) sums: Vec<f64>,
    /// Of each patch, what its row and its column are multiplied with.
    pub(super) scales: Option<[Vec<f64>; 2]>,
    /// How it came about.
    pub report: MatrixReport,
}

impl Matrix {
    /// What a stored file says of it.
    #[must_use]
    pub fn origin(&self, geometry: &Geometry) -> Origin {
        Origin {
            scene: self.report.scene.clone(),
            fingerprint: hexadecimal(&geometry.fingerprint()),
            patch_size: self.report.patch_size,
            engine: self.report.engine.as_ref().map_or("", |e| &e.name).to_owned(),
            enclosure: self.report.closure.is_some(),
            threshold: self.report.threshold.map_or(0.0, |t| t.below),
            lumped: false,
            checksum: String::new(),
        }
    }

    /// Area of the patch of row `i` in m²; 0 for a triangle that takes no part.
    #[must_use]
    pub fn area(&self, i: usize) -> f64 {
        self.layout.faces[i].patch.map_or(0.0, |p| self.patches.own_area(p))
    }

    /// Name of the surface of row `i`.
    #[must_use]
    pub fn name<'a>(&self, geometry: &'a Geometry, i: usize) -> &'a str {
        name_of(geometry, &self.layout, i)
    }

    /// What row `i` held beside its entries when it was made.
    #[must_use]
    pub fn account(&self, i: usize) -> RowAccount {
        let account = |p| self.storage.account(p);
        self.layout.faces[i].patch.map_or(RowAccount::default(), account)
    }

    /// What row `i` stands for.
    #[must_use]
    pub fn surface_row(&self, geometry: &Geometry, i: usize) -> SurfaceRow {
        let face = self.layout.faces[i];
        let corners = match face.patch {
            Some(patch) => self.patches.cell(patch).corners(geometry),
            None => geometry.corners(face.triangle),
        };
        let account = self.account(i);
        let area = |p: PatchId| self.patches.own_area(p);
        SurfaceRow {
            triangle: Some(geometry.face(face.triangle)),
            side: Some(face.side),
            name: self.name(geometry, i).to_owned(),
            area: face.patch.map_or_else(|| geometry.area(face.triangle), area),
            centroid: corners.iter().sum::<DVec3>() / 3.0,
            normal: geometry.normal(face.triangle, face.side),
            account: FaceAccount {
                front: face.patch.map_or(0.0, |p| self.sums[p.index()]),
                back: account.back,
                environment: account.environment,
            },
        }
    }
}

impl Rows for Matrix {
    fn len(&self) -> usize {
        self.layout.len()
    }

    fn entries(&self) -> u64 {
        self.storage.entries()
    }

    fn precision(&self) -> Precision {
        if self.scales.is_some() { Precision::Double } else { Precision::Single }
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        columns.clear();
        values.clear();
        let Some(patch) = self.layout.faces[i].patch else { return Ok(()) };
        self.storage.row(patch, |patches, factors| {
            columns.extend(patches.iter().map(|&j| self.layout.row_of(j)));
            let factors = factors.iter().map(|&f| f64::from(f));
            match &self.scales {
                None => values.extend(factors),
                Some([left, right]) => {
                    let left = left[patch.index()];
                    let scaled = patches.iter().zip(factors);
                    values.extend(scaled.map(|(&j, f)| left * f * right[j.index()]));
                }
            }
        })
    }

    fn label(&self, i: usize) -> String {
        i.to_string()
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        let RowAccount { environment, back, .. } = self.account(i);
        let closed = self.report.closure.is_some() && back <= COVERED;
        if closed { [0.0; 2] } else { [environment, back] }
    }

    fn surfaces(&self, geometry: &Geometry) -> Vec<SurfaceRow> {
        (0..self.len()).map(|i| self.surface_row(geometry, i)).collect()
    }
}
