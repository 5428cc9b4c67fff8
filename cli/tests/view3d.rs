//! `hemicube view3d`: its results are those of View3D, in View3D's formats.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::{Bench, Outcome};

/// The corners of a unit cube, and its sides seen from within.
const CORNERS: &str = "V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\n\
                       V 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n";
const SIDES: [&str; 6] = ["1 2 3 4", "8 7 6 5", "1 5 6 2", "4 3 7 8", "1 4 8 5", "2 6 7 3"];

/// Two opposite sides of the cube face each other.
const FACING: &str = "S 1 1 2 3 4 0 0 .5 floor\nS 2 8 7 6 5 0 0 .5 ceiling\n";

fn cube(control: &str, emittance: f64) -> String {
    let sides = (1..).zip(SIDES);
    let sides: String =
        sides.map(|(k, v)| format!("S {k} {v} 0 0 {emittance} side{k}\n")).collect();
    format!("T a cube\nC {control}\nF 3\n{CORNERS}{sides}End\n")
}

/// A room like an L, each leg 3 m long and 1 m wide, 3 m high; floor and ceiling in three squares.
fn l_shaped(control: &str) -> String {
    let outline = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]];
    // The corners of the squares follow those of the outline.
    let plan = [&outline[..], &[[1, 0], [0, 1]]].concat();
    let mut text = format!("C {control}\nF 3\n");
    for (k, [x, y]) in plan.iter().enumerate() {
        text += &format!("V {} {x} {y} 0\nV {} {x} {y} 3\n", 2 * k + 1, 2 * k + 2);
    }
    for k in 0..6 {
        let (a, b) = (2 * k + 1, 2 * ((k + 1) % 6) + 1);
        text += &format!("S {} {a} {} {} {b} 0 0 .9 wall{k}\n", k + 1, a + 1, b + 1);
    }
    // Floors run counter-clockwise seen from above.
    let squares = [[0, 6, 3, 7], [6, 1, 2, 3], [7, 3, 4, 5]];
    for (level, first) in [(0, 7), (1, 10)] {
        for (k, square) in squares.iter().enumerate() {
            let mut corners = square.map(|c| 2 * c + 1 + level);
            if level == 1 {
                corners.reverse();
            }
            let corners = corners.map(|c| c.to_string()).join(" ");
            let combined = if k == 0 { 0 } else { first };
            text += &format!("S {} {corners} 0 {combined} .9 level{level}\n", first + k);
        }
    }
    text + "End of data\n"
}

/// A table as text: areas, rows and emittances.
struct Table {
    header: String,
    areas: Vec<f64>,
    rows: Vec<Vec<f64>>,
    emittances: Vec<f64>,
}

fn table(bench: &Bench, name: &str) -> Table {
    let text = fs::read_to_string(bench.path(name)).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    let mut numbers: Vec<Vec<f64>> =
        lines.map(|l| l.split(' ').map(|w| w.parse().unwrap()).collect()).collect();
    let emittances = numbers.pop().unwrap();
    let areas = numbers.remove(0);
    assert!(numbers.len() == areas.len() && numbers.iter().all(|r| r.len() == areas.len()));
    Table { header, areas, rows: numbers, emittances }
}

fn run(bench: &Bench, more: &[&str]) -> Outcome {
    let outcome = bench.run(&[&["view3d", "in.vs3", "out"], more].concat()).ok();
    assert_eq!(outcome.stdout, "out\n");
    outcome
}

