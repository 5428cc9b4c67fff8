//! Light with a known answer: every engine and every solver must reach it.
//!
//! Each engine states how near it comes. Hemicubes and the classical algorithm look from the centre
//! of a patch, so sums over many patches carry a bias that depends on the scene. Rays begin all
//! over the patch: noise instead of bias. Exact factors are reciprocal, so the only error of sums
//! is what their rows lack to 1.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use common::engines::{ENGINES, Kind, METHODS};
use common::scenes::{lit_by_first, quad};
use glam::{DVec3, dvec3};
use hemicube::direct;
use hemicube::form_factors::FormFactors;
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::builtin::{self, FURNACE_REFLECTANCE, Mesh, closed_room};
use hemicube::scene::{Rgb, Scene, Sides};
use hemicube::solve::{EnergyBalance, Method, SolveOptions, System, solve};

/// A scene with all its rows, ready to be solved.
struct Case {
    scene: Scene,
    patches: Patches,
    factors: FormFactors,
    emission: Vec<Rgb>,
    rho: Vec<Rgb>,
    direct: Vec<Rgb>,
    areas: Vec<f64>,
}

impl Case {
    fn new(scene: Scene, patch_size: f64, kind: Kind) -> Self {
        let g = &scene.geometry;
        let patches = Patches::uniform(g, patch_size).unwrap();
        let ids: Vec<PatchId> = patches.ids().collect();
        let mut factors = FormFactors::new(ids.len(), 1 << 30);
        kind.with(g, &patches, |engine| engine.make(&ids, &mut factors, &Silent)).unwrap();
        let emission = direct::emission(&scene.optics, &patches);
        let rho = direct::reflectance(&scene.optics, &patches);
        let direct = direct::through_rows(&factors, &emission, scene.sky);
        let areas = ids.iter().map(|&i| patches.own_area(i)).collect();
        Self { scene, patches, factors, emission, rho, direct, areas }
    }

    fn system(&self) -> System<'_> {
        System { factors: &self.factors, rho: &self.rho, direct: &self.direct, areas: &self.areas }
    }

    fn solve(&self, method: Method) -> Vec<Rgb> {
        let options = SolveOptions { method, tolerance: 1e-9, ..SolveOptions::default() };
        solve(&self.system(), &options, &Silent).unwrap().0
    }

    fn balance(&self, h: &[Rgb]) -> EnergyBalance {
        EnergyBalance::of(&self.system(), &self.emission, self.scene.sky, &[], h)
    }
}

#[test]
fn furnace_has_its_radiosity_everywhere() {
    for kind in ENGINES {
        let case = Case::new(builtin::build("furnace").unwrap(), 0.02, kind);
        let tolerance = match kind {
            // Rows sum to one.
            Kind::Hemicube(_) | Kind::Rays => 1e-6,
            // Rows of a convex room are exact but for single precision.
            Kind::Classical => 1e-5,
            // What a row lacks, times 1 / (1 - ρ).
            Kind::Exact => 1e-4,
        };
        for method in METHODS {
            let h = case.solve(method);
            for (i, h) in h.iter().enumerate() {
                let b = case.emission[i] + case.rho[i] * *h;
                let exact = case.emission[i] / (Rgb::ONE - FURNACE_REFLECTANCE);
                let error = (b / exact - Rgb::ONE).abs().max_element();
                assert!(error <= tolerance, "{kind:?} {method:?}: patch {i}: {b} {exact}");
            }
        }
    }
}

#[test]
fn elimination_equals_iteration() {
    for kind in ENGINES {
        let case = Case::new(builtin::build("cornell-box").unwrap(), 0.7, kind);
        let exact = case.solve(Method::Direct);
        assert!(case.system().residual(&exact, 1e-13).unwrap() < 1e-13);
        let scale = exact.iter().map(|h| h.max_element()).fold(0.0, f64::max);
        for method in METHODS {
            let h = case.solve(method);
            let worst = exact.iter().zip(&h).map(|(a, b)| (*a - *b).abs().max_element());
            let worst = worst.fold(0.0, f64::max) / scale;
            assert!(worst < 1e-6, "{kind:?} {method:?}: {worst:e}");
        }
    }
}

#[test]
fn a_closed_room_with_uneven_emission_receives_what_is_known() {
    let radiance = [0.0, 0.0, 1.0, 20.0, 0.0, 3.0].map(Rgb::splat);
    let rho = Rgb::new(0.3, 0.5, 0.8);
    for kind in ENGINES {
        let scene = || closed_room("uneven", dvec3(4.0, 2.5, 3.0), rho, radiance);
        let mut errors = Vec::new();
        for size in [0.5, 0.1] {
            let case = Case::new(scene(), size, kind);
            let flux: Rgb = case.emission.iter().zip(&case.areas).map(|(e, a)| *e * *a).sum();
            for method in METHODS {
                let h = case.solve(method);
                let arriving: Rgb = h.iter().zip(&case.areas).map(|(h, a)| *h * *a).sum();
                let error = arriving / (flux / (Rgb::ONE - rho)) - Rgb::ONE;
                if method == Method::GaussSeidel {
                    errors.push(error.abs().max_element());
                }
                let balance = case.balance(&h);
                let sink = Rgb::from(balance.absorbed)
                    + Rgb::from(balance.absorbed_by_backs)
                    + Rgb::from(balance.escaped);
                let lost = sink / Rgb::from(balance.emitted) - Rgb::ONE;
                // Nothing escapes: arriving too little is the same as absorbing too little.
                assert!((lost - error).abs().max_element() < 1e-5, "{kind:?}: {lost} {error}");
                assert!(error.abs().max_element() < 0.03, "{kind:?} {method:?}: {error}");
            }
        }
        println!(
            "{kind:?}: relative error of the sum of A H at patch sizes .5 and .1: {errors:.4?}"
        );
        let worst = errors[0].max(errors[1]);
        let kept = match kind {
            Kind::Hemicube(_) | Kind::Classical => errors[1] < 0.6 * errors[0],
            // Noise does not fall with the patch size, but there is no bias either.
            Kind::Rays => worst < 2e-3,
            Kind::Exact => worst < 1e-4,
        };
        assert!(kept, "{kind:?}: {errors:?}");
    }
}

