//! Irradiance on surfaces as a smooth field, from one value a patch.
//!
//! Values move from patch centres to the vertices of a conforming triangulation and are
//! interpolated linearly over it. Surfaces are smooth across an edge that exactly two triangles
//! share at a blunt angle; never across a crease, nor between surfaces that merely touch.

mod blend;
mod mesh;
mod topology;

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::patches::{Cell, PatchId, Patches, SurfacePoint};
use crate::scene::{Geometry, Rgb};
use blend::Neighbours;
use mesh::{Mesh, VertexId};

/// A smooth irradiance field over all patches.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    patches: &'a Patches,
    mesh: Mesh,
    /// Irradiance at each vertex of the conforming triangulation.
    vertices: Vec<Rgb>,
    /// Irradiance at the corners of patches near contacts, as seen from their own side of it.
    parted: HashMap<PatchId, [Rgb; 3]>,
    /// Irradiance of each patch.
    irradiance: &'a [Rgb],
}

impl<'a> Field<'a> {
    /// The field of `irradiance`, one value a patch; patches for which `usable` is false (covered
    /// or unlit ones) lend their value to no vertex.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        patches: &'a Patches,
        irradiance: &'a [Rgb],
        usable: impl Fn(PatchId) -> bool,
    ) -> Self {
        let mesh = Mesh::new(geometry, patches);
        let incidence = mesh.incidence(patches, usable);
        let centres: Vec<DVec3> =
            patches.ids().map(|i| patches.center(i).position(geometry)).collect();
        let positions = mesh.positions(geometry, patches);
        let neighbours = patches
            .has_clusters()
            .then(|| Neighbours::new(geometry, patches, &incidence, mesh.len()));
        let second_ring = |v: usize| match &neighbours {
            Some(neighbours) => {
                let mut ring = Vec::new();
                neighbours.ring(incidence.around(v), &mut ring);
                ring
            }
            None => incidence.second_ring(patches, &mesh, v),
        };
        let vertices: Vec<Rgb> = match &neighbours {
            Some(neighbours) => blend::vertices(
                geometry,
                patches,
                &mesh,
                (&incidence, neighbours),
                (&positions, &centres),
                irradiance,
            ),
            None => (0..mesh.len())
                .into_par_iter()
                .map(|v| {
                    let border = mesh.on_border(v);
                    let ring = if border { second_ring(v) } else { incidence.around(v).to_vec() };
                    fit(positions[v], &ring, &centres, irradiance).at(DVec3::ZERO)
                })
                .collect(),
        };
        let mut touched = vec![false; mesh.len()];
        for id in patches.ids().filter(|&i| patches.has_contact(i)) {
            for v in mesh.corners(&patches.cell(id)) {
                touched[v.0 as usize] = true;
            }
        }
        // Near a contact each patch has corners of its own, from the patches that it sees.
        let parted = patches
            .ids()
            .filter(|&id| !patches.is_cluster(id))
            .collect::<Vec<_>>()
            .into_par_iter()
            .filter_map(|id| {
                let corners = mesh.corners(&patches.cell(id));
                if !corners.iter().any(|v| touched[v.0 as usize]) {
                    return None;
                }
                let values = corners.map(|v| {
                    let mut near = second_ring(v.0 as usize);
                    near.retain(|&q| patches.see_each_other(geometry, id, q));
                    if near.is_empty() {
                        return vertices[v.0 as usize];
                    }
                    fit(positions[v.0 as usize], &near, &centres, irradiance).at(DVec3::ZERO)
                });
                Some((id, values))
            })
            .collect();
        Self { patches, mesh, vertices, parted, irradiance }
    }

    /// Irradiance at a point of a surface, W/m² or lx; zero where no light is exchanged.
    #[must_use]
    pub fn at(&self, p: SurfacePoint) -> Rgb {
        let Some(id) = self.patches.at(p) else { return Rgb::ZERO };
        let cell = match self.patches.is_cluster(id) {
            true => Cell::whole(p.triangle, p.side),
            false => self.patches.cell(id),
        };
        let local = cell.local(p.barycentric());
        let linear =
            |c: [Rgb; 3]| (c[0] * local.x + c[1] * local.y + c[2] * local.z).max(Rgb::ZERO);
        if let Some(corners) = self.parted.get(&id) {
            return linear(*corners);
        }
        let value = |v: VertexId| self.vertices[v.0 as usize];
        let corners = self.mesh.corners(&cell).map(value);
        if !self.mesh.has_hanging(id) {
            return linear(corners);
        }
        let local = local.clamp(DVec3::ZERO, DVec3::ONE);
        // Stitched: a fan about the centre over all vertices on the outline.
        let k = (0..3).min_by(|&a, &b| local[a].total_cmp(&local[b])).unwrap_or(0);
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let (from, to) = ((k + 1) % 3, (k + 2) % 3);
        let share = 3.0 * local[k];
        if share >= 1.0 {
            return centre;
        }
        let along = ((local[to] - local[k]) / (1.0 - share)).clamp(0.0, 1.0);
        let edge = self.mesh.edge_vertices(&cell, from);
        let next = edge.partition_point(|e| e.0 <= along).clamp(1, edge.len() - 1);
        let ((t0, a), (t1, b)) = (edge[next - 1], edge[next]);
        let (a, b, t) = (value(a), value(b), (along - t0) / (t1 - t0));
        (a + (b - a) * t) * (1.0 - share) + centre * share
    }

    /// The patches' own irradiance.
    #[must_use]
    pub fn of_patches(&self) -> &[Rgb] {
        self.irradiance
    }
}

