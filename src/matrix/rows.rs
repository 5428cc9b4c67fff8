//! What formats and tables need to know of a matrix.

use std::io;

use glam::DVec3;

use crate::scene::{Geometry, Side};

/// How exactly entries are known, and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// As engines make them.
    Single,
    /// Scaled or added up.
    Double,
}

/// A matrix row by row, as formats write it.
pub trait Rows: Sync {
    /// Number of rows, and of columns.
    fn len(&self) -> usize;

    /// Whether there is no row.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of entries that are not zero.
    fn entries(&self) -> u64;

    /// How exactly entries are known.
    fn precision(&self) -> Precision;

    /// Replaces `columns`, ascending, and `values` by those of row `i`. Fails only where rows are
    /// not in memory.
    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()>;

    /// What row `i` is called.
    fn label(&self, i: usize) -> String;

    /// What each row stands for.
    fn surfaces(&self, geometry: &Geometry) -> Vec<SurfaceRow>;

    /// Shares of row `i` that go with its entries as they are: to the environment, and to backs
    /// that have no row.
    fn rest(&self, i: usize) -> [f64; 2];
}

/// What a row saw when it was made, as shares of 1; the rest is lost numerically.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaceAccount {
    /// Share that ends on sides with a row: the row's sum before closure.
    pub front: f64,
    /// Share that ends on backs that have none.
    pub back: f64,
    /// Share that escapes.
    pub environment: f64,
}

/// What a row stands for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceRow {
    /// The source triangle; `None` where several are lumped.
    pub triangle: Option<u32>,
    /// Its side; `None` likewise.
    pub side: Option<Side>,
    /// Name of the surface.
    pub name: String,
    /// m².
    pub area: f64,
    /// Metres.
    pub centroid: DVec3,
    /// Unit normal; zero without a direction.
    pub normal: DVec3,
    /// Where its light goes.
    pub account: FaceAccount,
}
