//! The lamp that a dark room is in want of.

use std::f64::consts::PI;

use glam::DVec3;

use super::model::{Inner, Model, look_around};
use super::rays::cast;
use crate::scene::{Side, TriangleId};

/// Irradiance that the lamp brings to what is nearest, lx: that of a living room.
const LUX: f64 = 100.0;

/// How far over an eye outside the lamp hangs, as a share of the way to the model.
const BESIDE: f64 = 0.3;

/// A lamp that would light a dark room, and what is around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendant {
    /// Where it hangs, m.
    pub position: DVec3,
    /// Its flux, lm.
    pub flux: f64,
    /// Whether nothing of what is around opens outwards.
    pub closed: bool,
    /// Share of fronts in what it shines on, 0..1.
    pub fronts: f64,
    /// Share of sides that reflect in what it shines on, 0..1.
    pub lit: f64,
    /// What is over it, and on which side.
    pub above: Option<(TriangleId, Side)>,
}

impl Model<'_> {
    /// The lamp that would light what an eye sees: within the model where there is most room in its
    /// sight, and beside an eye that is outside.
    #[must_use]
    pub fn pendant(&self, eye: DVec3) -> Pendant {
        let (low, high) = self.bounds;
        if eye.cmplt(low).any() || eye.cmpgt(high).any() {
            let far = (eye - self.centre()).length();
            let position = eye + self.up * (BESIDE * far);
            let flux = flux_at(far);
            return Pendant { position, flux, closed: false, fronts: 1.0, lit: 1.0, above: None };
        }
        let here = look_around(&self.bvh, &[eye]);
        let seen = self.free().filter(|p| !self.bvh.blocks(eye, p.at));
        // An eye may touch what it looks from.
        let mut best = (eye, 1e-3 * self.size(), None);
        for p in here.iter().chain(seen) {
            let room = p.met().map(|h| h.distance).fold(f64::INFINITY, f64::min);
            if room.is_finite() && room >= best.1 {
                best = (p.at, room, Some(p));
            }
        }
        let (position, room, around) = best;
        let lit = |p: &Inner| {
            let lit = p.met().filter(|h| self.is_lit_side(h)).count();
            lit as f64 / p.met().count().max(1) as f64
        };
        let above = cast(&self.bvh, &[(position, self.up)]).pop().flatten();
        Pendant {
            position,
            flux: flux_at(room),
            closed: around.is_some_and(|p| p.enclosure == 1.0),
            fronts: around.map_or(1.0, Inner::fronts),
            lit: around.map_or(1.0, lit),
            above: above.map(|h| (h.triangle, h.side)),
        }
    }
}

/// The flux that brings about that irradiance at a distance in metres, lm.
fn flux_at(distance: f64) -> f64 {
    4.0 * PI * distance * distance * LUX
}
