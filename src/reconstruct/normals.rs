//! Normals that turn smoothly over curved surfaces, for light that follows them.

use glam::DVec3;
use rayon::prelude::*;

use super::mesh::Mesh;
use crate::patches::{Cell, Patches, SurfacePoint, side_index};
use crate::scene::{Geometry, Side};

/// Normals whose cosine to a face's own is beyond this are the face's own.
const FLAT: f64 = 1.0 - 1e-6;

/// A normal at each corner of each side that has patches: the mean of those of all faces that meet
/// there across smooth edges, weighted by angle and area.
#[derive(Debug, Clone)]
pub struct Normals {
    /// By side; `None` where the surface is flat.
    corners: Vec<Option<Box<[DVec3; 3]>>>,
}

impl Normals {
    pub(super) fn new(geometry: &Geometry, patches: &Patches, mesh: &Mesh) -> Self {
        let sides: Vec<Cell> = geometry
            .ids()
            .flat_map(|t| Side::BOTH.map(|s| (t, s)))
            .filter(|&(t, s)| patches.splits()[side_index(t, s)].level().is_some())
            .map(|(t, s)| Cell::whole(t, s))
            .collect();
        let mut sums = vec![DVec3::ZERO; mesh.len()];
        for cell in &sides {
            let [a, b, c] = geometry.corners(cell.triangle);
            let normal = geometry.normal(cell.triangle, cell.side);
            let weight = geometry.area(cell.triangle);
            let angles = [(b - a, c - a), (c - b, a - b), (a - c, b - c)];
            for (v, (p, q)) in mesh.corners(cell).into_iter().zip(angles) {
                sums[v.0 as usize] += normal * (p.angle_between(q) * weight);
            }
        }
        let mut corners = vec![None; 2 * geometry.len()];
        let of = |cell: &Cell| {
            let own = geometry.normal(cell.triangle, cell.side);
            let turned = mesh.corners(cell).map(|v| sums[v.0 as usize].normalize_or(own));
            let curved = turned.iter().any(|n| n.dot(own) < FLAT);
            curved.then(|| Box::new(turned))
        };
        let found: Vec<_> = sides.par_iter().map(of).collect();
        for (cell, found) in sides.iter().zip(found) {
            corners[side_index(cell.triangle, cell.side)] = found;
        }
        Self { corners }
    }

    /// The unit normal at a point, and how far (m) the curved surface that the face stands for lies
    /// above it: `None` where that is the face itself.
    ///
    /// The distance is that of the tangent planes at the corners, interpolated (Hanika 2021,
    /// "Hacking the shadow terminator"); shadows on smooth bodies do not show their faces then.
    #[must_use]
    pub fn at(&self, geometry: &Geometry, p: SurfacePoint) -> Option<(DVec3, f64)> {
        let corners = self.corners[side_index(p.triangle, p.side)].as_ref()?;
        let own = geometry.normal(p.triangle, p.side);
        let (at, l) = (p.position(geometry), p.barycentric());
        let normal = corners[0] * l.x + corners[1] * l.y + corners[2] * l.z;
        let mut above = 0.0;
        for (k, corner) in geometry.corners(p.triangle).into_iter().enumerate() {
            let below = (at - corner).dot(corners[k]).min(0.0);
            above -= below * corners[k].dot(own) * l[k];
        }
        Some((normal.normalize_or(own), above))
    }
}
