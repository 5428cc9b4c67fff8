use std::io;

use super::*;
use crate::matrix::{Precision, Rows, SurfaceRow};
use crate::progress::Silent;
use crate::scene::Geometry;

/// A matrix that is given; what rows leave of 1 goes to the environment.
struct Plain(Vec<Vec<f64>>);

impl Rows for Plain {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn entries(&self) -> u64 {
        self.0.iter().flatten().filter(|f| **f > 0.0).count() as u64
    }

    fn precision(&self) -> Precision {
        Precision::Double
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        let entries = (0..).zip(&self.0[i]).filter(|e| *e.1 > 0.0);
        (*columns, *values) = entries.unzip();
        Ok(())
    }

    fn label(&self, i: usize) -> String {
        i.to_string()
    }

    fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
        vec![SurfaceRow::default(); self.len()]
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        [(1.0 - self.0[i].iter().sum::<f64>()).max(0.0), 0.0]
    }
}

/// Two plates so wide that they see each other alone.
fn plates() -> Plain {
    Plain(vec![vec![0.0, 1.0], vec![1.0, 0.0]])
}

fn exchange(rows: &Plain, areas: &[f64], environment: bool) -> Exchange {
    Exchange::new(rows, areas, environment, 1 << 30, &Silent).unwrap()
}

/// Every row is a node and a surface of its own.
struct Case {
    exchange: Exchange,
    emissivity: Vec<f64>,
    conditions: Vec<Condition>,
    node_of: Vec<u32>,
    environment: Option<f64>,
    sun: Option<(Vec<f64>, Vec<f64>, f64)>,
    error: f64,
}

impl Case {
    fn new(exchange: Exchange, emissivity: &[f64], conditions: &[Condition]) -> Self {
        Self {
            emissivity: emissivity.to_vec(),
            conditions: conditions.to_vec(),
            node_of: (0..exchange.len() as u32).collect(),
            environment: None,
            sun: None,
            error: 0.0,
            exchange,
        }
    }

    fn run(&self) -> Result<HeatBalance, HeatError> {
        let surface_of: Vec<u32> = (0..self.exchange.len() as u32).collect();
        let sunlight = self.sun.as_ref().map(|(absorptance, direct, diffuse)| Sunlight {
            absorptance,
            direct,
            diffuse: *diffuse,
        });
        let input = HeatInput {
            exchange: &self.exchange,
            emissivity: &self.emissivity,
            node_of: &self.node_of,
            conditions: &self.conditions,
            environment: self.environment,
            sunlight,
            surface_of: &surface_of,
            surfaces: surface_of.len(),
            error: self.error,
        };
        balance(&input, &Silent)
    }
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-10 * b.abs(), "{a} {b}");
}

use Condition::{Heat, Temperature};

#[test]
fn parallel_plates_exchange_what_the_formula_says() {
    let (hot, cold, e1, e2) = (600.0, 300.0, 0.7, 0.2);
    let exact = (emissive_power(hot) - emissive_power(cold)) / (1.0 / e1 + 1.0 / e2 - 1.0);
    let case = |conditions: [Condition; 2]| {
        Case::new(exchange(&plates(), &[2.0, 2.0], false), &[e1, e2], &conditions)
    };
    let found = case([Temperature(hot), Temperature(cold)]).run().unwrap();
    near(found.sides[0].flux, exact);
    near(found.sides[1].flux, -exact);
    near(found.supplied, 2.0 * exact);
    near(found.surfaces[1].net, -2.0 * exact);
    assert!(found.imbalance < 1e-12);
    // The heat instead of the temperature comes to the same.
    let found = case([Heat(2.0 * exact), Temperature(cold)]).run().unwrap();
    near(found.sides[0].temperature.unwrap(), hot);
    near(found.sides[0].flux, exact);
}

