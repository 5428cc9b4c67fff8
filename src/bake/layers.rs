//! Light of each source of a scene over one atlas.

use rayon::prelude::*;

use super::atlas::{Atlas, BakeError};
use super::facet::Facet;
use super::options::BakeOptions;
use super::sides::Sides;
use super::texels::{field_texels, light_texels, middle_of};
use crate::gather::{GatherOptions, Gatherer};
use crate::patches::{PatchId, Patches};
use crate::progress::Progress;
use crate::render::Renderer;
use crate::render::raster::BAND;
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
    /// Light of each source of a solved scene, alone and as it was solved: gathered at each texel,
    /// or, quickly and roughly, that of patches if `gather` is `None`. Surfaces of a stage are left
    /// out.
    ///
    /// # Errors
    /// If the solutions are of another scene, the atlas would be too large, nothing exchanges
    /// light, or the caller cancelled.
    pub fn new(
        scene: &Scene,
        store: &Store,
        options: &BakeOptions,
        gather: Option<GatherOptions>,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let all: Vec<usize> = (0..store.sources.len()).collect();
        let sides = sides(scene, store);
        let bvh = Bvh::new(&scene.geometry);
        let mut atlas = None;
        let mut irradiance = Vec::new();
        for source in all.iter().copied() {
            let alone = store.shining(scene, &[source]);
            let solution = store.mix(&alone)?;
            let field = solution.field_heard(&alone, progress)?;
            let how = gather.unwrap_or_else(|| GatherOptions::of_pictures(0));
            let gatherer = Gatherer::new_heard(&alone, &solution, &field, &bvh, how, progress)?;
            let renderer = Renderer::gathering(&alone, &field, &gatherer);
            let Some(gathered) = renderer.gathered_light() else { break };
            let atlas = match &mut atlas {
                Some(atlas) => atlas,
                none => none.insert(Atlas::of(&sides, gathered, options, all.len(), progress)?),
            };
            irradiance.push(match gather {
                Some(_) => {
                    let [light, _] = light_texels(atlas, &renderer, None, progress)?;
                    light
                }
                None => field_texels(atlas, &field, &scene.geometry),
            });
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

    /// The patch that each texel lies on, row by row from the top; beyond the edges of a chart that
    /// of a texel beside it.
    #[must_use]
    pub fn patches(&self, patches: &Patches) -> Vec<Option<PatchId>> {
        let [w, h] = self.size();
        let mut found = vec![None; w * h];
        found.par_chunks_mut(w * BAND).enumerate().for_each(|(band, found)| {
            let first = band * BAND;
            let places = self.atlas.places(&(first..first + found.len() / w));
            for (patch, samples) in found.iter_mut().zip(places) {
                *patch = middle_of(&samples).and_then(|p| patches.at(p));
            }
        });
        let beside = |i: usize| {
            let (x, y) = (i % w, i / w);
            let xs = x.saturating_sub(1)..(x + 2).min(w);
            (y.saturating_sub(1)..(y + 2).min(h)).flat_map(move |y| xs.clone().map(move |x| (x, y)))
        };
        let of_any = |i: usize| found[i].or_else(|| beside(i).find_map(|(x, y)| found[y * w + x]));
        (0..w * h).into_par_iter().map(of_any).collect()
    }

    /// All surfaces as triangles, with places in the atlas.
    #[must_use]
    pub fn facets(&self) -> Vec<Facet> {
        self.atlas.facets()
    }
}

/// The sides that any source lights.
fn sides(scene: &Scene, store: &Store) -> Sides {
    let all: Vec<usize> = (0..store.sources.len()).collect();
    let lights: Vec<_> = store.balances.iter().map(|b| &b.irradiance[..]).collect();
    Sides::of(&store.shining(scene, &all), &store.patches, &store.usable, &lights)
}
