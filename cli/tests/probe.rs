//! `hemicube probe` as users run it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::f64::consts::PI;
use std::fs;

use common::{Bench, CLOSED_ROOM, OPEN_MODEL, Outcome, ROOM_MATERIALS};

/// What is fast enough to run often.
const SMALL: [&str; 6] = ["--patch-size", "1", "--samples", "64", "--rays", "256"];

const POINTS: &str = "name,nz,ny,nx,z,y,x\n\"desk, left\",0,1,0,1,0.75,1\nfloor,0,2,0,2,0,3\n";

fn probe(bench: &Bench, scene: &str, more: &[&str], input: &str) -> Outcome {
    bench.run_with(&[&["probe", scene][..], &SMALL, more].concat(), input)
}

/// The fields of a table without quotation marks.
fn rows(text: &str) -> Vec<Vec<&str>> {
    text.lines().map(|line| line.split(',').collect()).collect()
}

/// A column of a table.
fn column(text: &str, title: &str) -> Vec<f64> {
    let rows = rows(text);
    let at = rows[0].iter().position(|t| *t == title).unwrap();
    rows[1..].iter().map(|row| row[at].parse().unwrap()).collect()
}

#[test]
fn a_table_comes_back_with_what_was_measured() {
    let bench = Bench::new().with("in.csv", POINTS);
    let outcome =
        probe(&bench, "cornell-box", &["--points", "in.csv", "-o", "out.csv", "-q"], "").ok();
    assert_eq!((&*outcome.stdout, &*outcome.stderr), ("out.csv\n", ""));
    assert_eq!(bench.files(), ["in.csv", "out.csv"]);
    let text = fs::read_to_string(bench.path("out.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "name,nz,ny,nx,z,y,x,E_r,E_g,E_b,E,error,place");
    assert!(lines[1].starts_with("\"desk, left\",0,1,0,1,0.75,1,"), "{text}");
    assert!(lines[2].starts_with("floor,0,2,0,2,0,3,") && lines[2].ends_with(",free"), "{text}");
    assert_eq!(lines.len(), 3);

    // The output is an input: old results make way.
    let again = probe(&bench, "cornell-box", &["--points", "out.csv", "-j", "1"], "").ok();
    assert_eq!(again.stdout, text);
    let piped = probe(&bench, "cornell-box", &["--points", "-"], &text.replace('\n', "\r\n")).ok();
    assert_eq!(piped.stdout, text);
    assert!(piped.stderr.contains("2 points: mean"), "{piped:?}");
}

#[test]
fn a_furnace_shows_its_irradiance() {
    let input = "x,y,z,nx,ny,nz\n0.5,0.5,0.5,0,0,-1\n0.1,0,0.7,0,1,0\n";
    let args = ["probe", "furnace", "--patch-size", "1", "--rays", "16384", "--points", "-"];
    let outcome = Bench::new().run_with(&args, input).ok();
    for (title, rho) in [("E_r", 0.3), ("E_g", 0.5), ("E_b", 0.8)] {
        let exact = PI / (1.0 - rho);
        for e in column(&outcome.stdout, title) {
            assert!((e / exact - 1.0).abs() < 5e-3, "{title}: {e}, exactly {exact}");
        }
    }
    let channels = ["E_r", "E_g", "E_b", "E"].map(|title| column(&outcome.stdout, title)[0]);
    let sum = 0.2126 * channels[0] + 0.7152 * channels[1] + 0.0722 * channels[2];
    assert!((sum / channels[3] - 1.0).abs() < 1e-5, "{channels:?}");
}

#[test]
fn a_grid_is_a_work_plane() {
    let bench = Bench::new();
    let grid = ["--grid", "0.1,0.5,0.1", "0,0,0.8", "0.4,0,0", "4x2"];
    let sky = ["--sky", "1,1,1", "--points"];
    let outcome = probe(&bench, "cornell-box", &grid, "").ok();
    let rows = rows(&outcome.stdout);
    assert_eq!(rows[0][..8], ["i", "j", "x", "y", "z", "nx", "ny", "nz"]);
    assert_eq!(rows.len(), 9);
    assert_eq!(rows[1][..8], ["0", "0", "0.2", "0.5", "0.2", "0", "1", "0"]);
    assert_eq!(rows[8][..8], ["3", "1", "0.4", "0.5", "0.8", "0", "1", "0"]);
    assert!(outcome.stderr.contains("uniformity"), "{outcome:?}");
    // One cannot have both, nor neither.
    probe(&bench, "cornell-box", &[&grid[..], &sky[2..], &["-"]].concat(), POINTS)
        .refused(&["--grid"]);
    probe(&bench, "cornell-box", &[], "").refused(&["--points"]);
}

#[test]
fn wrong_tables_are_refused() {
    let cases: &[(&str, &[&str])] = &[
        ("", &["empty", "x,y,z,nx,ny,nz"]),
        ("x,y,z,nx,ny\n1,2,3,0,1\n", &["line 1", "'nz'", "x,y,z,nx,ny"]),
        ("x,y,z,nx,ny,nz,x\n1,2,3,0,1,0,2\n", &["line 1", "two columns 'x'"]),
        ("x,y,z,nx,ny,nz\n", &["no points"]),
        ("x,y,z,nx,ny,nz\n1,2,3,0,1,0\n\n1,2,three,0,1,0\n", &["line 4", "column z", "'three'"]),
        ("x,y,z,nx,ny,nz\n1,2,inf,0,1,0\n", &["line 2", "column z"]),
        ("x,y,z,nx,ny,nz\n1,2,3,0,0,0\n", &["line 2", "nx,ny,nz", "0,1,0"]),
        ("x,y,z,nx,ny,nz\n1,2,3,0,1\n", &["line 2", "5 fields", "6 columns"]),
    ];
    for (text, parts) in cases {
        let bench = Bench::new().with("in.csv", text);
        probe(&bench, "cornell-box", &["--points", "in.csv", "-o", "out.csv"], "")
            .refused(&[&["in.csv"], *parts].concat());
        assert_eq!(bench.files(), ["in.csv"]);
        probe(&bench, "cornell-box", &["--points", "-"], text)
            .refused(&[&["stdin"], *parts].concat());
    }
    let bench = Bench::new().with("noise.csv", common::noise(5000));
    probe(&bench, "room", &["--points", "noise.csv"], "").refused(&["noise.csv", "UTF-8"]);
    probe(&bench, "room", &["--points", "none.csv"], "").refused(&["none.csv"]);
}

#[test]
fn wrong_grids_and_options_are_refused() {
    let bench = Bench::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--grid", "0,0,0", "0,0,1", "1,0,0"], &["--grid"]),
        (&["--grid", "0,0", "0,0,1", "1,0,0", "2x2"], &["--grid", "0,0"]),
        (&["--grid", "0,0,0", "0,0,1", "0,0,2", "2x2"], &["--grid", "parallel"]),
        (&["--grid", "0,0,0", "0,0,1", "1,0,0", "2"], &["--grid", "6x10"]),
        (&["--grid", "0,0,0", "0,0,1", "1,0,0", "0x4"], &["--grid", "0x4"]),
        (&["--grid", "0,0,0", "0,0,1", "1,0,0", "99999x99999"], &["--grid", "cells"]),
        (&["--points", "-", "-o", "missing/out.csv"], &["missing"]),
        (&["--points", "-", "--rays", "3"], &["--rays", "256"]),
        (&["--points", "-", "--engine", "hemicube"], &["--samples"]),
    ];
    for (args, parts) in cases {
        let args = [&["probe", "cornell-box", "--samples", "64"][..], args].concat();
        bench.run_with(&args, POINTS).refused(parts);
        assert!(bench.files().is_empty());
    }
}

#[test]
fn a_scene_without_light_is_refused() {
    let bench = Bench::new()
        .with("open.obj", OPEN_MODEL)
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", ROOM_MATERIALS);
    // No sky is seen from within a closed room.
    for (model, light) in [("open.obj", "--sky 1,1,1"), ("room.obj", "--lamp lamp=")] {
        probe(&bench, model, &["--points", "-"], POINTS).refused(&["emits light", light]);
    }
}

#[test]
fn an_open_sky_gives_pi_times_its_radiance() {
    let bench = Bench::new().with("open.obj", OPEN_MODEL);
    let input = "x,y,z,nx,ny,nz\n0,2,0,0,1,0\n";
    let args = ["probe", "open.obj", "--sky", "1,1,1", "--points", "-"];
    let outcome = bench.run_with(&args, input).ok();
    let found = column(&outcome.stdout, "E")[0];
    assert!((found / PI - 1.0).abs() < 1e-5, "{found}");
}

/// A grid that reaches beyond the walls on both sides: neither those points nor the darkness or sky
/// that they see count.
#[test]
fn points_outside_the_model_do_not_count() {
    let grid = ["--grid", "-1,0.5,0.25", "0,0,0.5", "3,0,0", "1x6"];
    for more in [&["--sides", "one"][..], &["--sides", "two"]] {
        let args = [&grid[..], more].concat();
        let outcome = probe(&Bench::new(), "furnace", &args, "").ok();
        let places: Vec<&str> =
            rows(&outcome.stdout)[1..].iter().map(|row| row[row.len() - 1]).collect();
        let [outside, free] = ["outside", "free"];
        assert_eq!(places, [outside, outside, free, free, outside, outside], "{outcome:?}");
        assert!(outcome.stderr.contains("2 points: mean"), "{outcome:?}");
        assert!(outcome.stderr.contains("; 4 outside the model left out"), "{outcome:?}");
    }
}

/// A point that faces the dark floor gets reflected light alone: what engine and solver make of it.
#[test]
fn every_engine_and_solver_lights_a_point_alike() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let input = "x,y,z,nx,ny,nz\n1,1,1,0,-1,0\n";
    let lit = ["--sides", "one", "--emission", "ceiling=1,1,1", "--patch-size", "0.05"];
    let found = |more: &[&str]| {
        let args = ["probe", "room.obj", "--points", "-", "--rays", "65536"];
        let outcome = bench.run_with(&[&args[..], &lit, more].concat(), input).ok();
        column(&outcome.stdout, "E")[0]
    };
    let exact = found(&["--engine", "exact"]);
    assert!(exact > 0.3, "{exact}");
    for (more, tolerance) in [
        (&["--engine", "rays"][..], 5e-3),
        (&["--engine", "hemicube"], 0.01),
        (&["--engine", "hemicube", "--draw", "patches"], 0.01),
        (&["--engine", "classical"], 0.01),
        (&["--engine", "exact", "--solver", "jacobi"], 1e-5),
        (&["--engine", "exact", "--solver", "shooting"], 1e-5),
        (&["--engine", "exact", "--solver", "direct"], 1e-5),
    ] {
        let e = found(more);
        assert!((e / exact - 1.0).abs() < tolerance, "{more:?}: {e}, exact factors {exact}");
    }
}
