//! `hemicube factors` as users run it, and the matrices that it writes as others read them.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "a test")]

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{Bench, CLOSED_ROOM, OPEN_MODEL, ROOM_MATERIALS};

/// The room with a name for each of its sides.
fn named_room() -> String {
    let mut text =
        String::from("v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 0 2 0\nv 2 2 0\nv 2 2 2\nv 0 2 2\n");
    let faces = ["4 3 2 1", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8", "5 6 7 8"];
    for (name, face) in ["floor", "north", "east", "south", "west", "ceiling"].iter().zip(faces) {
        text += &format!("g {name}\nf {face}\n");
    }
    text
}

/// The same with a crate of a third of its width in the middle of the floor.
fn room_with_crate() -> String {
    let mut text = named_room();
    text += "v .7 0 .7\nv 1.3 0 .7\nv 1.3 0 1.3\nv .7 0 1.3\n";
    text += "v .7 .6 .7\nv 1.3 .6 .7\nv 1.3 .6 1.3\nv .7 .6 1.3\n";
    text + "g crate\nf 10 9 13 14\nf 11 10 14 15\nf 12 11 15 16\nf 9 12 16 13\nf 16 15 14 13\n"
}

/// Every face turned round.
fn turned(obj: &str) -> String {
    let turn = |line: &str| match line.strip_prefix("f ") {
        Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    };
    obj.lines().map(turn).collect()
}

/// A dense array of floats of either width.
fn npy(path: &Path) -> Vec<Vec<f64>> {
    let bytes = fs::read(path).unwrap();
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = String::from_utf8(bytes[10..end].to_vec()).unwrap();
    let data = &bytes[end..];
    let values: Vec<f64> = if header.contains("'<f8'") {
        data.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    } else {
        data.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()).into()).collect()
    };
    let n = (values.len() as f64).sqrt() as usize;
    assert!(header.contains(&format!("({n}, {n})")), "{header}");
    values.chunks(n).map(<[f64]>::to_vec).collect()
}

/// A column of a table of numbers and plain names.
fn column(path: &Path, title: &str) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let at = lines.next().unwrap().iter().position(|t| *t == title).unwrap();
    lines.map(|fields| fields[at].to_owned()).collect()
}

fn numbers(path: &Path, title: &str) -> Vec<f64> {
    column(path, title).iter().map(|field| field.parse().unwrap()).collect()
}

/// Makes a dense matrix beside its table of surfaces.
fn factors(bench: &Bench, scene: &str, more: &[&str]) -> Vec<Vec<f64>> {
    let files = ["factors", scene, "-o", "F.npy", "--surfaces", "s.csv"];
    let outcome = bench.run(&[&files[..], more].concat()).ok();
    assert_eq!(outcome.stdout, "F.npy\ns.csv\n");
    npy(&bench.path("F.npy"))
}

#[test]
fn a_unit_cube_has_its_analytic_factors() {
    let bench = Bench::new().with("room.obj", named_room());
    factors(&bench, "room.obj", &["--group", "--samples", "16384", "--patch-size", "0.1"]);
    let f = npy(&bench.path("F.npy"));
    let names = column(&bench.path("s.csv"), "name");
    assert_eq!(names, ["floor", "north", "east", "south", "west", "ceiling"]);
    assert_eq!(numbers(&bench.path("s.csv"), "area"), [4.0; 6]);
    assert!((f[0][5] - 0.199_824_9).abs() < 3e-4, "{}", f[0][5]);
    assert!((f[0][1] - 0.200_043_8).abs() < 3e-4, "{}", f[0][1]);
    assert_eq!(f[0][0], 0.0);
}

#[test]
fn groups_are_sums_over_their_patches() {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let flags = ["--patch-size", "0.3", "--samples", "256"];
    let f = factors(&bench, "room.obj", &flags);
    let (names, areas) =
        (column(&bench.path("s.csv"), "name"), numbers(&bench.path("s.csv"), "area"));
    let lumped = factors(&bench, "room.obj", &[&flags[..], &["--group"]].concat());
    let groups = column(&bench.path("s.csv"), "name");
    assert_eq!(groups.len(), 7);
    for (i, from) in groups.iter().enumerate() {
        for (j, to) in groups.iter().enumerate() {
            let (mut sum, mut area) = (0.0, 0.0);
            for p in (0..names.len()).filter(|&p| names[p] == *from) {
                area += areas[p];
                let to = (0..names.len()).filter(|&q| names[q] == *to);
                sum += areas[p] * to.map(|q| f[p][q]).sum::<f64>();
            }
            assert!((lumped[i][j] - sum / area).abs() < 1e-12, "{from} {to}");
        }
    }
}

