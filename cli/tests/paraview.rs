//! `hemicube factors --surfaces FILE.vtu`: what rows stand for, drawn on the model.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use common::matrix::{named_room, npy, numbers};
use common::{Bench, CLOSED_ROOM, ROOM_MATERIALS};

/// The numbers of an array of `a.vtu`.
fn array(bench: &Bench, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(bench.path("a.vtu")).unwrap();
    let named = format!(" Name=\"{name}\"");
    let mut lines = text.lines().filter(|line| line.starts_with("<DataArray"));
    let Some(line) = lines.find(|line| line.contains(&named)) else {
        panic!("{name} is not there: {text}");
    };
    let data = line.split_once('>').unwrap().1.strip_suffix("</DataArray>").unwrap();
    let bytes = &STANDARD.decode(data).unwrap()[8..];
    match line.split('"').nth(1).unwrap() {
        "Int32" => bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b).into()).collect(),
        "Int64" => bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f64).collect(),
        _ => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
    }
}

/// The matrix of `room.obj`, with a drawing `a.vtu` and a table `s.csv` beside it.
fn draw(bench: &Bench, args: &[&str]) -> Vec<Vec<f64>> {
    let files =
        ["factors", "room.obj", "-o", "F.npy", "--surfaces", "s.csv", "--surfaces", "a.vtu"];
    let outcome = bench.run(&[&files[..], args].concat()).ok();
    assert_eq!(outcome.stdout, "F.npy\ns.csv\na.vtu\n");
    npy(&bench.path("F.npy"))
}

#[test]
fn cells_have_what_the_table_has_and_the_factors_from_a_row() {
    let bench = Bench::new().with("room.obj", named_room());
    let f = draw(&bench, &["--patch-size", "0.5", "--row", "5", "--row", "floor"]);
    let table = bench.path("s.csv");
    let n = f.len();
    assert_eq!(array(&bench, "row"), (0..n).map(|i| i as f64).collect::<Vec<_>>());
    for (name, column) in
        [("area", "area"), ("row_sum", "front"), ("back", "back"), ("environment", "environment")]
    {
        assert_eq!(array(&bench, name), numbers(&table, column), "{name}");
    }
    assert_eq!(array(&bench, "F from 5"), f[5]);
    // Patches are of one size: those of the floor together see what one sees on average.
    let floor: Vec<usize> = (0..n).filter(|&i| array(&bench, "surface")[i] == 0.0).collect();
    assert_eq!(floor.len(), n / 6);
    for (j, found) in array(&bench, "F from floor").iter().enumerate() {
        let mean = floor.iter().map(|&i| f[i][j]).sum::<f64>() / floor.len() as f64;
        assert!((found - mean).abs() < 1e-9, "{j}: {found} {mean}");
    }
    assert_eq!(array(&bench, "ceiling"), [5.0], "what the numbers of surfaces mean");
    // Each cell lies where the table says.
    let (points, corners) = (array(&bench, "Points"), array(&bench, "connectivity"));
    for (i, cell) in corners.chunks(3).enumerate() {
        let middle = cell.iter().map(|&p| points[3 * p as usize + 1]).sum::<f64>() / 3.0;
        assert!((middle - numbers(&table, "cy")[i]).abs() < 1e-12, "{i}");
    }
}

#[test]
fn lumped_rows_are_spread_over_their_cells_and_backs_have_arrays_of_their_own() {
    let bench = Bench::new().with("room.obj", named_room());
    let f = draw(&bench, &["--group", "--row", "ceiling", "--patch-size", "0.5"]);
    let groups = array(&bench, "row");
    assert_eq!(groups.len() % 6, 0);
    assert!(groups.len() > 12, "cut");
    let spread: Vec<f64> = groups.iter().map(|&g| f[5][g as usize]).collect();
    assert_eq!(array(&bench, "F from ceiling"), spread);
    assert!(array(&bench, "area").iter().all(|a| *a == 4.0));

    let f = draw(&bench, &["--sides", "two", "--row", "floor (back)", "--row", "floor"]);
    assert_eq!((f.len(), array(&bench, "row").len()), (24, 12));
    let backs: Vec<f64> = (12..24).map(f64::from).collect();
    assert_eq!(array(&bench, "row (back)"), backs);
    let floor = array(&bench, "F from floor");
    assert!((floor.iter().sum::<f64>() - 1.0).abs() < 1e-6);
    let outside = ["F from floor (back)", "F from floor (back) (back)"].map(|n| array(&bench, n));
    assert!(outside.iter().flatten().all(|f| *f == 0.0), "backs see nothing");
    assert!(array(&bench, "environment (back)").iter().all(|e| *e == 1.0));
}

#[test]
fn rows_that_are_not_there_are_refused_and_nothing_made() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let refused = |args: &[&str], parts: &[&str]| {
        bench.run(&[&["factors", "room.obj", "-o", "F.npz"], args].concat()).refused(parts);
        assert_eq!(bench.files(), ["room.mtl", "room.obj"]);
    };
    refused(&["--surfaces", "a.txt"], &["a.txt", ".csv or .vtu"]);
    refused(&["--surfaces", "a.csv", "--row", "0"], &["--row", "--surfaces FILE.vtu"]);
    refused(&["--surfaces", "a.vtu", "--surfaces", "a.vtu"], &["a.vtu", "different names"]);
    let drawn = |row: &'static str| ["--surfaces", "a.vtu", "--row", row];
    refused(&drawn("flor"), &["room.obj", "--row flor", "default"]);
    refused(&drawn("12"), &["room.obj", "--row 12", "12 rows"]);
    refused(&drawn("default (back)"), &["--row default (back)"]);
    refused(&[&drawn("1")[..], &["--group"]].concat(), &["--row 1", "1 rows"]);
}
