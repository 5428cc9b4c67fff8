//! `hemicube factors -o FILE.idf`: view factors of a zone, for EnergyPlus.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::fs;

use common::Bench;
use common::matrix::{factors, named_room, room_with_crate};

/// The fields of the one object of an .idf, without comments.
fn fields(bench: &Bench, name: &str) -> Vec<String> {
    let text = fs::read_to_string(bench.path(name)).unwrap();
    let text: String = text.lines().filter_map(|line| line.split('!').next()).collect();
    let (object, rest) = text.split_once(';').unwrap();
    assert_eq!(rest, "", "one object");
    object.split(',').map(|field| field.trim().to_owned()).collect()
}

#[test]
fn a_zone_has_the_factor_of_each_pair_of_its_surfaces() {
    let bench = Bench::new().with("room.obj", named_room());
    let f = factors(&bench, "room.obj", &["--group", "--enclosure"]);
    let made = ["factors", "room.obj", "--group", "--enclosure", "-o", "zone.idf"];
    let said = bench.run(&made).ok();
    assert_eq!(said.stdout, "zone.idf\n");
    assert!(!said.stderr.contains("EnergyPlus"), "{}", said.stderr);
    let own = fields(&bench, "zone.idf");
    assert_eq!(own[..2], ["ZoneProperty:UserViewFactors:BySurfaceName", "room"]);
    assert_eq!(own.len(), 2 + 3 * 36);
    let names = ["floor", "north", "east", "south", "west", "ceiling"];
    for (k, triple) in own[2..].chunks(3).enumerate() {
        let (i, j) = (k / 6, k % 6);
        assert_eq!(triple[..2], [names[i], names[j]]);
        assert_eq!(triple[2].parse::<f64>().unwrap(), f[i][j], "{triple:?}");
    }
    bench.run(&[&made[..], &["--zone", "ZONE 1"]].concat()).ok();
    assert_eq!(fields(&bench, "zone.idf")[1], "ZONE 1");
}

#[test]
fn what_energyplus_would_misread_is_refused_and_nothing_made() {
    let upper = named_room().replacen("g north", "g Floor", 1);
    let comma = named_room().replacen("g north", "g a;b", 1);
    let bench = Bench::new()
        .with("room.obj", named_room())
        .with("upper.obj", upper)
        .with("a;b.obj", comma.clone())
        .with("odd.obj", comma);
    let refused = |args: &[&str], parts: &[&str]| {
        bench.run(&[&["factors", "-o", "z.idf"], args].concat()).refused(parts);
        assert!(!bench.path("z.idf").exists());
    };
    refused(&["room.obj"], &["z.idf", "--group"]);
    refused(&["room.obj", "--group", "--sides", "two"], &["z.idf", "--sides one"]);
    refused(&["room.obj", "--group", "--zone", "a,b"], &["z.idf", "'a,b'", "comma", "--zone"]);
    refused(&["a;b.obj", "--group"], &["zone", "'a;b'", "--zone"]);
    refused(&["odd.obj", "--group"], &["z.idf", "'a;b'", "semicolon", "rename the surface"]);
    refused(&["upper.obj", "--group"], &["'floor' and 'Floor'", "case", "rename the surface"]);
    let zone = ["factors", "room.obj", "--zone", "z", "-o", "F.npz"];
    bench.run(&zone).refused(&["--zone", "FILE.idf"]);
}

#[test]
fn an_open_zone_is_written_with_a_warning() {
    let open = named_room().replace("g ceiling\nf 5 6 7 8\n", "");
    let bench = Bench::new().with("open.obj", open).with("crate.obj", room_with_crate());
    for (model, share) in [("open.obj", "20.0 % of "), ("crate.obj", "% of floor")] {
        let args = ["factors", model, "--group", "-o", "z.idf"];
        let said = bench.run(&args).ok().stderr;
        let line = said.lines().find(|line| line.starts_with("warning: EnergyPlus")).unwrap();
        assert!(line.contains(share) && line.contains("--enclosure"), "{line}");
        assert!(bench.run(&[&args[..], &["-q"]].concat()).ok().stderr.is_empty());
    }
}