#[test]
fn rows_are_faces_of_the_file_and_their_account_is_complete() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    for engine in ["exact", "rays", "hemicube", "classical"] {
        let f = factors(&bench, "room.obj", &["--engine", engine]);
        assert_eq!(f.len(), 12);
        let table = bench.path("s.csv");
        assert_eq!(column(&table, "patch").join(" "), "0 1 2 3 4 5 6 7 8 9 10 11");
        assert_eq!(column(&table, "triangle"), column(&table, "patch"));
        let [front, back, environment] =
            ["front", "back", "environment"].map(|title| numbers(&table, title));
        for (i, row) in f.iter().enumerate() {
            let sum: f64 = row.iter().sum();
            assert!((sum - front[i]).abs() < 1e-6, "{engine}: {sum} {}", front[i]);
            assert_eq!((back[i], environment[i]), (0.0, 0.0), "{engine}");
            assert!(engine == "classical" || (sum - 1.0).abs() < 1e-5, "{engine}: {sum}");
        }
        let normals = ["nx", "ny", "nz"].map(|title| numbers(&table, title));
        assert_eq!(normals.map(|n| n[0]), [0.0, 1.0, 0.0]);
        assert_eq!(["cx", "cy"].map(|title| numbers(&table, title)[1]), [2.0 / 3.0, 0.0]);
    }
}

#[test]
fn faces_that_take_no_part_keep_rows_of_zeros() {
    let text = CLOSED_ROOM.replace("f 1 2 6 5", "f 1 2 2\nf 1 2 6 5\nf 2 6 1");
    let bench = Bench::new().with("room.obj", &text).with("room.mtl", ROOM_MATERIALS);
    let whole = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let f = factors(&bench, "room.obj", &[]);
    let clean = factors(&whole, "room.obj", &[]);
    assert_eq!(f.len(), 14);
    // The triangle without area is the third; the one that coincides with another is the sixth.
    let kept: Vec<usize> = (0..14).filter(|i| ![2, 5].contains(i)).collect();
    for (row, i) in clean.iter().zip(&kept) {
        let without: Vec<f64> = kept.iter().map(|&j| f[*i][j]).collect();
        assert!((row.iter().sum::<f64>() - without.iter().sum::<f64>()).abs() < 1e-6);
        assert_eq!((f[*i][2], f[*i][5]), (0.0, 0.0));
    }
    assert!(f[2].iter().chain(&f[5]).all(|f| *f == 0.0));
    let said = bench.run(&["factors", "room.obj"]).ok().stderr;
    assert!(said.contains("1 degenerate faces") && said.contains("1 duplicate faces"), "{said}");
}

#[test]
fn backs_follow_the_fronts() {
    let bench = Bench::new().with("open.obj", OPEN_MODEL);
    let one = factors(&bench, "open.obj", &["--samples", "4096"]);
    let two = factors(&bench, "open.obj", &["--sides", "two", "--samples", "4096"]);
    assert_eq!((one.len(), two.len()), (4, 8));
    let sides = column(&bench.path("s.csv"), "side");
    assert_eq!(sides[3..5], ["front", "back"]);
    // The step faces upwards, so the floor sees its backs.
    let (fronts, backs): (f64, f64) = (two[0][..4].iter().sum(), two[0][4..].iter().sum());
    assert_eq!((one[0].iter().sum::<f64>(), fronts), (0.0, 0.0));
    assert!(backs > 0.05, "{backs}");
    let groups = ["factors", "open.obj", "--group", "--sides", "two", "-q"];
    assert!(bench.run(&groups).ok().stdout.starts_with("from,default,default (back)\n"));
}

#[test]
fn thresholds_restore_what_rows_sum_to() {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let flags = ["--patch-size", "0.1", "--engine", "hemicube", "--resolution", "64"];
    let all = factors(&bench, "room.obj", &flags);
    let some = factors(&bench, "room.obj", &[&flags[..], &["--threshold", "0.005"]].concat());
    let count = |f: &[Vec<f64>]| f.iter().flatten().filter(|f| **f > 0.0).count();
    assert!(count(&some) < count(&all) / 2, "{} of {}", count(&some), count(&all));
    for (a, b) in all.iter().zip(&some) {
        assert!((a.iter().sum::<f64>() - b.iter().sum::<f64>()).abs() < 1e-12);
        assert!(b.iter().zip(a).all(|(b, a)| *b == 0.0 || *a >= 0.005), "{a:?}");
    }
}

