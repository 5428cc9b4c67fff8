//! From the item buffer to a row: which patch lies under each pixel, and the sum of its weights.

use std::ops::Range;

use super::model::{BACK, Model, RowBuffers};
use crate::engines::lookup::{Lookup, back, environment, index_in_grid};
use crate::form_factors::tally::Tally;
use crate::form_factors::{ONE, Row, Weights};
use crate::patches::{PatchId, side_index};
use crate::simd::LANES;
use crate::visibility::{Edges, NOTHING, each_face};

/// Adds up a row of pixels. Neighbours mostly see one patch, and adding to a sum that was just
/// added to is slow: four pixels far apart take turns.
#[inline(always)]
fn add_all(tally: &mut Tally<u32>, places: &[u32], weights: &[u32]) {
    let quarter = places.len() / 4;
    let (p, w) = (&places[..4 * quarter], &weights[..4 * quarter]);
    for k in 0..quarter {
        for turn in 0..4 {
            let at = turn * quarter + k;
            tally.add(p[at], w[at]);
        }
    }
}

/// Moves the sums into `row` and clears them.
pub(super) fn write(tally: &mut Tally<u32>, patches: usize, row: &mut Row) {
    let mut fraction = |place: u32| f64::from(tally.take(place)) / f64::from(ONE);
    (row.environment, row.back, row.lost) =
        (fraction(environment(patches)), fraction(back(patches)), 0.0);
    let mut weights = match std::mem::take(&mut row.weights) {
        Weights::Fixed(w) => w,
        Weights::Each(_) | Weights::Equal { .. } => Vec::new(),
    };
    tally.write(&mut row.columns, &mut weights);
    row.weights = Weights::Fixed(weights);
}

/// Sums the weights of each patch in item buffers of patches.
#[inline(always)]
pub(super) fn count_patches(model: &Model<'_>, buffers: &mut RowBuffers) {
    let n = model.patches.len();
    each_face!(F => {
        let face = &model.faces[F];
        let weights = &model.weights[usize::from(F != 0)];
        let stride = face.stride();
        let rows = buffers.items[F].items().chunks(stride).zip(weights.chunks(stride));
        for ((items, weights), &y) in rows.zip(face.y()) {
            for ((&item, &weight), &x) in items.iter().zip(weights).zip(face.x()) {
                let place = match item {
                    NOTHING => environment(n),
                    BACK => back(n),
                    patch => part_of::<F>(model, &buffers.edges, patch, [x, y]),
                };
                buffers.tally.add(place, weight);
            }
        }
    });
}

/// The patch that a pixel of patch `id` counts for.
#[inline(always)]
fn part_of<const F: usize>(model: &Model<'_>, edges: &[Edges], id: u32, at: [f32; 2]) -> u32 {
    let cell = model.patches.cell(PatchId(id));
    let side = side_index(cell.triangle, cell.side);
    let lookups = &model.lookups;
    if !lookups.finest.has_crossed(side) {
        return id;
    }
    let e = edges[cell.triangle.index()].turned::<F>();
    let f = e.map(|e| e[0] * at[0] + (e[1] * at[1] + e[2]));
    let strips = (1_u32 << lookups.finest.splits()[side].level().unwrap_or(0)) as f32;
    let first = lookups.finest.of_side(cell.triangle, cell.side).next().map_or(0, |p| p.0);
    lookups.whole(lookups.owner(first + index_in_grid(strips, f[0], f[1], f[2]), f))
}

/// Looks up the patch under each pixel and sums the weights.
#[inline(always)]
pub(super) fn count_sources(model: &Model<'_>, buffers: &mut RowBuffers) {
    let mut places = std::mem::take(&mut buffers.places);
    places.resize(model.faces[0].stride(), 0);
    each_face!(F => {
        let face = &model.faces[F];
        let weights = &model.weights[usize::from(F != 0)];
        let stride = face.stride();
        let rows = buffers.items[F].items().chunks(stride).zip(weights.chunks(stride));
        for ((items, weights), &y) in rows.zip(face.y()) {
            let items = items.as_chunks::<LANES>().0;
            let xs = face.x().as_chunks::<LANES>().0;
            for ((items, xs), places) in items.iter().zip(xs).zip(places.as_chunks_mut().0) {
                look_up::<F>(model, &buffers.edges, items, xs, y, places);
            }
            if let Some(patch_of) = &model.lookups.patch_of {
                for place in &mut places {
                    *place = patch_of[*place as usize];
                }
            }
            add_all(&mut buffers.tally, &places, weights);
        }
    });
    buffers.places = places;
}

/// The places in the tally of a block of pixels, in the finest mesh.
#[inline(always)]
fn look_up<const F: usize>(
    model: &Model<'_>,
    edges: &[Edges],
    items: &[u32; LANES],
    xs: &[f32; LANES],
    y: f32,
    places: &mut [u32; LANES],
) {
    if items.iter().fold(0, |differ, &i| differ | (i ^ items[0])) == 0 {
        *places = of_item::<F>(model, edges, items[0], 0..LANES, xs, y);
        return;
    }
    let mut from = 0;
    while from < LANES {
        let item = items[from];
        let to = (from + 1..LANES).find(|&l| items[l] != item).unwrap_or(LANES);
        let found = of_item::<F>(model, edges, item, from..to, xs, y);
        for l in 0..LANES {
            places[l] = if (from..to).contains(&l) { found[l] } else { places[l] };
        }
        from = to;
    }
}

/// The places of the pixels of a block, if all of them were of one item; those of `run` are, and
/// only they mind what cuts patches.
#[inline(always)]
fn of_item<const F: usize>(
    model: &Model<'_>,
    edges: &[Edges],
    item: u32,
    run: Range<usize>,
    xs: &[f32; LANES],
    y: f32,
) -> [u32; LANES] {
    if item == NOTHING {
        return [environment(model.lookups.finest.len()); LANES];
    }
    let Lookup { first, strips, cut } = model.lookups.of(item);
    if strips == 0.0 {
        return [first; LANES];
    }
    let [e0, e1, e2] = edges[item as usize / 2].turned::<F>();
    let (c0, c1, c2) = (e0[1] * y + e0[2], e1[1] * y + e1[2], e2[1] * y + e2[2]);
    let mut places = [0; LANES];
    for l in 0..LANES {
        let x = xs[l];
        let (f0, f1, f2) = (e0[0] * x + c0, e1[0] * x + c1, e2[0] * x + c2);
        places[l] = first + index_in_grid(strips, f0, f1, f2);
    }
    if cut {
        for l in run {
            if model.lookups.finest.is_crossed(PatchId(places[l])) {
                let f = [e0[0] * xs[l] + c0, e1[0] * xs[l] + c1, e2[0] * xs[l] + c2];
                places[l] = model.lookups.owner(places[l], f);
            }
        }
    }
    places
}
