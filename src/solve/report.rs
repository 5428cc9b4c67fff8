//! How a solution was reached.

use serde::Serialize;

use super::Method;

/// How a solution was reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolveReport {
    /// The method.
    pub method: Method,
    /// Sweeps over all patches; for shooting, shots divided by patches, rounded up; for
    /// elimination, how often the matrix was factorised (once for each distinct reflectance).
    pub iterations: u32,
    /// Residual reached.
    pub residual: f64,
}
