//! Solutions: new lamps and reflectances from a file, what is refused, and files that are whole or
//! absent whenever a run ends.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;
use std::thread::sleep;
use std::time::{Duration, Instant};

use common::{Bench, SMALL, glb_with_lamp};

/// Few patches, many rays.
const LIGHT: [&str; 4] = ["--patch-size", "0.2", "--samples", "512"];

fn solved() -> Bench {
    let bench = Bench::new();
    let outcome = bench.run(&[&["solve", "cornell-box", "-o", "box.hemi"], &LIGHT[..]].concat());
    let outcome = outcome.ok();
    assert_eq!(outcome.stdout, "box.hemi\n");
    assert!(outcome.stderr.contains("source: light: 17.0000,12.0000,4.0000"), "{outcome:?}");
    bench
}

/// The mean luminance that `probe` finds on the floor.
fn floor(bench: &Bench, scene: &str, more: &[&str]) -> f64 {
    let grid = ["--grid", "0.5,0.01,0.5", "0,0,4", "4,0,0", "2x2"];
    let outcome = bench.run(&[&["probe", scene][..], &grid, more].concat()).ok();
    let rows: Vec<&str> = outcome.stdout.lines().collect();
    let column = rows[0].split(',').position(|c| c == "E").unwrap();
    let values = rows[1..].iter().map(|r| r.split(',').nth(column).unwrap());
    values.map(|v| v.parse::<f64>().unwrap()).sum::<f64>() / 4.0
}

#[test]
fn a_solution_is_taken_for_its_scene() {
    let bench = solved();
    let size = ["--size", "64x64", "--exposure", "0"];
    for (name, flags) in [
        ("same", &[][..]),
        ("dim", &["--emission", "light=25%"]),
        ("blue", &["--emission", "light=1,2,30"]),
    ] {
        let [mixed, afresh] = ["m", "a"].map(|k| format!("{name}-{k}.png"));
        bench.run(&[&["render", "box.hemi", "-o", &mixed][..], &size, flags].concat()).ok();
        let fresh = [&["render", "cornell-box", "-o", &afresh][..], &LIGHT, &size, flags];
        bench.run(&fresh.concat()).ok();
        let [a, b] = [&mixed, &afresh].map(|f| bench.picture(f));
        assert!(a.difference(&b).1 <= 2, "{name}: {:?}", a.difference(&b));
    }
    let [whole, dim] =
        [&[][..], &["--emission", "light=25%"]].map(|f| floor(&bench, "box.hemi", f));
    assert!((dim / whole - 0.25).abs() < 1e-3, "{dim} of {whole}");
    assert_eq!(floor(&bench, "box.hemi", &["--emission", "light=0%"]), 0.0);
    let info = bench.run(&["info", "box.hemi", "--emission", "light=50%"]).ok();
    assert!(info.stdout.contains("source:    light: 8.5000,6.0000,2.0000"), "{info:?}");
}

#[test]
fn another_reflectance_is_solved_by_the_factors_in_the_file() {
    let bench = solved();
    let dark = ["--reflectance", "white=0.1,0.1,0.1"];
    let outcome = bench.run(&[&["solve", "box.hemi", "-o", "dark.hemi"], &dark[..]].concat()).ok();
    assert!(!outcome.stderr.contains("form factors"), "{outcome:?}");
    let again = floor(&bench, "box.hemi", &dark);
    let stored = floor(&bench, "dark.hemi", &[]);
    let afresh = floor(&bench, "cornell-box", &[&dark[..], &LIGHT].concat());
    assert!((again / stored - 1.0).abs() < 1e-4, "{again}, {stored}");
    assert!((again / afresh - 1.0).abs() < 0.01, "{again}, {afresh}");
    assert!(again < 0.8 * floor(&bench, "box.hemi", &[]));
}

#[test]
fn a_lamp_that_is_hung_can_be_dimmed() {
    let bench = Bench::new();
    let lamp = ["--lamp", "bulb=2,2,2,1000", "--emission", "light=0%"];
    let whole = floor(&bench, "cornell-box", &[&lamp[..], &LIGHT].concat());
    let half = ["--emission", "bulb=50%"];
    let dim = floor(&bench, "cornell-box", &[&lamp[..], &LIGHT, &half].concat());
    assert!((dim / whole - 0.5).abs() < 1e-3, "{dim} of {whole}");
}

#[test]
fn a_baked_solution_keeps_the_names_of_its_model() {
    let bench = Bench::new().with("lit.glb", glb_with_lamp());
    bench.run(&["solve", "lit.glb", "-o", "lit.hemi", "--patch-size", "1"]).ok();
    fs::rename(bench.path("lit.glb"), bench.path("other.glb")).unwrap();
    let flags = ["--texel", "0.2", "--mode", "lightmap", "--direct"];
    bench.run(&[&["bake", "lit.hemi", "-o", "a.glb"], &flags[..]].concat()).ok();
    let model = ["bake", "other.glb", "-o", "b.glb", "--patch-size", "1"];
    bench.run(&[&model, &flags[..]].concat()).ok();
    let json = |name: &str| {
        let bytes = fs::read(bench.path(name)).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        json
    };
    let [a, b] = ["a.glb", "b.glb"].map(json);
    for part in ["nodes", "meshes", "cameras", "scenes"] {
        assert_eq!(a[part], b[part], "{part}");
    }
}

