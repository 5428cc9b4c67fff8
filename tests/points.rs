//! Irradiance as `hemicube probe` finds it, at points where it is hard to find, against random
//! paths.
//!
//! What paths find is kept in `tests/known`, as it takes them minutes; after a change of a scene
//! `HEMICUBE_BLESS=1 cargo test --release --test points` finds it anew.
//! `examples/measure/points_and_pictures.rs` says more of each kind of point.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

mod common;

use std::path::Path;

use common::furnished::furnished;
use common::hard::Kind;
use common::judge::{Figures, measured};
use common::known::{Known, mean, points_kept};
use hemicube::gather::{Estimate, GatherOptions};
use hemicube::scene::{Scene, builtin};

/// Points of each kind, and of all, at least.
const POINTS: (usize, usize) = (60, 300);

/// To which share of themselves, or of their mean where that is more, points are known.
const KNOWN: f64 = 0.0025;

/// Largest RMS and worst error, as shares of the mean, and the least share of points whose true
/// irradiance lies within the stated error.
const RMS: f64 = 0.01;
const WORST: f64 = 0.05;
const WITHIN: f64 = 0.93;

fn judge(scene: &Scene) {
    let name = &scene.name;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/known/{name}-points.txt"));
    let bless = std::env::var_os("HEMICUBE_BLESS").is_some();
    let known = points_kept(scene, POINTS, KNOWN, &file, bless);
    assert!(known.len() >= 300, "{} points", known.len());
    let (found, _) = measured(scene, &known, None, GatherOptions::default()).unwrap();
    let mean = mean(&known);
    let pairs: Vec<(&Known, &Estimate)> = known.iter().zip(&found).collect();
    for kind in Kind::ALL {
        let of: Vec<_> = pairs.iter().copied().filter(|(k, _)| k.placed.kind == kind).collect();
        println!("{name}, {kind}: {:?}", Figures::of(&of, mean));
    }
    let all = Figures::of(&pairs, mean);
    println!("{name}: {all:?}");
    assert!(50 * all.free >= 49 * all.count, "{name}: {all:?}");
    assert!(all.rms <= RMS && all.worst <= WORST && all.within >= WITHIN, "{name}: {all:?}");
}

#[test]
fn points_of_the_room_are_right() {
    judge(&builtin::build("room").unwrap());
}

#[test]
fn points_of_the_cornell_box_are_right() {
    judge(&builtin::build("cornell-box").unwrap());
}

#[test]
fn points_of_a_furnished_room_are_right() {
    judge(&furnished(4));
}