#[test]
fn shields_between_plates_divide_what_flows() {
    // Plate, both sides of each shield, plate: each sees the next alone.
    let shields = 3;
    let n = 2 * (shields + 1);
    let mut rows = vec![vec![0.0; n]; n];
    for gap in 0..=shields {
        (rows[2 * gap][2 * gap + 1], rows[2 * gap + 1][2 * gap]) = (1.0, 1.0);
    }
    let exchange = exchange(&Plain(rows), &vec![1.0; n], false);
    let mut conditions = vec![Heat(0.0); shields + 2];
    (conditions[0], conditions[shields + 1]) = (Temperature(500.0), Temperature(200.0));
    let mut case = Case::new(exchange, &vec![0.3; n], &conditions);
    case.node_of = (0..n as u32).map(|i| i.div_ceil(2)).collect();
    let found = case.run().unwrap();
    let without = (emissive_power(500.0) - emissive_power(200.0)) / (2.0 / 0.3 - 1.0);
    near(found.supplied, without / (shields + 1) as f64);
    // Their powers lie between in equal steps.
    let powers: Vec<f64> =
        found.sides.iter().map(|s| emissive_power(s.temperature.unwrap())).collect();
    near(powers[1], powers[2]);
    near(2.0 * powers[3], powers[1] + powers[5]);
    assert!(
        found.sides[1].net().abs() > 1.0
            && (found.sides[1].net() + found.sides[2].net()).abs() < 1e-9
    );
}

#[test]
fn black_and_white_sides_are_limits_like_others() {
    let exact = emissive_power(400.0) - emissive_power(100.0);
    let plates = || exchange(&plates(), &[1.0, 1.0], false);
    let black =
        Case::new(plates(), &[1.0, 1.0], &[Temperature(400.0), Temperature(100.0)]).run().unwrap();
    near(black.supplied, exact);
    let white =
        Case::new(plates(), &[1.0, 0.0], &[Temperature(400.0), Temperature(100.0)]).run().unwrap();
    assert!(white.supplied.abs() < 1e-10 * exact);
    let floats = Case::new(plates(), &[1.0, 0.0], &[Temperature(400.0), Heat(0.0)]).run().unwrap();
    assert_eq!(floats.sides[1].temperature, None, "nothing says which");
    near(floats.sides[1].radiosity, emissive_power(400.0));
    assert_eq!(floats.surfaces[1].temperature, None);
    let heated = Case::new(plates(), &[1.0, 0.0], &[Temperature(400.0), Heat(1.0)]).run();
    assert!(matches!(heated, Err(HeatError::White { node: 1 })));
}

#[test]
fn a_node_has_one_temperature_whichever_of_its_sides_tells_it() {
    // Row 0 is white, and the other side, row 1, of its node sees row 2.
    let rows = Plain(vec![vec![0.0; 3], vec![0.0, 0.0, 1.0], vec![0.0, 1.0, 0.0]]);
    let exchange = || exchange(&rows, &[1.0; 3], true);
    let run = |emissivity: [f64; 3], conditions: [Condition; 2]| {
        let mut case = Case::new(exchange(), &emissivity, &conditions);
        case.node_of = vec![0, 0, 1];
        case.environment = Some(250.0);
        case.run().unwrap().sides
    };
    let given = run([0.0, 0.5, 0.5], [Temperature(310.0), Heat(0.0)]);
    assert!(given.iter().all(|s| (s.temperature.unwrap() - 310.0).abs() < 1e-9));
    // What only its white side sees tells nothing.
    let open = run([0.0, 0.5, 0.5], [Heat(0.0), Heat(0.0)]);
    assert!(open.iter().all(|s| s.temperature.is_none()));
}

#[test]
fn equal_temperatures_exchange_nothing_at_all() {
    let rows = Plain(vec![vec![0.1, 0.2, 0.3], vec![0.2, 0.3, 0.1], vec![0.3, 0.1, 0.0]]);
    let conditions = [Temperature(293.15), Temperature(293.15), Heat(0.0)];
    let mut case = Case::new(exchange(&rows, &[1.0; 3], true), &[0.9, 0.05, 0.4], &conditions);
    case.environment = Some(293.15);
    let found = case.run().unwrap();
    for side in &found.sides {
        assert_eq!(side.flux, 0.0);
        near(side.temperature.unwrap(), 293.15);
    }
    assert_eq!((found.supplied, found.to_environment, found.imbalance), (0.0, 0.0, 0.0));
}

