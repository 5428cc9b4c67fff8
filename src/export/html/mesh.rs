//! Triangles of a page by material, and the outlines of patches.

use std::collections::HashSet;
use std::io::{self, Seek, Write};

use glam::DVec3;

use crate::bake::{Facet, Layers};
use crate::export::members::{Members, Packing};
use crate::patches::{Cell, PatchId, Patches};
use crate::scene::{Rgb, Scene, Side};

/// Corners that follow each other and look alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    pub material: usize,
    /// Whether the material emits on these sides.
    pub emits: bool,
    /// The first corner, and how many.
    pub first: usize,
    pub count: usize,
}

/// The middle of the model's box, from which positions are measured, as single precision knows
/// little far from its origin; and half of the box's extent. A stage is no part of the model.
pub fn frame(scene: &Scene) -> (DVec3, DVec3) {
    let g = &scene.geometry;
    let own = g.ids().filter(|&t| !g.is_whole(t)).flat_map(|t| g.corners(t));
    let bounds = own.fold(None, |bounds: Option<(DVec3, DVec3)>, p| {
        let (low, high) = bounds.unwrap_or((p, p));
        Some((low.min(p), high.max(p)))
    });
    let (low, high) = bounds.unwrap_or_default();
    ((low + high) / 2.0, (high - low) / 2.0)
}

/// The triangles of a page in the order in which it numbers them: by material, and by whether it
/// emits on their side.
#[must_use]
pub fn page_facets(scene: &Scene, layers: &Layers) -> Vec<Facet> {
    let mut facets = layers.facets();
    facets.sort_by_key(|f| kind(scene, f));
    facets
}

/// The material of a facet, and whether it emits on its side.
fn kind(scene: &Scene, facet: &Facet) -> (usize, bool) {
    let material = scene.optics.material_of[facet.triangle.index()] as usize;
    let both = scene.optics.materials[material].emits_both;
    (material, facet.side == Side::Front || both)
}

/// Writes triangles that are in the order of [`page_facets`].
pub fn write<W: Write + Seek>(
    to: &mut Members<'_, W>,
    scene: &Scene,
    facets: &[Facet],
    packing: Packing,
) -> io::Result<Vec<Run>> {
    let (g, optics) = (&scene.geometry, &scene.optics);
    let mut runs = Vec::new();
    let mut first = 0;
    for alike in facets.chunk_by(|a, b| kind(scene, a) == kind(scene, b)) {
        let (material, emits) = kind(scene, &alike[0]);
        let count = 3 * alike.len();
        runs.push(Run { material, emits, first, count });
        first += count;
    }
    let corners = || facets.iter().flat_map(|f| f.around().map(move |k| (f, k)));
    let point = |(f, k): (&Facet, usize)| f.point(DVec3::AXES[k]);
    let shape = |width: usize| [first, width];
    let origin = frame(scene).0;
    let position =
        |(f, k): (&Facet, usize)| (point((f, k)).position(g) - origin).as_vec3().to_array();
    to.array("mesh/position", &shape(3), packing, corners().flat_map(position))?;
    let atlas = |(f, k): (&Facet, usize)| f.atlas[k].to_array().map(whole);
    to.array("mesh/atlas", &shape(2), packing, corners().flat_map(atlas))?;
    if !optics.textures.is_empty() {
        let uv = |(f, k): (&Facet, usize)| {
            let l = point((f, k)).barycentric();
            let own = optics.uv.get(f.triangle.index()).copied().unwrap_or_default();
            (own[0] * l.x + own[1] * l.y + own[2] * l.z).as_vec2().to_array()
        };
        to.array("mesh/uv", &shape(2), packing, corners().flat_map(uv))?;
    }
    if !optics.tint.is_empty() {
        let tint = |(f, _): (&Facet, usize)| {
            let tint = optics.tint(f.triangle).clamp(Rgb::ZERO, Rgb::ONE).to_array();
            tint.map(|c| (c * 255.0).round() as u8)
        };
        to.array("mesh/tint", &shape(3), packing, corners().flat_map(tint))?;
    }
    Ok(runs)
}

/// 0..1 as a whole number of 16 bits.
fn whole(x: f64) -> u16 {
    (x.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16
}

/// Writes the edges of patches, each once.
pub fn write_outlines<W: Write + Seek>(
    to: &mut Members<'_, W>,
    scene: &Scene,
    patches: &Patches,
    packing: Packing,
) -> io::Result<()> {
    let g = &scene.geometry;
    let (middle, half) = frame(scene);
    let low = middle - half;
    let place = |p: DVec3| {
        let share = (p - low) / (2.0 * half).max(DVec3::splat(f64::MIN_POSITIVE));
        share.to_array().map(whole)
    };
    let mut edges = Vec::new();
    let mut known = HashSet::new();
    for id in patches.ids() {
        let own = |c: &Cell| !g.is_whole(c.triangle);
        for [a, b] in outline(patches, id, |c| c.corners(g).map(place), own) {
            if known.insert([a.min(b), a.max(b)]) {
                edges.push([a, b]);
            }
        }
    }
    let numbers = edges.iter().flatten().flatten().copied();
    to.array("mesh/outlines", &[2 * edges.len(), 3], packing, numbers)
}

/// The edges of a patch that only one of its pieces has.
fn outline(
    patches: &Patches,
    id: PatchId,
    corners: impl Fn(&Cell) -> [[u16; 3]; 3],
    own: impl Fn(&Cell) -> bool,
) -> Vec<[[u16; 3]; 2]> {
    let mut edges: Vec<[[u16; 3]; 2]> = Vec::new();
    for cell in patches.pieces(id).filter(own) {
        let c = corners(&cell);
        for edge in [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]] {
            edges.push([edge[0].min(edge[1]), edge[0].max(edge[1])]);
        }
    }
    if !patches.is_cluster(id) {
        return edges;
    }
    edges.sort_unstable();
    let alone = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    alone.map(|same| same[0]).collect()
}
