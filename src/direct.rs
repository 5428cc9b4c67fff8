//! Direct light: the irradiance D that arrives straight from emitters, lamps and the sky, and the
//! optics of patches that it starts from.

mod emitters;

pub use emitters::{Apart, ApartOptions, DirectLight, Emitters, MOST_SHADOW, Receiver, Room};

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::form_factors::FormFactors;
use crate::patches::{PatchId, Patches, SurfacePoint, side_index};
use crate::scene::{Lamp, Optics, Rgb, Scene, Side, TriangleId};
use crate::visibility::{Blockers, Bvh, Sight};

/// Reflectance ρ of each patch, 0..1: its source triangle's; of a cluster the mean by area.
#[must_use]
pub fn reflectance(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, _| optics.reflectance[t.index()])
}

/// Emission E (self-emitted exitance, W/m² or lm/m²) of each patch: its source triangle side's; of
/// a cluster the mean by area.
#[must_use]
pub fn emission(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, side| optics.emission(t, side))
}

/// The mean over each patch of what its source triangles' sides have.
fn mean(patches: &Patches, value: impl Fn(TriangleId, Side) -> Rgb) -> Vec<Rgb> {
    let of = |id: PatchId| {
        let cell = patches.cell(id);
        let first = value(cell.triangle, cell.side);
        // Exact where all are alike, as nearly always.
        if patches.members(id).iter().all(|&t| value(t, cell.side) == first) {
            return first;
        }
        patches.shares(id).map(|(t, share)| value(t, cell.side) * share).sum()
    };
    patches.ids().map(of).collect()
}

/// Direct irradiance of each patch (W/m² or lx) through its stored row:
///
/// ```text
/// D = F E + π L F_environment
/// ```
///
/// with the sky's uniform radiance L.
#[must_use]
pub fn through_rows(factors: &FormFactors, emission: &[Rgb], sky: Rgb) -> Vec<Rgb> {
    (0..factors.len() as u32)
        .into_par_iter()
        .map(|i| {
            let id = PatchId(i);
            factors.gather(id, emission) + sky * (PI * factors.account(id).environment)
        })
        .collect()
}

/// Direct irradiance of each patch with a row: from the emitters set apart for it by shadow rays, from
/// the others and the sky through its sampled row.
#[must_use]
pub fn apart(
    emitters: &Emitters<'_>,
    patches: &Patches,
    factors: &FormFactors,
    emission: &[Rgb],
    sky: Rgb,
) -> Vec<DirectLight> {
    let halves = factors.halves();
    let side = |j: usize| {
        let cell = patches.cell(PatchId(j as u32));
        side_index(cell.triangle, cell.side)
    };
    (0..patches.len() as u32)
        .into_par_iter()
        .map_init(Room::default, |room, i| {
            let id = PatchId(i);
            if !factors.has_row(id) {
                return DirectLight::default();
            }
            let receiver = emitters.patch(patches, id);
            let mut light = emitters.light_patch(&receiver, patches, id, room);
            let left = |j: usize| {
                let e = emission[j];
                if e == Rgb::ZERO || emitters.is_apart(&receiver, side(j)) { Rgb::ZERO } else { e }
            };
            let through = factors.gather_by(id, left);
            light.irradiance += through;
            for (k, half) in light.halves.iter_mut().enumerate() {
                *half += halves.as_ref().map_or(through, |h| h[k].gather_by(id, left));
            }
            light += sky * (PI * factors.account(id).environment);
            light
        })
        .collect()
}

/// Points of a cluster that lamps shine on.
const CLUSTER_POINTS: usize = 16;

/// Points of a patch that lamps shine on: the centroids of its four parts, or points spread evenly
/// over a cluster.
fn points_of(patches: &Patches, id: PatchId, points: &mut Vec<SurfacePoint>) {
    points.clear();
    if !patches.is_cluster(id) {
        let third = DVec3::splat(1.0 / 3.0);
        points.extend(patches.cell(id).children().map(|part| part.point(third)));
        return;
    }
    /// The fractional part of the golden ratio: multiples of it fill the unit interval evenly.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    points.extend((0..CLUSTER_POINTS).map(|k| {
        let k = k as f64 + 0.5;
        patches.sample(id, DVec2::new(k / CLUSTER_POINTS as f64, (k * GOLDEN).fract()))
    }));
}

