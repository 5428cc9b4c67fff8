//! `hemicube factors`: the files that it writes, who reads them, and what is refused.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "a test")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::matrix::{named_room, room_with_crate};
use common::{Bench, CLOSED_ROOM, ROOM_MATERIALS};

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

/// Whether Python has SciPy here. Without it the test is skipped, visibly, unless
/// `HEMICUBE_REQUIRE_SCIPY=1` is set.
fn has_scipy() -> bool {
    let import = Command::new("python3").args(["-c", "import scipy.sparse, scipy.io"]).output();
    let missing = match import {
        Ok(output) if output.status.success() => return true,
        Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
        Err(e) => e.to_string(),
    };
    let required = std::env::var("HEMICUBE_REQUIRE_SCIPY").is_ok_and(|v| v == "1");
    assert!(!required, "HEMICUBE_REQUIRE_SCIPY=1, but: {missing}");
    eprintln!("SKIPPED, python3 has no SciPy: {missing}");
    false
}

/// The block of Python that the documents show, of which `F` and `A` are left.
fn documented_python() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let docs = fs::read_dir(root.join("docs")).unwrap().map(|file| file.unwrap().path());
    let blocks = |path: PathBuf| {
        let text = fs::read_to_string(path).unwrap_or_default();
        let blocks = text.split("```python\n").skip(1).filter_map(|b| b.split("```").next());
        blocks.map(str::to_owned).collect::<Vec<_>>()
    };
    let mut found = [root.join("README.md")].into_iter().chain(docs).flat_map(blocks);
    found.find(|block| block.contains("load_npz")).unwrap()
}

#[test]
fn scipy_reads_what_is_written() {
    if !has_scipy() {
        return;
    }
    let bench = Bench::new().with("room.obj", room_with_crate()).with("empty.obj", named_room());
    let made = ["--patch-size", "0.2", "--samples", "256"];
    for file in ["F.npz", "F.mtx", "F.npy", "F.csv"] {
        let table = ["--surfaces", "surfaces.csv"];
        bench.run(&[&["factors", "room.obj", "-o", file], &made[..], &table].concat()).ok();
    }
    bench.run(&[&["factors", "room.obj", "-o", "G.npz", "--group"], &made[..]].concat()).ok();
    let closed = ["factors", "empty.obj", "-o", "C.npz", "--enclosure", "--patch-size", "0.2"];
    bench.run(&[&closed[..], &made[2..]].concat()).ok();
    let script = documented_python()
        + "
import csv, json, scipy.io
assert scipy.sparse.issparse(F) and F.format == 'csr' and F.has_sorted_indices, F
assert F.dtype == np.float32 and F.nnz > 1000, F
D = F.toarray()
assert np.array_equal(D, np.load('F.npy'))
assert np.allclose(D, scipy.io.mmread('F.mtx').toarray(), rtol=1e-7, atol=0)
C = np.genfromtxt('F.csv', delimiter=',', skip_header=1)[:, 1:]
assert np.array_equal(D, C.astype(np.float32))
z = np.load('F.npz')
assert json.loads(z['hemicube'].item())['engine'] == 'rays'
account = D.sum(1, dtype=float) + z['back'] + z['environment']
assert abs(account - 1).max() < 1e-5
table = list(csv.DictReader(open('surfaces.csv')))
assert A.dtype == float and np.array_equal(A, [float(row['area']) for row in table])
ceiling = [row['name'] == 'ceiling' for row in table]
assert abs(A[ceiling].sum() - 4) < 1e-9
# The room of 2 m, and five faces of the crate of .6 m on its floor.
assert abs(A.sum() - 24 - 5 * .36) < 1e-9
G = np.load('G.npz')
assert list(G['names'])[0] == 'floor' and scipy.sparse.load_npz('G.npz').dtype == float
closed, areas = scipy.sparse.load_npz('C.npz'), np.load('C.npz')['area']
exchange = closed.multiply(areas[:, None]).toarray()
assert abs(closed.sum(1) - 1).max() < 1.1e-9
assert np.allclose(exchange, exchange.T, rtol=1e-13, atol=0)
";
    let python = Command::new("python3").current_dir(bench.path("")).args(["-c", &script]).output();
    let output = python.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let bench = Bench::new().with("room.obj", room_with_crate());
    let run = |threads: &str, more: &[&str]| {
        let flags = ["factors", "room.obj", "--patch-size", "0.1", "-o", "F.npz", "-j", threads];
        bench.run(&[&flags[..], more].concat()).ok();
        fs::read(bench.path("F.npz")).unwrap()
    };
    let exact: &[&str] = &["--engine", "exact"];
    for more in [
        exact,
        &["--samples", "128", "--threshold", "0.001"],
        &["--engine", "hemicube", "--resolution", "32"],
        &["--engine", "classical"],
    ] {
        assert!(run("1", more) == run("3", more), "{more:?}");
    }
    let closed = Bench::new().with("room.obj", named_room());
    let run = |threads: &str| {
        let flags = ["--enclosure", "--patch-size", "0.1", "-o", "F.npz", "-j", threads];
        closed.run(&[&["factors", "room.obj"], &flags[..]].concat()).ok();
        fs::read(closed.path("F.npz")).unwrap()
    };
    assert!(run("1") == run("3"), "closed");
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
    bench.run(&[&closed[..], &["-o", "F.npz"]].concat()).refused(&[
        "40 MiB are allowed",
        "--memory",
        "--enclosure",
        "through a file",
    ]);
}

#[test]
fn dense_tables_beyond_reason_are_refused_beforehand() {
    let bench = Bench::new();
    bench
        .run(&["factors", "furnace", "--patch-size", "0.001"])
        .refused(&["stdout", "-o F.npz", "--group"]);
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
        (
            &["--engine", "rays", "--strict"],
            &["--strict", "error that is stated", "--engine exact"],
        ),
        (&["--samples", "64", "--strict"], &["--strict", "--engine exact"]),
        (&["--resolution", "64", "--strict"], &["--strict", "--engine exact"]),
        (&["--engine", "classical", "--strict"], &["--strict", "--engine exact"]),
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

#[test]
fn the_report_compares_a_sparse_file_with_a_dense_array() {
    let bench = Bench::new().with("room.obj", named_room());
    let of = |args: &[&str]| {
        let made = ["factors", "room.obj", "--patch-size", "0.1", "--report", "r.json"];
        let said = bench.run(&[&made[..], args].concat()).ok().stderr;
        assert!(!said.contains("dense"), "it is small: {said}");
        let report = fs::read(bench.path("r.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&report).unwrap()
    };
    let (plain, closed) = (of(&["-o", "F.npz"]), of(&["-o", "C.npz", "--enclosure"]));
    for (report, file, number) in [(plain, "F.npz", 4), (closed, "C.npz", 8)] {
        let [n, entries] = ["rows", "entries"].map(|name| report[name].as_u64().unwrap());
        let bytes = |name: &str| report["npz"][name].as_u64();
        assert_eq!(bytes("file_bytes"), Some(fs::metadata(bench.path(file)).unwrap().len()));
        assert_eq!(bytes("read_bytes"), Some(entries * (number + 4) + 4 * (n + 1)));
        assert_eq!(bytes("dense_bytes"), Some(n * n * number));
    }
    assert!(of(&["-o", "F.npy"])["npz"].is_null());
}
