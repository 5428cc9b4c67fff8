//! Light of each source of a scene over one atlas.

use super::atlas::{Atlas, BakeError};
use super::facet::Facet;
use super::options::BakeOptions;
use super::sides::Sides;
use super::texels::light_texels;
use crate::gather::{GatherOptions, Gatherer};
use crate::progress::Progress;
use crate::render::Renderer;
use crate::scene::Scene;
use crate::store::Store;
use crate::visibility::Bvh;

/// Light of each source of a scene at each texel of an atlas over its surfaces.
#[derive(Debug)]
pub struct Layers {
    atlas: Atlas,
    /// By source: irradiance of each texel as the source was solved, row by row from the top, W/m²
    /// or lx.
    pub irradiance: Vec<Vec<[f32; 3]>>,
}

impl Layers {
    /// Gathers the light of each source of a solved scene, alone and as it was solved. Surfaces of
    /// a stage are left out.
    ///
    /// # Errors
    /// If the solutions are of another scene, the atlas would be too large, nothing exchanges
    /// light, or the caller cancelled.
    pub fn new(
        scene: &Scene,
        store: &Store,
        options: &BakeOptions,
        gather: GatherOptions,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let all: Vec<usize> = (0..store.sources.len()).collect();
        let lights: Vec<_> = store.balances.iter().map(|b| &b.irradiance[..]).collect();
        let lit = store.shining(scene, &all);
        let sides = Sides::of(&lit, &store.patches, &store.usable, &lights);
        let bvh = Bvh::new(&scene.geometry);
        let mut atlas = None;
        let mut irradiance = Vec::new();
        for source in all.iter().copied() {
            let alone = store.shining(scene, &[source]);
            let solution = store.mix(&alone)?;
            let field = solution.field_heard(&alone, progress)?;
            let gatherer = Gatherer::new(&alone, &solution, &field, &bvh, gather);
            let renderer = Renderer::gathering(&alone, &field, &gatherer);
            let Some(gathered) = renderer.gathered_light() else { break };
            let atlas = match &mut atlas {
                Some(atlas) => atlas,
                none => none.insert(Atlas::of(&sides, gathered, options, all.len(), progress)?),
            };
            let [light, _] = light_texels(atlas, &renderer, |_| [0.0; 3], progress)?;
            irradiance.push(light);
        }
        let atlas = atlas.ok_or(BakeError::Nothing)?;
        Ok(Self { atlas, irradiance })
    }

    /// Texels across and down.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.atlas.size
    }

    /// Width of a texel on surfaces, m.
    #[must_use]
    pub fn texel(&self) -> f64 {
        self.atlas.texel
    }

    /// Number of charts.
    #[must_use]
    pub fn charts(&self) -> usize {
        self.atlas.charts.len()
    }

    /// All surfaces as triangles, with places in the atlas.
    #[must_use]
    pub fn facets(&self) -> Vec<Facet> {
        self.atlas.facets()
    }
}