/// Weight of a vanishing gradient in the fit, relative to the spread of the centres: enough to hold
/// it where centres lie on a line or are a single one.
const DAMPING: f64 = 0.02;

/// An extrapolated value may leave the range of the values around it by this share of the range.
const OVERSHOOT: f64 = 0.5;

/// A linear function in space, kept near the range of the values that it was fitted to.
#[derive(Debug, Clone, Copy)]
struct Linear {
    /// Weighted mean of the values, and the place of it, seen from the point that was fitted at.
    mean: Rgb,
    mean_offset: DVec3,
    /// Gradient of each channel.
    slope: [DVec3; 3],
    low: Rgb,
    high: Rgb,
}

impl Linear {
    /// Value at an offset from the point that was fitted at.
    fn at(&self, offset: DVec3) -> Rgb {
        let d = offset - self.mean_offset;
        let value = DVec3::from_array(self.slope.map(|s| s.dot(d))) + self.mean;
        value.clamp(self.low, self.high)
    }

    fn constant(value: Rgb) -> Self {
        let slope = [DVec3::ZERO; 3];
        Self { mean: value, mean_offset: DVec3::ZERO, slope, low: value, high: value }
    }
}

/// The linear function that fits the `ring`'s values best, those near `at` counting more.
fn fit(at: DVec3, ring: &[PatchId], centres: &[DVec3], values: &[Rgb]) -> Linear {
    if ring.is_empty() {
        return Linear::constant(Rgb::ZERO);
    }
    let offsets = || ring.iter().map(|i| (centres[i.index()] - at, values[i.index()]));
    let nearest = offsets()
        .map(|(d, _)| d.length_squared())
        .filter(|&d| d > 0.0)
        .fold(f64::INFINITY, f64::min);
    let weight = |d: DVec3| 1.0 / (d.length_squared() + nearest).max(f64::MIN_POSITIVE);
    if nearest == f64::INFINITY {
        return Linear::constant(values[ring[0].index()]);
    }
    let (mut total, mut mean, mut mean_offset) = (0.0, Rgb::ZERO, DVec3::ZERO);
    let (mut low, mut high) = (Rgb::INFINITY, Rgb::NEG_INFINITY);
    for (d, h) in offsets() {
        let w = weight(d);
        total += w;
        mean += h * w;
        mean_offset += d * w;
        (low, high) = (low.min(h), high.max(h));
    }
    mean /= total;
    mean_offset /= total;
    let mut spread = DMat3::ZERO;
    let mut slope = [DVec3::ZERO; 3];
    for (d, h) in offsets() {
        let (w, d, h) = (weight(d), d - mean_offset, h - mean);
        spread += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * w;
        for c in 0..3 {
            slope[c] += d * (h[c] * w);
        }
    }
    let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
    if trace <= 0.0 {
        return Linear::constant(mean);
    }
    let inverse = (spread + DMat3::from_diagonal(DVec3::splat(DAMPING * trace))).inverse();
    let slack = (high - low) * OVERSHOOT;
    Linear {
        mean,
        mean_offset,
        slope: slope.map(|s| inverse * s),
        low: (low - slack).max(Rgb::ZERO),
        high: high + slack,
    }
}