/// Irradiance of each patch from lamps (W/m² or lx), the mean over four points of it (16 of a cluster),
/// with shadows.
///
/// ```text
/// H = I(ω) cos θ / r²        point and spot lamps
/// H = H_⊥ cos θ              directional ones
/// ```
///
/// The cone of a spot lamp falls off as `KHR_lights_punctual` recommends.
#[must_use]
pub fn from_lamps(scene: &Scene, patches: &Patches) -> Vec<Rgb> {
    let mut direct = vec![Rgb::ZERO; patches.len()];
    if scene.lamps.is_empty() {
        return direct;
    }
    let g = &scene.geometry;
    let corners: Vec<[DVec3; 3]> =
        g.ids().filter(|&t| g.is_solid(t)).map(|t| g.corners(t)).collect();
    let blockers = Blockers::new(&corners);
    let far = g.bounds().map_or(0.0, |(low, high)| 2.0 * (high - low).length());
    for lamp in &scene.lamps {
        let position = match lamp {
            Lamp::Point { position, .. } | Lamp::Spot { position, .. } => Some(*position),
            Lamp::Directional { .. } => None,
        };
        direct.par_chunks_mut(256).enumerate().for_each(|(block, direct)| {
            let mut sight = Sight::default();
            if let Some(position) = position {
                blockers.look(blockers.local(position), &mut sight);
            }
            let mut lit: Vec<(usize, Vec3, Rgb)> = Vec::new();
            let (mut shadowed, mut points) = (Vec::new(), Vec::new());
            for (k, direct) in direct.iter_mut().enumerate() {
                let id = PatchId((block * 256 + k) as u32);
                points_of(patches, id, &mut points);
                let share = 1.0 / points.len() as f64;
                for p in &points {
                    let (point, normal) = (p.position(g), g.normal(p.triangle, p.side));
                    let (irradiance, towards) = unshadowed(lamp, point, normal);
                    if irradiance == Rgb::ZERO {
                        continue;
                    }
                    if position.is_some() {
                        lit.push((k, blockers.local(point), irradiance * share));
                    } else if !blockers.blocks(point, point + towards * far) {
                        *direct += irradiance * share;
                    }
                }
            }
            let ends: Vec<Vec3> = lit.iter().map(|l| l.1).collect();
            blockers.blocked(&sight, &ends, &mut shadowed);
            for ((k, _, irradiance), _) in lit.iter().zip(&shadowed).filter(|(_, s)| !**s) {
                direct[*k] += *irradiance;
            }
        });
    }
    direct
}

/// Irradiance from all lamps at a point (W/m² or lx), with shadows.
pub(crate) fn lamps_at(scene: &Scene, bvh: &Bvh, point: DVec3, normal: DVec3) -> Rgb {
    let light = |lamp: &Lamp| {
        let (irradiance, towards) = unshadowed(lamp, point, normal);
        if irradiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let end = match lamp {
            Lamp::Point { position, .. } | Lamp::Spot { position, .. } => *position,
            Lamp::Directional { .. } => {
                point + towards * ((point - bvh.center()).length() + 2.0 * bvh.scale())
            }
        };
        if bvh.blocks(point, end) { Rgb::ZERO } else { irradiance }
    };
    scene.lamps.iter().map(light).sum()
}