#[test]
fn what_a_solution_cannot_do_is_refused() {
    let bench = solved();
    let refuse = |args: &[&str], parts: &[&str]| {
        bench.run(args).refused(parts);
    };
    let render = ["render", "box.hemi", "-o", "x.png"];
    for (flags, parts) in [
        (&["--lamp", "a=0,1,0,100"][..], &["--lamp is not used with a solution"][..]),
        (&["--sun", "100,30"], &["--sun is not used"]),
        (&["--unit", "mm"], &["--unit is not used"]),
        (&["--sides", "two"], &["--sides is not used"]),
        (&["--max-reflectance", "0.5"], &["--max-reflectance is not used"]),
        (&["--samples", "64"], &["--samples is not used", "hemicube solve"]),
        (&["--patch-size", "1"], &["--patch-size is not used"]),
        (&["--factors", "F.npz"], &["--factors is not used"]),
        (&["--emission", "white=1,1,1"], &["white", "--group 'white=white'"]),
        (&["--sky", "1,1,1"], &["sky", "not among the sources"]),
        (&["--emission", "lihgt=1,1,1"], &["lihgt", "no such material or lamp", "light"]),
        (&["--reflectance", "wihte=.1,.1,.1"], &["wihte", "no such material"]),
        (&["--reflectance", "white=1,1,1"], &["0 to below 1"]),
        (&["--reflectance", "white=.95,.5,.5"], &["white", "0.9", "--max-reflectance"]),
        (&["--stage", "on"], &["--stage on is not used"]),
    ] {
        refuse(&[&render[..], flags].concat(), parts);
    }
    refuse(&["solve", "cornell-box", "-o", "x.npz"], &["x.npz", ".hemi"]);
    refuse(&["solve", "box.hemi", "-o", "box.hemi"], &["is read by this run"]);
    let wrong = ["solve", "cornell-box", "-o", "x.hemi", "--group", "a=lamp"];
    refuse(&wrong, &["no lamp lamp", "light"]);
    let bench =
        bench.with("torn.hemi", &fs::read(Bench::path(&solved(), "box.hemi")).unwrap()[..5000]);
    bench.run(&["render", "torn.hemi"]).refused(&["torn.hemi: is no whole file of solutions"]);
    let bench = bench.with("text.hemi", "no archive");
    bench.run(&["info", "text.hemi"]).refused(&["text.hemi", "make it again with hemicube solve"]);
    bench.run(&["render", "gone.hemi"]).refused(&["gone.hemi", "cannot be read"]);
    let dark = Bench::new().with("dark.obj", common::OPEN_MODEL);
    dark.run(&["solve", "dark.obj"]).refused(&["nothing emits light", "--sky"]);
    assert_eq!(dark.files(), ["dark.obj"]);
}

#[test]
fn killed_at_any_moment_every_file_is_whole_or_absent() {
    const MOMENTS: u32 = 50;
    let runs: [(&[&str], &[&str]); 4] = [
        (&["render", "cornell-box", "-o", "a.png"], &["a.png"]),
        (&["render", "cornell-box", "-o", "a.exr"], &["a.exr"]),
        (&["solve", "cornell-box", "-o", "a.hemi"], &["a.hemi"]),
        (
            &["bake", "cornell-box", "-o", "b.glb", "--mode", "lightmap", "--texel", "0.05"],
            &["b.glb", "b.exr", "b.json"],
        ),
    ];
    let flags = |args: &[&str]| -> Vec<&'static str> {
        let size: &[&str] = if args[0] == "render" { &SMALL[..2] } else { &[] };
        [size, &LIGHT[..]].concat()
    };
    let whole = Bench::new();
    let mut lasts = Vec::new();
    for (args, _) in runs {
        let start = Instant::now();
        whole.run(&[args, &flags(args)].concat()).ok();
        lasts.push(start.elapsed());
    }
    let mut state = 1_u32;
    let mut ended = 0;
    for k in 0..MOMENTS {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let share = 1.1 * f64::from(state) / f64::from(u32::MAX);
        let (args, results) = runs[k as usize % runs.len()];
        let bench = Bench::new();
        let mut child = bench.command(&[args, &flags(args)].concat()).spawn().unwrap();
        sleep(Duration::from_secs_f64(share * lasts[k as usize % runs.len()].as_secs_f64()));
        child.kill().unwrap();
        ended += u32::from(child.wait().unwrap().success());
        for name in bench.files() {
            if results.contains(&name.as_str()) {
                let [is, was] = [&bench, &whole].map(|b| fs::read(b.path(&name)).unwrap());
                assert!(is == was, "{name} is not whole, {share:.2} of the way");
            } else {
                assert!(name.starts_with(".hemicube-") && name.ends_with(".tmp"), "{name}");
            }
        }
    }
    assert!(ended < MOMENTS, "no run was killed before it ended");
}