#[test]
fn a_plate_in_the_sun_is_as_warm_as_it_absorbs_and_emits() {
    let (absorptance, emissivity, sun) = (0.2, 0.85, 1361.0);
    let mut case =
        Case::new(exchange(&Plain(vec![vec![0.0]]), &[3.0], true), &[emissivity], &[Heat(0.0)]);
    case.environment = Some(0.0);
    case.sun = Some((vec![absorptance], vec![sun], 0.0));
    let found = case.run().unwrap();
    near(found.sides[0].temperature.unwrap(), temperature(absorptance * sun / emissivity));
    near(found.to_environment, 3.0 * absorptance * sun);
    near(found.sunlight[0], 3.0 * sun);
    near(found.sunlight[1], 3.0 * (1.0 - absorptance) * sun);
    assert!(found.imbalance < 1e-12 && found.sides[0].net().abs() < 1e-9);
    // From everywhere, it is the same again.
    case.sun = Some((vec![absorptance], vec![0.0], sun));
    near(
        case.run().unwrap().sides[0].temperature.unwrap(),
        temperature(absorptance * sun / emissivity),
    );
}

#[test]
fn heat_of_sides_that_lie_on_something_is_left_out() {
    // The third side exchanges with nothing: all that it sends out meets backs.
    let rows = Plain(vec![vec![0.0, 1.0, 0.0], vec![1.0, 0.0, 0.0], vec![0.0, 0.0, 1.0]]);
    let conditions = [Temperature(400.0), Heat(5.0), Heat(7.0)];
    let found = Case::new(exchange(&rows, &[1.0; 3], false), &[0.9; 3], &conditions).run().unwrap();
    assert_eq!(found.left_out, (7.0, 1));
    assert_eq!((found.sides[2].flux, found.sides[2].temperature), (0.0, None));
    near(found.removed, 5.0);
    assert!(found.imbalance < 1e-12, "{}", found.imbalance);
}

#[test]
fn gebhart_factors_give_the_same_heat() {
    let rows = vec![vec![0.0, 0.3, 0.2], vec![0.15, 0.1, 0.25], vec![0.1, 0.25, 0.3]];
    let areas = [1.0, 2.0, 2.0];
    let emissivity = [0.9, 0.3, 0.05];
    let temperatures = [500.0, 300.0, 50.0];
    let exchange = exchange(&Plain(rows), &areas, true);
    let conditions = temperatures.map(Temperature);
    let mut case = Case::new(exchange, &emissivity, &conditions);
    case.environment = Some(100.0);
    let found = case.run().unwrap();
    let surfaces = vec![SurfaceRow::default(); 3];
    let factors = gebhart(&case.exchange, &emissivity, surfaces, 1 << 20, &Silent).unwrap();
    let heat = carried(&factors, &case.node_of, &temperatures, 100.0);
    for i in 0..3 {
        near(heat[i], areas[i] * found.sides[i].flux);
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        factors.row(i, &mut columns, &mut values).unwrap();
        near(values.iter().sum::<f64>() + factors.rest(i)[0], 1.0);
    }
    let little = gebhart(&case.exchange, &emissivity, Vec::new(), 100, &Silent);
    assert!(matches!(little, Err(HeatError::Memory { needed: 144, .. })));
}

/// Heat that leaves each node through conductors, W.
fn carried(factors: &Gebhart, node_of: &[u32], temperatures: &[f64], around: f64) -> Vec<f64> {
    let power = |i: usize| emissive_power(temperatures[i]);
    let mut heat = vec![0.0; temperatures.len()];
    let sum = factors.between_nodes(node_of, |i, others, out| {
        for (j, conductor) in others {
            let flows = conductor * (power(i) - power(*j));
            heat[i] += flows;
            heat[*j] -= flows;
        }
        heat[i] += out.unwrap_or(0.0) * (power(i) - emissive_power(around));
        Ok::<(), ()>(())
    });
    sum.unwrap();
    heat
}

#[test]
fn conductors_join_both_sides_of_a_node() {
    // A shield between two plates: its sides are rows 1 and 2, and one node.
    let mut rows = vec![vec![0.0; 4]; 4];
    for (i, j) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
        rows[i][j] = 1.0;
    }
    let emissivity = [0.9, 0.2, 0.6, 0.5];
    let given = [Temperature(500.0), Temperature(350.0), Temperature(200.0)];
    let mut case = Case::new(exchange(&Plain(rows), &[2.0; 4], false), &emissivity, &given);
    case.node_of = vec![0, 1, 1, 2];
    let found = case.run().unwrap();
    let surfaces = vec![SurfaceRow::default(); 4];
    let factors = gebhart(&case.exchange, &emissivity, surfaces, 1 << 20, &Silent).unwrap();
    let heat = carried(&factors, &case.node_of, &[500.0, 350.0, 200.0], 0.0);
    near(heat[0], 2.0 * found.sides[0].flux);
    near(heat[1], 2.0 * (found.sides[1].flux + found.sides[2].flux));
    near(heat[2], 2.0 * found.sides[3].flux);
}

