//! Heat on real geometry, by exact form factors: closed enclosures whose answers are known.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

#[path = "common/scenes.rs"]
#[allow(dead_code, reason = "each test file uses a part of it")]
mod scenes;

use std::f64::consts::PI;

use Condition::{Heat, Temperature};
use glam::DVec3;
use hemicube::heat::{
    Condition, Exchange, HeatBalance, HeatInput, STEFAN_BOLTZMANN, balance, emissive_power,
};
use hemicube::matrix::{Lumped, MatrixOptions, Rows, make};
use hemicube::progress::Silent;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Grouping, Scene, Sides, builtin};

/// Each group of triangles is a row, a node and a surface.
struct Grouped {
    areas: Vec<f64>,
    exchange: Exchange,
}

impl Grouped {
    fn new(scene: &Scene, groups: &[u32], environment: bool) -> Self {
        let matrix = make(&scene.geometry, &MatrixOptions::default(), &Silent).unwrap();
        let names = (0..=*groups.iter().max().unwrap()).map(|g| g.to_string()).collect();
        let grouping = Grouping { names, of: groups.to_vec() };
        let lumped = Lumped::new(&matrix, &scene.geometry, &grouping).unwrap();
        let areas: Vec<f64> = lumped.surfaces(&scene.geometry).iter().map(|s| s.area).collect();
        let exchange = Exchange::new(&lumped, &areas, environment, 1 << 30, &Silent).unwrap();
        Self { areas, exchange }
    }

    fn run(&self, emissivity: &[f64], conditions: &[Condition]) -> HeatBalance {
        let each: Vec<u32> = (0..self.areas.len() as u32).collect();
        let input = HeatInput {
            exchange: &self.exchange,
            emissivity,
            node_of: &each,
            conditions,
            environment: None,
            sunlight: None,
            surface_of: &each,
            surfaces: each.len(),
            error: 0.0,
        };
        balance(&input, &Silent).unwrap()
    }
}

/// To 1e-6 of it.
fn near(found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
}

#[test]
fn a_box_of_three_surfaces_is_the_network_of_textbooks() {
    // A unit cube: floor and ceiling of given temperatures, walls that let nothing through.
    let scene = scenes::scene_of(
        [(&Mesh::cuboid(DVec3::ONE, [1, 1, 1]).inverted(), scenes::grey(0.5, 0.0))],
        Sides::One,
    );
    let g = &scene.geometry;
    let place = |n: DVec3| {
        if n.y > 0.5 {
            0
        } else if n.y < -0.5 {
            1
        } else {
            2
        }
    };
    let groups: Vec<u32> =
        g.ids().map(|t| place(g.normal(t, hemicube::scene::Side::Front))).collect();
    let order = groups.iter().fold(Vec::new(), |mut order: Vec<u32>, &g| {
        if !order.contains(&g) {
            order.push(g);
        }
        order
    });
    let at = |group: u32| order.iter().position(|&g| g == group).unwrap();
    let grouped = Grouped::new(&scene, &groups, false);
    let (hot, cold, e1, e2) = (900.0, 400.0, 0.8, 0.3);
    let (mut emissivity, mut conditions) = (vec![0.5; 3], vec![Heat(0.0); 3]);
    (emissivity[at(0)], emissivity[at(1)]) = (e1, e2);
    (conditions[at(0)], conditions[at(1)]) = (Temperature(hot), Temperature(cold));
    let found = grouped.run(&emissivity, &conditions);
    // Two squares that face each other at the distance of their side.
    let f = 2.0 / PI
        * ((4.0_f64 / 3.0).sqrt().ln() + 2.0 * 2.0_f64.sqrt() * (0.5_f64.sqrt()).atan()
            - 2.0 * 1.0_f64.atan());
    let (direct, by_walls) = (f, (1.0 - f) / 2.0);
    let resistance = (1.0 - e1) / e1 + 1.0 / (direct + by_walls) + (1.0 - e2) / e2;
    let exact = (emissive_power(hot) - emissive_power(cold)) / resistance;
    near(found.surfaces[at(0)].net, exact);
    near(found.surfaces[at(1)].net, -exact);
    // Walls see both alike: their power lies halfway between the radiosities.
    let radiosity = |i: usize| found.sides[at(i as u32)].radiosity;
    near(
        emissive_power(found.sides[at(2)].temperature.unwrap()),
        0.5 * (radiosity(0) + radiosity(1)),
    );
    assert!(found.imbalance < 1e-9, "{}", found.imbalance);
}

