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

mod count;

use std::sync::{Mutex, PoisonError};

use glam::Vec3;
use rayon::prelude::*;
use thiserror::Error;

use super::delta::DeltaFormFactors;
use super::engine::{Engine, EngineError};
use super::lookup::Lookups;
use crate::form_factors::Row;
use crate::form_factors::tally::Tally;
use crate::patches::{PatchId, Patches, Split};
use crate::scene::{Geometry, Side, TriangleId};
use crate::simd::multiversion;
use crate::visibility::{
    Bodies, Edges, Face, Frame, ItemBuffer, NOTHING, Occluders, PatchArea, View, code, each_face,
    faces_of,
};
use count::{count_patches, count_sources, write};

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
    draw: Draw,
    occluders: Occluders,
    bodies: Bodies,
    faces: [Face; 5],
    /// Delta form factors of top and side with the stride of the faces; padding weighs nothing.
    weights: [Vec<u32>; 2],
    lookups: Lookups<'a>,
    scratch: Mutex<Vec<Scratch>>,
}

/// What one thread needs to make a row.
#[derive(Default)]
struct Scratch {
    view: View,
    /// Solid triangles whose back would be seen, if their body did not hide it.
    hidden: Vec<bool>,
    buffers: [ItemBuffer; 5],
    /// Edge functions of the triangles drawn: by solid triangle, or by source triangle when patches
    /// are drawn.
    edges: Vec<Edges>,
    /// Weight of each patch seen so far in this row.
    tally: Tally<u32>,
    /// The patch under each pixel of a row of pixels.
    places: Vec<u32>,
}

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
        let occluders = Occluders::new(geometry);
        let scratch = Mutex::new(Vec::new());
        let bodies = occluders.bodies(geometry);
        let lookups = Lookups::new(occluders.ids(), patches);
        let draw = options.draw;
        Ok(Self { geometry, patches, draw, occluders, bodies, faces, weights, lookups, scratch })
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        let mut scratch = self.locked().pop().unwrap_or_default();
        scratch.tally.resize(self.patches.len() + 2);
        make_row(self, id, &mut scratch, row);
        self.locked().push(scratch);
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Vec<Scratch>> {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Engine for Hemicube<'_> {
    fn name(&self) -> &'static str {
        "hemicube"
    }

    fn sees_from_centres(&self) -> bool {
        true
    }

    fn bytes(&self, rows: usize) -> u64 {
        let threads = rows.min(rayon::current_num_threads()) as u64;
        let pixels: usize = self.faces.iter().map(|f| f.stride() * f.height()).sum();
        let per_thread = 8 * pixels + 5 * self.patches.len() + 63 * self.occluders.len();
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
    let own = engine.occluders.ids().binary_search(&cell.triangle).ok();
    let own = own.map(|i| (i, cell.side == Side::Front));
    engine.bodies.hide(centre, own, &mut scratch.hidden);
    for (buffer, face) in scratch.buffers.iter_mut().zip(&engine.faces) {
        buffer.clear(face);
    }
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
    write(&mut scratch.tally, engine.patches.len(), row);
}

/// Projects every source triangle but the patch's own on the faces; items are twice the number of
/// the solid triangle, plus one if its back is seen.
#[inline(always)]
fn project_sources(engine: &Hemicube<'_>, own: TriangleId, s: &mut Scratch) {
    s.edges.resize(engine.occluders.len(), Edges::default());
    for (i, &id) in engine.occluders.ids().iter().enumerate() {
        let faces = engine.occluders.faces_in(&s.view, i);
        if faces == 0 || id == own || s.hidden[i] {
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
        if engine.occluders.faces_in(&s.view, i) == 0 || id == own || s.hidden[i] {
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
    fn leaving_out_the_backs_of_bodies_changes_no_row_by_more_than_a_silhouette() {
        for name in ["paper-1", "paper-3", "room"] {
            let g = crate::scene::builtin::build(name).unwrap().geometry;
            let p = Patches::uniform(&g, 1.0).unwrap();
            let mut engine = Hemicube::new(&g, &p, HemicubeOptions::default()).unwrap();
            let ids: Vec<PatchId> = p.ids().step_by(p.len() / 150).collect();
            let mut rows = [vec![Row::default(); ids.len()], vec![Row::default(); ids.len()]];
            engine.fill(&ids, &mut rows[0]).unwrap();
            engine.bodies = Bodies::none(engine.occluders.len());
            engine.fill(&ids, &mut rows[1]).unwrap();
            for ((a, b), &id) in rows[0].iter().zip(&rows[1]).zip(&ids) {
                let change: f64 = p.ids().map(|j| (a.factor_to(j) - b.factor_to(j)).abs()).sum();
                assert!(change <= 1e-3, "{name} {id:?}: {change}");
                assert!((a.back - b.back).abs() <= 1e-3, "{name} {id:?}: {} {}", a.back, b.back);
            }
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
