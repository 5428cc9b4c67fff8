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
    let mut heat = [0.0; 3];
    let difference = |i: usize, j: f64| emissive_power(temperatures[i]) - emissive_power(j);
    for (i, j, conductor) in factors.conductors() {
        let flows = conductor * difference(i, temperatures[j]);
        (heat[i], heat[j]) = (heat[i] + flows, heat[j] - flows);
    }
    for (i, conductor) in factors.to_environment() {
        heat[i] += conductor * difference(i, 100.0);
    }
    for i in 0..3 {
        near(heat[i], areas[i] * found.sides[i].flux);
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        factors.row(i, &mut columns, &mut values).unwrap();
        near(values.iter().sum::<f64>() + factors.rest(i)[0], 1.0);
    }
    let little = gebhart(&case.exchange, &emissivity, Vec::new(), 100, &Silent);
    assert!(matches!(little, Err(HeatError::Memory { needed: 144, .. })));
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