fn factors(text: &str) -> Table {
    let bench = Bench::new().with("in.vs3", text);
    run(&bench, &[]);
    assert_eq!(bench.files(), ["in.vs3", "out"], "something is left behind");
    table(&bench, "out")
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

#[test]
fn a_cube_has_its_exact_factors() {
    let found = factors(&cube("encl=1", 0.5));
    assert_eq!(found.header, "View3D 4.0-hemicube 0 1 0 6   ");
    assert_eq!((found.areas, found.emittances), (vec![1.0; 6], vec![0.5; 6]));
    for (i, row) in found.rows.iter().enumerate() {
        for (j, &f) in row.iter().enumerate() {
            let exact = match (i == j, i / 2 == j / 2) {
                (true, _) => 0.0,
                (_, true) => 0.199_825,
                _ => 0.200_044,
            };
            assert_close(f, exact, 1.1e-6);
        }
    }
}

#[test]
fn obstructions_block_both_ways_and_have_no_row() {
    let blocker = "V 9 0 0 .5\nV 10 .5 0 .5\nV 11 .5 .5 .5\nV 12 0 .5 .5\n";
    for obstruction in ["S 3 9 10 11 12 0 0 .5 x", "O 3 9 10 11 12", "O 3 12 11 10 9 more words"] {
        let found = factors(&format!("C encl=0\n{CORNERS}{blocker}{FACING}{obstruction}\n"));
        let rows = if obstruction.starts_with('S') { 3 } else { 2 };
        assert_eq!(found.rows.len(), rows, "{obstruction}");
        assert_close(found.rows[0][1], 0.149_868_672, 1e-5);
        assert_close(found.rows[1][0], 0.149_868_672, 1e-5);
    }
}

#[test]
fn combined_surfaces_have_one_row() {
    let found = factors(&l_shaped("encl=1 eps=1e-4"));
    assert_eq!(found.header, "View3D 4.0-hemicube 0 1 0 8   ");
    assert_eq!(found.areas, [9.0, 3.0, 6.0, 6.0, 3.0, 9.0, 5.0, 5.0]);
    // Pinney & Bean (1988), test 4: the two long walls.
    assert_close(found.rows[0][5], 0.182_355_9, 1e-5);
    for row in &found.rows {
        assert_close(row.iter().sum(), 1.0, 4e-6);
    }
}

#[test]
fn both_ways_to_give_surfaces_agree() {
    let placed = "F 3a\nS 1 R 0 0 .9 south\n 3 0 0 0 90  3 3\n\
                  S 2 R 0 0 .9 north\n 0 2 0 180 90 3 3\n\
                  S 3 Q 0 0 .9 floor\n 0 0 0 180 0\n 0 0 3 0 3 2 0 2\n\
                  S 4 T 0 3 .9 x\n 0 0 1.5 0 0\n 0 0 -1 0 -1 -1\n";
    let listed = "F 3\nV 1 0 0 0\nV 2 3 0 0\nV 3 3 2 0\nV 4 0 2 0\n\
                  V 5 0 0 3\nV 6 3 0 3\nV 7 3 2 3\nV 8 0 2 3\nV 9 0 0 1.5\nV 10 1 0 1.5\n\
                  V 11 1 1 1.5\nS 1 6 2 1 5 0 0 .9 south\nS 2 8 4 3 7 0 0 .9 north\n\
                  S 3 1 2 3 4 0 0 .9 floor\nS 4 9 10 11 0 0 3 .9 x\n";
    let [placed, listed] = [placed, listed].map(factors);
    assert_eq!(placed.areas, listed.areas);
    assert!(listed.rows[0][1] > 0.1);
    for (a, b) in placed.rows.iter().flatten().zip(listed.rows.iter().flatten()) {
        assert_close(*a, *b, 2e-5);
    }
}

/// What uDALES writes: a box of triangles in a street, with line ends of Windows.
fn street(out: u8, more: &str) -> String {
    let mut text = format!("T\r\nC out={out} {more}row=0 col=0\r\nF 3\r\n!    #      x      y\r\n");
    let corners = ["0 0", "9 0", "9 9", "0 9", "3 3", "6 3", "6 6", "3 6"];
    let heights = [0, 0, 0, 0, 0, 0, 0, 0];
    for (k, (corner, z)) in corners.iter().zip(heights).enumerate() {
        text += &format!("V {:4} {corner} {z}.000000\r\n", k + 1);
    }
    for (k, corner) in corners[4..].iter().enumerate() {
        text += &format!("V {:4} {corner} 2.000000\r\n", k + 9);
    }
    let quads = [
        "1 2 6 5",
        "2 3 7 6",
        "3 4 8 7",
        "4 1 5 8",
        "5 6 10 9",
        "6 7 11 10",
        "7 8 12 11",
        "8 5 9 12",
        "9 10 11 12",
    ];
    let mut n = 0;
    for quad in quads {
        let v: Vec<&str> = quad.split(' ').collect();
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            n += 1;
            text += &format!(
                "S {n:4} {:>6} {:>6} {:>6}      0      0      0      0 {n:6}f\r\n",
                v[a], v[b], v[c]
            );
        }
    }
    text + "End of Data\r\n"
}

