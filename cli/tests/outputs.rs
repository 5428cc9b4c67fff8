//! Where results go: nothing that is read, or is no file, is replaced, and nothing half-written
//! stays.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test")]

mod common;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{Bench, CLOSED_ROOM, ROOM_MATERIALS};

const POINTS: &str = "x,y,z,nx,ny,nz\n1,1,1,0,1,0\n";

const EMISSION: [&str; 2] = ["--emission", "ceiling=1,1,1"];

fn room() -> Bench {
    Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", ROOM_MATERIALS)
        .with("in.csv", POINTS)
}

fn make_fifo(bench: &Bench, name: &str) {
    assert!(Command::new("mkfifo").arg(bench.path(name)).status().unwrap().success());
}

#[test]
fn a_full_disk_behind_stdout_is_a_failure() {
    let bench = room();
    let probe = ["probe", "room.obj", "--points", "in.csv", "--samples", "64", "--rays", "256"];
    let commands: [&[&str]; 3] =
        [&["scenes"], &["info", "room.obj"], &[&probe[..], &EMISSION].concat()];
    for args in commands {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let output = bench.command(args).stdout(full).stderr(Stdio::piped()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {stderr}");
        assert!(stderr.contains("cannot write stdout"), "{args:?}: {stderr}");
    }
}

#[test]
fn what_is_read_is_not_overwritten() {
    let ies = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 180\n0\n100 100\n";
    let bench = room().with("lamp.ies", ies);
    symlink("room.obj", bench.path("link.png")).unwrap();
    fs::hard_link(bench.path("room.mtl"), bench.path("hard.json")).unwrap();
    fs::create_dir(bench.path("sub")).unwrap();
    bench.run(&["factors", "room.obj", "-o", "F.npz", "--samples", "64"]).ok();
    let before: Vec<Vec<u8>> = ["room.obj", "room.mtl", "F.npz", "in.csv"]
        .map(|f| fs::read(bench.path(f)).unwrap())
        .into();
    let render = |more: &[&str]| bench.render("room.obj", &[&EMISSION[..], more].concat());
    render(&["-o", "a.png", "--report", "room.mtl"]).refused(&["room.mtl", "--report"]);
    render(&["-o", "a.png", "--report", "sub/../room.mtl"]).refused(&["--report"]);
    render(&["-o", "a.png", "--report", "hard.json"]).refused(&["hard.json", "room.mtl"]);
    let lamp = ["--lamp", "spot=1,1,1,100,lamp.ies", "-o", "a.png", "--report", "lamp.ies"];
    render(&lamp).refused(&["lamp.ies", "--report"]);
    render(&["-o", "link.png"]).refused(&["link.png", "room.obj", "-o"]);
    render(&["-o", "a.png", "--report", "a.png"]).refused(&["a.png", "-o", "--report"]);
    render(&["-o", "a.png", "--report", "./sub/../a.png"]).refused(&["different names"]);
    let common = [&["render", "room.obj", "--factors", "F.npz", "--sides", "one"], &EMISSION[..]];
    let stored = |more: &[&str]| bench.run(&[&common.concat()[..], more].concat());
    stored(&["-o", "a.png", "--report", "F.npz"]).refused(&["F.npz", "--report"]);
    let common = [&["probe", "room.obj", "--points", "in.csv"], &EMISSION[..]].concat();
    bench.run(&[&common[..], &["-o", "in.csv"]].concat()).refused(&["in.csv", "-o"]);
    let factors = |more: &[&str]| bench.run(&[&["factors", "room.obj"][..], more].concat());
    factors(&["-o", "G.csv", "--surfaces", "G.csv"]).refused(&["G.csv", "--surfaces"]);
    factors(&["-o", "G.csv", "--report", "room.obj"]).refused(&["room.obj", "--report"]);
    let after =
        ["room.obj", "room.mtl", "F.npz", "in.csv"].map(|f| fs::read(bench.path(f)).unwrap());
    assert!(before == after);
    assert!(!bench.files().iter().any(|f| f == "a.png" || f == "G.csv"));
}

#[test]
fn a_scenes_own_texture_is_not_overwritten_by_the_usual_name() {
    let mut texture = Vec::new();
    let encoder = png::Encoder::new(&mut texture, 1, 1);
    encoder.write_header().unwrap().write_image_data(&[200]).unwrap();
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("room.mtl", format!("{ROOM_MATERIALS}map_Kd room.png\n"))
        .with("room.png", &texture);
    bench.render("room.obj", &EMISSION).refused(&["room.png", "-o"]);
    assert_eq!(fs::read(bench.path("room.png")).unwrap(), texture);
}

#[test]
fn a_pipe_is_written_into_and_stays_one() {
    let bench = room();
    make_fifo(&bench, "pipe");
    let small =
        [&["render", "room.obj", "-o", "a.png", "--report", "pipe"], &EMISSION[..]].concat();
    let mut run = bench.command(&small).stdout(Stdio::null()).spawn().unwrap();
    let mut report = String::new();
    File::open(bench.path("pipe")).unwrap().read_to_string(&mut report).unwrap();
    assert!(run.wait().unwrap().success());
    assert!(report.starts_with('{') && report.ends_with('}'), "{report}");
    assert!(fs::metadata(bench.path("pipe")).unwrap().file_type().is_fifo());
}

#[test]
fn a_pipe_as_a_model_is_refused_at_once() {
    let bench = Bench::new();
    make_fifo(&bench, "model.obj");
    bench.run(&["info", "model.obj"]).refused(&["model.obj", "pipe"]);
    make_fifo(&bench, "F.npz");
    bench
        .run(&["render", "cornell-box", "--factors", "F.npz", "-o", "a.png"])
        .refused(&["F.npz", "pipe"]);
}

#[test]
fn files_keep_their_mode() {
    let bench = room().with("a.png", "");
    fs::set_permissions(bench.path("a.png"), fs::Permissions::from_mode(0o600)).unwrap();
    bench.render("room.obj", &[&EMISSION[..], &["-o", "a.png"]].concat()).ok();
    let metadata = fs::metadata(bench.path("a.png")).unwrap();
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    assert!(metadata.len() > 100);
}

#[test]
fn a_run_that_is_asked_to_end_leaves_nothing_and_what_killed_ones_left_is_removed() {
    let bench = room().with(".hemicube-killed.tmp", "half");
    let args = ["factors", "room.obj", "--patch-size", "0.002", "--samples", "65536", "-q"];
    let mut command = bench.command(&[&args[..], &["-o", "F.npz"]].concat());
    let mut child = command.stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(700));
    let asked = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(asked.success());
    let start = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(start.elapsed() < Duration::from_secs(20));
    assert_eq!(bench.files(), ["in.csv", "room.mtl", "room.obj"]);
}

