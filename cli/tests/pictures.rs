//! Pictures of `hemicube render` in other formats, from many cameras, and in false colour; plans of
//! `hemicube probe`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::Bench;

#[test]
fn the_extension_chooses_the_format() {
    let bench = Bench::new();
    for (name, head) in [
        ("a.jpg", &b"\xff\xd8\xff"[..]),
        ("a.exr", b"\x76\x2f\x31\x01"),
        ("a.hdr", b"#?RADIANCE\n"),
        ("a.png", b"\x89PNG"),
    ] {
        let outcome = bench.render("cornell-box", &["-o", name]).ok();
        assert_eq!(outcome.stdout, format!("{name}\n"));
        assert!(fs::read(bench.path(name)).unwrap().starts_with(head), "{name}");
    }
    let outcome = bench.render("cornell-box", &["-o", "a.bmp"]);
    assert_eq!(outcome.code, Some(2));
    assert!(outcome.stderr.contains("a.bmp: pictures are written as .png, .jpg, .exr or .hdr"));
}

#[test]
fn radiance_is_written_as_it_is_whatever_the_exposure() {
    let bench = Bench::new();
    bench.render("cornell-box", &["-o", "a.hdr", "--exposure", "0"]).ok();
    bench.render("cornell-box", &["-o", "b.hdr", "--exposure", "5"]).ok();
    assert_eq!(fs::read(bench.path("a.hdr")).unwrap(), fs::read(bench.path("b.hdr")).unwrap());
}

#[test]
fn many_cameras_make_many_pictures_of_one_light() {
    let bench = Bench::new();
    let flags = ["--camera", "orbit:3", "-o", "v-{camera}.png", "--contact-sheet", "all.png"];
    let outcome = bench.render("cornell-box", &flags).ok();
    assert_eq!(outcome.stdout, "v-orbit-1.png\nv-orbit-2.png\nv-orbit-3.png\nall.png\n");
    assert_eq!(outcome.stderr.matches("patches of at most").count(), 1, "lit once: {outcome:?}");
    let (width, height) = bench.picture("all.png").size();
    assert!(width > 2 * 64 && height > 2 * 48, "two rows of two");
    assert_ne!(
        fs::read(bench.path("v-orbit-1.png")).unwrap(),
        fs::read(bench.path("v-orbit-2.png")).unwrap()
    );
    // The first view is that of one camera alone.
    bench.render("cornell-box", &["-o", "one.png", "--exposure", "0"]).ok();
    bench.render("cornell-box", &["--camera", "all", "-o", "{camera}.png", "--exposure", "0"]).ok();
    let name = bench
        .files()
        .into_iter()
        .find(|f| !f.contains("orbit") && f != "one.png" && f != "all.png");
    assert_eq!(
        fs::read(bench.path("one.png")).unwrap(),
        fs::read(bench.path(&name.unwrap())).unwrap()
    );
}

#[test]
fn many_pictures_need_many_names() {
    let bench = Bench::new();
    let outcome = bench.render("cornell-box", &["--camera", "orbit:2", "-o", "v.png"]);
    assert_eq!(outcome.code, Some(2));
    assert!(outcome.stderr.contains("{camera}"), "{outcome:?}");
    let outcome = bench.render("cornell-box", &["--camera", "orbit:0"]);
    assert_eq!(outcome.code, Some(2));
    let outcome = bench.render("cornell-box", &["--camera", "nobody"]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("no camera 'nobody'"));
    assert!(bench.files().is_empty(), "nothing was written");
}

#[test]
fn false_colour_shows_illuminance_with_a_legend() {
    let bench = Bench::new();
    let flags = ["--false-colour", "lux", "--range", "0,2", "-o", "lux.png"];
    let outcome = bench.render("cornell-box", &flags).ok();
    assert!(outcome.stderr.contains("--range 0,2 lx"), "{outcome:?}");
    let (width, height) = bench.picture("lux.png").size();
    assert!(width > 64 && height == 48, "a legend stands beside it");
    let alias = ["--false-color", "lux", "--range", "0,2", "-o", "again.png"];
    bench.render("cornell-box", &alias).ok();
    assert_eq!(
        fs::read(bench.path("lux.png")).unwrap(),
        fs::read(bench.path("again.png")).unwrap()
    );
    for flags in [
        &["--range", "0,2"][..],
        &["--false-colour", "lux", "--range", "2,1"],
        &["--false-colour", "lux", "-o", "a.exr"],
    ] {
        assert_eq!(bench.render("cornell-box", flags).code, Some(2), "{flags:?}");
    }
}

#[test]
fn a_work_plane_is_drawn() {
    let bench = Bench::new();
    let grid = ["1,4,4", "3,0,0", "0,0,-3", "3x4"];
    for plan in ["plan.svg", "plan.png"] {
        let args = [
            &["probe", "cornell-box", "--patch-size", "1", "--grid"],
            &grid[..],
            &["-o", "a.csv", "--plan", plan],
        ]
        .concat();
        let outcome = bench.run(&args).ok();
        assert_eq!(outcome.stdout, format!("a.csv\n{plan}\n"));
    }
    let text = fs::read_to_string(bench.path("plan.svg")).unwrap();
    assert_eq!(text.matches("fill=\"#fff\"").count() + text.matches("fill=\"#000\"").count(), 12);
    assert!(bench.picture("plan.png").size().0 > 800);
}

#[test]
fn a_model_is_baked_in_each_mode_or_not_at_all() {
    let bench = Bench::new();
    let bake = |mode: &str, name: &str, more: &[&str]| {
        let args = ["bake", "cornell-box", "--mode", mode, "--texel", "0.3", "--patch-size", "1"];
        bench.run(&[&args[..], &["-o", name], more].concat())
    };
    for mode in ["unlit", "vertex"] {
        let name = format!("{mode}.glb");
        assert_eq!(bake(mode, &name, &[]).ok().stdout, format!("{name}\n"));
        assert!(fs::read(bench.path(&name)).unwrap().starts_with(b"glTF"));
    }
    assert_eq!(bake("lightmap", "a.glb", &["--direct"]).ok().stdout, "a.glb\na.exr\na.json\n");
    let layout = fs::read_to_string(bench.path("a.json")).unwrap();
    let layout: serde_json::Value = serde_json::from_str(&layout).unwrap();
    assert!(layout["nodes"].as_array().unwrap().len() > 4 && layout["texel_m"] == 0.3);
    assert_eq!(bake("unlit", "b.glb", &["--direct"]).code, Some(2));
    assert_eq!(bake("unlit", "b.obj", &[]).code, Some(2));
    let outcome = bench.run(&["bake", "cornell-box", "--texel", "1e-5", "--patch-size", "1"]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("--texel"), "{outcome:?}");
    assert_eq!(bench.files(), ["a.exr", "a.glb", "a.json", "unlit.glb", "vertex.glb"]);
}
