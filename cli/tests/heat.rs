//! `hemicube heat`: what is given by name, what is refused, and the files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::Bench;
use common::matrix::{column, named_room, numbers};

const SIGMA: f64 = 5.670_374_419e-8;

/// A sheet of a square metre that faces upwards, alone.
const SHEET: &str = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\ng sheet\nf 4 3 2 1\n";

fn near(found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
}

#[test]
fn a_sheet_in_the_sun_has_the_temperature_that_its_paint_gives_it() {
    let bench = Bench::new().with("sheet.obj", SHEET);
    let sun = ["heat", "sheet.obj", "--environment", "0", "--sun", "0,30,1361"];
    let paint = ["--emissivity", ".8", "--absorptance", ".25", "--surfaces", "s.csv"];
    let absorbed = 0.25 * 1361.0 * 0.5;
    for (sides, emitting) in [("one", 1.0), ("two", 2.0)] {
        bench.run(&[&sun[..], &paint, &["--sides", sides, "-o", "f.csv"]].concat()).ok();
        let exact = (absorbed / (0.8 * emitting) / SIGMA).powf(0.25);
        let temperatures = numbers(&bench.path("s.csv"), "temperature_K");
        assert_eq!(temperatures.len() as f64, emitting);
        temperatures.iter().for_each(|t| near(*t, exact));
        near(numbers(&bench.path("s.csv"), "sunlight_W")[0], absorbed);
        // The back gives away what the front takes.
        let net: f64 = numbers(&bench.path("s.csv"), "net_W").iter().sum();
        assert!(net.abs() < 1e-9 * absorbed, "{net}");
        assert_eq!(numbers(&bench.path("f.csv"), "temperature_K").len() as f64, 2.0 * emitting);
    }
    // Another paint on the back, which the sun does not see.
    let back =
        ["--sides", "two", "--emissivity", "sheet (back)=.1", "--absorptance", "sheet (back)=1"];
    bench.run(&[&sun[..], &paint, &back].concat()).ok();
    let exact = (absorbed / 0.9 / SIGMA).powf(0.25);
    near(numbers(&bench.path("s.csv"), "temperature_K")[1], exact);
}

#[test]
fn names_are_surfaces_materials_and_objects() {
    let text = named_room().replacen("g floor", "usemtl clay\ng floor", 1);
    let bench = Bench::new().with("room.obj", text);
    let base = ["heat", "room.obj", "--emissivity", "1", "--temperature", "clay=300"];
    let all = bench.run(&base).ok();
    assert!(all.stdout.starts_with("surface,area_m2,temperature_K"));
    // All of one temperature: nothing flows.
    assert!(all.stderr.contains("energy: 0 W supplied, 0 W taken away"), "{}", all.stderr);
    let more =
        ["--flux", "floor=100", "--temperature", "ceiling=280", "--temperature", "north=280"];
    let twice = bench.run(&[&base[..], &more].concat());
    twice.refused(&["floor has a --temperature and a --flux"]);
    let given = ["--flux", "floor=100", "--temperature", "ceiling=280", "--emissivity", ".9"];
    let given = [&["heat", "room.obj", "--surfaces", "s.csv"][..], &given].concat();
    let found = bench.run(&given).ok();
    assert!(found.stderr.contains("adiabatic"), "{}", found.stderr);
    assert!(found.stderr.contains("north, east"), "{}", found.stderr);
    let surfaces = column(&bench.path("s.csv"), "surface");
    let net = numbers(&bench.path("s.csv"), "net_W");
    let of = |name: &str| net[surfaces.iter().position(|s| s == name).unwrap()];
    near(of("floor"), 400.0);
    near(of("ceiling"), -400.0);
    assert_eq!(of("east"), 0.0);
}

