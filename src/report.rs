//! What happened: one tree, from the scene to the picture.

use std::time::Instant;

use serde::Serialize;

use crate::engines::EngineReport;
use crate::form_factors::RowsReport;
use crate::solve::{EnergyBalance, SolveReport};

/// Name of the engine of a solution by stored form factors.
pub(crate) const STORED: &str = "stored";

/// Everything worth knowing about one run; serialises to JSON.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Name of the scene.
    pub scene: String,
    /// Source triangles, flagged ones included.
    pub source_triangles: usize,
    /// Patches, with and without a row.
    pub patches: usize,
    /// How many of them join several source triangles.
    pub clusters: usize,
    /// Largest area of a patch, m².
    pub patch_size: f64,
    /// Source triangles that touch or cross so many others that contacts of them may be left out.
    pub contacts_left_out: usize,
    /// The engine and its options.
    pub engine: Option<EngineReport>,
    /// The matrix of form factors.
    pub rows: Option<RowsReport>,
    /// The solution.
    pub solve: Option<SolveReport>,
    /// How well irradiance is known, once somebody asked for it.
    pub error: Option<ErrorReport>,
    /// How well the picture is known, once one was made that is no draft.
    pub picture_error: Option<PictureError>,
    /// Where the light went.
    pub energy: Option<EnergyBalance>,
    /// The stages in order, with wall-clock seconds.
    pub stages: Vec<Stage>,
    /// Bytes that the work was foretold to take.
    pub foretold_memory_bytes: Option<u64>,
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Estimated standard errors of irradiance as a field over the surfaces, each relative to
/// irradiance or 1 % of its mean: what they are at most on four fifths of the lit surface. (An
/// average would tell of the darkest corners alone.)
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorReport {
    /// All of it: the sum of both, patch by patch.
    pub total: f64,
    /// What is due to sampling.
    pub noise: f64,
    /// What is due to the size of patches.
    pub refinement: f64,
    /// All of it, at most on half of the surface.
    pub half: f64,
}

/// Half-widths of 95 % intervals of the luminance of pixels, as shares of it: what they are at most
/// on four fifths of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PictureError {
    /// All of it.
    pub total: f64,
    /// What of it the solution does not know.
    pub of_solution: f64,
}

/// Share of all light that may come from nowhere or go there; more is worth a warning.
pub const IMBALANCE: f64 = 0.01;

/// More or less light arrives than is sent out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imbalance {
    /// What arrives beyond what is sent out, as a share of that.
    pub share: f64,
    /// What most likely brought it about.
    pub cause: Cause,
}

/// Why light does not balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// What patches send out meets nothing that can be told.
    Lost,
    /// Form factors are samples, and these too few.
    Samples,
    /// A row is the view from one point of a patch, and does not stand for all of it.
    Patches,
    /// Form factors are stored ones.
    Stored,
}

impl Report {
    /// What is wrong with the balance of energy, if more than [`IMBALANCE`] of all light is.
    #[must_use]
    pub fn imbalance(&self) -> Option<Imbalance> {
        /// More than this part of an imbalance is its cause.
        const MOST: f64 = 0.5;
        let energy = self.energy?;
        let share = energy.imbalance;
        if share.abs() <= IMBALANCE {
            return None;
        }
        let source: f64 = energy.emitted.iter().chain(&energy.received).sum();
        let lost: f64 = energy.lost.iter().sum();
        let engine = self.engine.as_ref();
        let cause = if lost > MOST * share.abs() * source {
            Cause::Lost
        } else if engine.is_none_or(|e| e.name == STORED) {
            Cause::Stored
        } else if engine.is_some_and(|e| e.samples.is_some() || e.error.is_some()) {
            Cause::Samples
        } else {
            Cause::Patches
        };
        Some(Imbalance { share, cause })
    }
}

/// One stage of the work.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// Seconds of one stage after the other.
pub(crate) struct Clock {
    last: Instant,
    pub(crate) stages: Vec<Stage>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        self.stages.push(Stage { name, seconds: self.last.elapsed().as_secs_f64() });
        self.last = Instant::now();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(imbalance: f64, lost: f64, engine: Option<EngineReport>) -> Report {
        let energy = EnergyBalance {
            emitted: [1.0; 3],
            lost: [lost; 3],
            imbalance,
            ..EnergyBalance::default()
        };
        Report { energy: Some(energy), engine, ..Report::default() }
    }

    #[test]
    fn an_imbalance_has_a_cause() {
        let rays = || {
            let mut engine = EngineReport::named("rays");
            engine.samples = Some(64);
            Some(engine)
        };
        let hemicube = || Some(EngineReport::named("hemicube"));
        let cause = |r: Report| r.imbalance().map(|i| i.cause);
        assert_eq!(Report::default().imbalance(), None);
        assert_eq!(cause(report(0.009, 0.0, rays())), None);
        assert_eq!(cause(report(-0.02, 0.0, rays())), Some(Cause::Samples));
        assert_eq!(cause(report(0.02, 0.0, hemicube())), Some(Cause::Patches));
        assert_eq!(cause(report(0.02, 0.015, hemicube())), Some(Cause::Lost));
        let stored = Some(EngineReport::named(STORED));
        assert_eq!(report(0.3, 0.0, stored).imbalance().map(|i| i.share), Some(0.3));
        assert_eq!(cause(report(0.3, 0.0, None)), Some(Cause::Stored));
    }
}