#[test]
fn what_nothing_of_absorbs_spoils_no_factors_of_others() {
    // Rows 2 and 3 exchange with each other alone, and row 4 with itself; all are white.
    let mut rows = vec![vec![0.0; 5]; 5];
    for (i, j) in [(0, 1), (1, 0), (2, 3), (3, 2), (4, 4)] {
        rows[i][j] = 1.0;
    }
    let exchange = exchange(&Plain(rows), &[1.0; 5], false);
    let emissivity = [0.8, 0.4, 0.0, 0.0, 0.0];
    let surfaces = vec![SurfaceRow::default(); 5];
    let factors = gebhart(&exchange, &emissivity, surfaces, 1 << 20, &Silent).unwrap();
    let mut all = Vec::new();
    let each: Vec<u32> = (0..5).collect();
    let listed = factors.between_nodes(&each, |i, others, out| {
        assert_eq!(out, None);
        all.extend(others.iter().map(|(j, conductor)| (i, *j, *conductor)));
        Ok::<(), ()>(())
    });
    listed.unwrap();
    let [(0, 1, conductor)] = all[..] else { panic!("{all:?}") };
    near(conductor, 1.0 / (1.0 / 0.8 + 1.0 / 0.4 - 1.0));
}

#[test]
fn entries_of_one_row_alone_count_half() {
    let above = exchange(&Plain(vec![vec![0.0, 0.4], vec![0.0, 0.0]]), &[1.0, 2.0], true);
    let below = exchange(&Plain(vec![vec![0.0, 0.0], vec![0.2, 0.0]]), &[1.0, 2.0], true);
    for found in [above, below] {
        assert_eq!(found.row(0).collect::<Vec<_>>(), [(1, 0.2)]);
    }
}

#[test]
fn errors_are_those_of_matrices_that_are_off() {
    // Three rows that all see the environment, a heated shield and sunlight.
    let factors = [[0.0, 0.3, 0.2], [0.3, 0.0, 0.25], [0.2, 0.25, 0.1]];
    let solve = |off: f64, draw: usize, error: f64| {
        let mut rows: Vec<Vec<f64>> = factors.iter().map(|r| r.to_vec()).collect();
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let sign = if deviation::signs(i, j) >> draw & 1 == 0 { off } else { -off };
            rows[i][j] *= 1.0 + sign;
            rows[j][i] = rows[i][j];
        }
        let conditions = [Temperature(400.0), Heat(30.0), Heat(0.0)];
        let exchange = exchange(&Plain(rows), &[1.0; 3], true);
        let mut case = Case::new(exchange, &[0.7, 0.3, 0.9], &conditions);
        case.environment = Some(250.0);
        case.sun = Some((vec![0.2, 0.6, 0.5], vec![0.0, 900.0, 100.0], 40.0));
        case.error = error;
        case.run().unwrap()
    };
    const OFF: f64 = 1e-5;
    let (plain, stated) = (solve(0.0, 0, 0.0), solve(0.0, 0, OFF));
    let mut squares = [[0.0; 2]; 3];
    for draw in 0..16 {
        let off = solve(OFF, draw, 0.0);
        for ((sum, off), plain) in squares.iter_mut().zip(&off.sides).zip(&plain.sides) {
            sum[0] += (off.temperature.unwrap() - plain.temperature.unwrap()).powi(2) / 16.0;
            sum[1] += (off.net() - plain.net()).powi(2) / 16.0;
        }
    }
    for (i, (side, square)) in stated.sides.iter().zip(squares).enumerate() {
        for (stated, square) in [side.temperature_error, side.flux_error].iter().zip(square) {
            let exact = 1.96 * square.sqrt();
            assert!((stated - exact).abs() <= 1e-2 * exact + 1e-9, "{i}: {stated} {exact}");
        }
    }
    assert!(stated.sides[0].flux_error > 1e-4 && stated.sides[2].temperature_error > 1e-5);
}