/// Irradiance that a lamp alone would give, and the unit direction towards it.
fn unshadowed(lamp: &Lamp, point: DVec3, normal: DVec3) -> (Rgb, DVec3) {
    let (irradiance, towards) = match lamp {
        Lamp::Directional { direction, irradiance, .. } => (*irradiance, -*direction),
        Lamp::Point { position, intensity, .. } | Lamp::Spot { position, intensity, .. } => {
            let way = *position - point;
            let distance2 = way.length_squared();
            if distance2 == 0.0 {
                return (Rgb::ZERO, normal);
            }
            (*intensity / distance2, way / distance2.sqrt())
        }
    };
    let cone = match lamp {
        Lamp::Spot { direction, inner, outer, .. } => {
            let (cos, edge) = (-towards.dot(*direction), outer.cos());
            let t = ((cos - edge) / (inner.cos() - edge).max(1e-9)).clamp(0.0, 1.0);
            t * t
        }
        Lamp::Point { .. } | Lamp::Directional { .. } => 1.0,
    };
    (irradiance * (cone * normal.dot(towards).max(0.0)), towards)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides, Surface};

    /// A floor of 2 x 2 m at y = 0, and a screen of 1 x 1 m above one of its quarters.
    fn floor_and_screen(lamp: Lamp) -> (Scene, Patches) {
        let mut b = SceneBuilder::new("lamp");
        let m = b.material(Material::default());
        let s = b.surface(Surface { name: "floor".into(), node: 0, primitive: 0 });
        for (from, to, y) in [(-1.0, 1.0, 0.0), (0.0, 1.0, 0.5)] {
            let v = [(from, from), (from, to), (to, to), (to, from)]
                .map(|(x, z)| b.vertex(DVec3::new(x, y, z)));
            b.triangle([v[0], v[1], v[2]], None, s, m, Sides::Two);
            b.triangle([v[0], v[2], v[3]], None, s, m, Sides::Two);
        }
        b.lamp(lamp);
        let scene = b.finish();
        let patches = Patches::uniform(&scene.geometry, 0.002).unwrap();
        (scene, patches)
    }

    fn at(scene: &Scene, patches: &Patches, direct: &[Rgb], x: f64, z: f64) -> f64 {
        let nearest = patches
            .ids()
            .filter(|&i| patches.cell(i).triangle.0 < 2 && direct_side(scene, patches, i))
            .min_by(|&a, &b| {
                let d = |i| {
                    let p = patches.center(i).position(&scene.geometry);
                    (p - DVec3::new(x, 0.0, z)).length()
                };
                d(a).total_cmp(&d(b))
            })
            .unwrap();
        direct[nearest.index()].x
    }

    fn direct_side(scene: &Scene, patches: &Patches, i: PatchId) -> bool {
        let cell = patches.cell(i);
        scene.geometry.normal(cell.triangle, cell.side).y > 0.0
    }

    #[test]
    fn a_point_lamp_follows_the_inverse_square_and_casts_shadows() {
        let lamp = Lamp::Point {
            name: "lamp".into(),
            position: DVec3::new(-0.5, 2.0, -0.5),
            intensity: Rgb::splat(100.0),
        };
        let (scene, patches) = floor_and_screen(lamp);
        let direct = from_lamps(&scene, &patches);
        let below = at(&scene, &patches, &direct, -0.5, -0.5);
        assert!((below / 25.0 - 1.0).abs() < 0.005, "100 cd at 2 m: 25 lx, got {below}");
        assert_eq!(at(&scene, &patches, &direct, 0.75, 0.75), 0.0);
    }

    #[test]
    fn the_sun_casts_a_sharp_shadow_straight_down() {
        let lamp = Lamp::Directional {
            name: "sun".into(),
            direction: DVec3::NEG_Y,
            irradiance: Rgb::splat(3.0),
        };
        let (scene, patches) = floor_and_screen(lamp);
        let direct = from_lamps(&scene, &patches);
        assert_eq!(at(&scene, &patches, &direct, 0.5, 0.5), 0.0);
        assert_eq!(at(&scene, &patches, &direct, -0.5, 0.5), 3.0);
        let lit = patches.ids().filter(|i| direct[i.index()].x > 0.0).map(|i| patches.area(i));
        // Three quarters of the floor and the whole screen.
        assert!((lit.sum::<f64>() - 4.0).abs() < 0.05);
    }

    #[test]
    fn a_spot_lamp_shines_within_its_cone_only() {
        let lamp = Lamp::Spot {
            name: "spot".into(),
            position: DVec3::new(-0.5, 1.0, -0.5),
            direction: DVec3::NEG_Y,
            intensity: Rgb::splat(10.0),
            inner: 0.2,
            outer: 0.4,
        };
        let (scene, patches) = floor_and_screen(lamp);
        let direct = from_lamps(&scene, &patches);
        assert!((at(&scene, &patches, &direct, -0.5, -0.5) / 10.0 - 1.0).abs() < 0.005);
        assert_eq!(at(&scene, &patches, &direct, 0.0, -0.5), 0.0, "beyond 0.42 m");
    }
}
