//! Triangles that overlap in one plane.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::grid::{Bounds, Grid};
use crate::scene::geometry::{Geometry, Side, TriangleId};
use crate::scene::hash::Mixed;
use crate::scene::planes::plane_key;

/// What was found.
pub struct Overlaps {
    /// Triangles that overlap with one at least as large.
    pub count: usize,
    /// How many of them face the opposite way.
    pub opposite: usize,
    /// The first of them, and what it lies on.
    pub first: (TriangleId, TriangleId),
}

/// Overlaps shallower than this fraction of the triangle are touching edges.
const SHALLOW: f64 = 1e-5;

/// Candidates tried for each triangle; only bundles of slivers have more.
const MOST_TRIED: usize = 512;

struct Flat {
    id: TriangleId,
    plane: u64,
    normal: DVec3,
    corners: [DVec2; 3],
}

/// Finds solid triangles that overlap in their plane; exact duplicates are no longer solid.
pub fn find(g: &Geometry) -> Option<Overlaps> {
    let (low, high) = g.bounds()?;
    let (centre, extent) = ((low + high) / 2.0, (high - low).max_element());
    if !(extent > 0.0 && extent.is_finite()) {
        return None;
    }
    let solid: Vec<TriangleId> = g.ids().filter(|&t| g.is_solid(t)).collect();
    let mut flat: Vec<Flat> = solid
        .par_iter()
        .map(|&id| {
            let corners = g.corners(id).map(|p| p - centre);
            let normal = g.normal(id, Side::Front);
            let plane = plane_key(normal, corners[0], extent);
            let corners = corners.map(|p| dropped(p, normal));
            Flat { id, plane, normal, corners }
        })
        .collect();
    // Planes with a single triangle, nearly all of a curved model, need no test.
    let mut on_plane: HashMap<u64, u32, Mixed> = HashMap::default();
    for f in &flat {
        *on_plane.entry(f.plane).or_default() += 1;
    }
    flat.retain(|f| on_plane[&f.plane] > 1);
    let items: Vec<(u32, u64, Bounds<2>)> = flat
        .par_iter()
        .enumerate()
        .map(|(i, f)| (i as u32, f.plane, Bounds::of(f.corners.map(|c| c.to_array()))))
        .collect();
    let grid = Grid::new(&items);
    let found: Vec<(TriangleId, TriangleId, bool)> = flat
        .par_iter()
        .zip(&items)
        .filter_map(|(a, (i, plane, bounds))| {
            let mut tried = 0;
            let mut other = None;
            grid.meet(*plane, bounds, |j| {
                tried += 1;
                if j != *i && bounds.meets(&items[j as usize].2) {
                    let b = &flat[j as usize];
                    if a.plane == b.plane && overlap(&a.corners, &b.corners) {
                        other = Some((a.id, b.id, a.normal.dot(b.normal) < 0.0));
                    }
                }
                other.is_none() && tried < MOST_TRIED
            });
            other
        })
        .collect();
    let &(a, b, _) = found.first()?;
    let opposite = found.iter().filter(|f| f.2).count();
    Some(Overlaps { count: found.len(), opposite, first: (a, b) })
}

/// A point without the coordinate along which the plane is seen best.
fn dropped(p: DVec3, normal: DVec3) -> DVec2 {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        DVec2::new(p.y, p.z)
    } else if n.y >= n.z {
        DVec2::new(p.z, p.x)
    } else {
        DVec2::new(p.x, p.y)
    }
}

/// Whether two triangles share area: no edge of either separates them.
fn overlap(a: &[DVec2; 3], b: &[DVec2; 3]) -> bool {
    let separates = |t: &[DVec2; 3], o: &[DVec2; 3]| {
        (0..3).any(|i| {
            let across = (t[(i + 1) % 3] - t[i]).perp();
            let range = |s: &[DVec2; 3]| {
                let d = s.map(|p| across.dot(p - t[i]));
                [d[0].min(d[1]).min(d[2]), d[0].max(d[1]).max(d[2])]
            };
            let ([a0, a1], [b0, b1]) = (range(t), range(o));
            a1.min(b1) - a0.max(b0) <= SHALLOW * (a1 - a0).min(b1 - b0)
        })
    };
    !separates(a, b) && !separates(b, a)
}
