//! How a scene is lit.

use crate::direct::DirectOptions;
use crate::engines::{EngineOptions, RaysOptions};
use crate::form_factors::KeptRows;
use crate::patches::Patches;
use crate::ranks::Ranks;
use crate::scene::{Geometry, Side};
use crate::solve::{Method, SAMPLED_TOLERANCE, SolveOptions};
use crate::units::DEFAULT_MEMORY;

/// How the work of lighting is shared out, and what of it outlives the process. The default: this
/// process does all of it, and keeps nothing.
#[derive(Clone, Default)]
pub struct Work<'a> {
    /// Who shares it. Their light is that of one process to the tolerance of the solver, and the
    /// same to the last bit for any number of ranks.
    pub ranks: Ranks,
    /// Where rows are kept, from which another run takes them up.
    pub kept: Option<&'a dyn KeptRows>,
}

/// How a scene is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightOptions {
    /// Largest area of a patch, m². Default: what adds about [`DEFAULT_PATCHES`] patches to the
    /// source triangles, [`SAMPLED_PATCHES`] where rows are sampled.
    pub patch_size: Option<f64>,
    /// Whether small source triangles are joined to larger patches. Default: where it pays.
    pub cluster: Clustering,
    /// Split further where form factors demand it. Default: no.
    pub adaptive: Option<Adaptive>,
    /// Who makes the form factors. Default: sampled rays.
    pub engine: EngineOptions,
    /// Which emitters light patches analytically, and not through sampled rows. Other engines see
    /// emitters well enough and do not use this.
    pub direct: DirectOptions,
    /// How the balance is solved. Default: Gauss-Seidel.
    pub method: Method,
    /// The residual to reach, relative. Default: 1e-4 with sampled rows, whose noise is larger,
    /// 1e-6 with others.
    pub tolerance: Option<f64>,
    /// The error aimed at, of irradiance on four fifths of the lit surface, as a share of 1:
    /// [`Scene::light`](crate::Scene::light) then chooses rays and patches. With sampled rays only.
    /// Default: none.
    pub error: Option<f64>,
    /// Bytes that the work may take. Default [`DEFAULT_MEMORY`].
    pub memory: u64,
}

impl Default for LightOptions {
    fn default() -> Self {
        Self {
            patch_size: None,
            cluster: Clustering::Auto,
            adaptive: None,
            engine: EngineOptions::Rays(RaysOptions::default()),
            direct: DirectOptions::default(),
            method: Method::default(),
            tolerance: None,
            error: None,
            memory: DEFAULT_MEMORY,
        }
    }
}

impl LightOptions {
    /// Whether several ranks can share the work.
    pub(super) fn can_be_shared(&self) -> bool {
        let gathers = matches!(self.method, Method::GaussSeidel | Method::Jacobi);
        matches!(self.engine, EngineOptions::Rays(_)) && self.adaptive.is_none() && gathers
    }

    /// What the solver is asked for, where rows are `sampled` or not.
    pub(super) fn solve(&self, sampled: bool) -> SolveOptions {
        let usual = SolveOptions::default();
        SolveOptions {
            method: self.method,
            tolerance: self.tolerance.unwrap_or(match sampled {
                true => SAMPLED_TOLERANCE,
                false => usual.tolerance,
            }),
            memory: self.memory,
            ..usual
        }
    }

    /// Number of patches aimed at where no size is given.
    pub(super) fn default_patches(&self, geometry: &Geometry) -> u64 {
        let usual = match self.engine {
            EngineOptions::Rays(_) => SAMPLED_PATCHES,
            _ => DEFAULT_PATCHES,
        };
        // A stage has patches of its own, which are part of them.
        let whole = geometry.whole_from.map_or(0, |from| geometry.len() - from.index());
        usual.saturating_sub(whole as u64).max(usual / 4)
    }

    /// Whether source triangles are to be clustered.
    pub(super) fn clusters(&self, geometry: &Geometry) -> bool {
        match self.cluster {
            Clustering::On => true,
            Clustering::Off => false,
            Clustering::Auto => {
                let count =
                    |t| Side::BOTH.iter().filter(|&&s| geometry.exchanges(t, s)).count() as u64;
                let sides: u64 = geometry.ids().map(count).sum();
                let wanted = |size| Patches::clustered_count(geometry, size);
                let possible = self.adaptive.is_none() && self.engine != EngineOptions::Classical;
                possible
                    && sides > MANY_SIDES
                    && sides as f64 > 2.0 * self.patch_size.map_or(CLUSTERED_PATCHES, wanted)
            }
        }
    }
}

/// Whether small source triangles are joined to larger patches ([`Patches::clustered`]) where they
/// have one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Clustering {
    /// If more than [`MANY_SIDES`] sides exchange light, those are more than twice as many as the
    /// clusters would be, and neither adaptive subdivision nor the classical engine is asked for.
    #[default]
    Auto,
    /// Wherever it is possible; an error with adaptive subdivision and with the classical engine.
    On,
    /// Never.
    Off,
}

/// Models with more exchanging sides of source triangles than this are clustered unless the user
/// says otherwise.
pub const MANY_SIDES: u64 = 20_000;

/// The paper's adaptive subdivision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Largest form factor allowed, 0..1.
    pub max_factor: f64,
    /// Patches are split only while their area exceeds this, m².
    pub min_area: f64,
}

/// Number of patches aimed at where no size is given, beyond one a side of each source triangle.
pub const DEFAULT_PATCHES: u64 = 5_000;

/// The same where rows are sampled.
pub const SAMPLED_PATCHES: u64 = 12_000;

/// Number of patches aimed at where source triangles are clustered and no size is given.
pub const CLUSTERED_PATCHES: f64 = 10_000.0;
