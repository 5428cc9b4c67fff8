//! `hemicube factors --group`: rows lumped by surface, material and object.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::matrix::{column, factors, named_room, numbers};
use common::{Bench, CLOSED_ROOM, ROOM_MATERIALS, glb};

/// The named room in two materials, and the objects `shell` and `lid`.
fn room() -> String {
    let text = named_room();
    let text = text.replacen("g floor", "mtllib room.mtl\no shell\nusemtl plaster\ng floor", 1);
    text.replacen("g ceiling", "o lid\ng top\nusemtl ceiling", 1)
}

#[test]
fn rows_are_lumped_by_what_is_asked_for() {
    let bench = Bench::new().with("room.obj", room()).with("room.mtl", ROOM_MATERIALS);
    let mut all = Vec::new();
    let walls = ["shell/floor", "shell/north", "shell/east", "shell/south", "shell/west"];
    for (group, names) in [
        (&["--group"][..], &[&walls[..], &["lid/top"]].concat()[..]),
        (&["--group=surface"], &[]),
        (&["--group", "surface"], &[]),
        (&["--group", "material"], &["plaster", "ceiling"]),
        (&["--group", "object"], &["shell", "lid"]),
    ] {
        let f = factors(&bench, "room.obj", group);
        let table = bench.path("s.csv");
        if !names.is_empty() {
            assert_eq!(column(&table, "name"), names);
        }
        let areas = numbers(&table, "area");
        assert_eq!(areas.iter().sum::<f64>(), 24.0);
        for (i, row) in f.iter().enumerate() {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-5, "{group:?}: {row:?}");
            for (j, there) in row.iter().enumerate() {
                let (there, back) = (areas[i] * there, areas[j] * f[j][i]);
                assert!((there - back).abs() < 1e-5, "{group:?} {i} {j}: {there} {back}");
            }
        }
        all.push(f);
    }
    assert!(all[0] == all[1] && all[0] == all[2]);
    // Of two groups one is the ceiling: all of it sees the other.
    for f in &all[3..] {
        assert!(f[1][1].abs() < 1e-9 && (f[1][0] - 1.0).abs() < 1e-5, "{f:?}");
    }
}

#[test]
fn the_value_need_not_follow_and_other_words_are_no_value() {
    let bench = Bench::new().with("room.obj", room()).with("room.mtl", ROOM_MATERIALS);
    let header = |args: &[&str]| {
        let outcome = bench.run(&[&["factors", "-q"][..], args].concat()).ok();
        outcome.stdout.lines().next().unwrap().to_owned()
    };
    assert!(header(&["--group", "room.obj"]).starts_with("from,shell/floor,"));
    assert!(header(&["room.obj", "--group", "--enclosure"]).starts_with("from,shell/floor,"));
    assert_eq!(header(&["--group", "material", "room.obj"]), "from,plaster,ceiling");
    let wrong = bench.run(&["factors", "room.obj", "--group=colour"]);
    wrong.refused(&["--group", "surface, material, object"]);
    let report = ["factors", "room.obj", "--group", "object", "--report", "r.json", "-o", "F.npz"];
    assert!(bench.run(&report).ok().stderr.contains("lumped to 2 objects"));
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert_eq!((&report["grouped_by"], &report["groups"]), (&"object".into(), &2.into()));
}

#[test]
fn one_group_alone_is_said_with_what_would_part_it() {
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", ROOM_MATERIALS)
        .with("one.glb", glb());
    let said = |args: &[&str]| bench.run(&[&["factors"][..], args].concat()).ok().stderr;
    for group in ["surface", "object"] {
        let said = said(&["room.obj", "--group", group]);
        let line = said.lines().find(|line| line.starts_with("warning: --group")).unwrap();
        for part in [&format!("one {group} only (default)"), "--group material makes 2 groups"] {
            assert!(line.contains(part), "{line}");
        }
    }
    assert!(!said(&["room.obj", "--group", "material"]).contains("warning"));
    let alone = said(&["one.glb", "--group"]);
    assert!(alone.contains("one surface only (node 0)"), "{alone}");
    assert!(alone.contains("without --group every face has a row"), "{alone}");
    assert!(!said(&["room.obj", "--group", "-q"]).contains("warning"));
}
