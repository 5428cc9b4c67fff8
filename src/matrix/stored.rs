//! A matrix as it was stored, and the form factors that it holds for a scene.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Layout, subdivide};
use crate::form_factors::{FormFactors, RowAccount, SinkError};
use crate::patches::{Patches, PatchesError};
use crate::scene::{Geometry, Sides};
use crate::visibility::Bvh;

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
    /// Form factors, 0..1.
    pub values: Vec<f32>,
    /// Share of each row that escapes.
    pub environment: Vec<f64>,
    /// Share of each row that ends on backs without a row.
    pub back: Vec<f64>,
}

/// Why a stored matrix does not serve a scene.
#[derive(Debug, Error)]
pub enum StoredError {
    /// It is another geometry's.
    #[error("was made for another geometry (of {scene}): {remedy}")]
    Foreign {
        /// The scene that it was made for.
        scene: String,
        /// What to do about it.
        remedy: String,
    },
    /// It holds no patches.
    #[error("its rows are lumped to surfaces; make it without --group")]
    Lumped,
    /// The model could not be subdivided as then.
    #[error(transparent)]
    Patches(#[from] PatchesError),
    /// It does not fit in memory.
    #[error(transparent)]
    Sink(#[from] SinkError),
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
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
        let foreign =
            |remedy: String| StoredError::Foreign { scene: self.origin.scene.clone(), remedy };
        if hexadecimal(&geometry.fingerprint()) != self.origin.fingerprint {
            return Err(foreign(self.remedy(geometry)));
        }
        let patches = subdivide(geometry, &Bvh::new(geometry), self.origin.patch_size)?;
        let layout = Layout::new(geometry, &patches);
        if layout.len() + 1 != self.starts.len() {
            return Err(foreign(format!(
                "it has {} rows and the model {}; make it again",
                self.starts.len() - 1,
                layout.len()
            )));
        }
        let factors = self.rows_of(&layout, patches.len(), memory)?;
        Ok((patches, factors))
    }

    /// What to do about another fingerprint: the flags with which it would be the same, if there are
    /// any.
    fn remedy(&self, geometry: &Geometry) -> String {
        for flip in [false, true] {
            let mut other = geometry.clone();
            if flip {
                other.flip();
            }
            for (sides, flag) in [(None, ""), (Some(Sides::One), "one"), (Some(Sides::Two), "two")]
            {
                if let Some(sides) = sides {
                    other.sides.fill(sides);
                }
                if hexadecimal(&other.fingerprint()) == self.origin.fingerprint {
                    let sides = sides.map_or(String::new(), |_| format!(" --sides {flag}"));
                    let flip = if flip { " --flip, which one of both has" } else { "" };
                    return format!("it is the same with{sides}{flip}");
                }
            }
        }
        String::from("check --unit, or make it again with hemicube factors")
    }

    /// The same entries, taken over in the memory that they have.
    fn rows_of(
        self,
        layout: &Layout,
        patches: usize,
        memory: u64,
    ) -> Result<FormFactors, SinkError> {
        let Self { starts, mut columns, mut values, environment, back, .. } = self;
        let (mut ids, mut accounts, mut ends) = (Vec::new(), Vec::new(), vec![0]);
        let mut end = 0;
        for (i, face) in layout.faces.iter().enumerate() {
            let Some(patch) = face.patch else { continue };
            let mut sum = 0.0;
            for k in starts[i] as usize..starts[i + 1] as usize {
                // Faces that take no part have no column either.
                let Some(column) = layout.faces[columns[k] as usize].patch else { continue };
                (columns[end], values[end]) = (column.0, values[k]);
                sum += f64::from(values[k]);
                end += 1;
            }
            let (environment, back) = (environment[i], back[i]);
            ids.push(patch);
            accounts.push(RowAccount { environment, back, lost: 1.0 - sum - environment - back });
            ends.push(end);
        }
        columns.truncate(end);
        values.truncate(end);
        FormFactors::of_shares(patches, memory, (&ids, &accounts), ends, columns, values)
    }
}
