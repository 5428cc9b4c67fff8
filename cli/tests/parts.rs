//! `hemicube factors --plan`, `--part` and `hemicube merge`: a matrix made by several processes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Stdio};

use common::matrix::{named_room, room_with_crate};
use common::{Bench, Outcome};

/// What the parts are of: seven tiles or so.
const PATCH_SIZE: &str = "0.04";

fn planned() -> Bench {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let plan =
        bench.run(&["factors", "room.obj", "--patch-size", PATCH_SIZE, "--plan", "plan.json"]).ok();
    assert_eq!(plan.stdout, "plan.json\n");
    bench
}

fn part(bench: &Bench, part: &str, folder: &str) -> Outcome {
    bench.run(&["factors", "room.obj", "--plan", "plan.json", "--part", part, "-o", folder])
}

fn merge(bench: &Bench, folder: &str, more: &[&str]) -> Outcome {
    bench.run(&[&["merge", "room.obj", folder, "--plan", "plan.json"], more].concat())
}

fn whole(bench: &Bench, more: &[&str]) -> Outcome {
    bench.run(&[&["factors", "room.obj", "--patch-size", PATCH_SIZE], more].concat())
}

fn file(folder: &str, part: usize, of: usize) -> String {
    format!("{folder}/part-{part}-of-{of}.npz")
}

/// A file of all parts of a room, and where it lies.
fn made_in(bench: &Bench, of: usize, folder: &str) -> Vec<PathBuf> {
    (1..=of)
        .map(|k| {
            let made = part(bench, &format!("{k}/{of}"), folder).ok();
            assert_eq!(made.stdout, file(folder, k, of) + "\n");
            bench.path(&file(folder, k, of))
        })
        .collect()
}

#[test]
fn four_processes_of_which_one_is_killed_and_repeated_make_the_same_matrix() {
    let bench = planned();
    let spawn = |k: usize| -> Child {
        let k = format!("{k}/4");
        let args = ["factors", "room.obj", "--plan", "plan.json", "--part", &k, "-o", "parts"];
        let mut command = bench.command(&args);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut running: Vec<Child> = (1..=4).map(spawn).collect();
    running[2].kill().unwrap();
    for (k, child) in running.iter_mut().enumerate() {
        assert_eq!(child.wait().unwrap().success(), k != 2);
    }
    let incomplete = merge(&bench, "parts", &["-o", "G.npz"]);
    assert_eq!(incomplete.code, Some(1), "{incomplete:?}");
    for text in ["1 of 4 parts", "3 (missing)", "make part 3 of 4 again", "--part"] {
        assert!(incomplete.stderr.contains(text), "'{text}' is not in {incomplete:?}");
    }
    assert!(!bench.path("G.npz").exists());
    part(&bench, "3/4", "parts").ok();
    assert_eq!(merge(&bench, "parts", &["-o", "G.npz"]).ok().stdout, "G.npz\n");
    whole(&bench, &["-o", "F.npz"]).ok();
    let read = |name: &str| fs::read(bench.path(name)).unwrap();
    assert!(read("F.npz") == read("G.npz"), "one process and four");
}

#[test]
fn bytes_do_not_depend_on_how_many_parts_there_are() {
    let bench = planned();
    let report = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(bench.path(name)).unwrap()).unwrap()
    };
    whole(&bench, &["-o", "F.npz", "--report", "once.json"]).ok();
    let once = report("once.json");
    for (outcome, name) in [
        (&["--group", "--enclosure", "-o"][..], "closed.csv"),
        (&["--threshold", "1e-3", "-o"][..], "thin.mtx"),
        // Too little for all of it: rows go through a file, but no pair is evaluated for it twice.
        (&["--memory", "7M", "-o"][..], "small.npy"),
    ] {
        let as_whole = format!("whole-{name}");
        whole(&bench, &[outcome, &[&as_whole, "--report", "whole.json"]].concat()).ok();
        let expected = fs::read(bench.path(&as_whole)).unwrap();
        for of in [1, 3, 40] {
            let folder = format!("in-{of}");
            made_in(&bench, of, &folder);
            let arguments = [outcome, &[name, "--report", "merged.json"]].concat();
            merge(&bench, &folder, &arguments).ok();
            assert!(fs::read(bench.path(name)).unwrap() == expected, "{name} in {of} parts");
            let [whole, merged] = ["whole.json", "merged.json"].map(report);
            for key in ["evaluated", "partly_hidden", "shadow_rays"] {
                assert!(once["pairs"][key].as_u64().unwrap() > 0, "{key}");
                assert_eq!(once["pairs"][key], merged["pairs"][key], "{key}: each pair once");
            }
            assert_eq!(merged["through_a_file"], outcome[0] == "--memory");
            assert_eq!(whole["through_a_file"], merged["through_a_file"]);
        }
    }
}