#[test]
fn a_file_that_outgrows_its_limit_is_an_error() {
    let bench = room();
    let program = bench.command(&[]).get_program().to_owned();
    for blocks in [0, 1, 5, 8, 12] {
        let script = format!(
            "trap - XFSZ; ulimit -f {blocks}; exec \"$0\" factors room.obj --patch-size 0.05 \
             --samples 64 -q -o F.npz"
        );
        let mut shell = Command::new("sh");
        let output = shell.arg("-c").arg(script).arg(&program).current_dir(bench.path("")).output();
        let output = output.unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{blocks}: {stderr}");
        // Libraries print nothing of their own.
        assert!(stderr.starts_with("error: cannot write F.npz"), "{blocks}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{blocks}: {stderr}");
        assert!(!bench.files().iter().any(|f| f.contains("F.npz") || f.ends_with(".tmp")));
    }
}

#[test]
fn names_cannot_command_the_terminal() {
    let name = "a\u{1b}[31m.obj";
    let bench = Bench::new().with(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let outcome = bench.run(&["info", name]).ok();
    assert!(!outcome.stdout.contains('\u{1b}') && outcome.stdout.contains("a\\u{1b}[31m"));
    let bench = Bench::new().with(name, "f 1 2 3\n");
    let outcome = bench.run(&["info", name]).refused(&["a\\u{1b}[31m.obj"]);
    assert!(!outcome.stderr.contains('\u{1b}'));
}

#[test]
fn paths_that_are_no_text_are_named() {
    let bench = Bench::new();
    let odd = OsStr::from_bytes(b"odd\xff.obj");
    fs::write(bench.path("").join(odd), "f 1 2 3\n").unwrap();
    let mut command = bench.command(&["info"]);
    let output = command.arg(odd).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr.contains("odd\u{fffd}.obj: line 1"), "{stderr}");
    let mut command = bench.command(&["info", "cornell-box", "--ies"]);
    let output = command.arg(OsStr::from_bytes(b"lamp=odd\xff.ies")).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr.contains("lamp=odd\u{fffd}.ies: is not in UTF-8"), "{stderr}");
}

#[test]
fn more_threads_than_can_be_made_are_refused() {
    Bench::new().run(&["render", "cornell-box", "-j", "100000"]).refused(&["100000", "1024"]);
}