#[test]
fn an_open_scene_balances_within_the_engines_error() {
    for kind in ENGINES {
        let case = Case::new(builtin::build("cornell-box").unwrap(), 0.3, kind);
        let balance = case.balance(&case.solve(Method::GaussSeidel));
        println!("{kind:?}: {balance:.4?}");
        // How far the factors are from reciprocity, and what the rows cannot say the end of.
        let (imbalance, lost) = match kind {
            Kind::Hemicube(_) | Kind::Rays => (0.03, 0.0),
            Kind::Classical => (0.03, 1.0),
            Kind::Exact => (1e-6, 2e-3),
        };
        assert!(balance.imbalance.abs() < imbalance, "{kind:?}: {}", balance.imbalance);
        for (channel, emitted) in balance.emitted.into_iter().enumerate() {
            assert!(balance.lost[channel].abs() <= lost * emitted, "{kind:?}: {balance:?}");
        }
        if kind == Kind::Classical {
            assert_eq!((balance.escaped, balance.absorbed_by_backs), ([0.0; 3], [0.0; 3]));
        } else {
            assert!(balance.escaped[0] > 0.1 * balance.emitted[0], "the front is open");
        }
    }
}

/// Two rooms with one wall between them, all double-sided; the left one is lit.
fn two_rooms() -> Scene {
    let at =
        |x: f64| [dvec3(x, 0.0, 0.0), dvec3(x, 1.0, 0.0), dvec3(x, 1.0, 1.0), dvec3(x, 0.0, 1.0)];
    // The four sides of a box open at both ends.
    let sleeve = |from: f64, to: f64| {
        let vertices = [at(from), at(to)].concat();
        Mesh::from_quads(vertices, &[0, 1, 2, 3].map(|i| [i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4]))
    };
    let (left, wall, right) = (quad(at(0.0)), quad(at(1.0)), quad(at(2.0)));
    lit_by_first(&[&left, &sleeve(0.0, 1.0), &wall, &sleeve(1.0, 2.0), &right], Sides::Two)
}

#[test]
fn a_thin_wall_leaves_the_dark_room_dark() {
    for kind in ENGINES {
        for size in [0.5, 0.1] {
            let case = Case::new(two_rooms(), size, kind);
            for method in METHODS {
                let h = case.solve(method);
                let rooms = [0.0, 1.0].map(|x| {
                    let inside = case.patches.ids().filter(|&id| faces_room(&case, id, x));
                    inside.map(|id| h[id.index()]).collect::<Vec<Rgb>>()
                });
                let count = case.patches.len() * 6 / 22;
                assert_eq!(rooms.each_ref().map(Vec::len), [count; 2]);
                let [lit, dark] = rooms;
                let least = lit.iter().map(|h| h.min_element()).fold(f64::INFINITY, f64::min);
                let leak = dark.iter().map(|h| h.max_element()).fold(0.0, f64::max);
                // Exact factors tell what is hidden by clipping in single precision.
                let allowed = if kind == Kind::Exact { 1e-6 } else { 0.0 };
                println!("{kind:?} {method:?} {size}: at least {least:.3}, beyond {leak:.1e}");
                assert!(least > 0.02 && leak <= allowed, "{kind:?} {method:?} {size}: {leak}");
            }
        }
    }
}

/// Whether a patch faces the inside of the unit cube that begins at (x, 0, 0).
fn faces_room(case: &Case, id: PatchId, x: f64) -> bool {
    let g = &case.scene.geometry;
    let cell = case.patches.cell(id);
    let centre = case.patches.center(id).position(g);
    let before = centre + 1e-6 * g.normal(cell.triangle, cell.side) - x * DVec3::X;
    before.cmpgt(DVec3::ZERO).all() && before.cmplt(DVec3::ONE).all()
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize, kind: Kind| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let case = Case::new(builtin::build("cornell-box").unwrap(), 0.5, kind);
            let solutions = METHODS.map(|m| case.solve(m));
            let rows: Vec<_> = case
                .patches
                .ids()
                .filter_map(|i| Some(case.factors.row(i)?.entries().collect::<Vec<_>>()))
                .collect();
            (rows, solutions)
        })
    };
    for kind in ENGINES {
        let one = run(1, kind);
        for threads in [2, 8] {
            let many = run(threads, kind);
            assert!(one.0 == many.0, "{kind:?}: rows with {threads} threads");
            for ((a, b), method) in one.1.iter().zip(&many.1).zip(METHODS) {
                assert!(a == b, "{kind:?} {method:?}: {threads} threads");
            }
        }
    }
}
