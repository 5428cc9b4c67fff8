//! A scene whose light is known at each texel of an atlas over its surfaces.

use std::f32::consts::PI;

use glam::{DVec2, DVec3};

use super::atlas::{Atlas, BakeError};
use super::facet::Facet;
use super::options::BakeOptions;
use super::sides::Sides;
use super::texels::light_texels;
use crate::progress::Progress;
use crate::render::{Renderer, Sight};
use crate::scene::{Rgb, Scene};
use crate::solution::Solution;

/// A scene whose light is known at each texel of an atlas over its surfaces.
pub struct Bake<'a> {
    pub(super) renderer: &'a Renderer<'a>,
    pub(super) scene: &'a Scene,
    pub(super) atlas: Atlas,
    /// Irradiance of each texel, row by row from the top, W/m² or lx.
    pub(super) irradiance: Vec<[f32; 3]>,
    /// What each texel shows, mapped.
    shown: Vec<[f32; 3]>,
}

impl<'a> Bake<'a> {
    /// Bakes the light that `renderer` gathers into texels; `map` makes of what a place shows what
    /// its texel holds, and is averaged over each texel. Surfaces of a stage are left out.
    ///
    /// # Errors
    /// If the atlas would be too large, nothing exchanges light, or the caller cancelled.
    pub fn new(
        scene: &'a Scene,
        solution: &Solution,
        renderer: &'a Renderer<'a>,
        options: &BakeOptions,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let Some(gathered) = renderer.gathered_light() else { return Err(BakeError::Nothing) };
        let Solution { patches, usable, irradiance, .. } = solution;
        let sides = Sides::of(scene, patches, usable, &[irradiance]);
        let atlas = Atlas::of(&sides, gathered, options, 1, progress)?;
        let [irradiance, shown] = light_texels(&atlas, renderer, Some(&map), progress)?;
        Ok(Self { renderer, scene, atlas, irradiance, shown })
    }

    /// Width of a texel on surfaces, m.
    #[must_use]
    pub fn texel(&self) -> f64 {
        self.atlas.texel
    }

    /// Texels across and down.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.atlas.size
    }

    /// Number of charts.
    #[must_use]
    pub fn charts(&self) -> usize {
        self.atlas.charts.len()
    }

    /// Irradiance of each texel, row by row from the top, W/m² or lx.
    #[must_use]
    pub fn irradiance(&self) -> &[[f32; 3]] {
        &self.irradiance
    }

    /// What each texel shows, row by row from the top.
    #[must_use]
    pub fn shown(&self) -> &[[f32; 3]] {
        &self.shown
    }

    /// E / π of each texel: the radiance that it gives a white surface, which some programs
    /// multiply by reflectance.
    #[must_use]
    pub fn lambertian(&self) -> Vec<[f32; 3]> {
        self.irradiance.iter().map(|e| e.map(|c| c / PI)).collect()
    }

    /// All surfaces as triangles, with places in the atlas.
    #[must_use]
    pub fn facets(&self) -> Vec<Facet> {
        self.atlas.facets()
    }

    /// The texels of each chart and of the gutter around it, as numbers.
    pub(crate) fn texels_of(&self, chart: usize) -> impl Iterator<Item = usize> + '_ {
        let ([left, top], [across, down]) = self.atlas.outer(chart);
        let width = self.atlas.size[0];
        (top..top + down).flat_map(move |y| (left..left + across).map(move |x| y * width + x))
    }

    /// Irradiance (W/m² or lx) and what is shown at a place of the atlas (0..1 from its upper
    /// left), bilinear as readers do it.
    #[must_use]
    pub fn at(&self, atlas: DVec2) -> [Rgb; 2] {
        let [w, h] = self.atlas.size.map(|n| n as f64);
        let at = atlas * DVec2::new(w, h);
        [self.read(at), self.bilinear(&self.shown, at)]
    }

    /// Irradiance at a place of the atlas, in texels.
    pub(super) fn read(&self, at: DVec2) -> Rgb {
        self.bilinear(&self.irradiance, at)
    }

    fn bilinear(&self, texels: &[[f32; 3]], at: DVec2) -> Rgb {
        let [w, h] = self.atlas.size;
        let at = at - 0.5;
        let low = at.floor();
        let f = at - low;
        let texel = |dx: f64, dy: f64| {
            let x = (low.x + dx).clamp(0.0, w as f64 - 1.0) as usize;
            let y = (low.y + dy).clamp(0.0, h as f64 - 1.0) as usize;
            DVec3::from_array(texels[y * w + x].map(f64::from))
        };
        let row = |dy: f64| texel(0.0, dy).lerp(texel(1.0, dy), f.x);
        row(0.0).lerp(row(1.0), f.y)
    }
}
