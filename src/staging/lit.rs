//! Whether a room has light of its own.

use glam::DVec3;

use super::model::Model;
use crate::scene::{Side, TriangleId, luminance};

/// So many emitters stand for all.
const EMITTERS: usize = 64;

/// A point is lit if it gets this share of the light of the brightest.
const DIM: f64 = 0.01;

/// An emitter that fills less than this solid angle is out of sight, sr.
const SMALL: f64 = 1e-4;

/// A room is lit if this share of the points within it is.
const SHARE: f64 = 0.25;

impl Model<'_> {
    /// Whether surfaces that emit light the model from within, and not just a corner of it.
    #[must_use]
    pub fn is_lit(&self) -> bool {
        let emitters = self.emitters();
        let light = |at: DVec3| emitters.iter().map(|&e| self.light(e, at)).sum::<f64>();
        let lit: Vec<f64> = self.free().map(|p| light(p.at)).collect();
        let most = lit.iter().copied().fold(0.0, f64::max);
        let brightest = |e: &TriangleId| luminance(self.scene.optics.emission[e.index()]);
        let least = SMALL * emitters.iter().map(brightest).fold(0.0, f64::max);
        let count = lit.iter().filter(|&&l| l > least.max(DIM * most)).count();
        most > 0.0 && count as f64 >= SHARE * lit.len() as f64
    }

    /// The strongest emitters.
    fn emitters(&self) -> Vec<TriangleId> {
        let (g, optics) = (&self.scene.geometry, &self.scene.optics);
        let power = |t: &TriangleId| luminance(optics.emission(*t, Side::Front)) * g.area(*t);
        let mut emitters: Vec<TriangleId> =
            self.bvh.ids().iter().copied().filter(|t| power(t) > 0.0).collect();
        emitters.sort_by(|a, b| power(b).total_cmp(&power(a)));
        emitters.truncate(EMITTERS);
        emitters
    }

    /// Emission of a triangle times the solid angle under which a point sees it, about.
    fn light(&self, emitter: TriangleId, at: DVec3) -> f64 {
        let g = &self.scene.geometry;
        let [a, b, c] = g.corners(emitter);
        let way = at - (a + b + c) / 3.0;
        let slant = g.normal(emitter, Side::Front).dot(way.normalize_or_zero());
        let side = if slant > 0.0 { Side::Front } else { Side::Back };
        let emission = luminance(self.scene.optics.emission(emitter, side));
        // Off the emitter, so that it does not hide itself.
        let from = at - way * (1.0 - 1e-3);
        if emission <= 0.0 || self.bvh.blocks(from, at) {
            return 0.0;
        }
        emission * slant.abs() * g.area(emitter) / way.length_squared().max(f64::MIN_POSITIVE)
    }
}