#[test]
fn conductors_and_gebhart_factors_say_where_heat_goes() {
    let bench = Bench::new().with("room.obj", named_room());
    let files = ["--gebhart", "B.csv", "--conductors", "GR.csv", "--surfaces", "s.csv"];
    let given = ["--group", "--emissivity", ".6", "--emissivity", "floor=.9", "--temperature"];
    let walls = ["floor=320", "north=300", "east=300", "south=300", "west=300", "ceiling=290"];
    let mut args = [&["heat", "room.obj"][..], &files, &given[..5]].concat();
    walls.iter().for_each(|wall| args.extend(["--temperature", wall]));
    bench.run(&args).ok();
    let (path, names) = (bench.path("GR.csv"), column(&bench.path("s.csv"), "surface"));
    let conductors = numbers(&path, "GR_m2");
    assert_eq!(conductors.len(), 15, "each pair once");
    assert_eq!(column(&path, "from")[0], names[0]);
    let temperature = |i: f64| {
        let name = &names[i as usize];
        walls.iter().find(|w| w.starts_with(name)).unwrap().rsplit_once('=').unwrap().1
    };
    let power = |i: f64| SIGMA * temperature(i).parse::<f64>().unwrap().powi(4);
    let mut heat = [0.0; 6];
    let pairs = numbers(&path, "i").into_iter().zip(numbers(&path, "j")).zip(conductors);
    for ((i, j), conductor) in pairs {
        let flows = conductor * (power(i) - power(j));
        heat[i as usize] += flows;
        heat[j as usize] -= flows;
    }
    for (heat, net) in heat.iter().zip(numbers(&bench.path("s.csv"), "net_W")) {
        assert!((heat - net).abs() < 1e-9 * 500.0, "{heat} {net}");
    }
    let shares = fs::read_to_string(bench.path("B.csv")).unwrap();
    for row in shares.lines().skip(1) {
        let sum: f64 = row.split(',').skip(1).map(|b| b.parse::<f64>().unwrap()).sum();
        near(sum, 1.0);
    }
}

