//! View factors with published or exact values, through the front door of the library.
//!
//! Every case is made as it is, split into patches, turned at random, and turned and rounded to
//! single precision, as files have it. The cases and their bounds are those of the page of the
//! documentation.

#![allow(clippy::unwrap_used, reason = "a test")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use common::contour::exchange;
use common::published::{Case, cases, formulas};
use common::random::Random;
use glam::{DMat3, DVec3, dvec3};

/// How a case is made: turned or not, in single precision or not, split or not.
#[derive(Debug, Clone, Copy)]
struct Variant {
    turned: bool,
    single: bool,
    split: bool,
}

const PLAIN: Variant = Variant { turned: false, single: false, split: false };

/// Makes the cases that `which` picks, and fails with all figures that are out of bounds.
fn hold(which: fn(&Case) -> bool, variant: Variant) {
    let mut random = Random::new(5);
    let mut wrong = Vec::new();
    for case in cases().iter().filter(|c| which(c)) {
        let turn = if variant.turned { random.rotation() } else { DMat3::IDENTITY };
        let patch_size = variant.split.then_some(case.patch_size);
        let found = case.run(turn, variant.single, patch_size).unwrap();
        for (figure, &factor) in case.figures.iter().zip(&found.factors) {
            let off = factor - figure.exact;
            let line = format!(
                "{} {}: {factor:.9}, exact {:.9}, off {off:.1e} ({:.4} %), stated {:.3} %, {} \
                 rows, {:.2} s",
                case.name,
                figure.name,
                figure.exact,
                100.0 * off / figure.exact,
                100.0 * found.stated,
                found.rows,
                found.seconds
            );
            println!("{line}");
            wrong.extend((off.abs() > case.bound(figure)).then_some(line));
        }
    }
    assert!(wrong.is_empty(), "{variant:?}: {wrong:#?}");
}

fn open(case: &Case) -> bool {
    !case.obstructed
}

fn obstructed(case: &Case) -> bool {
    case.obstructed
}

#[test]
fn open_cases_as_they_are() {
    hold(open, PLAIN);
}

#[test]
fn open_cases_split() {
    hold(open, Variant { split: true, ..PLAIN });
}

#[test]
fn open_cases_turned() {
    hold(open, Variant { turned: true, ..PLAIN });
}

#[test]
fn open_cases_turned_and_rounded() {
    hold(open, Variant { turned: true, single: true, ..PLAIN });
}

#[test]
fn obstructed_cases_as_they_are() {
    hold(obstructed, PLAIN);
}

#[test]
fn obstructed_cases_split() {
    hold(obstructed, Variant { split: true, ..PLAIN });
}

#[test]
fn obstructed_cases_turned() {
    hold(obstructed, Variant { turned: true, ..PLAIN });
}

#[test]
fn obstructed_cases_turned_and_rounded() {
    hold(obstructed, Variant { turned: true, single: true, ..PLAIN });
}

fn near(found: f64, known: f64, off: f64) {
    assert!((found - known).abs() < off, "{found} {known}");
}

/// The formulas themselves, by values that are known from elsewhere.
#[test]
fn formulas_give_the_values_that_are_known() {
    let unit = [0.0, 1.0, 0.0, 1.0];
    near(formulas::parallel(unit, unit, 1.0), 0.199_824_896, 1e-9);
    near(formulas::parallel(unit, unit, 0.01), 0.980_416_603, 1e-9);
    near(formulas::parallel(unit, unit, 1e-4), 0.999_800_071, 1e-9);
    near(formulas::parallel(unit, [1.0, 2.0, 0.0, 1.0], 1.0), 0.086_050_489, 1e-9);
    near(formulas::parallel(unit, [1.0, 2.0, 1.0, 2.0], 1.0), 0.043_327_410, 1e-9);
    near(formulas::parallel(unit, [-0.5, 1.5, -0.5, 1.5], 1.0), 0.517_653_080, 1e-9);
    near(formulas::perpendicular(1.0, 1.0, 1.0), 0.200_043_776, 1e-9);
    near(formulas::corner(1.0, 1.0, 1.0), 0.138_531_606, 1e-9);
    near(formulas::upright_corner(1.0, 1.0, 1.0), 0.055_734_197, 1e-9);
    near(formulas::behind([0.0, 0.5], [0.0, 0.5], 0.5), 0.75 * 0.199_824_895_7, 1e-9);
    near(formulas::behind([0.25, 0.75], [0.25, 0.75], 0.5), 0.099_506_295, 1e-9);
    near(formulas::behind([0.25, 0.75], [0.25, 0.75], 0.25), 0.115_620_602, 1e-9);
    near(formulas::behind([0.375, 0.625], [0.375, 0.625], 0.5), 0.169_474_205, 1e-9);
    near(formulas::behind([0.125, 0.875], [0.125, 0.875], 0.5), 0.029_483_545, 1e-9);
    near(formulas::l_shaped(), 0.182_355_9, 1e-7);
    // Equal discs: F = (x - √(x² - 4)) / 2, x = 2 + h² / r².
    near(formulas::discs(1.0, 1.0, 1.0), 0.5 * (3.0 - 5.0_f64.sqrt()), 1e-12);
}

/// Values that stand in the cases as numbers, by integrals along the outlines.
#[test]
fn numbers_are_those_of_integrals_along_the_outlines() {
    let square = [DVec3::ZERO, DVec3::X, dvec3(1.0, 1.0, 0.0), DVec3::Y];
    for (degrees, known) in [(30.0, 0.619_028_323), (60.0, 0.370_905_321), (120.0, 0.086_615_001)] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let out = dvec3(cos, 0.0, sin);
        let other = [DVec3::ZERO, DVec3::Y, DVec3::Y + out, out];
        near(exchange(&square, &other), known, 1e-9);
    }
    let hexagon = |z: f64| -> Vec<DVec3> {
        (0..6)
            .map(|k| DMat3::from_rotation_z(f64::from(k).to_radians() * 60.0) * dvec3(1.0, 0.0, z))
            .collect()
    };
    let above: Vec<DVec3> = hexagon(1.0).into_iter().rev().collect();
    near(exchange(&hexagon(0.0), &above) / (1.5 * 3.0_f64.sqrt()), 0.348_575_877, 1e-9);
    let face = [DVec3::X, DVec3::Z, DVec3::Y];
    let area = 0.5 * 3.0_f64.sqrt();
    let across = [
        ([DVec3::NEG_X, DVec3::Y, DVec3::Z], 0.136_854_3),
        ([DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y], 0.148_941_1),
        ([DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z], 0.142_613_7),
    ];
    let mut sum = 0.0;
    for ((other, known), count) in across.into_iter().zip([3.0, 3.0, 1.0]) {
        let found = exchange(&face, &other).max(exchange(&face, &[other[0], other[2], other[1]]));
        near(found / area, known, 1e-7);
        sum += count * found / area;
    }
    near(sum, 1.0, 1e-9);
}

/// Polyhedra come near the curved bodies that they stand for, the more corners they have.
#[test]
fn polyhedra_are_nearly_the_bodies_that_they_stand_for() {
    for case in cases() {
        for figure in &case.figures {
            let Some(curved) = figure.curved else { continue };
            let facets = figure.exact - curved;
            println!("{} {}: {:.6} {curved:.6} {facets:.1e}", case.name, figure.name, figure.exact);
            assert!(facets.abs() < 0.02, "{}: {} {curved}", case.name, figure.exact);
        }
    }
}
