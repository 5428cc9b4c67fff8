//! `hemicube render`, `info` and `scenes` as users run them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::{Bench, CLOSED_ROOM, OPEN_MODEL, ROOM_MATERIALS, glb, glb_with_lamp};

#[test]
fn writes_a_picture_and_prints_its_path_alone() {
    let bench = Bench::new();
    let outcome = bench.render("cornell-box", &[]).ok();
    assert_eq!(outcome.stdout, "cornell-box.png\n");
    assert_eq!(bench.picture("cornell-box.png").size(), (64, 48));
    assert_eq!(bench.files(), ["cornell-box.png"]);
    assert!(outcome.stderr.contains("patches of at most"), "it says what it chose: {outcome:?}");
}

#[test]
fn shows_no_progress_in_a_pipe() {
    let outcome = Bench::new().render("cornell-box", &[]).ok();
    assert!(!outcome.stderr.contains(['\r', '\x1b']), "{outcome:?}");
    let mut said = outcome.stderr.lines().filter(|line| !line.starts_with("warning:"));
    assert!(said.all(|line| !line.contains('%')), "{outcome:?}");
}

#[test]
fn a_quiet_run_says_nothing_and_reports_everything() {
    let bench = Bench::new();
    let outcome = bench.render("cornell-box", &["-q", "--report", "run.json"]).ok();
    assert_eq!(outcome.stderr, "");
    assert_eq!(bench.files(), ["cornell-box.png", "run.json"]);
    let text = fs::read_to_string(bench.path("run.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |path: &str| {
        let value = report.pointer(path).and_then(serde_json::Value::as_f64);
        value.filter(|v| v.is_finite()).unwrap_or_else(|| panic!("no number {path} in {text}"))
    };
    assert_eq!(number("/source_triangles"), 38.0);
    assert!(number("/patches") > 38.0);
    assert_eq!(number("/patch_size"), 1.0);
    assert!(number("/solve/iterations") >= 1.0);
    assert!(number("/solve/residual") <= 1e-6);
    let shares = ["entries_share", "environment", "back", "lost"];
    let account: f64 = shares.iter().map(|s| number(&format!("/rows/{s}"))).sum();
    assert!((account - 1.0).abs() < 1e-9, "rows account for everything: {account}");
    for term in ["emitted", "absorbed", "escaped"] {
        assert!(number(&format!("/energy/{term}/0")) > 0.0, "{term}");
    }
    let stages = report["stages"].as_array().unwrap();
    assert!(stages.len() >= 4);
    assert!(stages.iter().all(|s| s["name"].is_string() && s["seconds"].as_f64().unwrap() >= 0.0));
    if cfg!(target_os = "linux") {
        assert!(number("/peak_memory_bytes") > 1e6);
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let bench = Bench::new();
    let bytes = |threads: &str, scene: &str, more: &[&str]| {
        let args = ["render", scene, "--size", "64x48", "--patch-size", "1", "-o", "a.png", "-q"];
        bench.run(&[&args[..], &["-j", threads], more].concat()).ok();
        fs::read(bench.path("a.png")).unwrap()
    };
    let cases: &[(&str, &[&str])] = &[
        ("room", &["--samples", "64"]),
        ("room", &["--resolution", "32"]),
        ("room", &["--resolution", "32", "--draw", "patches"]),
        ("room", &["--resolution", "32", "--solver", "jacobi"]),
        ("cornell-box", &["--engine", "exact"]),
        ("cornell-box", &["--engine", "classical", "--solver", "shooting"]),
    ];
    for (scene, more) in cases {
        assert!(bytes("1", scene, more) == bytes("2", scene, more), "{scene} {more:?}");
    }
}

/// All solvers solve the same system, to a residual that no pixel shows: a value on the border of
/// two levels may fall on either.
#[test]
fn every_solver_paints_the_same_within_one_level() {
    let bench = Bench::new();
    let picture = |solver: &str| {
        let outcome = bench.render("cornell-box", &["--solver", solver, "-o", "a.png"]).ok();
        assert_eq!(outcome.stdout, "a.png\n");
        bench.picture("a.png")
    };
    let exact = picture("direct");
    assert_eq!(exact.size(), (64, 48));
    for solver in ["gauss-seidel", "jacobi", "shooting"] {
        let (mean, worst) = exact.difference(&picture(solver));
        assert!(worst <= 1 && mean < 0.01, "{solver}: {mean} of 255 on average, {worst} at most");
    }
}

#[test]
fn a_closed_room_without_light_and_stage_is_refused_with_what_could_emit() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let off = ["--stage", "off"];
    let parts = ["room", "--emission", "plaster", "ceiling", "--lamp"];
    let refusal = bench.render("room.obj", &off).refused(&parts);
    assert_eq!(bench.files(), ["room.mtl", "room.obj"]);
    // The lamp that is proposed lights it.
    let words: Vec<&str> = refusal.stderr.split([' ', '\n']).collect();
    let at = words.iter().position(|w| *w == "--lamp").unwrap();
    let lamp = words[at + 1].trim_end_matches(',');
    let lit = bench.render("room.obj", &["--stage", "off", "--lamp", lamp]).ok();
    assert!(!lit.stderr.contains("warning: the picture is black"), "{lit:?}");
    assert!(bench.picture("room.png").mean()[0] > 0.05, "{lamp}");
}

#[test]
fn a_material_can_be_made_to_emit() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let args = ["--emission", "ceiling=5,5,4", "--sides", "one", "-o", "lit.png"];
    let outcome = bench.render("room.obj", &args).ok();
    assert_eq!(outcome.stdout, "lit.png\n");
    let [red, green, blue] = bench.picture("lit.png").mean();
    assert!(red > 0.05 && (green / red - 1.0).abs() < 0.02, "{red} {green} {blue}");
    assert!(blue < 0.9 * red, "less blue than red: {red} {green} {blue}");
    let wrong = ["--emission", "lamp=5,5,4"];
    bench.render("room.obj", &wrong).refused(&["lamp", "ceiling", "plaster"]);
}

