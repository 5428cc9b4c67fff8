//! The field: a fan or a linear function over each patch.

use std::borrow::Cow;
use std::collections::HashMap;
use std::convert::Infallible;

use glam::DVec3;
use rayon::prelude::*;

use super::blend::{self, Neighbours};
use super::fit::fit;
use super::mesh::{Mesh, VertexId};
use super::normals::Normals;
use crate::patches::{Cell, PatchId, Patches, SurfacePoint};
use crate::progress::{Cancelled, Progress};
use crate::scene::{Geometry, Rgb};

/// A smooth irradiance field over all patches.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    patches: &'a Patches,
    mesh: Mesh,
    /// Irradiance at each vertex of the conforming triangulation.
    vertices: Vec<Rgb>,
    /// Irradiance at the corners of patches near contacts, as seen from their own side of it.
    at_contacts: HashMap<PatchId, [Rgb; 3]>,
    /// Irradiance of each patch.
    irradiance: Cow<'a, [Rgb]>,
}

impl<'a> Field<'a> {
    /// The field of `irradiance`, one value a patch; patches for which `usable` is false (covered
    /// or unlit ones) lend their value to no vertex.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        patches: &'a Patches,
        irradiance: impl Into<Cow<'a, [Rgb]>>,
        usable: impl Fn(PatchId) -> bool,
    ) -> Self {
        let go_on = || Ok::<(), Infallible>(());
        let Ok(field) = Self::make(geometry, patches, irradiance.into(), usable, go_on);
        field
    }

    /// [`new`](Self::new), which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn new_heard(
        geometry: &Geometry,
        patches: &'a Patches,
        irradiance: impl Into<Cow<'a, [Rgb]>>,
        usable: impl Fn(PatchId) -> bool,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        Self::make(geometry, patches, irradiance.into(), usable, || progress.advance(0))
    }

    /// `go_on` is asked again and again.
    fn make<E: Send>(
        geometry: &Geometry,
        patches: &'a Patches,
        irradiance: Cow<'a, [Rgb]>,
        usable: impl Fn(PatchId) -> bool,
        go_on: impl Fn() -> Result<(), E> + Sync,
    ) -> Result<Self, E> {
        go_on()?;
        let mesh = Mesh::new(geometry, patches);
        go_on()?;
        let incidence = mesh.incidence(patches, usable);
        go_on()?;
        let centres: Vec<DVec3> =
            patches.ids().map(|i| patches.center(i).position(geometry)).collect();
        let positions = mesh.positions(geometry, patches);
        let neighbours = patches
            .has_clusters()
            .then(|| Neighbours::new(geometry, patches, &incidence, mesh.len()));
        go_on()?;
        let second_ring = |v: usize| match &neighbours {
            Some(neighbours) => {
                let mut ring = Vec::new();
                neighbours.ring(incidence.around(v), &mut ring);
                ring
            }
            None => incidence.second_ring(patches, &mesh, v),
        };
        let vertices: Result<Vec<Rgb>, E> = match &neighbours {
            Some(neighbours) => Ok(blend::vertices(
                geometry,
                patches,
                &mesh,
                (&incidence, neighbours),
                (&positions, &centres),
                &irradiance,
            )),
            None => (0..mesh.len())
                .into_par_iter()
                .map(|v| {
                    go_on()?;
                    let border = mesh.on_border(v);
                    let ring = if border { second_ring(v) } else { incidence.around(v).to_vec() };
                    Ok(fit(positions[v], &ring, &centres, &irradiance).at(DVec3::ZERO))
                })
                .collect(),
        };
        let vertices = vertices?;
        let mut touched = vec![false; mesh.len()];
        for id in patches.ids().filter(|&i| patches.has_contact(i)) {
            for v in mesh.corners(&patches.cell(id)) {
                touched[v.0 as usize] = true;
            }
        }
        // Near a contact each patch has corners of its own, from the patches that it sees.
        let at_contacts: Result<HashMap<_, _>, E> = patches
            .ids()
            .filter(|&id| !patches.is_cluster(id))
            .collect::<Vec<_>>()
            .into_par_iter()
            .filter_map(|id| {
                if let Err(stopped) = go_on() {
                    return Some(Err(stopped));
                }
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
                    fit(positions[v.0 as usize], &near, &centres, &irradiance).at(DVec3::ZERO)
                });
                Some(Ok((id, values)))
            })
            .collect();
        Ok(Self { patches, mesh, vertices, at_contacts: at_contacts?, irradiance })
    }

    /// Irradiance at a point of a surface, W/m² or lx; zero where no light is exchanged.
    #[must_use]
    pub fn at(&self, p: SurfacePoint) -> Rgb {
        self.patches.at(p).map_or(Rgb::ZERO, |id| self.within(id, p))
    }

    /// The same at a point that is known to belong to a patch.
    #[must_use]
    pub(crate) fn within(&self, id: PatchId, p: SurfacePoint) -> Rgb {
        let cell = match self.patches.is_cluster(id) {
            true => Cell::whole(p.triangle, p.side),
            false => self.patches.cell(id),
        };
        let local = cell.local(p.barycentric());
        let linear =
            |c: [Rgb; 3]| (c[0] * local.x + c[1] * local.y + c[2] * local.z).max(Rgb::ZERO);
        if let Some(corners) = self.at_contacts.get(&id) {
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
        // 0 at the edge, 1 at the centre.
        let inward = 3.0 * local[k];
        if inward >= 1.0 {
            return centre;
        }
        let along = ((local[to] - local[k]) / (1.0 - inward)).clamp(0.0, 1.0);
        let edge = self.mesh.edge_vertices(&cell, from);
        let next = edge.partition_point(|e| e.0 <= along).clamp(1, edge.len() - 1);
        let ((t0, a), (t1, b)) = (edge[next - 1], edge[next]);
        let (a, b, t) = (value(a), value(b), (along - t0) / (t1 - t0));
        (a + (b - a) * t) * (1.0 - inward) + centre * inward
    }

    /// Normals that turn smoothly where the field does.
    #[must_use]
    pub fn normals(&self, geometry: &Geometry) -> Normals {
        Normals::new(geometry, self.patches, &self.mesh)
    }

    /// The patches' own irradiance.
    #[must_use]
    pub fn of_patches(&self) -> &[Rgb] {
        &self.irradiance
    }
}
