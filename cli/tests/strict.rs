//! `hemicube factors --strict`: the error that a matrix states against the one asked for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::Bench;

#[test]
fn an_error_beyond_the_one_asked_for_is_said_and_fails_where_it_must_not_be() {
    let bench = Bench::new();
    for error in ["100%", ".1", ".01", ".0001"] {
        let plain =
            ["factors", "cornell-box", "-o", "F.npz", "--error", error, "--report", "r.json"];
        let outcome = bench.run(&plain).ok();
        let whole = fs::read(bench.path("F.npz")).unwrap();
        let report: serde_json::Value =
            serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
        let stated = report["pairs"]["error"].as_f64().unwrap();
        let exceeds = stated > report["engine"]["error"].as_f64().unwrap();
        assert!(!exceeds || error != "100%", "{stated}");
        let lines: Vec<&str> =
            outcome.stderr.lines().filter(|line| line.contains("the stated error")).collect();
        assert_eq!(lines.len(), usize::from(exceeds), "{error}: {stated}: {outcome:?}");
        for line in lines {
            for part in ["warning: ", " times the ", "--patch-size", "--error", "--engine rays"] {
                assert!(line.contains(part), "{line}");
            }
        }

        fs::remove_file(bench.path("F.npz")).unwrap();
        let strict = bench.run(&[&plain[..], &["--strict", "-q"]].concat());
        assert_eq!(strict.code, Some(i32::from(exceeds)), "{strict:?}");
        assert_eq!(strict.stdout, "F.npz\n");
        assert!(fs::read(bench.path("F.npz")).unwrap() == whole);
        let said = "F.npz is written all the same";
        assert_eq!(strict.stderr.contains(said), exceeds, "{strict:?}");
        assert_eq!(strict.stderr.contains("error: cornell-box: the stated"), exceeds, "{strict:?}");
    }
}

#[test]
fn a_furnace_keeps_the_error_asked_for() {
    let bench = Bench::new();
    let said = bench.run(&["factors", "furnace", "--strict", "-o", "F.npz"]).ok().stderr;
    assert!(!said.contains("warning"), "{said}");
}