#[test]
fn a_lamp_can_be_given_a_photometric_file() {
    let file = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 180\n0\n100 100\n";
    let bench = Bench::new().with("lamp.glb", glb_with_lamp()).with("even.ies", file);
    let info = |ies: &str| bench.run(&["info", "lamp.glb", "--ies", ies]);
    let outcome = info("bulb=even.ies").ok();
    assert!(outcome.stdout.contains("bulb (point, 1257 lm)"), "4 pi 100 cd: {outcome:?}");
    bench.render("lamp.glb", &["--ies", "bulb=even.ies", "-o", "lamp.png"]).ok();
    info("lamp=even.ies").refused(&["--ies lamp", "the scene has bulb"]);
    info("bulb=gone.ies").refused(&["gone.ies", "cannot be read"]);
    info("bulb").refused(&["bulb=bulb.ies"]);
    let cornell = ["info", "cornell-box", "--ies", "bulb=even.ies"];
    bench.run(&cornell).refused(&["has no point or spot lamps"]);
}

#[test]
fn half_the_emission_is_half_the_light_in_every_pixel() {
    let bench = Bench::new();
    let picture = |share: &str| {
        let args = ["--emission", share, "--exposure", "-5", "--tone", "linear", "-o", "a.png"];
        bench.render("cornell-box", &args).ok();
        bench.picture("a.png")
    };
    let (full, half) = (picture("light=100%"), picture("light=50%"));
    assert!(full.pixels.iter().flatten().all(|&c| c < 255), "the lamp is clipped at white");
    for (full, half) in full.pixels.iter().zip(&half.pixels) {
        assert!(full.iter().zip(half).all(|(f, h)| h < f || *f < 4), "{full:?} {half:?}");
    }
    for (full, half) in full.mean().into_iter().zip(half.mean()) {
        assert!(full > 5e-4 && (half / full - 0.5).abs() < 0.01, "{half} of {full}");
    }
}

#[test]
fn a_model_without_light_gets_a_stage_and_a_camera_to_be_copied() {
    let bench = Bench::new().with("step.obj", OPEN_MODEL);
    let outcome = bench.render("step.obj", &[]).ok();
    assert!(outcome.stderr.contains("--stage off"), "{outcome:?}");
    assert_eq!(bench.picture("step.png").size(), (64, 48));
    let line = outcome.stderr.lines().find(|l| l.contains("--eye")).unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    let value = |flag: &str| {
        let at = words.iter().position(|w| *w == flag).unwrap_or_else(|| panic!("{flag}: {line}"));
        words[at + 1]
    };
    let (eye, target, vfov) = (value("--eye"), value("--target"), value("--vfov"));
    let copied = ["--eye", eye, "--target", target, "--vfov", vfov, "-o", "again.png"];
    let again = bench.render("step.obj", &copied).ok();
    assert!(!again.stderr.contains("--eye"), "a given camera is not announced: {again:?}");
    // Coordinates to copy are rounded: a pixel at an edge may differ.
    let (mean, _) = bench.picture("step.png").difference(&bench.picture("again.png"));
    assert!(mean < 0.5, "another picture: {mean} of 255 on average");
}

#[test]
fn reads_a_binary_gltf_file() {
    let bench = Bench::new().with("triangle.glb", glb());
    bench.render("triangle.glb", &[]).ok();
    assert_eq!(bench.files(), ["triangle.glb", "triangle.png"]);
    let picture = bench.picture("triangle.png");
    let around = picture.pixels[0];
    let seen = picture.pixels.iter().filter(|p| **p != around).count();
    assert!(seen > 100, "the triangle fills {seen} of {} pixels", picture.pixels.len());
}

#[test]
fn negative_coordinates_are_values_and_not_options() {
    let bench = Bench::new();
    let args = ["--eye", "-1,2,-3", "--target", "-1,2,0", "--exposure", "-2"];
    bench.render("cornell-box", &args).ok();
}

#[test]
fn a_file_wins_over_the_built_in_scene_of_its_name() {
    let bench = Bench::new().with("room", OPEN_MODEL);
    bench.render("room", &[]).refused(&["room", ".obj"]);
}