/// Rows sum to 1 to 1e-9 and pairs are reciprocal, but for rows of zeros.
fn assert_closed(f: &[Vec<f64>], areas: &[f64], zero: &[usize]) {
    for (i, row) in f.iter().enumerate() {
        let sum: f64 = row.iter().sum();
        let expected = if zero.contains(&i) { 0.0 } else { 1.0 };
        assert!((sum - expected).abs() < 1.1e-9, "row {i}: {sum}");
        for (j, there) in row.iter().enumerate() {
            let (there, back) = (areas[i] * there, areas[j] * f[j][i]);
            assert!((there - back).abs() <= 1e-14 * there, "{i} {j}: {there} {back}");
        }
    }
}

#[test]
fn enclosures_close() {
    let bench = Bench::new().with("room.obj", named_room());
    let exact: &[&str] = &["--engine", "exact"];
    for engine in [exact, &["--samples", "64"], &["--engine", "hemicube", "--resolution", "32"]] {
        for threshold in [&[][..], &["--threshold", "0.0005"]] {
            let flags = [&["--enclosure", "--patch-size", "0.1"], engine, threshold].concat();
            let f = factors(&bench, "room.obj", &flags);
            assert_closed(&f, &numbers(&bench.path("s.csv"), "area"), &[]);
        }
    }
    let outcome = bench.run(&["factors", "room.obj", "--enclosure", "-o", "F.npz"]).ok();
    assert!(outcome.stderr.contains("rows sum to 1 within"), "{outcome:?}");
    let outcome = bench.run(&[
        "factors",
        "room.obj",
        "--enclosure",
        "--samples",
        "32",
        "--report",
        "r.json",
        "-o",
        "F.npz",
    ]);
    assert!(outcome.ok().stderr.contains("rows scaled by less than .9 or more than 1.1"));
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert!(report["closure"]["outside"].as_array().is_some_and(|rows| !rows.is_empty()));
    assert!(report["closure"]["asymmetry"].as_f64().is_some_and(|a| a > 0.0));
}

#[test]
fn covered_rows_keep_zero_and_are_listed() {
    // A floor in two parts, the smaller one wholly under the crate.
    let text = room_with_crate().replace(
        "g floor\nf 4 3 2 1\n",
        "g floor\nf 4 3 11 12\nf 3 2 10 11\nf 2 1 9 10\nf 1 4 12 9\ng hidden\nf 12 11 10 9\n",
    );
    let bench = Bench::new().with("room.obj", text);
    let f = factors(&bench, "room.obj", &["--enclosure"]);
    let names = column(&bench.path("s.csv"), "name");
    let hidden: Vec<usize> = (0..names.len()).filter(|&i| names[i] == "hidden").collect();
    assert_eq!(hidden.len(), 2);
    assert_closed(&f, &numbers(&bench.path("s.csv"), "area"), &hidden);
    let outcome = bench.run(&["factors", "room.obj", "--enclosure", "--group"]).ok();
    assert!(outcome.stderr.contains("2 rows covered"), "{outcome:?}");
    assert!(outcome.stderr.contains("of hidden (1.000)"), "{outcome:?}");
}

#[test]
fn what_is_no_enclosure_is_refused_by_name() {
    let open = named_room().replace("g east\nf 2 3 7 6\n", "");
    let bench = Bench::new().with("open.obj", open).with("crate.obj", room_with_crate());
    let run = |scene: &str| bench.run(&["factors", scene, "--enclosure", "-o", "F.npz"]);
    run("open.obj").refused(&["--enclosure", "surface west", "2 patches", "environment"]);
    // Half of the floor's triangles lie under the crate, but not enough to be covered.
    run("crate.obj").refused(&["--enclosure", "surface floor", "backs"]);
    let classical = ["factors", "furnace", "--enclosure", "--engine", "classical"];
    bench.run(&classical).refused(&["--enclosure", "classical", "hemicube"]);
    assert_eq!(bench.files(), ["crate.obj", "open.obj"]);
}

