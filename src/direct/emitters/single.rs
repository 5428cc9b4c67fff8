//! One shadow ray, for places of which there are many.

use std::f64::consts::PI;

use glam::DVec3;

use super::pairs::{kernel, point_on};
use super::receiver::Receiver;
use super::set::Emitters;
use super::solid_angle::toward;
use crate::direct::Analytic;
use crate::engines::sampling::Random;
use crate::scene::Rgb;

impl Emitters<'_> {
    /// A point of the emitters that are analytic for a point, drawn about in proportion to what
    /// arrives from each, and the irradiance (W/m² or lx) that it stands for: on average, where the
    /// segment to it is free, that of all.
    pub(crate) fn one(&self, receiver: &Receiver, random: &mut Random) -> Option<(Rgb, DVec3)> {
        if self.is_empty() || self.options.analytic == Analytic::None {
            return None;
        }
        let [x, u, v] = random.numbers();
        let (k, chance) = self.tree.choose(receiver.centre, receiver.normal, x as f32)?;
        if !self.source_is_analytic(receiver, k) {
            return None;
        }
        let s = &self.sources[k];
        let (from, normal) = receiver.middle;
        let chosen = 1.0 / f64::from(chance);
        if self.tree.is_near(k, receiver.centre) {
            // Evenly over what is seen of it: by area, what is next to the receiver would weigh
            // any amount.
            let (way, angle) = toward(from, &s.corners, [u, v])?;
            let (here, there) = (normal.dot(way), -s.normal.dot(way));
            let distance = -s.normal.dot(s.corners[0] - from) / there;
            let light = s.radiance * (here * angle * chosen);
            let is_seen = here > 0.0 && there > 0.0 && distance > 0.0;
            return is_seen.then(|| (light, from + way * distance));
        }
        let to = point_on(s.corners, u, v);
        let kernel = kernel(s, from, normal, to);
        let light = s.radiance * (PI * kernel * s.area * chosen);
        (kernel > 0.0).then_some((light, to))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::direct::DirectOptions;
    use crate::direct::emitters::sources::Source;
    use crate::form_factors::kernel::point_to_polygon;
    use crate::patches::Patches;
    use crate::scene::{builtin, luminance};
    use crate::visibility::Bvh;

    /// What one ray stands for is on average what all emitters send if nothing stands between.
    #[test]
    fn the_mean_of_single_rays_is_the_light_of_all_emitters() {
        let scene = builtin::build("paper-2").unwrap();
        let patches = Patches::uniform(&scene.geometry, f64::INFINITY).unwrap();
        let bvh = Bvh::new(&scene.geometry);
        let options = DirectOptions::default();
        let emitters =
            Emitters::new(&scene.geometry, &scene.optics, &patches, &bvh, options, |_| Rgb::ZERO);
        let mut random = Random::new(3);
        let (low, high) = scene.geometry.bounds().unwrap_or_default();
        for k in 0..12 {
            let [x, y, z] = random.numbers();
            let at = low + (high - low) * DVec3::new(x, y, z);
            let normal = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X][k % 4];
            let receiver = emitters.point(at, normal, 0);
            let sent = |(k, s): (usize, &Source)| {
                let faces = s.normal.dot(at - s.corners[0]) > 0.0;
                let counts = faces && emitters.source_is_analytic(&receiver, k);
                let factor = if counts { point_to_polygon(at, normal, &s.corners) } else { 0.0 };
                s.radiance * (PI * factor)
            };
            let all: Rgb = emitters.sources.iter().enumerate().map(sent).sum();
            let count = 60_000;
            let drawn = (0..count).filter_map(|_| emitters.one(&receiver, &mut random));
            let mut sums = (0.0, 0.0);
            for light in drawn.map(|(light, _)| luminance(light)) {
                sums = (sums.0 + light, sums.1 + light * light);
            }
            let mean = sums.0 / f64::from(count);
            let error =
                (sums.1 / f64::from(count) - mean * mean).max(0.0).sqrt() / f64::from(count).sqrt();
            let exact = luminance(all);
            assert!(
                (mean - exact).abs() <= 4.5 * error + 0.01 * exact,
                "{at}: {mean} {exact} {error}"
            );
        }
    }
}