#[test]
fn nested_polyhedra_exchange_as_concentric_spheres_do() {
    let inner = Mesh::geodesic(0.5, 2);
    let outer = Mesh::geodesic(1.0, 2).inverted();
    let grey = scenes::grey(0.5, 0.0);
    let scene = scenes::scene_of([(&inner, grey.clone()), (&outer, grey)], Sides::One);
    let groups: Vec<u32> =
        (0..scene.geometry.len()).map(|t| u32::from(t >= inner.triangles.len())).collect();
    let grouped = Grouped::new(&scene, &groups, false);
    let [a1, a2] = [grouped.areas[0], grouped.areas[1]];
    for (e1, e2) in [(1.0, 1.0), (0.9, 0.1), (0.05, 0.6)] {
        let found = grouped.run(&[e1, e2], &[Temperature(77.0), Temperature(300.0)]);
        let resistance = 1.0 / (a1 * e1) + (1.0 / e2 - 1.0) / a2;
        let exact = STEFAN_BOLTZMANN * (77.0_f64.powi(4) - 300.0_f64.powi(4)) / resistance;
        near(found.surfaces[0].net, exact);
        assert!(found.imbalance < 1e-9, "{}", found.imbalance);
    }
}

#[test]
fn a_box_with_things_in_it_is_at_rest_at_one_temperature() {
    let scene = builtin::build("cornell-box").unwrap();
    let options = MatrixOptions { patch_size: Some(0.2), ..MatrixOptions::default() };
    let matrix = make(&scene.geometry, &options, &Silent).unwrap();
    let areas: Vec<f64> = (0..matrix.len()).map(|i| matrix.area(i)).collect();
    let exchange = Exchange::new(&matrix, &areas, true, 1 << 32, &Silent).unwrap();
    let n = areas.len();
    let each: Vec<u32> = (0..n as u32).collect();
    let emissivity: Vec<f64> = (0..n).map(|i| (i % 11) as f64 / 10.0).collect();
    let run = |conditions: &[Condition]| {
        let input = HeatInput {
            exchange: &exchange,
            emissivity: &emissivity,
            node_of: &each,
            conditions,
            environment: Some(291.0),
            sunlight: None,
            surface_of: &each,
            surfaces: n,
            error: 0.0,
        };
        balance(&input, &Silent).unwrap()
    };
    let even = |i: usize| if i.is_multiple_of(3) { Temperature(291.0) } else { Heat(0.0) };
    let conditions: Vec<Condition> = (0..n).map(even).collect();
    let found = run(&conditions);
    assert!(found.sides.iter().all(|s| s.flux == 0.0), "no flux at all");
    let temperatures = found.sides.iter().filter_map(|s| s.temperature);
    assert!(temperatures.clone().count() > n / 2);
    temperatures.for_each(|t| assert!((t - 291.0).abs() < 1e-9, "{t}"));
    // With heat here and there, what is supplied leaves again.
    let uneven = |i: usize| match i % 5 {
        _ if emissivity[i] == 0.0 => Heat(0.0),
        0 => Temperature(280.0 + i as f64 / 100.0),
        1 => Heat(10.0 * areas[i]),
        _ => Heat(0.0),
    };
    let conditions: Vec<Condition> = (0..n).map(uneven).collect();
    let found = run(&conditions);
    assert!(found.imbalance < 1e-9 && found.supplied > 1.0, "{}", found.imbalance);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| run(&conditions)).sides, found.sides, "{threads} threads");
    }
}