#[test]
fn what_cannot_be_answered_is_refused_with_its_remedy() {
    let mirror = "newmtl chrome\nKd .5 .5 .5\nKs 1 1 1\nillum 3\n";
    let shiny = SHEET.replace("g sheet", "mtllib m.mtl\nusemtl chrome\ng sheet");
    let bench = Bench::new()
        .with("room.obj", named_room())
        .with("sheet.obj", SHEET)
        .with("shiny.obj", shiny)
        .with("m.mtl", mirror);
    let refused = |args: &[&str], parts: &[&str]| {
        bench.run(&[&["heat"][..], args].concat()).refused(parts);
    };
    refused(&["room.obj"], &["no emissivity is given for ceiling, east", "--emissivity NAME=E"]);
    refused(&["room.obj", "--emissivity", "floor=.9"], &["no emissivity is given for ceiling"]);
    refused(
        &["room.obj", "--emissivity", "-0.1"],
        &["--emissivity -0.1", "is not between 0 and 1"],
    );
    refused(&["room.obj", "--emissivity", "floor=1.5"], &["floor=1.5"]);
    refused(&["room.obj", "--emissivity", "floor=nan"], &["floor=nan"]);
    refused(&["room.obj", "--emissivity", "=1"], &["write it like wall=0.9"]);
    let e = |more: &[&'static str]| [&["room.obj", "--emissivity", ".9"][..], more].concat();
    refused(&e(&["--temperature", "300"]), &["says not what"]);
    refused(&e(&["--temperature", "floor=20C"]), &["'floor=20C' is no temperature in K"]);
    refused(&e(&["--flux", "floor=much"]), &["'floor=much' is no flux in W/m2"]);
    refused(&e(&["--flux", "floor=1e200"]), &["floor=1e200", "is no flux"]);
    refused(&e(&["--temperature", "floor (back)=300"]), &["floor (back)", "--sides two"]);
    let twice = e(&["--temperature", "floor=300", "--temperature", "floor=301"]);
    refused(&twice, &["--temperature floor: is given twice"]);
    let cold = e(&["--temperature", "floor=300", "--flux", "ceiling=-9000"]);
    refused(&cold, &["ceiling (row", "more heat is taken away than arrives"]);
    refused(&e(&["--temperature", "roof=300"]), &["roof", "it has the surfaces floor"]);
    refused(&e(&["--temperature", "floor=-3"]), &["floor=-3", "no temperature in K"]);
    refused(&e(&["--flux", "floor=10"]), &["no temperature settles", "--environment"]);
    refused(&e(&["--environment", "-1"]), &["--environment -1"]);
    refused(&e(&["--sun", "180,45"]), &["'180,45' is no sun", "135,40,1000"]);
    refused(&e(&["--diffuse-sun", "-1"]), &["--diffuse-sun -1", "no irradiance"]);
    refused(&e(&["-o", "faces.xls"]), &["faces.xls", ".csv or .vtu"]);
    refused(&e(&["--conductors", "gr.txt"]), &["gr.txt", ".csv"]);
    refused(&e(&["--gebhart", "b.txt"]), &["b.txt", ".npz"]);
    refused(&e(&["--gebhart", "b.idf"]), &["b.idf", "are no view factors"]);
    refused(&e(&["--picture", "t.exr"]), &["t.exr", ".png or .jpg"]);
    refused(&["sheet.obj", "--emissivity", "1"], &["leaves the model", "--environment K"]);
    let both =
        ["--sides", "two", "--temperature", "sheet (back)=1", "--temperature", "sheet (front)=2"];
    let sheet = ["sheet.obj", "--emissivity", "1", "--environment", "3"];
    refused(&[&sheet[..], &both].concat(), &["sheet: both sides", "one temperature"]);
    refused(
        &["sheet.obj", "--emissivity", "0", "--flux", "sheet=1", "--environment", "3"],
        &["sheet", "emissivity of 0", "--emissivity"],
    );
    let shiny = ["shiny.obj", "--emissivity", "1", "--environment", "3"];
    refused(&shiny, &["mirror or metal", "chrome", "--diffuse"]);
    for name in ["chrome", "sheet", "all"] {
        bench.run(&[&["heat"][..], &shiny, &["--diffuse", name]].concat()).ok();
    }
    let mixed = e(&["--group", "object", "--temperature", "floor=300"]);
    refused(&mixed, &["--group", "different things"]);
}

#[test]
fn pictures_and_grids_are_written_whole() {
    let bench = Bench::new().with("room.obj", named_room());
    let base = ["heat", "room.obj", "--emissivity", ".8", "--temperature", "floor=310", "--flux"];
    let files = ["ceiling=-50", "-o", "f.vtu", "--picture", "t.png", "--size", "64x48", "--report"];
    let found = bench.run(&[&base[..], &files, &["r.json", "--patch-size", ".2"]].concat()).ok();
    assert!(found.stdout.starts_with("surface,"), "a table alone: {}", found.stdout);
    let named = bench.run(&[&base[..], &["ceiling=-50", "--surfaces", "s.csv"]].concat()).ok();
    assert_eq!(named.stdout, "s.csv\n");
    let picture = bench.picture("t.png");
    assert_eq!(picture.height, 48);
    assert!(picture.width > 64, "with a legend");
    let grid = fs::read_to_string(bench.path("f.vtu")).unwrap();
    assert!(grid.contains("NumberOfCells=") && grid.contains("Name=\"temperature\""));
    let report = fs::read_to_string(bench.path("r.json")).unwrap();
    assert!(report.contains("\"imbalance\"") && report.contains("\"supplied_w\""));
}

#[test]
fn what_takes_no_part_is_said_or_refused() {
    // The room with its floor twice, and a block that stands on it.
    let twice = format!("{}g again\nf 4 3 2 1\n", named_room());
    let bench = Bench::new().with("twice.obj", &twice);
    let base = ["heat", "twice.obj", "--emissivity", ".9", "--temperature", "ceiling=300"];
    let again = bench.run(&[&base[..], &["--temperature", "again=300"]].concat());
    again.refused(&["--temperature again", "is there twice"]);
    let files = ["--temperature", "floor=310", "--conductors", "GR.csv", "--surfaces", "s.csv"];
    bench.run(&[&base[..], &files].concat()).ok();
    let conductors = numbers(&bench.path("GR.csv"), "GR_m2");
    assert_eq!(conductors.len(), 11 * 12 / 2, "by reflection, triangles of one plane too");
    // Sunlight that does not get in.
    let dark = bench.run(&[&base[..], &["--diffuse-sun", "500"]].concat()).ok();
    assert!(dark.stderr.contains("no sunlight arrives"), "{}", dark.stderr);
}
