//! Where light by way of other surfaces is calm: nothing near by shapes it, and patches know it.
//!
//! Such light changes over lengths of the distance to the nearest thing (Ward, Rubinstein & Clear
//! 1988, "A ray tracing solution for diffuse interreflection"). Where that is several sizes of a
//! patch, rays from a point would find what the patches around it have found by all of theirs. So a
//! smooth field of what patches receive that way serves, and another one tells how far it does.

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::gatherer::{CLEARANCE, Gatherer};
use super::outlook::Outlook;
use crate::engines::sampling::{Random, cosine};
use crate::patches::{PatchId, Patches, SurfacePoint};
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::Field;
use crate::scene::{Rgb, luminance};
use crate::simd::LANES;
use crate::uncertainty::Uncertainty;
use crate::visibility::{Frame, Hits, NOTHING, Packet};

/// Light is calm from the second of these reaches on, in radii of a patch, and not below the first.
const CALM: [f64; 2] = [1.5, 3.0];

/// Of the noise of patches this much is left in a field through them.
const IN_A_FIELD: f64 = 0.5;

/// Rays from all over a patch.
const RAYS: usize = 64;

/// What patches receive by way of other surfaces, and where that will do.
#[derive(Debug)]
pub(crate) struct Calm<'a> {
    patches: &'a Patches,
    /// Irradiance, W/m² or lx.
    reflected: Field<'a>,
    /// 0 where rays are needed, 1 where they are not, in each component.
    share: Field<'a>,
    usable: &'a [bool],
    /// Standard errors of luminance: what the field has of their noise, and that with what their
    /// size blurs.
    errors: Vec<[f64; 2]>,
}

/// What patches know of the light at a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    /// Irradiance by way of other surfaces, W/m² or lx.
    pub light: Rgb,
    /// How far that will do, 0..1.
    pub share: f64,
    /// Variance of its luminance, where it does; and of what rays read in its stead.
    pub variance: [f64; 2],
}

impl Known {
    const NOTHING: Self = Self { light: Rgb::ZERO, share: 0.0, variance: [0.0; 2] };
}

impl Calm<'_> {
    /// What patches know of the light at a point.
    pub fn at(&self, p: SurfacePoint) -> Known {
        let Some(id) = self.patches.at(p) else { return Known::NOTHING };
        if !self.usable[id.index()] {
            return Known::NOTHING;
        }
        let share = self.share.within(id, p).x.clamp(0.0, 1.0);
        let light = if share > 0.0 { self.reflected.within(id, p) } else { Rgb::ZERO };
        let [noise, all] = self.errors[id.index()];
        Known { light, share, variance: [all * all, noise * noise] }
    }
}

impl<'a> Gatherer<'a> {
    /// Where light by way of other surfaces is calm.
    pub(crate) fn calm(&self) -> Calm<'a> {
        let (geometry, solution) = (&self.scene.geometry, self.solution);
        let usable = |i: PatchId| solution.usable[i.index()];
        let share = |id: PatchId| {
            if !usable(id) {
                return Rgb::ZERO;
            }
            let reach = self.outlooks[id.index()].reach / f64::from(self.radii[id.index()]);
            let share = ((reach - CALM[0]) / (CALM[1] - CALM[0])).clamp(0.0, 1.0);
            Rgb::splat(share)
        };
        let shares: Vec<Rgb> =
            self.patches.ids().collect::<Vec<_>>().into_par_iter().map(share).collect();
        let reflected = Field::new(geometry, self.patches, &solution.reflected, usable);
        let uncertain = Uncertainty::of_reflected(geometry, solution, &reflected);
        let error = |id: PatchId| {
            let noise = IN_A_FIELD * luminance(uncertain.noise[id.index()]);
            [noise, noise + luminance(uncertain.refinement[id.index()])]
        };
        Calm {
            patches: self.patches,
            reflected,
            errors: self.patches.ids().map(error).collect(),
            share: Field::new(geometry, self.patches, shares, usable),
            usable: &solution.usable,
        }
    }

    /// What rays from all over each patch meet: of pictures alone.
    pub(super) fn outlooks(&self, progress: &dyn Progress) -> Result<Vec<Outlook>, Cancelled> {
        if !self.options.of_pictures {
            return Ok(Vec::new());
        }
        let outlook = |i: PatchId| {
            progress.advance(0)?;
            Ok(self.outlook(i))
        };
        self.patches.ids().collect::<Vec<_>>().into_par_iter().map(outlook).collect()
    }

    fn outlook(&self, id: PatchId) -> Outlook {
        let (g, scale) = (&self.scene.geometry, self.bvh.scale());
        let mut random = Random::new(u64::from(id.0) ^ 0x63a1 << 32);
        let mut packets = [Packet::EMPTY; RAYS / LANES];
        let mut faces = [Vec3::ZERO; RAYS];
        for (i, face) in faces.iter_mut().enumerate() {
            let [s, t, u, v] = random.numbers();
            // Of one coordinate one in each of equal intervals.
            let u = (i as f64 + u) / RAYS as f64;
            let at = self.patches.sample_own(id, DVec2::new(s, t));
            let normal = g.normal(at.triangle, at.side);
            let start = at.position(g) + normal * (CLEARANCE * scale);
            let axes = Frame::on_surface(start, normal).axes.map(|a| a.as_vec3());
            let way = cosine(u as f32, v as f32);
            let way = axes[0] * way[0] + axes[1] * way[1] + axes[2] * way[2];
            packets[i / LANES].set(i % LANES, self.bvh.local(start), way, f32::INFINITY, None);
            *face = normal.as_vec3();
        }
        let mut hits = [Hits::NONE; RAYS / LANES];
        self.bvh.closest(&packets, &mut hits);
        let mut outlook = Outlook { reach: f64::INFINITY, near: 0.0 };
        let radius = f64::from(self.radii[id.index()]);
        for (i, face) in faces.into_iter().enumerate() {
            let (k, l) = (i / LANES, i % LANES);
            let reach = self.near_of(&packets[k], &hits[k], l, face).reach;
            outlook.reach = outlook.reach.min(reach);
            let met = hits[k].item[l] != NOTHING;
            if met && f64::from(hits[k].distance[l]) * scale < radius {
                outlook.near += 1.0 / RAYS as f32;
            }
        }
        outlook
    }
}
