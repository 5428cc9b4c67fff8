//! What is asked of a matrix.

use crate::engines::{EngineOptions, ExactOptions};
use crate::units::DEFAULT_MEMORY;

/// How a matrix is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatrixOptions {
    /// Largest area of a patch, m². Default: every triangle of the file is a patch.
    pub patch_size: Option<f64>,
    /// Who makes the form factors. Default: the exact engine.
    pub engine: EngineOptions,
    /// Whether the model is an enclosure, whose matrix is to be
    /// [closed](crate::form_factors::close). Default: no.
    pub enclosure: bool,
    /// Form factors below this are left out, 0..1; 0 keeps all. Default 0.
    pub threshold: f64,
    /// Bytes that the work may take. Default [`DEFAULT_MEMORY`].
    pub memory: u64,
}

impl Default for MatrixOptions {
    fn default() -> Self {
        Self {
            patch_size: None,
            engine: EngineOptions::Exact(ExactOptions::default()),
            enclosure: false,
            threshold: 0.0,
            memory: DEFAULT_MEMORY,
        }
    }
}