#[test]
fn damaged_parts_are_named_and_finished_ones_are_left_as_they_are() {
    let bench = planned();
    let parts = made_in(&bench, 5, "parts");
    let sound: Vec<Vec<u8>> = parts.iter().map(|path| fs::read(path).unwrap()).collect();
    let mut flipped = sound[1].clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    fs::write(&parts[1], flipped).unwrap();
    fs::write(&parts[2], &sound[2][..sound[2].len() / 2]).unwrap();
    fs::write(&parts[3], &sound[0]).unwrap();
    fs::write(&parts[4], "nonsense").unwrap();
    let damaged = merge(&bench, "parts", &["-o", "G.npz"]);
    assert_eq!(damaged.code, Some(1), "{damaged:?}");
    for text in ["4 of 5 parts", "2 (", "3 (", "4 (is part 1 of 5)", "5 (", "make part 2-5 of 5"] {
        assert!(damaged.stderr.contains(text), "'{text}' is not in {damaged:?}");
    }
    for k in 1..=5 {
        let again = part(&bench, &format!("{k}/5"), "parts").ok();
        assert_eq!(again.stderr.contains("is there already"), k == 1, "{again:?}");
    }
    let repeated: Vec<Vec<u8>> = parts.iter().map(|path| fs::read(path).unwrap()).collect();
    assert!(repeated == sound, "parts that were made again");
    merge(&bench, "parts", &["-o", "G.npz"]).ok();
}

#[test]
fn parts_of_another_plan_or_division_and_other_models_are_refused() {
    let bench = planned().with("plain.obj", named_room());
    made_in(&bench, 2, "parts");
    let of_model =
        |model: &str| bench.run(&["merge", model, "parts", "--plan", "plan.json", "-o", "G.npz"]);
    of_model("plain.obj").refused(&["plain.obj", "is not the model", "(room)", "--plan"]);
    let both = ["merge", "room.obj", "parts", "--plan", "plan.json", "--sides", "two"];
    bench.run(&both).refused(&["room.obj", "is not the model", "the same with --sides one"]);
    let by_plain = ["factors", "plain.obj", "--plan", "plan.json", "--part", "1/2", "-o", "other"];
    bench.run(&by_plain).refused(&["plain.obj", "is not the model"]);

    let finer = ["factors", "room.obj", "--patch-size", "0.05", "--plan", "finer.json"];
    bench.run(&finer).ok();
    let merged = bench.run(&["merge", "room.obj", "parts", "--plan", "finer.json", "-o", "G.npz"]);
    assert_eq!(merged.code, Some(1), "{merged:?}");
    assert!(merged.stderr.contains("1 (of another plan)"), "{merged:?}");

    let over = merge(&bench, "parts", &["-o", "parts/part-1-of-2.npz"]);
    over.refused(&["part-1-of-2.npz", "is read by this run"]);
    merge(&bench, "parts", &["--report", "plan.json"]).refused(&["is read by this run"]);

    part(&bench, "1/3", "parts").ok();
    merge(&bench, "parts", &[]).refused(&["parts of 2 and of 3"]);
    fs::create_dir(bench.path("empty")).unwrap();
    merge(&bench, "empty", &[]).refused(&["empty", "no parts"]);
    merge(&bench, "none", &[]).refused(&["none", "cannot be read"]);

    let plan = fs::read_to_string(bench.path("plan.json")).unwrap();
    let edit = |from: &str, to: &str| {
        assert!(plan.contains(from));
        fs::write(bench.path("plan.json"), plan.replace(from, to)).unwrap();
        part(&bench, "1/2", "parts").refused(&["plan.json", "--plan"]);
    };
    edit("\"program\": \"", "\"program\": \"9");
    edit("\"error\": 0.001", "\"error\": 0.01");
    edit("hemicube plan", "something");
    edit("\"version\": 1", "\"version\": 2");
    edit("\"tiles\": ", "\"tiles\": 9");
    edit("{", "");
    fs::remove_file(bench.path("plan.json")).unwrap();
    part(&bench, "1/2", "parts").refused(&["plan.json", "cannot be read"]);
}

#[test]
fn what_does_not_belong_to_a_part_is_refused() {
    let bench = planned();
    let args = |more: &[&str]| {
        bench.run(&[&["factors", "room.obj", "--plan", "plan.json"], more].concat())
    };
    args(&["-o", "F.npz"]).refused(&["--part K/N"]);
    args(&["--engine", "rays"]).refused(&["--engine exact"]);
    args(&["--group"]).refused(&["--group"]);
    args(&["--part", "1/2"]).refused(&["--output"]);
    for wrong in ["0/2", "3/2", "1", "1/0", "a/b"] {
        args(&["--part", wrong, "-o", "parts"]).refused(&[wrong, "3/16"]);
    }
    args(&["--part", "1/2", "-o", "parts", "--error", "1"]).refused(&["--error"]);
    args(&["--part", "1/2", "-o", "parts", "--memory", "1K"])
        .refused(&["--memory", "make more parts"]);
    args(&["--part", "1/2", "-o", "parts", "--report", "plan.json"])
        .refused(&["plan.json", "is read by this run"]);
    args(&["--part", "1/9999999", "-o", "parts"]).refused(&["at most"]);
    assert_eq!(bench.files(), ["parts", "plan.json", "room.obj"]);
}
