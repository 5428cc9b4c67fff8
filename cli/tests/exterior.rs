//! `hemicube factors` of bodies seen from outside, without any flag.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::Bench;
use common::matrix::{column, factors, named_room, numbers, turned};

/// A 2 m cube of named sides, seen from outside, `x` metres along the x axis; its vertices are
/// those from `first` on.
fn cube(prefix: &str, x: f64, first: usize) -> String {
    let mut text = String::new();
    for line in turned(&named_room()).lines() {
        let words: Vec<&str> = line.split(' ').collect();
        text += &match words[..] {
            ["v", a, b, c] => format!("v {} {b} {c}\n", a.parse::<f64>().unwrap() + x),
            ["f", ..] => {
                let moved = words[1..].iter().map(|w| w.parse::<usize>().unwrap() + first);
                format!("f {}\n", moved.map(|v| v.to_string()).collect::<Vec<_>>().join(" "))
            }
            _ => line.replacen("g ", &format!("g {prefix}"), 1) + "\n",
        };
    }
    text
}

/// Entries, environment and backs of each row add up to 1.
fn assert_accounted(bench: &Bench, f: &[Vec<f64>]) {
    let table = bench.path("s.csv");
    let [back, environment] = ["back", "environment"].map(|title| numbers(&table, title));
    for (i, row) in f.iter().enumerate() {
        let sum = row.iter().sum::<f64>() + back[i] + environment[i];
        assert!((sum - 1.0).abs() < 1e-9, "row {i}: {sum}");
    }
}

#[test]
fn a_cube_sees_nothing_of_itself() {
    let bench = Bench::new().with("cube.obj", cube("", 0.0, 0));
    for engine in ["exact", "rays", "hemicube"] {
        let f = factors(&bench, "cube.obj", &["--engine", engine]);
        assert!(f.iter().flatten().all(|f| *f == 0.0), "{engine}");
        assert_eq!(numbers(&bench.path("s.csv"), "environment"), [1.0; 12], "{engine}");
        assert_accounted(&bench, &f);
    }
    let open = bench.run(&["factors", "cube.obj", "--enclosure"]);
    open.refused(&["cube.obj", "--flip", "--enclosure"]);
}

#[test]
fn two_cubes_that_face_each_other_exchange_as_squares_do() {
    // Their nearest sides are 2 m squares, 2 m apart.
    let text = cube("a-", 0.0, 0) + &cube("b-", 4.0, 8);
    let bench = Bench::new().with("two.obj", text);
    let f = factors(&bench, "two.obj", &["--group", "--patch-size", "0.5"]);
    let names = column(&bench.path("s.csv"), "name");
    let at = |name: &str| names.iter().position(|n| n == name).unwrap();
    let (a, b) = (at("a-east"), at("b-west"));
    for f in [f[a][b], f[b][a]] {
        assert!((f - 0.199_824_9).abs() < 1e-5, "{f}");
    }
    let others: f64 = f.iter().flatten().sum::<f64>() - f[a][b] - f[b][a];
    // The other sides of one are in the planes of the other's, or turned away.
    assert!(others.abs() < 1e-6, "{others}");
    assert_accounted(&bench, &f);
    let said = bench.run(&["factors", "two.obj", "-o", "F.npz"]).ok().stderr;
    assert!(said.contains("bodies seen from outside"), "{said}");
    let quiet = bench.run(&["factors", "two.obj", "-o", "F.npz", "-q"]).ok().stderr;
    assert_eq!(quiet, "");
    // An open model is no enclosure, whichever way its faces look.
    let open = ["factors", "two.obj", "--enclosure"];
    bench.run(&open).refused(&["two.obj", "--enclosure"]);
}

#[test]
fn rows_that_lose_much_say_where_it_goes() {
    // A lid close over the floor, which shows the floor its back.
    let lid = "v .1 .1 .1\nv 1.9 .1 .1\nv 1.9 .1 1.9\nv .1 .1 1.9\ng lid\nf 12 11 10 9\n";
    let bench = Bench::new().with("room.obj", named_room() + lid);
    let run = ["factors", "room.obj", "--report", "r.json", "-o", "F.npz"];
    let said = bench.run(&run).ok().stderr;
    for part in [
        "2 are covered by another face",
        "(floor)",
        "% to backs (most of lid)",
        "another face covers its view",
        "--sides two",
    ] {
        assert!(said.contains(part), "'{part}' is not in {said}");
    }
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("r.json")).unwrap()).unwrap();
    let worst = &report["losses"]["worst"][0];
    let share = |title: &str| worst[title].as_f64().unwrap();
    assert_eq!((&worst["surface"], &worst["backs_of"]), (&"floor".into(), &"lid".into()));
    assert!(share("back") > 0.5);
    let sum = ["faces", "environment", "back", "lost"].map(share).iter().sum::<f64>();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    let two = bench.run(&[&run[..], &["--sides", "two"]].concat()).ok().stderr;
    assert!(!two.contains("to backs,") && !two.contains("covered"), "{two}");
}

#[test]
fn a_wall_turned_round_sees_hardly_any_face() {
    let text = named_room().replace("f 2 3 7 6", "f 6 7 3 2");
    let bench = Bench::new().with("room.obj", text);
    let said = bench.run(&["factors", "room.obj", "-o", "F.npz"]).ok().stderr;
    for part in ["2 see hardly any face", "(east)", "it looks out of the model", "(most of east)"] {
        assert!(said.contains(part), "'{part}' is not in {said}");
    }
    // The classical engine does not know where rows go.
    let classical = ["factors", "room.obj", "--engine", "classical", "-o", "F.npz"];
    assert!(!bench.run(&classical).ok().stderr.contains("hardly"));
}
