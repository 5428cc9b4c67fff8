//! Lights under the ceilings of a closed room.

use glam::DVec3;

use super::model::{Inner, Model};
use super::rays::{cast, horizon};
use crate::scene::{Material, Rgb, Scene};

/// A square that shines downwards.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    centre: DVec3,
    /// Half its sides, m.
    half: [DVec3; 2],
    /// Its height above what is below it, m.
    drop: f64,
}

/// At most so many are hung.
const MOST: usize = 24;

/// A light reaches what it is seen from, up to this multiple of its height above the floor.
const REACH: f64 = 5.0;

/// This share of the points may stay in the shadow of furniture.
const LEFT: f64 = 0.1;

/// Share of the height over a point at which its light hangs.
const HEIGHT: f64 = 0.97;

/// Half the side of a panel, as a share of the way to the nearest wall.
const SIZE: f64 = 0.3;

/// Radiance of the panels; exposure follows it.
const RADIANCE: f64 = 10.0;

/// Panels that together reach most points within the model, and an eye there.
pub(super) fn panels(model: &Model<'_>, eye: DVec3) -> Vec<Panel> {
    let mut dark: Vec<&Inner> = model.free().collect();
    let enough = (LEFT * dark.len() as f64) as usize;
    let places: Vec<(Panel, DVec3)> = dark.iter().filter_map(|p| hang(model, p.at)).collect();
    let (mut panels, mut seen) = (Vec::new(), false);
    while dark.len() > enough && panels.len() < MOST {
        let reached = |(panel, below): &(Panel, DVec3)| {
            let near = |p: DVec3| (p - *below).length() < REACH * panel.drop;
            dark.iter().map(|p| near(p.at) && !model.bvh.blocks(*below, p.at)).collect()
        };
        let count = |r: &Vec<bool>| r.iter().filter(|r| **r).count();
        // Of places that reach as much, the one that is high and has room for a large panel.
        let worth = |((panel, _), reached): &((Panel, DVec3), Vec<bool>)| {
            count(reached) as f64 * panel.half[0].length() * panel.drop.powi(2)
        };
        let all = places.iter().map(|place| (*place, reached(place)));
        let best = all.reduce(|a, b| if worth(&b) > worth(&a) { b } else { a });
        let Some(((panel, below), reached)) = best.filter(|b| count(&b.1) > 0) else { break };
        let mut left = reached.iter();
        dark.retain(|_| left.next() == Some(&false));
        seen |= !model.bvh.blocks(below, eye);
        panels.push(panel);
    }
    if !seen {
        // The eye is in a nook that those few points do not tell of.
        panels.extend(hang(model, model.pendant(eye).position).map(|place| place.0));
    }
    panels
}

/// A panel under the ceiling over a point, and a point right below it.
fn hang(model: &Model<'_>, at: DVec3) -> Option<(Panel, DVec3)> {
    let up = model.up;
    let height = model.bvh.see(at, up, None)?.distance;
    let centre = at + up * (HEIGHT * height);
    let around: Vec<(DVec3, DVec3)> = horizon(up, 8).map(|d| (centre, d)).collect();
    let near = |hits: &[Option<super::rays::Hit>]| {
        hits.iter().flatten().map(|h| h.distance).fold(f64::INFINITY, f64::min)
    };
    let clear = near(&cast(&model.bvh, &around)).min(0.2 * model.size());
    let x = horizon(up, 4).next()? * (SIZE * clear);
    let drop = model.bvh.see(centre, -up, None).map_or(height, |m| m.distance);
    let panel = Panel { centre, half: [x, up.cross(x)], drop };
    Some((panel, centre - up * (0.01 * height)))
}

impl Panel {
    /// Hangs it into the scene.
    pub(super) fn set(&self, scene: &mut Scene) {
        let [x, y] = self.half;
        let corners = [-x - y, x - y, x + y, y - x].map(|c| self.centre + c);
        let material = Material {
            name: "stage ceiling light".into(),
            radiance: Rgb::splat(RADIANCE),
            ..Material::default()
        };
        scene.extend(&corners, &[[0, 2, 1], [0, 3, 2]], material);
    }
}
