//! Hemicubes: a whole row of form factors from one item buffer.
//!
//! Cohen & Greenberg (1985), "The hemi-cube: a radiosity solution for complex environments", in the
//! order of steps of Kulyasov & Nikulin (2012), algorithm 1: number the patches; build a hemicube
//! about the centre of one; project all others on its five faces; count pixels by item; weight
//! them; that is a row.
//!
//! # Deviations
//! - Delta form factors are exact point-to-rectangle factors and sum to exactly one, so that
//!   nothing needs to be divided by a total.
//! - [`Draw::Sources`] projects source triangles instead of patches and looks up the patch under
//!   each pixel: a row then costs the same however fine the mesh is.
//! - A pixel on a part of a patch that something standing on it parts from the patch's centre counts
//!   for the neighbour that the part belongs to ([`Patches::at`]).
//! - The patch's own source triangle is left out by its id, never by depth.
//! - Backs that do not reflect lose against all that is nearly as near: a closed body shows none.

use std::sync::{Mutex, PoisonError};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use thiserror::Error;

use super::delta::{DeltaFormFactors, ONE};
use super::rows::{Engine, EngineError, Row, Weights};
use crate::patches::{PatchId, Patches, Split, side_index};
use crate::scene::{Geometry, Side, TriangleId};
use crate::visibility::{
    Edges, Face, Frame, ItemBuffer, LANES, NOTHING, Occluders, PatchArea, View, code, each_face,
    faces_of, multiversion,
};

/// What is projected on the faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Draw {
    /// Source triangles; the patch under a pixel is looked up.
    #[default]
    Sources,
    /// Every patch, as in the paper.
    Patches,
}

/// How hemicubes are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HemicubeOptions {
    /// Pixels along the top, even, 16 to 1,024; the sides are half as high. Default 128.
    pub resolution: usize,
    /// What is projected. Default: source triangles.
    pub draw: Draw,
}

impl Default for HemicubeOptions {
    fn default() -> Self {
        Self { resolution: 128, draw: Draw::Sources }
    }
}

impl HemicubeOptions {
    /// An error if the resolution is not one that hemicubes can have.
    pub(super) fn check(&self) -> Result<(), HemicubeError> {
        let n = self.resolution;
        if !(16..=1024).contains(&n) || n % 2 == 1 {
            return Err(HemicubeError::Resolution(n));
        }
        Ok(())
    }
}

/// Why hemicubes cannot be made as asked.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum HemicubeError {
    /// The resolution is odd or out of range.
    #[error("the hemicube resolution {0} is not an even number from 16 to 1024")]
    Resolution(usize),
}

/// The hemicube engine on the CPU.
pub struct Hemicube<'a> {
    geometry: &'a Geometry,
    patches: &'a Patches,
    /// The uniform mesh that the patch under a pixel is looked up in.
    finest: &'a Patches,
    /// For each of its patches the patch that it is a part of, if that is another mesh.
    patch_of: Option<&'a [u32]>,
    draw: Draw,
    occluders: Occluders,
    faces: [Face; 5],
    /// Delta form factors of top and side with the stride of the faces; padding weighs nothing.
    weights: [Vec<u32>; 2],
    /// For each pixel of top and side the weight of all before it in its row, and one more a row.
    before: [Vec<u32>; 2],
    scratch: Mutex<Vec<Scratch>>,
}

/// What one thread needs to make a row.
#[derive(Default)]
struct Scratch {
    view: View,
    buffers: [ItemBuffer; 5],
    /// Edge functions of the triangles drawn: by solid triangle, or by source triangle when patches
    /// are drawn.
    edges: Vec<Edges>,
    /// Weight of each patch seen so far in this row.
    sums: Vec<u32>,
    /// Whether some patch of each [`GROUP`] has been seen.
    seen: Vec<bool>,
    environment: u64,
    back: u64,
}

/// Patches are marked as seen by groups of so many.
const GROUP: usize = 64;

/// Mark of a back that does not reflect, in an item buffer of patches.
const BACK: u32 = NOTHING - 1;

