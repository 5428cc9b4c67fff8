//! A matrix as it was stored, and the form factors that it holds for a scene.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::layout::Layout;
use crate::form_factors::{FormFactors, RowAccount, RowBlock, RowSink, SinkError, Weights};
use crate::patches::{PatchId, Patches, PatchesError, warn_of_contacts};
use crate::progress::{Progress, Silent};
use crate::scene::{Geometry, Sides};
use crate::visibility::{Bvh, uncover};

/// What a stored matrix says of itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Name of the scene.
    pub scene: String,
    /// [Fingerprint](Geometry::fingerprint) of its geometry, in hexadecimal.
    pub fingerprint: String,
    /// Largest area of a patch, m²; none if every triangle is one.
    pub patch_size: Option<f64>,
    /// The engine's name.
    pub engine: String,
    /// Whether rows were scaled to sums of 1.
    pub enclosure: bool,
    /// Form factors below this were left out.
    pub threshold: f64,
    /// Whether rows are those of named surfaces.
    pub lumped: bool,
    /// Checksum of the arrays of the file; the format that has one fills it in.
    #[serde(default)]
    pub checksum: String,
}

/// A matrix as read from a file: compressed sparse rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// What it says of itself.
    pub origin: Origin,
    /// Where each row begins, and where the last ends; ascending, from 0 to the number of entries.
    pub starts: Vec<u64>,
    /// Columns, ascending in each row, below the number of rows.
    pub columns: Vec<u32>,
    /// Form factors, 0..1 but for rounding.
    pub values: Vec<f32>,
    /// Share of each row that escapes.
    pub environment: Vec<f64>,
    /// Share of each row that ends on backs without a row.
    pub back: Vec<f64>,
}

/// How a geometry differs from the one that a matrix was made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SameWith {
    /// It had these sides.
    pub sides: Option<Sides>,
    /// Its triangles were turned round.
    pub flipped: bool,
}

/// Why a stored matrix does not serve a scene.
#[derive(Debug, Error)]
pub enum StoredError {
    /// It is another geometry's.
    #[error("was made for another geometry (of {scene})")]
    Foreign {
        /// The scene that it was made for.
        scene: String,
        /// What would make it this geometry's, if anything does.
        same_with: Option<SameWith>,
    },
    /// It is this geometry's, but has another number of rows.
    #[error("has {rows} rows, and the model has {wanted}")]
    Rows {
        /// Rows that it has.
        rows: usize,
        /// Rows that the model has.
        wanted: usize,
    },
    /// It holds no patches.
    #[error("has rows of surfaces or whole faces, not of patches")]
    Lumped,
    /// The model could not be subdivided as then.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// It does not fit in memory.
    #[error(transparent)]
    Sink(#[from] SinkError),
}

/// The patches that rows are of, whole triangles or parts of at most `patch_size` m², and the
/// hierarchy of the geometry.
pub(super) fn subdivide(
    geometry: &Geometry,
    patch_size: Option<f64>,
    progress: &dyn Progress,
) -> Result<(Bvh, Patches), PatchesError> {
    let bvh = Bvh::new(geometry);
    let patch_size = patch_size.unwrap_or(f64::INFINITY);
    let patches = Patches::uniform_heard(geometry, patch_size, progress)?;
    let patches = uncover(geometry, patches, &bvh, progress)?;
    warn_of_contacts(&patches, progress);
    Ok((bvh, patches))
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// The sides and the winding with which a geometry would be the one of a fingerprint.
pub(super) fn same_with(geometry: &Geometry, fingerprint: &str) -> Option<SameWith> {
    for flipped in [false, true] {
        let mut other = geometry.clone();
        if flipped {
            other.flip();
        }
        for sides in [None, Some(Sides::One), Some(Sides::Two)] {
            if let Some(sides) = sides {
                other.choose_sides(sides);
            }
            if hexadecimal(&other.fingerprint()) == fingerprint {
                return Some(SameWith { sides, flipped });
            }
        }
    }
    None
}

impl Stored {
    /// The patches that the matrix is of and their form factors, in at most `memory` bytes.
    ///
    /// # Errors
    /// If it was made for another geometry.
    pub fn restore(
        self,
        geometry: &Geometry,
        memory: u64,
    ) -> Result<(Patches, FormFactors), StoredError> {
        if self.origin.lumped {
            return Err(StoredError::Lumped);
        }
        if hexadecimal(&geometry.fingerprint()) != self.origin.fingerprint {
            let scene = self.origin.scene.clone();
            let same_with = same_with(geometry, &self.origin.fingerprint);
            return Err(StoredError::Foreign { scene, same_with });
        }
        let rows = self.starts.len() - 1;
        let patch_size = self.origin.patch_size;
        // What a file claims may be a billion patches.
        let claimed = Patches::uniform_count(geometry, patch_size.unwrap_or(f64::INFINITY))?;
        if claimed > rows as u64 {
            return Err(StoredError::Rows { rows, wanted: claimed as usize });
        }
        let (_, patches) = subdivide(geometry, patch_size, &Silent)?;
        let layout = Layout::new(geometry, &patches);
        let wanted = layout.len();
        if rows != wanted {
            return Err(StoredError::Rows { rows, wanted });
        }
        let factors = self.rows_of(&layout, patches.len(), memory)?;
        Ok((patches, factors))
    }

    /// The same entries, taken over in the memory that they have.
    fn rows_of(
        self,
        layout: &Layout,
        patches: usize,
        memory: u64,
    ) -> Result<FormFactors, SinkError> {
        let Self { starts, columns, mut values, environment, back, .. } = self;
        let mut columns: Vec<PatchId> = columns.into_iter().map(PatchId).collect();
        let mut block = RowBlock { starts: vec![0], ..RowBlock::default() };
        let mut end = 0;
        for (i, face) in layout.faces.iter().enumerate() {
            let Some(patch) = face.patch else { continue };
            let mut sum = 0.0;
            for k in starts[i] as usize..starts[i + 1] as usize {
                // Faces that take no part have no column either.
                let Some(column) = layout.faces[columns[k].index()].patch else { continue };
                (columns[end], values[end]) = (column, values[k]);
                sum += f64::from(values[k]);
                end += 1;
            }
            let (environment, back) = (environment[i], back[i]);
            let lost = 1.0 - sum - environment - back;
            block.ids.push(patch);
            block.accounts.push(RowAccount { environment, back, lost });
            block.starts.push(end);
        }
        columns.truncate(end);
        values.truncate(end);
        (block.columns, block.weights) = (columns, Weights::Each(values));
        let mut factors = FormFactors::new(patches, memory);
        factors.take(block)?;
        Ok(factors)
    }
}