#[test]
fn a_room_with_outward_faces_is_named_and_flipped() {
    let bench = Bench::new().with("room.obj", named_room()).with("out.obj", turned(&named_room()));
    let outcome = bench.run(&["factors", "out.obj", "-o", "F.npz"]);
    outcome.refused(&["out", "most faces see nothing", "--flip", "--sides two"]);
    let f = factors(&bench, "room.obj", &["--group"]);
    let flipped = factors(&bench, "out.obj", &["--group", "--flip"]);
    for (a, b) in f.iter().flatten().zip(flipped.iter().flatten()) {
        assert!((a - b).abs() < 0.01, "{a} {b}");
    }
    factors(&bench, "out.obj", &["--sides", "two"]);
}

#[test]
fn stored_factors_light_their_own_scene_alone() {
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", ROOM_MATERIALS)
        .with("other.obj", CLOSED_ROOM.replace("v 2 2 2", "v 2 2.5 2"))
        .with("in.csv", "x,y,z,nx,ny,nz\n1,1,1,0,1,0\n");
    let small =
        ["--size", "32x24", "--emission", "ceiling=1,1,1", "--exposure", "0", "-o", "a.png"];
    let engine = ["--engine", "hemicube", "--resolution", "64", "--patch-size", "0.2"];
    bench.run(&[&["factors", "room.obj", "-o", "F.npz"], &engine[..]].concat()).ok();
    let render =
        |scene: &str, more: &[&str]| bench.run(&[&["render", scene], &small[..], more].concat());
    let stored = ["--factors", "F.npz", "--sides", "one"];
    render("room.obj", &stored).ok();
    let picture = fs::read(bench.path("a.png")).unwrap();
    render("room.obj", &[&engine[..], &["--sides", "one"]].concat()).ok();
    assert_eq!(picture, fs::read(bench.path("a.png")).unwrap(), "as if made anew");
    fs::remove_file(bench.path("a.png")).unwrap();

    render("room.obj", &["--factors", "F.npz"]).refused(&["F.npz", "room", "--sides one"]);
    render("other.obj", &stored).refused(&["F.npz", "another geometry", "hemicube factors"]);
    render("room.obj", &[&stored[..], &["--unit", "mm"]].concat()).refused(&["F.npz", "--unit"]);
    render("room.obj", &[&stored[..], &["--samples", "64"]].concat()).refused(&["--samples"]);
    render("room.obj", &["--factors", "room.obj"]).refused(&["room.obj", "hemicube factors"]);
    render("room.obj", &["--factors", "none.npz"]).refused(&["none.npz", "cannot be read"]);
    render("room.obj", &[&stored[..], &["--memory", "100K"]].concat()).refused(&["--memory"]);

    let probe = ["probe", "room.obj", "--points", "in.csv", "--emission", "ceiling=1,1,1", "-q"];
    let by = |more: &[&str]| bench.run(&[&probe[..], more].concat());
    let found = by(&stored).ok().stdout;
    let own = by(&["--sides", "one"]).ok().stdout;
    let e = |table: &str| -> f64 {
        table.lines().nth(1).unwrap().split(',').nth(9).unwrap().parse().unwrap()
    };
    assert!((e(&found) / e(&own) - 1.0).abs() < 0.05, "{found}{own}");
    by(&["--factors", "F.npz"]).refused(&["F.npz", "--sides one"]);
    bench.run(&["factors", "room.obj", "--group", "-o", "G.npz"]).ok();
    by(&["--factors", "G.npz", "--sides", "one"]).refused(&["G.npz", "--group"]);
}