impl<'a> Hemicube<'a> {
    /// An engine for these patches.
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        options: HemicubeOptions,
    ) -> Result<Self, HemicubeError> {
        options.check()?;
        let n = options.resolution;
        let delta = DeltaFormFactors::new(n);
        let faces = Face::hemicube(n);
        let pad = |weights: &[u32]| -> Vec<u32> {
            let stride = faces[0].stride();
            weights
                .chunks(n)
                .flat_map(|row| {
                    row.iter().copied().chain(std::iter::repeat_n(0, stride - row.len()))
                })
                .collect()
        };
        let weights = [pad(&delta.top), pad(&delta.side)];
        let before = weights.each_ref().map(|w| {
            w.chunks(faces[0].stride())
                .flat_map(|row| {
                    let sums = row.iter().scan(0_u32, |sum, w| {
                        *sum += w;
                        Some(*sum)
                    });
                    std::iter::once(0).chain(sums)
                })
                .collect()
        });
        let occluders = Occluders::new(geometry);
        let scratch = Mutex::new(Vec::new());
        let (finest, patch_of) = match patches.finest() {
            Some((finest, patch_of)) => (finest, Some(patch_of)),
            None => (patches, None),
        };
        let draw = options.draw;
        Ok(Self {
            geometry,
            patches,
            finest,
            patch_of,
            draw,
            occluders,
            faces,
            weights,
            before,
            scratch,
        })
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        let mut scratch = self.locked().pop().unwrap_or_default();
        scratch.sums.resize(self.patches.len(), 0);
        scratch.seen.resize(self.patches.len().div_ceil(GROUP), false);
        make_row(self, id, &mut scratch, row);
        self.locked().push(scratch);
    }

    /// The patch that a patch of the finest mesh is a part of.
    #[inline(always)]
    fn whole(&self, finest: u32) -> u32 {
        self.patch_of.map_or(finest, |p| p[finest as usize])
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Vec<Scratch>> {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Engine for Hemicube<'_> {
    fn name(&self) -> &'static str {
        "hemicube"
    }

    fn bytes(&self, rows: usize) -> u64 {
        let threads = rows.min(rayon::current_num_threads()) as u64;
        let pixels: usize = self.faces.iter().map(|f| f.stride() * f.height()).sum();
        let per_thread = 8 * pixels + 5 * self.patches.len() + 62 * self.occluders.len();
        threads * per_thread as u64
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        let me = &*self;
        rows.par_iter().zip(out).for_each(|(&id, row)| me.row(id, row));
        Ok(())
    }
}

