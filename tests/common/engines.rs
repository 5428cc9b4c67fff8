//! Every engine with its default options, and every solver: what has a known answer runs through
//! all of them.

use hemicube::engines::{Draw, Engine, EngineOptions, ExactOptions, HemicubeOptions, RaysOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::Geometry;
use hemicube::solve::Method;
use hemicube::units::DEFAULT_MEMORY;
use hemicube::visibility::Bvh;

/// An engine of default options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Hemicube(Draw),
    Classical,
    Rays,
    Exact,
}

/// All engines of the processor.
pub const ENGINES: [Kind; 5] = [
    Kind::Hemicube(Draw::Sources),
    Kind::Hemicube(Draw::Patches),
    Kind::Classical,
    Kind::Rays,
    Kind::Exact,
];

/// Those that look from the centre of a patch; the others find means over its area.
pub const CENTRED: [Kind; 3] = [ENGINES[0], ENGINES[1], ENGINES[2]];

/// All solvers.
pub const METHODS: [Method; 4] =
    [Method::GaussSeidel, Method::Jacobi, Method::Shooting, Method::Direct];

impl Kind {
    /// Its default options.
    pub fn options(self) -> EngineOptions {
        match self {
            Self::Hemicube(draw) => {
                EngineOptions::Hemicube(HemicubeOptions { draw, ..HemicubeOptions::default() })
            }
            Self::Classical => EngineOptions::Classical,
            Self::Rays => EngineOptions::Rays(RaysOptions { samples: 1024, seed: 0 }),
            Self::Exact => EngineOptions::Exact(ExactOptions::default()),
        }
    }

    /// Calls `work` with the engine for these patches.
    pub fn with<T>(self, g: &Geometry, p: &Patches, work: impl FnOnce(&mut dyn Engine) -> T) -> T {
        let bvh = Bvh::new(g);
        let mut engine = self.options().engine(g, p, &bvh, DEFAULT_MEMORY, &Silent).unwrap();
        work(engine.as_mut())
    }
}

/// The rows of `ids`.
pub fn rows_of(kind: Kind, g: &Geometry, p: &Patches, ids: &[PatchId]) -> Vec<Row> {
    let mut rows = vec![Row::default(); ids.len()];
    kind.with(g, p, |engine| engine.fill(ids, &mut rows)).unwrap();
    rows
}

/// The rows of all patches.
pub fn all_rows(kind: Kind, g: &Geometry, p: &Patches) -> Vec<Row> {
    rows_of(kind, g, p, &p.ids().collect::<Vec<_>>())
}

/// Half the sum of absolute differences.
pub fn total_variation(p: &Patches, a: &Row, b: &Row) -> f64 {
    p.ids().map(|j| (a.factor_to(j) - b.factor_to(j)).abs()).sum::<f64>() / 2.0
}
