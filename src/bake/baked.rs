//! A scene whose light is known at each texel of an atlas over its surfaces.

use std::f32::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::atlas::{Atlas, BakeError, Texels};
use super::charts::Piece;
use super::facet::Facet;
use super::fill;
use crate::gather::Probe;
use crate::patches::PatchId;
use crate::progress::Progress;
use crate::render::raster::BAND;
use crate::render::{Renderer, Sight};
use crate::scene::{Rgb, Scene, Side, TriangleId, luminance};
use crate::solution::Solution;

/// Texels of an atlas, about, unless a size is given.
const USUAL_TEXELS: f64 = 262_144.0;

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

/// The width of a texel (m) that gives a scene an atlas of usual size.
#[must_use]
pub fn usual_texel(scene: &Scene, solution: &Solution) -> f64 {
    let g = &scene.geometry;
    let counts = counts(scene, solution);
    let own = g.ids().filter(|&t| g.is_solid(t) && !g.is_whole(t));
    let sides = own.flat_map(|t| Side::BOTH.map(|s| (t, s))).filter(|&(t, s)| counts(t, s));
    let area: f64 = sides.map(|(t, _)| g.area(t)).sum();
    (area / USUAL_TEXELS).sqrt()
}

/// Whether a side counts: fronts do, and backs that light reaches or comes from, which may stand in
/// for a front that it does not. Others lie within solids, or look out of the model.
fn counts<'a>(
    scene: &'a Scene,
    solution: &'a Solution,
) -> impl Fn(TriangleId, Side) -> bool + Sync + 'a {
    /// Of the mean irradiance; what leaks into solids at contacts is less.
    const DARK: f64 = 0.01;
    let g = &scene.geometry;
    let light = move |p: PatchId| luminance(solution.irradiance[p.index()]);
    let lit = || solution.patches.ids().filter(|p| solution.usable[p.index()]);
    let mean = lit().map(light).sum::<f64>() / lit().count().max(1) as f64;
    let reached = move |t, side| {
        g.exchanges(t, side)
            && (scene.optics.emission(t, side) != Rgb::ZERO
                || solution
                    .patches
                    .of_side(t, side)
                    .any(|p| solution.usable[p.index()] && light(p) > DARK * mean))
    };
    move |t, side| match side {
        Side::Front => g.exchanges(t, side) && (reached(t, side) || !reached(t, Side::Back)),
        Side::Back => reached(t, side),
    }
}

impl<'a> Bake<'a> {
    /// Bakes the light that `renderer` gathers into texels of a width (m) on surfaces; `map` makes
    /// of what a place shows what its texel holds, and is averaged over each texel. Surfaces of a
    /// stage are left out.
    ///
    /// # Errors
    /// If the atlas would be too large, nothing exchanges light, or the caller cancelled.
    pub fn new(
        scene: &'a Scene,
        solution: &Solution,
        renderer: &'a Renderer<'a>,
        texel: f64,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let Some(gathered) = renderer.gathered_light() else { return Err(BakeError::Nothing) };
        let g = &scene.geometry;
        let counts = counts(scene, solution);
        // Where most sides that count are backs, faces are turned the wrong way.
        let area = |side| {
            let own = g.ids().filter(|&t| !g.is_whole(t) && counts(t, side));
            own.map(|t| g.area(t)).sum::<f64>()
        };
        let is_wound = area(Side::Front) > area(Side::Back);
        let is_covered = |piece: &Piece| {
            let point = piece.point(DVec3::splat(1.0 / 3.0)).position(g);
            let probe = Probe { point, normal: g.normal(piece.triangle, piece.side) };
            is_wound && gathered.gatherer.is_enclosed(probe, u64::from(piece.triangle.0))
        };
        let atlas = Atlas::new(scene, texel, &counts, is_covered, progress)?;
        if atlas.pieces.is_empty() {
            return Err(BakeError::Nothing);
        }
        let [w, h] = atlas.size;
        let mut irradiance = vec![[0.0_f32; 3]; w * h];
        let mut shown = vec![[0.0_f32; 3]; w * h];
        let mut covered = vec![false; w * h];
        progress.stage("texels", h as u64);
        let texels = Texels { atlas: &atlas, gathered };
        gathered.light(&texels, progress, |rows, lit| {
            let of_rows = rows.start * w..rows.end * w;
            irradiance[of_rows.clone()]
                .par_chunks_mut(w * BAND)
                .zip(shown[of_rows.clone()].par_chunks_mut(w * BAND))
                .zip(covered[of_rows].par_chunks_mut(w * BAND))
                .enumerate()
                .for_each(|(band, ((irradiance, shown), covered))| {
                    let first = rows.start + band * BAND;
                    let places = texels.places(&(first..first + irradiance.len() / w));
                    for (cell, samples) in places.iter().enumerate() {
                        let mut count = 0.0;
                        for (sample, at) in samples.iter().enumerate() {
                            let (_, light) = lit.of(band * BAND * w + cell, sample);
                            let Some((at, light)) = at.zip(light) else { continue };
                            let value = map(&renderer.sight(at, light.irradiance));
                            let e = light.irradiance.as_vec3().to_array();
                            for c in 0..3 {
                                irradiance[cell][c] += e[c];
                                shown[cell][c] += value[c];
                            }
                            count += 1.0;
                        }
                        covered[cell] = count > 0.0;
                        if count > 0.0 {
                            irradiance[cell] = irradiance[cell].map(|c| c / count);
                            shown[cell] = shown[cell].map(|c| c / count);
                        }
                    }
                });
        })?;
        fill::fill(&atlas, &covered, &mut [&mut irradiance, &mut shown]);
        fill::lend(&atlas, g, &covered, &mut [&mut irradiance, &mut shown]);
        Ok(Self { renderer, scene, atlas, irradiance, shown })
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
        self.atlas.pieces.iter().map(|p| self.facet(p, [[0.0; 3]; 3])).collect()
    }

    pub(super) fn facet(&self, p: &Piece, radiance: [[f32; 3]; 3]) -> Facet {
        let [w, h] = self.atlas.size.map(|n| n as f64);
        Facet {
            triangle: p.triangle,
            side: p.side,
            corners: p.corners,
            atlas: p.texels.map(|t| t / DVec2::new(w, h)),
            chart: p.chart,
            radiance,
        }
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