#[test]
fn scipy_reads_what_is_written() {
    let has = Command::new("python3").args(["-c", "import scipy.sparse, scipy.io"]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        eprintln!("SKIPPED: python3 has no SciPy here");
        return;
    }
    let bench = Bench::new().with("room.obj", room_with_crate());
    let made = ["--patch-size", "0.2", "--samples", "256"];
    for file in ["F.npz", "F.mtx", "F.npy", "F.csv"] {
        bench.run(&[&["factors", "room.obj", "-o", file], &made[..]].concat()).ok();
    }
    bench.run(&[&["factors", "room.obj", "-o", "G.npz", "--group"], &made[..]].concat()).ok();
    let script = "
import json, numpy as np, scipy.io, scipy.sparse as sp
F = sp.load_npz('F.npz')
assert F.format == 'csr' and F.has_sorted_indices and F.dtype == np.float32, F
D = F.toarray()
assert np.array_equal(D, np.load('F.npy'))
assert np.allclose(D, scipy.io.mmread('F.mtx').toarray(), rtol=1e-7, atol=0)
C = np.genfromtxt('F.csv', delimiter=',', skip_header=1)[:, 1:]
assert np.array_equal(D, C.astype(np.float32))
z = np.load('F.npz')
assert json.loads(z['hemicube'].item())['engine'] == 'rays'
account = D.sum(1, dtype=float) + z['back'] + z['environment']
assert abs(account - 1).max() < 1e-5
assert abs(z['area'].sum() - 24 - 5 * .36) < 1e-9
assert list(np.load('G.npz')['names'])[0] == 'floor' and sp.load_npz('G.npz').dtype == float
";
    let output = bench_python(&bench, script);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn bench_python(bench: &Bench, script: &str) -> std::process::Output {
    Command::new("python3").current_dir(bench.path("")).args(["-c", script]).output().unwrap()
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let bench = Bench::new().with("room.obj", named_room());
    let run = |threads: &str, file: &str| {
        let flags = ["--enclosure", "--patch-size", "0.1", "--samples", "128"];
        bench.run(&[&["factors", "room.obj", "-j", threads, "-o", file], &flags[..]].concat()).ok();
        fs::read(bench.path(file)).unwrap()
    };
    assert!(run("1", "a.npz") == run("3", "b.npz"));
}

#[test]
fn wrong_usage_is_refused_before_any_work() {
    let bench = Bench::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["-o", "F.mat"], &["F.mat", ".npz", ".mtx"]),
        (&["-o", "missing/F.npz"], &["missing"]),
        (&["--surfaces", "s.txt"], &["s.txt", ".csv"]),
        (&["--threshold", "1"], &["--threshold", "1e-6"]),
        (&["--threshold", "-0.1"], &["--threshold"]),
        (&["--patch-size", "0"], &["patch size"]),
        (&["--engine", "hemicube", "--samples", "64"], &["--samples", "hemicube"]),
        (&["--engine", "hemicube", "--error", ".1"], &["--error", "hemicube", "--engine exact"]),
        (&["--samples", "64", "--error", ".1"], &["--error", "rays"]),
        (&["--engine", "exact", "--samples", "64"], &["--samples", "--engine rays"]),
        (&["--error", "0"], &["--error", "per cent", ".1%"]),
        (&["--error", "-1"], &["--error", "per cent"]),
        (&["--error", "many"], &["--error", "per cent"]),
        (&["--engine", "classical", "--resolution", "64"], &["--resolution", "classical"]),
        (&["--resolution", "33"], &["33", "even"]),
        (&["--memory", "1K"], &["KiB", "--memory"]),
        (&["--patch-size", "0.0005", "--memory", "100M"], &["100 MiB", "--memory"]),
        (&["--sky", "1,1,1"], &["--sky"]),
    ];
    for (args, parts) in cases {
        let args = [&["factors", "cornell-box", "-o", "F.npz"], *args].concat();
        // Of two outputs the last counts for clap, which refuses it: the second alone is meant.
        let args = if args[4] == "-o" { [&args[..2], &args[4..]].concat() } else { args };
        bench.run(&args).refused(parts);
        assert!(bench.files().is_empty(), "{args:?} left {:?}", bench.files());
    }
}

#[test]
fn an_occluded_room_is_exact_by_default() {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let flags = ["--patch-size", "0.1", "--report", "r.json"];
    let f = factors(&bench, "room.obj", &flags);
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
    assert_eq!(report["engine"]["name"], "exact");
    assert!(report["pairs"]["partly_hidden"].as_u64().is_some_and(|n| n > 0));
    let error = report["pairs"]["error"].as_f64().unwrap();
    assert!(error > 0.0 && error < 2e-3, "{error} where .1 % is asked for");
    let table = bench.path("s.csv");
    let (areas, back) = (numbers(&table, "area"), numbers(&table, "back"));
    let mut beyond = 0;
    for (i, row) in f.iter().enumerate() {
        let sum: f64 = row.iter().sum::<f64>() + back[i];
        let off = (sum - 1.0).abs();
        // At the foot of the crate pairs touch and are hidden in part.
        assert!(off < 5e-3, "row {i}: {sum}, back {}", back[i]);
        beyond += usize::from(off >= 2e-3);
        for (j, there) in row.iter().enumerate() {
            let (there, back) = (areas[i] * there, areas[j] * f[j][i]);
            // Two numbers of single precision, both rounded.
            let rounding = 2.0 * f64::from(f32::EPSILON) * there.max(f64::from(f32::MIN_POSITIVE));
            assert!((there - back).abs() <= rounding, "{i} {j}: {there} {back}");
        }
    }
    assert!(beyond <= 2, "{beyond} rows");
    // Both spellings of an error are the same share.
    let same =
        |error: &str| factors(&bench, "room.obj", &[&flags[..2], &["--error", error]].concat());
    assert!(same(".5") == same("0.5%"));
}

