//! Bad input and usage: exit code 2, one message that names place and remedy, no file left.

#![allow(clippy::unwrap_used, reason = "a test")]

mod common;

use std::fs;

use common::{Bench, OPEN_MODEL, glb, noise};

/// Runs on a model that cannot be read, and looks whether its message names the file.
fn refuse_model(name: &str, bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let bench = Bench::new().with(name, bytes);
    for command in ["render", "info", "factors"] {
        bench.run(&[command, name]).refused(&[&[name], parts].concat());
        assert_eq!(bench.files(), [name], "{command} left something behind");
    }
}

#[test]
fn an_empty_file() {
    for name in ["model.obj", "model.glb", "model.gltf", "model.stl", "model.ply", "model.vs3"] {
        refuse_model(name, "", &["empty"]);
    }
}

#[test]
fn a_missing_file() {
    let bench = Bench::new();
    bench.run(&["render", "missing.obj"]).refused(&["missing.obj", "no such file"]);
    bench.run(&["render", "cornel-box"]).refused(&["cornel-box", "cornell-box", "room"]);
    assert!(bench.files().is_empty());
}

#[test]
fn a_directory() {
    let bench = Bench::new();
    fs::create_dir(bench.path("model.obj")).unwrap();
    bench.run(&["render", "model.obj"]).refused(&["model.obj", "directory"]);
    assert_eq!(bench.files(), ["model.obj"]);
}

#[test]
fn a_kind_that_is_not_read() {
    refuse_model("model.fbx", "Kaydara", &[".glb", ".obj"]);
}

#[test]
fn a_model_of_clear_glass_alone_names_its_materials() {
    let bench = Bench::new()
        .with("m.obj", format!("mtllib m.mtl\nusemtl pane\n{OPEN_MODEL}"))
        .with("m.mtl", "newmtl pane\nKd 1 1 1\nd 0\n");
    bench.run(&["render", "m.obj"]).refused(&["m: no triangle", "pane", "d 1"]);
}

#[test]
fn a_truncated_binary_file() {
    let whole = glb();
    for length in [5, 12, 19, 100, whole.len() - 40, whole.len() - 1] {
        refuse_model("cut.glb", &whole[..length], &[]);
    }
}

#[test]
fn a_vertex_that_is_not_a_number() {
    refuse_model("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", &["line 2"]);
    refuse_model("inf.obj", "v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", &["line 3"]);
    let nan = f32::NAN.to_le_bytes();
    let mut bytes = glb();
    let last = bytes.len() - 4;
    bytes[last..].copy_from_slice(&nan);
    refuse_model("nan.glb", &bytes, &[]);
}

#[test]
fn an_index_out_of_range() {
    for face in ["1 2 9", "1 2 0", "1 2 -7", "1 2 99999999999999999999"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n");
        refuse_model("index.obj", text, &["line 4"]);
    }
}

#[test]
fn a_file_without_triangles() {
    refuse_model("points.obj", "v 0 0 0\nv 1 0 0\n", &["triangles"]);
}

#[test]
fn megabytes_of_noise() {
    let noise = noise(3 << 20);
    for name in ["noise.obj", "noise.glb", "noise.gltf", "noise.stl", "noise.ply"] {
        refuse_model(name, &noise, &[]);
    }
}

