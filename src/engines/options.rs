//! The choice of an engine, and what a report says of it.

use serde::{Deserialize, Serialize};

use super::classical::Classical;
use super::engine::{Engine, EngineError};
use super::exact::{Exact, ExactOptions};
use super::hemicube::{Draw, Hemicube, HemicubeOptions};
#[cfg(feature = "gpu")]
use super::hemicube_gpu::HemicubeGpu;
use super::rays::{Rays, RaysOptions};
use crate::patches::Patches;
use crate::progress::Progress;
use crate::scene::Geometry;
use crate::visibility::Bvh;

/// Who makes the form factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EngineOptions {
    /// Hemicubes on the CPU.
    Hemicube(HemicubeOptions),
    /// Hemicubes on the graphics device.
    #[cfg(feature = "gpu")]
    HemicubeGpu(HemicubeOptions),
    /// One visibility ray a pair against every patch: the paper's baseline.
    Classical,
    /// Each pair in closed form, times its visible fraction.
    Exact(ExactOptions),
    /// Sampled rows.
    Rays(RaysOptions),
}

impl EngineOptions {
    /// The engine for these patches. It keeps what it needs for rows under way within `memory`
    /// bytes, and hears from `progress` when it is to stop.
    ///
    /// # Errors
    /// If options are out of range, there is no graphics device, or `progress` stops it.
    pub fn engine<'a>(
        &self,
        geometry: &'a Geometry,
        patches: &'a Patches,
        bvh: &'a Bvh,
        memory: u64,
        progress: &'a dyn Progress,
    ) -> Result<Box<dyn Engine + 'a>, EngineError> {
        #[cfg(not(feature = "gpu"))]
        let _ = memory;
        patches.find_fragments(progress)?;
        Ok(match *self {
            Self::Hemicube(options) => Box::new(Hemicube::new(geometry, patches, options)?),
            #[cfg(feature = "gpu")]
            Self::HemicubeGpu(options) => {
                /// Rows under way on the device take at most this, and a quarter of what is
                /// allowed.
                const UNDER_WAY: u64 = 1 << 30;
                let memory = UNDER_WAY.min(memory / 4);
                Box::new(HemicubeGpu::new(geometry, patches, options, memory)?)
            }
            Self::Classical => Box::new(Classical::new(geometry, patches)),
            Self::Exact(options) => {
                Box::new(Exact::new(geometry, patches, bvh, options, progress)?)
            }
            Self::Rays(options) => Box::new(Rays::new(geometry, patches, bvh, options)),
        })
    }

    /// Whether rows tell what escapes. The classical engine cannot know.
    #[must_use]
    pub fn knows_environment(&self) -> bool {
        *self != Self::Classical
    }

    /// What a report says of `engine`, made by these options.
    pub(crate) fn report(&self, engine: &dyn Engine) -> EngineReport {
        let mut report = EngineReport::named(engine.name());
        report.device = engine.device();
        match self {
            Self::Rays(options) => report.samples = Some(options.samples),
            Self::Exact(options) => report.error = Some(options.error),
            Self::Classical => {}
            Self::Hemicube(options) => report.hemicube(options),
            #[cfg(feature = "gpu")]
            Self::HemicubeGpu(options) => report.hemicube(options),
        }
        report
    }
}

/// Which engine made the form factors.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct EngineReport {
    /// Its name.
    pub name: String,
    /// The graphics device, if one made them; says so when it is one in software.
    pub device: Option<String>,
    /// Pixels along a hemicube's top.
    pub resolution: Option<usize>,
    /// What was projected.
    pub draw: Option<String>,
    /// Rays a row.
    pub samples: Option<usize>,
    /// RMS error of form factors aimed at, as a share of their RMS.
    pub error: Option<f64>,
}

impl EngineReport {
    /// Of an engine of which nothing is known but its name.
    pub(crate) fn named(name: &str) -> Self {
        let name = name.to_owned();
        Self { name, device: None, resolution: None, draw: None, samples: None, error: None }
    }

    fn hemicube(&mut self, options: &HemicubeOptions) {
        self.resolution = Some(options.resolution);
        let draw = match options.draw {
            Draw::Sources => "sources",
            Draw::Patches => "patches",
        };
        self.draw = Some(draw.to_owned());
    }
}
