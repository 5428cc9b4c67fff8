//! A View3D file as a task: its scene, and what is to be computed of it.

use std::path::Path;

use super::grouping::Grouping;
use super::import::{ImportOptions, load_by, look_at};
use super::model::Scene;
use super::source::ImportError;
use super::vs3;

pub use super::vs3::{Control, OutputFormat, Radiating};

/// What a View3D file asks for.
#[derive(Debug, Clone)]
pub struct View3d {
    /// Its surfaces, those of [`surfaces`](Self::surfaces) in order, then obstructions.
    pub scene: Scene,
    /// Its title.
    pub title: String,
    /// What is to be computed, and how it is written.
    pub control: Control,
    /// The surfaces that exchange radiation.
    pub surfaces: Vec<Radiating>,
}

impl View3d {
    /// Reads a View3D file of any name. [`load`](super::load) reads one that ends in `.vs3` as a
    /// mere model.
    ///
    /// # Errors
    /// As [`load`](super::load).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ImportError> {
        let path = path.as_ref();
        look_at(path)?;
        let (scene, read) = load_by(path, &ImportOptions::default(), vs3::read)?;
        let vs3::Read { title, control, surfaces } = read;
        Ok(Self { scene, title, control, surfaces })
    }

    /// The triangles of each surface.
    #[must_use]
    pub fn by_surface(&self) -> Grouping {
        let names = self.scene.geometry.surfaces.iter().map(|s| s.name.clone()).collect();
        Grouping { names, of: self.scene.geometry.surface_of.clone() }
    }

    /// The row that each surface belongs to once surfaces are combined, from 0.
    #[must_use]
    pub fn rows(&self) -> Vec<usize> {
        let mut rows: Vec<usize> = Vec::with_capacity(self.surfaces.len());
        let mut next = 0;
        for surface in &self.surfaces {
            let own = surface.combined.map(|c| rows[c]);
            rows.push(own.unwrap_or(next));
            next += usize::from(own.is_none());
        }
        rows
    }
}
