//! Pictures: their size, their pixels, and why there is none.

use thiserror::Error;

use crate::progress::Cancelled;

/// Size and quality of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureOptions {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Samples along each side of a pixel, at most 15 where light is gathered. Default 8: 64 a
    /// pixel.
    pub samples: usize,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { width: 800, height: 600, samples: 8 }
    }
}

/// Why there is no picture.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum RenderError {
    /// No pixel, or more than memory should hold.
    #[error("a picture of {0} x {1} pixels cannot be made; 1 x 1 to 16384 x 16384 can")]
    Size(usize, usize),
    /// No triangle blocks light.
    #[error("there is nothing to see: no triangle blocks light")]
    Nothing,
    /// The camera looks nowhere.
    #[error("{0}")]
    Camera(&'static str),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// Rows of pixels from top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Whatever the samples were mapped to, averaged over each pixel.
    pub pixels: Vec<[f32; 3]>,
}