multiversion! {
    fn make_row(engine: &Hemicube<'_>, id: PatchId, scratch: &mut Scratch, row: &mut Row)
        = make_row_kernel
}

#[inline(always)]
fn make_row_kernel(engine: &Hemicube<'_>, id: PatchId, scratch: &mut Scratch, row: &mut Row) {
    let cell = engine.patches.cell(id);
    let normal = engine.geometry.normal(cell.triangle, cell.side);
    let centre = engine.patches.origin(id).position(engine.geometry);
    engine.occluders.look(&Frame::on_surface(centre, normal), &mut scratch.view);
    for (buffer, face) in scratch.buffers.iter_mut().zip(&engine.faces) {
        buffer.clear(face);
    }
    (scratch.environment, scratch.back) = (0, 0);
    match engine.draw {
        Draw::Sources => {
            project_sources(engine, cell.triangle, scratch);
            count_sources(engine, scratch);
        }
        Draw::Patches => {
            project_patches(engine, cell.triangle, scratch);
            count_patches(engine, scratch);
        }
    }
    scratch.write(row);
}

/// Projects every source triangle but the patch's own on the faces; items are twice the number of
/// the solid triangle, plus one if its back is seen.
#[inline(always)]
fn project_sources(engine: &Hemicube<'_>, own: TriangleId, s: &mut Scratch) {
    s.edges.resize(engine.occluders.len(), Edges::default());
    for (i, &id) in engine.occluders.ids().iter().enumerate() {
        let faces = engine.occluders.faces_in(&s.view, i);
        if faces == 0 || id == own {
            continue;
        }
        let corners = engine.occluders.corners_in(&s.view, i);
        let mut known = false;
        each_face!(F => if faces >> F & 1 == 1
            && let Some(bounds) = engine.faces[F].bounds::<F>(&corners)
        {
            if !std::mem::replace(&mut known, true) {
                let Some(edges) = Edges::new(corners) else { continue };
                let absorbs = edges.back && engine.patches.split_of(id, Side::Back) == Split::None;
                s.edges[i] = if absorbs { edges.receded() } else { edges };
            }
            let edges = &s.edges[i];
            let item = 2 * i as u32 + u32::from(edges.back);
            s.buffers[F].draw::<F>(&engine.faces[F], bounds, edges, item);
        });
    }
}

/// Projects every patch but those of the own source triangle on the faces; items are patches.
#[inline(always)]
fn project_patches(engine: &Hemicube<'_>, own: TriangleId, s: &mut Scratch) {
    s.edges.resize(engine.geometry.len(), Edges::default());
    for (i, &id) in engine.occluders.ids().iter().enumerate() {
        if engine.occluders.faces_in(&s.view, i) == 0 || id == own {
            continue;
        }
        let corners = engine.occluders.corners_in(&s.view, i);
        let Some(edges) = Edges::new(corners) else { continue };
        let side = if edges.back { Side::Back } else { Side::Front };
        let absorbs = engine.patches.split_of(id, side) == Split::None;
        let edges = if absorbs { edges.receded() } else { edges };
        s.edges[id.index()] = edges;
        let mut draw = |patch: [Vec3; 3], area: &PatchArea, item: u32| {
            let joined = patch.iter().fold(0, |c, p| c | code(p.x, p.y, p.z));
            let faces = faces_of(joined);
            each_face!(F => if faces >> F & 1 == 1
                && let Some(bounds) = engine.faces[F].bounds::<F>(&patch)
            {
                s.buffers[F].draw_patch::<F>(&engine.faces[F], bounds, &edges, area, item);
            });
        };
        if absorbs {
            let whole = PatchArea { strips: 1.0, strip: [0.0; 3], inverted: false };
            draw(corners, &whole, BACK);
        }
        for patch in engine.patches.of_side(id, side) {
            let cell = engine.patches.cell(patch);
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

impl Scratch {
    #[inline(always)]
    fn add(&mut self, patch: u32, weight: u32) {
        self.sums[patch as usize] += weight;
        self.seen[patch as usize / GROUP] = true;
    }

    /// Moves the sums into `row`, ascending, and clears them.
    #[inline(always)]
    fn write(&mut self, row: &mut Row) {
        row.columns.clear();
        let mut weights = match std::mem::take(&mut row.weights) {
            Weights::Fixed(w) => w,
            Weights::Each(_) => Vec::new(),
        };
        weights.clear();
        let groups = self.seen.iter_mut().zip(self.sums.chunks_mut(GROUP)).enumerate();
        for (group, (seen, sums)) in groups {
            if !std::mem::take(seen) {
                continue;
            }
            // Without a branch an entry: which patches of a group were seen cannot be foretold.
            let (mut columns, mut sums_seen, mut count) = ([0; GROUP], [0; GROUP], 0);
            for (column, sum) in ((group * GROUP) as u32..).zip(sums.iter()) {
                columns[count % GROUP] = column;
                sums_seen[count % GROUP] = *sum;
                count += usize::from(*sum > 0);
            }
            row.columns.extend_from_slice(&columns[..count]);
            weights.extend_from_slice(&sums_seen[..count]);
            sums.fill(0);
        }
        row.weights = Weights::Fixed(weights);
        row.environment = self.environment as f64 / f64::from(ONE);
        row.back = self.back as f64 / f64::from(ONE);
        row.lost = 0.0;
    }
}

/// Sums the weights of each patch in the item buffers.
#[inline(always)]
fn count_patches(engine: &Hemicube<'_>, s: &mut Scratch) {
    each_face!(F => {
        let face = &engine.faces[F];
        let weights = &engine.weights[usize::from(F != 0)];
        let buffer = std::mem::take(&mut s.buffers[F]);
        for (y, (items, weights)) in
            buffer.items().chunks(face.stride()).zip(weights.chunks(face.stride())).enumerate()
        {
            let y = face.y()[y];
            for ((&item, &weight), &x) in items.iter().zip(weights).zip(face.x()) {
                match item {
                    NOTHING => s.environment += u64::from(weight),
                    BACK => s.back += u64::from(weight),
                    patch => {
                        let cell = engine.patches.cell(PatchId(patch));
                        let side = side_index(cell.triangle, cell.side);
                        let patch = if engine.finest.has_cuts(side) {
                            let e = s.edges[cell.triangle.index()].turned::<F>();
                            let f = e.map(|e| e[0] * x + (e[1] * y + e[2]));
                            let n = (1_u32 << engine.finest.splits()[side].level().unwrap_or(0)) as f32;
                            let first = engine.finest.of_side(cell.triangle, cell.side).next();
                            let first = first.map_or(0, |p| p.0);
                            engine.whole(owner(engine, first + index_in_grid(n, f[0], f[1], f[2]), f))
                        } else {
                            patch
                        };
                        s.add(patch, weight);
                    }
                }
            }
        }
        s.buffers[F] = buffer;
    });
}

/// Looks up the patch under each pixel and sums the weights. Pixels come in runs of one source
/// triangle; the run of a triangle that is a single patch is summed as a whole.
#[inline(always)]
fn count_sources(engine: &Hemicube<'_>, s: &mut Scratch) {
    each_face!(F => {
        let face = &engine.faces[F];
        let table = &engine.weights[usize::from(F != 0)];
        let buffer = std::mem::take(&mut s.buffers[F]);
        for (y, (items, weights)) in
            buffer.items().chunks(face.stride()).zip(table.chunks(face.stride())).enumerate()
        {
            let items = &items[..face.width()];
            let mut from = 0;
            while from < items.len() {
                let item = items[from];
                let mut to = from + 1;
                while to + LANES <= items.len() && all_equal(&items[to..to + LANES], item) {
                    to += LANES;
                }
                while to < items.len() && items[to] == item {
                    to += 1;
                }
                count_run::<F>(engine, s, y, item, from..to, weights);
                from = to;
            }
        }
        s.buffers[F] = buffer;
    });
}

/// Whether all items of a block are `item`; without a branch a block, so that it vectorises.
#[inline(always)]
fn all_equal(items: &[u32], item: u32) -> bool {
    items.iter().fold(0, |differ, &i| differ | (i ^ item)) == 0
}

/// Counts a run of pixels that see the same source triangle.
#[inline(always)]
fn count_run<const F: usize>(
    engine: &Hemicube<'_>,
    s: &mut Scratch,
    y: usize,
    item: u32,
    run: std::ops::Range<usize>,
    weights: &[u32],
) {
    let row = y * (engine.faces[F].stride() + 1);
    let before = &engine.before[usize::from(F != 0)];
    let whole = || before[row + run.end] - before[row + run.start];
    if item == NOTHING {
        s.environment += u64::from(whole());
        return;
    }
    let solid = item as usize / 2;
    let triangle = engine.occluders.ids()[solid];
    let side = 2 * triangle.index() + (item as usize & 1);
    match engine.finest.splits()[side] {
        Split::None | Split::Adaptive { .. } => s.back += u64::from(whole()),
        Split::Uniform { first, level: 0 } if !engine.finest.has_cuts(side) => {
            s.add(engine.whole(first), whole());
        }
        Split::Uniform { first, level } => {
            let face = &engine.faces[F];
            let [e0, e1, e2] = s.edges[solid].turned::<F>();
            let y = face.y()[y];
            let (c0, c1, c2) = (e0[1] * y + e0[2], e1[1] * y + e1[2], e2[1] * y + e2[2]);
            let n = (1_u32 << level) as f32;
            let blocks = run.start / LANES..run.end.div_ceil(LANES);
            let mut ids = [0; LANES];
            for block in blocks {
                let start = block * LANES;
                let xs = &face.x().as_chunks::<LANES>().0[block];
                for l in 0..LANES {
                    let x = xs[l];
                    ids[l] = index_in_grid(n, e0[0] * x + c0, e1[0] * x + c1, e2[0] * x + c2);
                }
                let (from, to) = (run.start.max(start), run.end.min(start + LANES));
                if engine.finest.has_cuts(side) {
                    for l in from - start..to - start {
                        if !engine.finest.is_cut(PatchId(first + ids[l])) {
                            continue;
                        }
                        let f = [e0[0] * xs[l] + c0, e1[0] * xs[l] + c1, e2[0] * xs[l] + c2];
                        ids[l] = owner(engine, first + ids[l], f) - first;
                    }
                }
                for (&id, &weight) in ids[from - start..to - start].iter().zip(&weights[from..to]) {
                    s.add(engine.whole(first + id), weight);
                }
            }
        }
    }
}

/// The patch that the point with edge functions `f` in the cell of patch `id` belongs to.
fn owner(engine: &Hemicube<'_>, id: u32, f: [f32; 3]) -> u32 {
    let f = DVec3::from_array(f.map(f64::from));
    engine.finest.owner(PatchId(id), f / (f.x + f.y + f.z)).0
}

/// Index of the patch in a grid of `n` strips where the edge functions have the values `f0, f1, f2`;
/// the twin in single precision of the look-up by barycentric coordinates. Always below n².
#[inline(always)]
fn index_in_grid(n: f32, f0: f32, f1: f32, f2: f32) -> u32 {
    let scale = n / (f0 + f1 + f2);
    let (u, v) = ((f0 * scale).max(0.0), (f1 * scale).max(0.0));
    let i = u.floor().min(n - 1.0);
    let j = v.floor().min(n - 1.0 - i);
    let inverted = ((u - i) + (v - j) > 1.0) & (i + j + 2.0 <= n);
    let (n, i, j) = (small_integer(n), small_integer(i), small_integer(j));
    i * (2 * n - i) + 2 * j + u32::from(inverted)
}

/// `x as u32` for whole x from 0 to 2^22, in a form that vectorises.
#[inline(always)]
fn small_integer(x: f32) -> u32 {
    const SHIFT: f32 = 8_388_608.0;
    (x + SHIFT).to_bits() & 0x7f_ffff
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, SceneBuilder, Sides, Surface};

    /// The inside of a unit cube.
    fn cube() -> Geometry {
        let mut b = SceneBuilder::new("cube");
        let m = b.material(Material::default());
        let s = b.surface(Surface { name: "cube".into(), node: 0, primitive: 0 });
        let v: Vec<u32> = (0..8_u32)
            .map(|i| b.vertex(DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2 & 1).into())))
            .collect();
        for [p, q, r, t] in
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        {
            b.triangle([v[p], v[q], v[r]], None, s, m, Sides::One);
            b.triangle([v[p], v[r], v[t]], None, s, m, Sides::One);
        }
        b.finish().geometry
    }

    fn rows(g: &Geometry, p: &Patches, draw: Draw, resolution: usize) -> Vec<Row> {
        let mut engine = Hemicube::new(g, p, HemicubeOptions { resolution, draw }).unwrap();
        let ids: Vec<PatchId> = p.ids().collect();
        let mut rows = vec![Row::default(); ids.len()];
        engine.fill(&ids, &mut rows).unwrap();
        rows
    }

    #[test]
    fn rows_of_a_closed_cube_sum_to_exactly_one() {
        let g = cube();
        let p = Patches::uniform(&g, 0.02).unwrap();
        for draw in [Draw::Sources, Draw::Patches] {
            for row in rows(&g, &p, draw, 64) {
                assert_eq!(row.weights.sum(), 1.0, "{draw:?}");
                assert_eq!([row.environment, row.back, row.lost], [0.0; 3]);
            }
        }
    }

    #[test]
    fn drawing_sources_gives_the_rows_of_drawing_patches() {
        let g = cube();
        let p = Patches::uniform(&g, 0.01).unwrap();
        let (a, b) = (rows(&g, &p, Draw::Sources, 128), rows(&g, &p, Draw::Patches, 128));
        for (a, b) in a.iter().zip(&b) {
            let variation: f64 =
                p.ids().map(|j| (a.factor_to(j) - b.factor_to(j)).abs()).sum::<f64>() / 2.0;
            assert!(variation <= 1e-4, "{variation}");
        }
    }

    #[test]
    fn faces_of_the_unit_cube_have_their_analytic_factors() {
        let g = cube();
        let p = Patches::uniform(&g, 0.5 / 256.0).unwrap();
        let rows = rows(&g, &p, Draw::Sources, 128);
        let face = |id: PatchId| p.cell(id).triangle.index() / 2;
        let mut factor = [0.0; 6];
        for (i, row) in p.ids().zip(&rows).filter(|(i, _)| face(*i) == 0) {
            for (j, f) in row.entries() {
                factor[face(j)] += p.area(i) * f;
            }
        }
        assert_eq!(factor[0], 0.0);
        assert!((factor[1] / 0.199_824_895_7 - 1.0).abs() < 5e-3, "opposite {}", factor[1]);
        for adjacent in &factor[2..] {
            assert!((adjacent / 0.200_043_776_1 - 1.0).abs() < 5e-3, "adjacent {adjacent}");
        }
    }
}