#[test]
fn errors_of_factors_carry_through_as_the_derivative_says() {
    // Q = (E1 - E2) / (R1 + 1/S + R2): dQ = Q² / (E1 - E2) dS / S².
    let rows = Plain(vec![vec![0.5, 0.5], vec![0.5, 0.5]]);
    let conditions = [Temperature(600.0), Temperature(300.0)];
    let mut case = Case::new(exchange(&rows, &[1.0, 1.0], false), &[0.7, 0.2], &conditions);
    case.error = 1e-3;
    let found = case.run().unwrap();
    let difference = emissive_power(600.0) - emissive_power(300.0);
    let off = found.supplied.powi(2) / difference / 0.25 * 0.5 * case.error;
    assert!((found.surfaces[0].net_error / (1.96 * off) - 1.0).abs() < 1e-3);
    assert_eq!(found.surfaces[0].temperature_error, 0.0, "it is given");
    // With the heat given, the temperature is what is not known: 4 σ T³ dT = Q dS / S².
    case.conditions = vec![Heat(found.supplied), Temperature(300.0)];
    let hot = case.run().unwrap();
    let slope = 4.0 * emissive_power(600.0) / 600.0;
    let off = found.supplied / 0.25 * 0.5 * case.error / slope;
    assert!((hot.surfaces[0].temperature_error / (1.96 * off) - 1.0).abs() < 1e-3);
    assert_eq!(hot.surfaces[0].net_error, 0.0, "it is given");
}

#[test]
fn what_has_no_answer_is_an_error() {
    let plates = || exchange(&plates(), &[1.0, 1.0], false);
    let run = |emissivity: [f64; 2], conditions: [Condition; 2]| {
        Case::new(plates(), &emissivity, &conditions).run()
    };
    let cold = Temperature(0.0);
    assert!(matches!(
        run([-0.1, 0.5], [cold, cold]),
        Err(HeatError::Share { row: 0, value, .. }) if value == -0.1
    ));
    assert!(matches!(run([0.5, f64::NAN], [cold, cold]), Err(HeatError::Share { row: 1, .. })));
    assert!(matches!(run([0.5; 2], [Temperature(-1.0), cold]), Err(HeatError::Temperature(_))));
    assert!(matches!(run([0.5; 2], [Heat(f64::INFINITY), cold]), Err(HeatError::Flux(_))));
    assert!(matches!(
        run([0.5; 2], [Heat(1.0), Heat(0.0)]),
        Err(HeatError::Unbounded { supplied, .. }) if supplied == 1.0
    ));
    // No temperature is low enough to give away so little.
    let cold = run([0.5; 2], [Heat(-1000.0), Temperature(300.0)]);
    assert!(matches!(cold, Err(HeatError::BelowZero { row: 0, supplied }) if supplied == -1000.0));
    assert!(matches!(
        run([0.5; 2], [Heat(1e200), Temperature(3.0)]),
        Err(HeatError::Stalled { .. })
    ));
    assert!(crate::progress::is_cancelled(&HeatError::from(crate::progress::Cancelled)));
    // What is taken is what is given, but for rounding.
    let three = Plain(vec![vec![0.0, 0.5, 0.5], vec![0.5, 0.0, 0.5], vec![0.5, 0.5, 0.0]]);
    let conditions = [Heat(0.1), Heat(0.2), Heat(-0.3)];
    Case::new(exchange(&three, &[1.0; 3], false), &[0.5; 3], &conditions).run().unwrap();
    // Without heat, or with as much taken as given, any temperature would do.
    for heat in [0.0, 3.0] {
        let found = run([0.5; 2], [Heat(heat), Heat(-heat)]).unwrap();
        assert!(found.sides.iter().all(|s| s.temperature.is_none()));
        assert!((found.sides[0].flux - heat).abs() < 1e-9);
    }
    let open = Plain(vec![vec![0.0, 0.5], vec![0.5, 0.0]]);
    let refused = Exchange::new(&open, &[1.0, 1.0], false, 1 << 20, &Silent);
    assert!(matches!(refused, Err(HeatError::Open { share }) if share == 0.5));
    let refused = Exchange::new(&open, &[1.0, 1.0], true, 4000, &Silent);
    assert!(matches!(refused, Err(HeatError::Memory { .. })));
}