#[test]
fn a_file_of_udales_is_answered_with_a_list() {
    let bench = Bench::new().with("in.vs3", street(2, "maxD=500.0 "));
    let said = run(&bench, &[]).stderr;
    assert_eq!(said.matches("emittance is below").count(), 1, "{said}");
    assert!(said.contains("18 surfaces, 18 rows") && said.contains("error about"), "{said}");
    let text = fs::read_to_string(bench.path("out")).unwrap();
    let list: Vec<(usize, usize, f64)> = text
        .lines()
        .map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            assert!(words.len() == 3 && words[2].len() == 8, "{line}");
            (words[0].parse().unwrap(), words[1].parse().unwrap(), words[2].parse().unwrap())
        })
        .collect();
    let dense = factors(&street(0, ""));
    for (i, row) in dense.rows.iter().enumerate() {
        for (j, &f) in row.iter().enumerate() {
            let listed = list.iter().find(|e| (e.0, e.1) == (i + 1, j + 1)).map_or(0.0, |e| e.2);
            assert_eq!(listed, f, "{i} {j}");
        }
    }
    assert!(list.iter().all(|e| e.2 > 0.0) && list.len() > 20, "{list:?}");
    // The binary file has the same in single precision.
    let bench = Bench::new().with("in.vs3", street(1, ""));
    run(&bench, &["-q"]);
    let bytes = fs::read(bench.path("out")).unwrap();
    assert_eq!(&bytes[..32], b"View3D 4.0-hemicube 1 0 0 18  \r\n");
    let numbers = bytes[32..].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
    let numbers: Vec<f64> = numbers.map(f64::from).collect();
    assert_eq!(numbers.len(), 18 * 20);
    let emittances = &numbers[18 * 19..];
    assert!(emittances.iter().all(|e| (e - 0.001).abs() < 1e-9));
    for (found, expected) in numbers.iter().zip(dense.areas.iter()) {
        assert_close(*found, *expected, 1e-4);
    }
    for (found, expected) in numbers[18..].iter().zip(dense.rows.iter().flatten()) {
        assert_close(*found, *expected, 5.1e-7);
    }
}

#[test]
fn what_is_far_away_exchanges_nothing() {
    let (all, near) = (factors(&street(0, "")), factors(&street(0, "maxD=3.5 ")));
    let lost = |t: &Table| t.rows.iter().flatten().filter(|f| **f == 0.0).count();
    assert!(lost(&near) > lost(&all), "{} {}", lost(&near), lost(&all));
    let kept = all.rows.iter().flatten().zip(near.rows.iter().flatten());
    assert!(kept.into_iter().all(|(a, b)| a == b || *b == 0.0));
    let bench = Bench::new().with("in.vs3", cube("encl=1 maxD=3", 0.5));
    bench.run(&["view3d", "in.vs3", "out"]).refused(&["in.vs3", "encl=1", "maxD"]);
}

#[test]
fn a_row_or_a_factor_can_be_asked_for() {
    let whole = factors(&l_shaped("out=0"));
    let bench = Bench::new().with("in.vs3", l_shaped("row=6"));
    run(&bench, &[]);
    let text = fs::read_to_string(bench.path("out")).unwrap();
    let row: Vec<f64> = text.lines().map(|line| line.parse().unwrap()).collect();
    assert!(text.lines().all(|line| line.len() == 7) && row.len() == 8, "{text}");
    for (found, expected) in row.iter().zip(&whole.rows[5]) {
        assert_close(*found, *expected, 5.6e-6);
    }
    let bench = Bench::new().with("in.vs3", l_shaped("row=1 col=6"));
    run(&bench, &[]);
    assert_eq!(fs::read_to_string(bench.path("out")).unwrap(), "0.18236\n");
    let bench = Bench::new().with("in.vs3", l_shaped("row=1 emit=1"));
    bench.run(&["view3d", "in.vs3", "out"]).refused(&["in.vs3", "emit=1", "row"]);
}

/// A room with a window in a wall, as energyplus-viewfactors writes it.
fn zone(window: bool) -> String {
    let corners = "0 0 0, 4 0 0, 4 3 0, 0 3 0, 0 0 2.5, 4 0 2.5, 4 3 2.5, 0 3 2.5, \
                   1 0 .8, 3 0 .8, 3 0 2, 1 0 2";
    let mut text = String::from("C\tencl=1\tlist=1\t\n!\t#\tx\ty\tz\t\n");
    for (k, corner) in corners.split(", ").enumerate() {
        text += &format!("V\t{}\t{}\t\n", k + 1, corner.replace(' ', "\t"));
    }
    text += "!\t#\tv1\tv2\tv3\tv4\tbase\tcmb\temit\tname\t\n";
    for (k, side) in SIDES.iter().enumerate() {
        let side = side.replace(' ', "\t");
        text += &format!("S\t{}\t{side}\t0\t0\t0.9\tZn001:Wall {}\t\n", k + 1, k + 1);
    }
    if window {
        text += "S\t7\t12\t11\t10\t9\t3\t0\t0.84\tZn001:Window 1\t\n";
    }
    text + "End of Data\n"
}