#[test]
fn options_out_of_range() {
    let bench = Bench::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--camera", "nobody"], &["nobody", "main"]),
        (&["--size", "800"], &["--size", "800x600"]),
        (&["--size", "ax4"], &["--size"]),
        (&["--size", "0x4", "--patch-size", "2"], &["--size"]),
        (&["--size", "99999x99999", "--patch-size", "2"], &["--size"]),
        (&["--resolution", "33"], &["33", "even"]),
        (&["--resolution", "14"], &["14", "16"]),
        (&["--resolution", "2048"], &["2048", "1024"]),
        (&["--patch-size", "0"], &["patch size"]),
        (&["--patch-size=-1"], &["patch size"]),
        (&["--patch-size", "nan"], &["patch size"]),
        (&["--patch-size", "1e-12"], &["--patch-size"]),
        (&["--memory", "1K"], &["--resolution", "--memory"]),
        (&["--memory", "lots"], &["--memory", "4G"]),
        (&["--eye", "1,2"], &["--eye"]),
        (&["--eye", "1,2,3"], &["--target"]),
        (&["--sky=-1,0,0"], &["--sky"]),
        (&["--emission", "light=x"], &["lamp=10,10,8"]),
        (&["--emission", "nothing=1,1,1"], &["nothing", "light"]),
        (&["--up", "0,0,0"], &["--up"]),
        (&["--exposure", "bright"], &["--exposure"]),
        (&["--vfov", "180", "--patch-size", "2"], &["angle of view"]),
        (&["-o", "picture.bmp"], &["picture.bmp", ".png"]),
    ];
    for (args, parts) in cases {
        bench.run(&[&["render", "cornell-box"], *args].concat()).refused(parts);
        assert!(bench.files().is_empty(), "{args:?} left {:?}", bench.files());
    }
}

#[test]
fn what_would_not_fit_in_memory_is_refused_beforehand() {
    let bench = Bench::new();
    let args = ["render", "room", "--patch-size", "0.002", "--memory", "100M"];
    let start = std::time::Instant::now();
    let outcome = bench.run(&args).refused(&["--patch-size", "--memory", "100 MiB"]);
    assert!(start.elapsed().as_secs() < 60, "beforehand: {outcome:?}");
}

#[test]
fn the_patch_size_proposed_fits() {
    let bench = Bench::new();
    let cases: [&[&str]; 3] = [
        &["room", "--patch-size", "0.01", "--memory", "100M", "--samples", "1024"],
        &["cornell-box", "--patch-size", "0.02", "--memory", "8M", "--engine", "hemicube"],
        &["cornell-box", "--patch-size", "0.05", "--memory", "12M", "--solver", "direct"],
    ];
    for case in cases {
        let small = ["--size", "32x24", "-q", "-o", "a.png"];
        let mut args = [&["render"], case, &small].concat();
        let refused = bench.run(&args).refused(&["--patch-size", "--memory"]);
        let proposed = refused.stderr.split("--patch-size ").nth(1).unwrap();
        let proposed = proposed.split(' ').next().unwrap();
        // The size stands behind its flag.
        args[3] = proposed;
        bench.run(&args).ok();
    }
}

#[test]
fn a_direct_solution_that_does_not_fit_is_refused_before_rows_are_made() {
    let bench = Bench::new();
    let start = std::time::Instant::now();
    let args = ["render", "room", "--patch-size", "0.003", "--solver", "direct"];
    let memory = ["--memory", "4G", "--samples", "65536"];
    bench.run(&[&args[..], &memory].concat()).refused(&["--patch-size", "4.0 GiB are allowed"]);
    // All rows take minutes.
    assert!(start.elapsed().as_secs() < 60);
}

#[test]
fn a_folder_that_cannot_be_written() {
    let bench = Bench::new().with("file", "");
    bench.render("cornell-box", &["-o", "missing/out.png"]).refused(&["missing"]);
    bench.render("cornell-box", &["-o", "file/out.png"]).refused(&["file"]);
    assert_eq!(bench.files(), ["file"]);
}

#[test]
fn a_picture_that_would_replace_a_folder() {
    let bench = Bench::new();
    fs::create_dir(bench.path("out.png")).unwrap();
    let outcome = bench.render("cornell-box", &["-o", "out.png"]);
    assert!(matches!(outcome.code, Some(1 | 2)), "{outcome:?}");
    assert!(outcome.stderr.contains("error:") && outcome.stderr.contains("out.png"));
    assert_eq!(outcome.stdout, "");
    assert_eq!(bench.files(), ["out.png"], "a temporary file was left behind");
}

#[test]
fn a_model_beside_others_names_the_right_one() {
    let bench = Bench::new().with("good.obj", OPEN_MODEL).with("bad.obj", "f 1 2 3\n");
    bench.run(&["render", "bad.obj"]).refused(&["bad.obj", "line 1"]);
    assert_eq!(bench.files(), ["bad.obj", "good.obj"]);
}
