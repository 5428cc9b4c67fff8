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
//! - A pixel on a part of a patch that something standing on it parts from the patch's centre
//!   counts for the neighbour that the part belongs to ([`Patches::at`]).
//! - The patch's own source triangle is left out by its id, never by depth.
//! - Backs that do not reflect lose against all that is nearly as near: a closed body shows none.

mod count;
mod model;
mod net;
mod options;
mod project;

use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::engine::{Engine, EngineError};
use crate::form_factors::Row;
use crate::patches::{PatchId, Patches};
use crate::scene::{Geometry, Side};
use crate::simd::multiversion;
use crate::visibility::Frame;
use count::{count_patches, count_sources, write};
use model::{Model, RowBuffers};
pub use net::{Item, Net};
pub use options::{Draw, HemicubeError, HemicubeOptions};
use project::{project_patches, project_sources};

/// The hemicube engine on the CPU.
pub struct Hemicube<'a> {
    model: Model<'a>,
    draw: Draw,
    buffers: Mutex<Vec<RowBuffers>>,
}

impl<'a> Hemicube<'a> {
    /// An engine for these patches.
    pub fn new(
        geometry: &'a Geometry,
        patches: &'a Patches,
        options: HemicubeOptions,
    ) -> Result<Self, HemicubeError> {
        options.check()?;
        let model = Model::new(geometry, patches, options.resolution);
        Ok(Self { model, draw: options.draw, buffers: Mutex::default() })
    }

    /// Makes one row.
    pub fn row(&self, id: PatchId, row: &mut Row) {
        let mut buffers = self.locked().pop().unwrap_or_default();
        buffers.tally.resize(self.model.patches.len() + 2);
        make_row(&self.model, self.draw, id, &mut buffers, row);
        self.locked().push(buffers);
    }

    /// What the hemicube of a patch sees, laid flat. The engine must draw patches
    /// ([`Draw::Patches`]); another's pixels hold source triangles, and yield `None`.
    #[must_use]
    pub fn net(&self, id: PatchId) -> Option<Net> {
        if self.draw != Draw::Patches {
            return None;
        }
        let mut buffers = RowBuffers::default();
        buffers.tally.resize(self.model.patches.len() + 2);
        make_row(&self.model, self.draw, id, &mut buffers, &mut Row::default());
        Some(net::net(&self.model, &buffers))
    }

    fn locked(&self) -> MutexGuard<'_, Vec<RowBuffers>> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
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
        let pixels: usize = self.model.faces.iter().map(|f| f.stride() * f.height()).sum();
        let per_thread =
            8 * pixels + 5 * self.model.patches.len() + 63 * self.model.occluders.len();
        threads * per_thread as u64
    }

    fn fill(&mut self, rows: &[PatchId], out: &mut [Row]) -> Result<(), EngineError> {
        let me = &*self;
        rows.par_iter().zip(out).for_each(|(&id, row)| me.row(id, row));
        Ok(())
    }
}

multiversion! {
    fn make_row(model: &Model<'_>, draw: Draw, id: PatchId, buffers: &mut RowBuffers, row: &mut Row)
        = make_row_kernel
}

#[inline(always)]
fn make_row_kernel(
    model: &Model<'_>,
    draw: Draw,
    id: PatchId,
    buffers: &mut RowBuffers,
    row: &mut Row,
) {
    let cell = model.patches.cell(id);
    let normal = model.geometry.normal(cell.triangle, cell.side);
    let centre = model.patches.origin(id).position(model.geometry);
    model.occluders.look(&Frame::on_surface(centre, normal), &mut buffers.view);
    let own = model.occluders.ids().binary_search(&cell.triangle).ok();
    let own = own.map(|i| (i, cell.side == Side::Front));
    model.bodies.hide(centre, own, &mut buffers.hidden);
    for (items, face) in buffers.items.iter_mut().zip(&model.faces) {
        items.clear(face);
    }
    match draw {
        Draw::Sources => {
            project_sources(model, cell.triangle, buffers);
            count_sources(model, buffers);
        }
        Draw::Patches => {
            project_patches(model, cell.triangle, buffers);
            count_patches(model, buffers);
        }
    }
    write(&mut buffers.tally, model.patches.len(), row);
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::builtin::Mesh;
    use crate::scene::{Material, SceneBuilder, Sides};
    use crate::visibility::Bodies;

    /// The inside of a unit cube.
    fn cube() -> Geometry {
        let corner = |i: u32| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2 & 1).into());
        let cube = Mesh::from_quads(
            (0..8).map(corner).collect(),
            &[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
        );
        let mut b = SceneBuilder::new("cube");
        let m = b.material(Material::default());
        b.mesh("cube", &cube.vertices, &cube.triangles, m, Sides::One);
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
    fn a_hemicube_laid_flat_goes_on_over_the_edges_of_its_top() {
        let g = cube();
        let p = Patches::uniform(&g, 1.0).unwrap();
        let n = 64;
        let of = |draw| Hemicube::new(&g, &p, HemicubeOptions { resolution: n, draw }).unwrap();
        assert_eq!(of(Draw::Sources).net(PatchId(0)), None);
        let net = of(Draw::Patches).net(PatchId(0)).unwrap();
        assert_eq!((net.size, net.pixels.len()), (2 * n, 4 * n * n));
        assert_eq!(net.pixels.iter().flatten().count(), 3 * n * n, "five faces");
        let at = |x: usize, y: usize| net.pixels[y * net.size + x].unwrap();
        let (first, last) = (n / 2, 3 * n / 2 - 1);
        let across = (first..=last).flat_map(|i| {
            [
                [at(i, first), at(i, first - 1)],
                [at(i, last), at(i, last + 1)],
                [at(first, i), at(first - 1, i)],
                [at(last, i), at(last + 1, i)],
            ]
        });
        let same = across.filter(|[a, b]| a == b).count();
        assert!(same >= 4 * n * 9 / 10, "{same} of {}", 4 * n);
        let mut row = Row::default();
        of(Draw::Patches).row(PatchId(0), &mut row);
        for (j, _) in row.entries() {
            assert!(net.pixels.contains(&Some(Item::Patch(j))), "{j:?}");
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
            let hides = |&id: &PatchId| {
                let mut hidden = Vec::new();
                engine.model.bodies.hide(p.origin(id).position(&g), None, &mut hidden);
                hidden.contains(&true)
            };
            assert!(ids.iter().any(hides), "{name}: nothing is left out");
            engine.model.bodies = Bodies::none(engine.model.occluders.len());
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