#[test]
fn a_window_takes_its_part_of_the_wall() {
    let (plain, found) = (factors(&zone(false)), factors(&zone(true)));
    assert_eq!(found.areas, [12.0, 12.0, 7.6, 10.0, 7.5, 7.5, 2.4]);
    assert_eq!(found.emittances[6], 0.84);
    let (wall, window) = (2, 6);
    for i in (0..6).filter(|&i| i != wall) {
        // Both are seen as one, and see as one.
        assert_close(found.rows[i][wall] + found.rows[i][window], plain.rows[i][wall], 5e-6);
        let both = (7.6 * found.rows[wall][i] + 2.4 * found.rows[window][i]) / 10.0;
        assert_close(both, plain.rows[wall][i], 5e-6);
    }
    assert_eq!((found.rows[wall][window], found.rows[window][wall]), (0.0, 0.0));
    for (i, row) in found.rows.iter().enumerate() {
        assert_close(row.iter().sum(), 1.0, 4e-6);
        for (j, f) in row.iter().enumerate() {
            assert_close(found.areas[i] * f, found.areas[j] * found.rows[j][i], 1.3e-5);
        }
    }
    let bench = Bench::new().with("in.vs3", zone(true));
    let said = run(&bench, &[]).stderr;
    assert!(said.contains("2.400000          1.000000  Zn001:Window 1"), "{said}");
    assert_eq!(run(&bench, &["--quiet"]).stderr, "");
}

#[test]
fn grey_surfaces_of_a_cube_exchange_in_closed_form() {
    // The matrix of a cube keeps what all sides have alike, what sums to zero over three pairs, and
    // what opposite sides have with opposite signs.
    let (e, opposite) = (0.3, 0.199_824_896);
    let adjacent = (1.0 - opposite) / 4.0;
    let factor = |lambda: f64| e * e * lambda / (1.0 - (1.0 - e) * lambda);
    let (all, pairs, signs) = (factor(1.0), factor(opposite - 2.0 * adjacent), factor(-opposite));
    let exact = |i: usize, j: usize| match (i == j, i / 2 == j / 2) {
        (true, _) => all / 6.0 + pairs / 3.0 + signs / 2.0,
        (_, true) => all / 6.0 + pairs / 3.0 - signs / 2.0,
        _ => all / 6.0 - pairs / 6.0,
    };
    let found = factors(&cube("encl=1 emit=1", e));
    assert_eq!(found.header, "View3D 4.0-hemicube 0 1 1 6   ");
    for (i, row) in found.rows.iter().enumerate() {
        for (j, &f) in row.iter().enumerate() {
            assert_close(f, exact(i, j), 1.5e-6);
        }
        assert_close(row.iter().sum(), e, 4e-6);
    }
    // Between wide plates close together: 1 / (1/e1 + 1/e2 - 1).
    let plates = format!(
        "C emit=1 eps=1e-5\n{}{}",
        CORNERS.replace(" 1\n", " .0001\n"),
        FACING.replace(".5 ceiling", ".8 ceiling")
    );
    let found = factors(&plates);
    assert_close(found.rows[0][1], 1.0 / (1.0 / 0.5 + 1.0 / 0.8 - 1.0), 2e-4);
    assert_eq!(found.emittances, [0.5, 0.8]);
    let bench = Bench::new().with("in.vs3", l_shaped("emit=1"));
    run(&bench, &[]);
    let said = bench.run(&["view3d", "in.vs3", "out", "--memory", "1K"]);
    said.refused(&["in.vs3", "--memory"]);
}

#[cfg(unix)]
#[test]
fn the_program_may_be_called_view3d() {
    let bench = Bench::new().with("in.vs3", cube("encl=1", 0.5));
    run(&bench, &[]);
    let expected = fs::read(bench.path("out")).unwrap();
    for name in ["view3d", "View3D"] {
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_hemicube"), bench.path(name)).unwrap();
        let called = bench.path(name);
        let mut command = std::process::Command::new(&called);
        command.current_dir(called.parent().unwrap()).args(["in.vs3", "by-name"]);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{output:?}");
        assert_eq!(fs::read(bench.path("by-name")).unwrap(), expected);
        let output = std::process::Command::new(&called).arg("in.vs3").output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(&format!("Usage: {name} <INPUT> <OUTPUT>")), "{said}");
    }
}