#[test]
fn an_older_picture_is_replaced() {
    let bench = Bench::new().with("out.png", "not a picture");
    bench.render("cornell-box", &["-o", "out.png"]).ok();
    assert_eq!(bench.picture("out.png").size(), (64, 48));
    assert_eq!(bench.files(), ["out.png"]);
}

#[test]
fn scenes_are_listed_and_can_be_looked_at() {
    let bench = Bench::new();
    let listed = bench.run(&["scenes"]).ok().stdout;
    let names: Vec<&str> =
        listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    for name in ["cornell-box", "furnace", "room"] {
        assert!(names.contains(&name), "{listed}");
    }
    for name in names {
        let info = bench.run(&["info", name]).ok().stdout;
        assert!(info.contains("triangles"), "{name}: {info}");
    }
}

#[test]
fn info_names_what_is_doubtful() {
    const DOUBTFUL: &str = "\
v 0 0 0\nv 4000 0 0\nv 4000 0 3000\nv 0 0 3000\nv 0 2500 0\nv 4000 2500 0\nv 2000 0 0
o floor\nf 1 4 3 2
o doubled\nf 1 4 3
o line\nf 1 2 7
o wall\nf 1 2 6 5
";
    let bench = Bench::new().with("doubtful.obj", DOUBTFUL);
    let outcome = bench.run(&["info", "doubtful.obj"]).ok();
    let text = outcome.stdout.to_lowercase();
    for part in ["1 degenerate", "1 duplicate", "doubled", "line", "open", "--unit mm"] {
        assert!(text.contains(part), "'{part}' is not in {text}");
    }
    let metres = bench.run(&["info", "doubtful.obj", "--unit", "mm"]).ok().stdout;
    assert!(metres.contains("4.0000 x 2.5000 x 3.0000"), "{metres}");
    assert!(!metres.contains("--unit"), "{metres}");
}

#[test]
fn info_names_fronts_that_face_the_wrong_way() {
    // A closed box whose fronts face outwards, as seen by whoever wants to light its inside.
    let text: String = CLOSED_ROOM
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => {
                let turned: Vec<&str> = face.split(' ').rev().collect();
                format!("f {}\n", turned.join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    let bench = Bench::new().with("turned.obj", text).with("room.mtl", ROOM_MATERIALS);
    let outcome = bench.run(&["info", "turned.obj", "--sides", "one"]).ok();
    assert!(outcome.stdout.contains("normals"), "{outcome:?}");
}

#[test]
fn help_is_short_or_has_examples() {
    let bench = Bench::new();
    let short = bench.run(&["render", "-h"]).ok().stdout;
    let long = bench.run(&["render", "--help"]).ok().stdout;
    assert!(long.contains("Examples:") && long.contains("--report"));
    assert!(!short.contains("--report") && short.contains("--patch-size"));
}

/// Ctrl-C in the middle of the work.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_work_and_leaves_nothing() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let bench = Bench::new();
    // Minutes of work; the memory is not touched before the interrupt comes.
    let long =
        ["--patch-size", "0.002", "--draw", "patches", "--memory", "1000G", "--size", "64x48"];
    let args = [&["render", "room"][..], &long].concat();
    let mut child = bench.command(&args).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    assert!(child.try_wait().unwrap().is_none(), "it ended before the interrupt");
    let start = Instant::now();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    assert!(String::from_utf8_lossy(&output.stderr).contains("cancelled"));
    assert!(bench.files().is_empty(), "{:?}", bench.files());
}

#[test]
fn a_map_shows_how_well_pixels_are_known() {
    let bench = Bench::new();
    let map = ["--error-map", "map.png", "--report", "run.json"];
    let outcome = bench.render("cornell-box", &map).ok();
    assert!(outcome.stderr.contains("map.png: black 0 %"), "{outcome:?}");
    assert_eq!(bench.picture("map.png").size(), (64, 48));
    let text = fs::read_to_string(bench.path("run.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    let error = |name: &str| report["picture_error"][name].as_f64().unwrap();
    assert!(error("total") > 0.0 && error("total") < 1.0 && error("of_solution") <= error("total"));
    bench.render("cornell-box", &["--error-map", "map.exr"]).refused(&["map.exr", ".png"]);
    bench.render("cornell-box", &["--error-map", "map.png", "--draft"]).refused(&["--draft"]);
    let same = ["-o", "map.png", "--error-map", "map.png"];
    bench.render("cornell-box", &same).refused(&["map.png"]);
}

#[test]
fn an_error_asked_for_makes_a_picture_better_known() {
    let known = |more: &[&str]| {
        let bench = Bench::new();
        let args = ["render", "cornell-box", "--size", "64x48", "--report", "run.json"];
        bench.run(&[&args, more].concat()).ok();
        let text = fs::read_to_string(bench.path("run.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        report["picture_error"]["total"].as_f64().unwrap()
    };
    let (usual, better) = (known(&[]), known(&["--error", "2%"]));
    assert!(better < 0.03 && better < 0.8 * usual, "{usual} {better}");
}
