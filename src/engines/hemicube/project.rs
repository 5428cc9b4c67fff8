//! From the view of a patch to its item buffer: triangles projected on the five faces.

use glam::Vec3;

use super::model::{BACK, Model, RowBuffers};
use crate::patches::Split;
use crate::scene::{Side, TriangleId};
use crate::visibility::{Edges, PatchArea, code, each_face, faces_of};

/// Projects every source triangle but the patch's own on the faces; items are twice the number of
/// the solid triangle, plus one if its back is seen.
#[inline(always)]
pub(super) fn project_sources(model: &Model<'_>, own: TriangleId, buffers: &mut RowBuffers) {
    buffers.edges.resize(model.occluders.len(), Edges::default());
    for (i, &id) in model.occluders.ids().iter().enumerate() {
        let faces = model.occluders.faces_in(&buffers.view, i);
        if faces == 0 || id == own || buffers.hidden[i] {
            continue;
        }
        let corners = model.occluders.corners_in(&buffers.view, i);
        let mut known = false;
        each_face!(F => if faces >> F & 1 == 1
            && let Some(bounds) = model.faces[F].bounds::<F>(&corners)
        {
            if !std::mem::replace(&mut known, true) {
                let Some(edges) = Edges::new(corners) else { continue };
                let absorbs = edges.back && model.patches.split_of(id, Side::Back) == Split::None;
                buffers.edges[i] = if absorbs { edges.receded() } else { edges };
            }
            let edges = &buffers.edges[i];
            let item = 2 * i as u32 + u32::from(edges.back);
            buffers.items[F].draw::<F>(&model.faces[F], bounds, edges, item);
        });
    }
}

/// Projects every patch but those of the own source triangle on the faces; items are patches.
#[inline(always)]
pub(super) fn project_patches(model: &Model<'_>, own: TriangleId, buffers: &mut RowBuffers) {
    buffers.edges.resize(model.geometry.len(), Edges::default());
    for (i, &id) in model.occluders.ids().iter().enumerate() {
        if model.occluders.faces_in(&buffers.view, i) == 0 || id == own || buffers.hidden[i] {
            continue;
        }
        let corners = model.occluders.corners_in(&buffers.view, i);
        let Some(edges) = Edges::new(corners) else { continue };
        let side = if edges.back { Side::Back } else { Side::Front };
        let absorbs = model.patches.split_of(id, side) == Split::None;
        let edges = if absorbs { edges.receded() } else { edges };
        buffers.edges[id.index()] = edges;
        let mut draw = |patch: [Vec3; 3], area: &PatchArea, item: u32| {
            let joined = patch.iter().fold(0, |c, p| c | code(p.x, p.y, p.z));
            let faces = faces_of(joined);
            each_face!(F => if faces >> F & 1 == 1
                && let Some(bounds) = model.faces[F].bounds::<F>(&patch)
            {
                buffers.items[F].draw_patch::<F>(&model.faces[F], bounds, &edges, area, item);
            });
        };
        if absorbs {
            let whole = PatchArea { strips: 1.0, strip: [0.0; 3], inverted: false };
            draw(corners, &whole, BACK);
        }
        for patch in model.patches.of_side(id, side) {
            let cell = model.patches.cell(patch);
            let n = cell.strips() as f32;
            let area = PatchArea {
                strips: n,
                strip: cell.strip().map(|i| i as f32),
                inverted: cell.inverted,
            };
            let [a, b, c] = corners;
            let at =
                |l: [u32; 3]| (a * l[0] as f32 + b * l[1] as f32 + c * l[2] as f32) * (1.0 / n);
            let [p, q, r] = cell.lattice();
            draw([at(p), at(q), at(r)], &area, patch.0);
        }
    }
}