#[test]
fn through_a_file_is_the_same_to_the_byte() {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let run = |file: &str, more: &[&str]| {
        let report = ["-o", file, "--report", "r.json"];
        bench.run(&[&["factors", "room.obj"][..], &report[..], more].concat()).ok();
        let report: serde_json::Value =
            serde_json::from_slice(&fs::read(bench.path("r.json")).unwrap()).unwrap();
        let through = report["through_a_file"].as_bool().unwrap();
        (fs::read(bench.path(file)).unwrap(), through, report["account"].clone())
    };
    let hemicube = ["--patch-size", "0.02", "--engine", "hemicube", "--resolution", "32"];
    let exact = ["--patch-size", "0.02"];
    let thinned = [&hemicube[..], &["--threshold", "0.001"]].concat();
    for (more, memory) in [(&hemicube[..], "14M"), (&thinned, "14M"), (&exact, "25M")] {
        let all = run("a.npz", more);
        let little = run("b.npz", &[more, &["--memory", memory]].concat());
        assert_eq!((all.1, little.1), (false, true), "{more:?}");
        assert!(all.0 == little.0, "{more:?}");
        assert_eq!(all.2, little.2);
    }
    assert_eq!(bench.files(), ["a.npz", "b.npz", "r.json", "room.obj"]);
    let closed = ["factors", "furnace", "--patch-size", "0.004", "--enclosure", "--memory", "40M"];
    bench.run(&[&closed[..], &["-o", "F.npz"]].concat()).refused(&["--enclosure", "in memory"]);
}

#[test]
fn dense_tables_beyond_reason_are_refused_beforehand() {
    let bench = Bench::new();
    bench
        .run(&["factors", "furnace", "--patch-size", "0.001"])
        .refused(&["stdout", "-o F.npz", "--group"]);
}

#[test]
fn render_and_probe_agree_by_exact_factors_and_stored_ones() {
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", ROOM_MATERIALS)
        .with("in.csv", "x,y,z,nx,ny,nz\n1,1,1,0,1,0\n");
    let exact = ["--engine", "exact", "--patch-size", "0.2"];
    bench.run(&[&["factors", "room.obj", "-o", "F.npz"], &exact[2..]].concat()).ok();
    let common = ["--sides", "one", "--emission", "ceiling=1,1,1", "-q"];
    let stored = ["--factors", "F.npz"];
    let picture = |more: &[&str]| {
        let flags = ["render", "room.obj", "--size", "32x24", "--exposure", "0", "-o", "a.png"];
        bench.run(&[&flags[..], &common, more].concat()).ok();
        fs::read(bench.path("a.png")).unwrap()
    };
    assert!(picture(&exact) == picture(&stored));
    let probe = |more: &[&str]| {
        let flags = ["probe", "room.obj", "--points", "in.csv"];
        bench.run(&[&flags[..], &common, more].concat()).ok().stdout
    };
    assert_eq!(probe(&exact), probe(&stored));
}

/// Ctrl-C in the middle of the work.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_work_and_leaves_nothing() {
    use std::process::Stdio;
    use std::time::Duration;

    let bench = Bench::new();
    // Minutes of work; the memory is not touched before the interrupt comes, or a file is.
    let hemicube = ["room", "--patch-size", "0.002", "--engine", "hemicube", "--draw", "patches"];
    let in_memory = [&hemicube[..], &["--memory", "1000G"]].concat();
    let through_a_file = ["cornell-box", "--patch-size", "0.02", "--memory", "200M"];
    for long in [&in_memory[..], &through_a_file] {
        let args = [&["factors", "-o", "F.npz"], long].concat();
        let mut child = bench.command(&args).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        assert!(child.try_wait().unwrap().is_none(), "it ended before the interrupt");
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{output:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("cancelled"));
        assert!(bench.files().is_empty(), "{:?}", bench.files());
    }
}