#[test]
fn a_surface_that_is_given_again_has_its_area_and_no_factors() {
    let text = format!("C list=1\n{CORNERS}{FACING}S 3 2 3 4 1 0 0 .5 again\n");
    let bench = Bench::new().with("in.vs3", text);
    let said = run(&bench, &[]).stderr;
    let found = table(&bench, "out");
    assert_eq!(found.areas, [1.0; 3]);
    assert_close(found.rows[0][1], 0.199_824_9, 1e-5);
    assert_close(found.rows[1][0], 0.199_824_9, 1e-5);
    assert_eq!((&found.rows[2][..], found.rows[1][2]), (&[0.0; 3][..], 0.0));
    assert_eq!(said.matches("warning:").count(), 1, "{said}");
    assert!(said.contains("line 12: is an earlier surface again"), "{said}");
    assert!(said.contains("3       1.000000          0.000000  again"), "{said}");
}

#[test]
fn bad_files_end_with_one_message() {
    let refuse = |text: &str, parts: &[&str]| {
        let bench = Bench::new().with("in.vs3", text);
        bench.run(&["view3d", "in.vs3", "out"]).refused(&[&["in.vs3"], parts].concat());
        assert_eq!(bench.files(), ["in.vs3"]);
    };
    refuse("", &["is empty"]);
    refuse(&format!("{CORNERS}S 1 1 2 3 4 0 0 .9 a\nS 2 1 2 9 4 0 0 .9 b\n"), &["line 10", "8"]);
    refuse(&format!("{CORNERS}S 1 1 2 3 0 0 .9 a\n"), &["line 9", "triangle"]);
    refuse(&format!("{CORNERS}S 1 1 3 2 4 0 0 .9 a\n"), &["line 9", "surface 1 cross"]);
    refuse(&format!("{CORNERS}S 1 1 1 2 0 0 0 .9 a\n"), &["line 9", "at one place"]);
    refuse(&format!("{CORNERS}S 1 1 2 3 0 0 0 2 a\n"), &["line 9", "emittance 2"]);
    refuse(&format!("C encl=1\n{CORNERS}{FACING}"), &["no enclosure", "encl=0"]);
    let outside: Vec<String> = (1..)
        .zip(SIDES)
        .map(|(k, side)| {
            let turned: Vec<&str> = side.split(' ').rev().collect();
            format!("S {k} {} 0 0 .5 side{k}\n", turned.join(" "))
        })
        .collect();
    refuse(&format!("C encl=1\n{CORNERS}{}", outside.concat()), &["outwards", "from inside"]);
    let bench = Bench::new().with("in.vs3", cube("encl=1", 0.5));
    bench.run(&["view3d", "none.vs3", "out"]).refused(&["none.vs3", "cannot be read"]);
    bench.run(&["view3d", "in.vs3", "in.vs3"]).refused(&["in.vs3", "is read by this run"]);
    bench.run(&["view3d", "in.vs3", "no/out"]).refused(&["no", "no such folder"]);
}

#[test]
fn a_view3d_file_is_a_model_for_other_commands() {
    let bench = Bench::new().with("room.vs3", format!("{CORNERS}{FACING}O 3 1 2 6 5\n"));
    let info = bench.run(&["info", "room.vs3"]).ok().stdout;
    assert!(info.contains("obstructions that only block: 2 of 6"), "{info}");
    assert!(info.contains("emittance 0.5"), "{info}");
    let found = bench.run(&["factors", "room.vs3", "--group", "-q"]).ok().stdout;
    assert!(found.starts_with("from,floor,ceiling\n"), "{found}");
    for engine in ["classical", "hemicube", "rays"] {
        let found = bench.run(&["factors", "room.vs3", "--engine", engine, "-q"]).ok().stdout;
        assert_eq!(found.lines().count(), 5, "{engine}: {found}");
    }
    let drawn = |row| ["factors", "room.vs3", "--surfaces", "a.vtu", "--row", row, "-q"];
    for more in [&[][..], &["--group"]] {
        let refused = bench.run(&[&drawn("obstruction 3")[..], more].concat());
        let refused = refused.refused(&["--row obstruction 3", "floor", "ceiling"]);
        assert_eq!(refused.stderr.matches("obstruction").count(), 1, "{refused:?}");
        bench.run(&[&drawn("floor")[..], more].concat()).ok();
    }
    // A solution keeps what only blocks.
    let solve = ["solve", "room.vs3", "--emission", "emittance 0.5=1,1,1", "--patch-size", ".1"];
    bench.run(&[&solve[..], &["-o", "room.hemi", "-q"]].concat()).ok();
    let kept = bench.run(&["info", "room.hemi"]).ok().stdout;
    assert!(kept.contains("obstructions that only block: 2 of 6"), "{kept}");
}
