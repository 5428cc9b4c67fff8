//! Rooms to make matrices of, and matrices as others read them.

use std::fs;
use std::path::Path;

use super::Bench;

/// The room with a name for each of its sides.
pub fn named_room() -> String {
    let mut text =
        String::from("v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 0 2 0\nv 2 2 0\nv 2 2 2\nv 0 2 2\n");
    let faces = ["4 3 2 1", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8", "5 6 7 8"];
    for (name, face) in ["floor", "north", "east", "south", "west", "ceiling"].iter().zip(faces) {
        text += &format!("g {name}\nf {face}\n");
    }
    text
}

/// The same with a crate of a third of its width in the middle of the floor.
pub fn room_with_crate() -> String {
    let mut text = named_room();
    text += "v .7 0 .7\nv 1.3 0 .7\nv 1.3 0 1.3\nv .7 0 1.3\n";
    text += "v .7 .6 .7\nv 1.3 .6 .7\nv 1.3 .6 1.3\nv .7 .6 1.3\n";
    text + "g crate\nf 10 9 13 14\nf 11 10 14 15\nf 12 11 15 16\nf 9 12 16 13\nf 16 15 14 13\n"
}

/// Every face turned round.
pub fn turned(obj: &str) -> String {
    let turn = |line: &str| match line.strip_prefix("f ") {
        Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    };
    obj.lines().map(turn).collect()
}

/// A dense array of floats of either width.
pub fn npy(path: &Path) -> Vec<Vec<f64>> {
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
pub fn column(path: &Path, title: &str) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let at = lines.next().unwrap().iter().position(|t| *t == title).unwrap();
    lines.map(|fields| fields[at].to_owned()).collect()
}

pub fn numbers(path: &Path, title: &str) -> Vec<f64> {
    column(path, title).iter().map(|field| field.parse().unwrap()).collect()
}

/// Makes a dense matrix beside its table of surfaces.
pub fn factors(bench: &Bench, scene: &str, more: &[&str]) -> Vec<Vec<f64>> {
    let files = ["factors", scene, "-o", "F.npy", "--surfaces", "s.csv"];
    let outcome = bench.run(&[&files[..], more].concat()).ok();
    assert_eq!(outcome.stdout, "F.npy\ns.csv\n");
    npy(&bench.path("F.npy"))
}
