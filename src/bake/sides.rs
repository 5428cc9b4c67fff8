//! Which sides of source triangles are baked.

use super::options::USUAL_TEXELS;
use crate::patches::{PatchId, Patches, side_index};
use crate::scene::{Geometry, Rgb, Scene, Side, TriangleId, luminance};

/// Of the mean irradiance; what leaks into solids at contacts is less.
const DARK: f64 = 0.01;

/// Which sides of source triangles are baked: fronts, and backs that light reaches or comes from,
/// which may stand in for a front that it does not. Others lie within solids, or look out of the
/// model.
pub(super) struct Sides {
    /// By `side_index`.
    baked: Vec<bool>,
}

impl Sides {
    /// Those that one of several lights (W/m² or lx a patch) reaches, or that emit.
    pub fn of(scene: &Scene, patches: &Patches, usable: &[bool], lights: &[&[Rgb]]) -> Self {
        let g = &scene.geometry;
        let lit: Vec<PatchId> = patches.ids().filter(|p| usable[p.index()]).collect();
        let mut is_lit = vec![false; patches.len()];
        for light in lights {
            let light = |p: PatchId| luminance(light[p.index()]);
            let mean = lit.iter().map(|p| light(*p)).sum::<f64>() / lit.len().max(1) as f64;
            for p in lit.iter().filter(|p| light(**p) > DARK * mean) {
                is_lit[p.index()] = true;
            }
        }
        let reached = |t, side| {
            g.exchanges(t, side)
                && (scene.optics.emission(t, side) != Rgb::ZERO
                    || patches.of_side(t, side).any(|p| is_lit[p.index()]))
        };
        let counts = |t, side| match side {
            Side::Front => g.exchanges(t, side) && (reached(t, side) || !reached(t, Side::Back)),
            Side::Back => reached(t, side),
        };
        Self { baked: g.ids().flat_map(|t| Side::BOTH.map(|s| counts(t, s))).collect() }
    }

    pub fn has(&self, triangle: TriangleId, side: Side) -> bool {
        self.baked[side_index(triangle, side)]
    }

    /// Whether most are fronts: else faces are turned the wrong way.
    pub fn are_fronts(&self, g: &Geometry) -> bool {
        let area = |side| {
            let own = g.ids().filter(|&t| !g.is_whole(t) && self.has(t, side));
            own.map(|t| g.area(t)).sum::<f64>()
        };
        area(Side::Front) > area(Side::Back)
    }

    /// The width of a texel (m) that gives an atlas of usual size.
    pub fn usual_texel(&self, g: &Geometry) -> f64 {
        let own = g.ids().filter(|&t| g.is_solid(t) && !g.is_whole(t));
        let sides = own.flat_map(|t| Side::BOTH.map(|s| (t, s)));
        let area: f64 = sides.filter(|&(t, s)| self.has(t, s)).map(|(t, _)| g.area(t)).sum();
        (area / USUAL_TEXELS).sqrt()
    }
}
