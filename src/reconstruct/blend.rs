//! The field over clusters: within a patch of many source triangles values must follow the light
//! too, not only from patch to patch.
//!
//! Each patch carries the linear function that fits its own value and its neighbours' best; at a
//! vertex the functions of the patches about it are blended with weights that fall smoothly to zero
//! (a partition of unity: Franke & Nielson 1980, "Smooth interpolation of large sets of scattered
//! data").

use glam::DVec3;
use rayon::prelude::*;

use super::fit::{Linear, fit};
use super::mesh::{Incidence, Mesh};
use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, Rgb};

/// The function of a patch reaches this far, in radii of the patch about its centre. More than one,
/// so that every vertex has a value; enough for neighbours to overlap widely.
const REACH: f64 = 1.6;

/// Which patches have a vertex in common and see each other along the surface, themselves included.
pub(super) struct Neighbours {
    starts: Vec<u32>,
    around: Vec<PatchId>,
}

impl Neighbours {
    pub fn new(geometry: &Geometry, patches: &Patches, incidence: &Incidence, len: usize) -> Self {
        let mut pairs: Vec<(PatchId, PatchId)> = Vec::new();
        let mut most = 2 * len;
        for v in 0..len {
            let around = incidence.around(v);
            for (k, &a) in around.iter().enumerate() {
                pairs.extend(around[k + 1..].iter().map(|&b| (a.min(b), a.max(b))));
            }
            // Neighbours meet at many vertices.
            if pairs.len() > most {
                pairs.par_sort_unstable();
                pairs.dedup();
                most = most.max(2 * pairs.len());
            }
        }
        pairs.par_sort_unstable();
        pairs.dedup();
        let pairs: Vec<_> = pairs
            .into_par_iter()
            .filter(|&(a, b)| patches.see_each_other(geometry, a, b))
            .collect();
        let mut starts = vec![1_u32; patches.len() + 1];
        starts[0] = 0;
        for (a, b) in &pairs {
            starts[a.index() + 1] += 1;
            starts[b.index() + 1] += 1;
        }
        for p in 0..patches.len() {
            starts[p + 1] += starts[p];
        }
        let mut next = starts.clone();
        let mut around = vec![PatchId(0); starts[patches.len()] as usize];
        let mut put = |a: PatchId, b: PatchId| {
            around[next[a.index()] as usize] = b;
            next[a.index()] += 1;
        };
        patches.ids().for_each(|p| put(p, p));
        for (a, b) in pairs {
            put(a, b);
            put(b, a);
        }
        Self { starts, around }
    }

    /// A patch and its neighbours.
    pub fn of(&self, id: PatchId) -> &[PatchId] {
        &self.around[self.starts[id.index()] as usize..self.starts[id.index() + 1] as usize]
    }

    /// The patches about a vertex and their neighbours, ascending.
    pub fn ring(&self, about: &[PatchId], ring: &mut Vec<PatchId>) {
        ring.clear();
        for &id in about {
            ring.extend_from_slice(self.of(id));
        }
        ring.sort_unstable();
        ring.dedup();
    }
}

/// Irradiance at every vertex.
pub(super) fn vertices(
    geometry: &Geometry,
    patches: &Patches,
    mesh: &Mesh,
    (incidence, neighbours): (&Incidence, &Neighbours),
    (positions, centres): (&[DVec3], &[DVec3]),
    irradiance: &[Rgb],
) -> Vec<Rgb> {
    let function = |id: PatchId| {
        let centre = centres[id.index()];
        let corners = patches.pieces(id).flat_map(|piece| piece.corners(geometry));
        let radius = corners.map(|c| c.distance_squared(centre)).fold(0.0, f64::max).sqrt();
        (fit(centre, neighbours.of(id), centres, irradiance), REACH * radius)
    };
    let functions: Vec<(Linear, f64)> =
        patches.ids().collect::<Vec<_>>().into_par_iter().map(function).collect();
    (0..mesh.len())
        .into_par_iter()
        .map_init(Vec::new, |ring, v| {
            neighbours.ring(incidence.around(v), ring);
            let (mut sum, mut total) = (Rgb::ZERO, 0.0);
            for &id in &*ring {
                let (linear, reach) = &functions[id.index()];
                let offset = positions[v] - centres[id.index()];
                let inside = 1.0 - offset.length_squared() / (reach * reach);
                if inside > 0.0 {
                    sum += linear.at(offset) * inside * inside;
                    total += inside * inside;
                }
            }
            if total > 0.0 { sum / total } else { Rgb::ZERO }
        })
        .collect()
}
