//! The method of a solver, and when it stops.

use serde::Serialize;

/// How the energy balance is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Gathering with the newest values, block after block.
    #[default]
    GaussSeidel,
    /// Gathering with the values of the last iteration.
    Jacobi,
    /// Distributing the largest unshot flux first.
    Shooting,
    /// Elimination: exact, and O(n³).
    Direct,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// The method. Default: Gauss-Seidel.
    pub method: Method,
    /// The residual to reach. Default 1e-6.
    pub tolerance: f64,
    /// Iterations after which to give up (sweeps; n shots count as one). Default 1,000.
    pub max_iterations: u32,
    /// Bytes that the dense matrix of [`Method::Direct`] may take. Default 4 GiB.
    pub memory: u64,
}

/// A residual that is small beside the noise of sampled rows.
pub const SAMPLED_TOLERANCE: f64 = 1e-4;

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::default(), tolerance: 1e-6, max_iterations: 1000, memory: 4 << 30 }
    }
}
