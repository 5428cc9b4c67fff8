//! What is measured, and how carefully.

use std::fmt;

use hemicube::engines::{Draw, HemicubeOptions};

use crate::args::Paper;
use crate::machine;

/// What is measured, and how carefully.
#[derive(Debug, Clone)]
pub struct Conditions {
    /// A quick look instead of a full run.
    pub quick: bool,
    /// The sizes (m²) of the paper's that are measured, largest first.
    pub sizes: Vec<f64>,
    /// The smallest size (m²), of table 3 and the comparison of quality.
    pub finest: f64,
    /// Pixels along a hemicube's top.
    pub resolution: usize,
    /// Seconds that a cell of table 1 may take; what would take longer is estimated from a sample.
    pub budget: f64,
    /// Measurements are made at most so often, and the best counts.
    pub repeats: usize,
    /// Seconds after which none is repeated.
    pub enough: f64,
    /// Tolerances whose loss of quality is measured.
    pub tolerances: Vec<f64>,
    /// Size of the pictures.
    pub picture: (usize, usize),
    /// Bytes that rows may take.
    pub memory: u64,
}

impl Conditions {
    /// The conditions of a full or a quick run.
    pub fn new(args: &Paper) -> Self {
        let memory = machine::available_memory();
        if args.quick {
            return Self {
                quick: true,
                sizes: vec![10.0, 1.0],
                finest: 1.0,
                resolution: 32,
                budget: 0.3,
                repeats: 1,
                enough: 0.0,
                tolerances: vec![0.02],
                picture: (320, 240),
                memory,
            };
        }
        Self {
            quick: false,
            sizes: vec![10.0, 1.0, 0.7, 0.1],
            finest: 0.1,
            resolution: 128,
            budget: 20.0,
            repeats: 3,
            enough: 15.0,
            tolerances: vec![0.1, 0.05, 0.02],
            picture: (640, 480),
            memory,
        }
    }

    /// Hemicubes under these conditions.
    pub fn hemicube(&self, draw: Draw) -> HemicubeOptions {
        HemicubeOptions { resolution: self.resolution, draw }
    }

    /// The resolution relative to the full run's, in pixels.
    pub fn pixels(&self) -> f64 {
        (self.resolution as f64 / 128.0).powi(2)
    }
}

impl fmt::Display for Conditions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.quick {
            writeln!(
                f,
                "**A quick look** (`--quick`): two sizes of four, small hemicubes, small samples, \
                 one \
                 measurement each. Its figures are no results.\n"
            )?;
        }
        let threads = rayon::current_num_threads();
        write!(
            f,
            "Measured with {threads} thread{}, hemicubes of {} pixels along the top.{} In table 1 \
             what would take longer than {} s is estimated from a spread sample of rows and marked \
             with ≈.",
            if threads == 1 { "" } else { "s" },
            self.resolution,
            if self.repeats > 1 {
                format!(" The best of up to {} runs counts.", self.repeats)
            } else {
                String::new()
            },
            self.budget,
        )
    }
}
