//! STL files of both kinds, whole and broken.

use std::fs;

use proptest::prelude::*;

use crate::scene::{GroupBy, ImportOptions, Scene, TriangleState, load};

/// Two facets: a unit square.
const SQUARE: [[[f32; 3]; 3]; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];

fn binary(title: &[u8], facets: &[[[f32; 3]; 3]], normal: [f32; 3]) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        for number in normal.iter().chain(facet.iter().flatten()) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii(name: &str, facets: &[[[f32; 3]; 3]]) -> String {
    let mut text = format!("solid {name}\n");
    for facet in facets {
        text += " facet normal 0 0 1\n  outer loop\n";
        for [x, y, z] in facet {
            text += &format!("   vertex {x} {y:e} {z}\n");
        }
        text += "  endloop\n endfacet\n";
    }
    text + &format!("endsolid {name}\n")
}

fn read(bytes: impl AsRef<[u8]>) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.stl");
    fs::write(&path, bytes).unwrap();
    let read = load(&path, &ImportOptions::default()).map_err(|e| e.to_string());
    if let Err(message) = &read {
        assert!(message.contains("m.stl: ") && message.len() < 500, "{message}");
    }
    read
}

fn refused(bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let message = read(bytes).unwrap_err();
    assert!(parts.iter().all(|part| message.contains(part)), "{message}");
}

#[test]
fn both_kinds_hold_the_same_triangles_in_order() {
    let text = read(ascii("flat roof", &SQUARE)).unwrap();
    let titled = read(binary(b"solid as some write it", &SQUARE, [0.0; 3])).unwrap();
    let crlf = read(ascii("a", &SQUARE).replace('\n', "\r\n").to_uppercase()).unwrap();
    for scene in [&text, &titled, &crlf] {
        assert_eq!(scene.geometry.vertices.len(), 4);
        assert_eq!(scene.geometry.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(scene.geometry.state, [TriangleState::Solid; 2]);
    }
    assert_eq!(text.geometry.surfaces[0].name, "flat roof");
    assert_eq!(titled.geometry.surfaces[0].name, "default");
}

#[test]
fn solids_are_surfaces() {
    let scene = read(ascii("floor", &SQUARE[..1]) + &ascii("lid", &SQUARE[1..])).unwrap();
    let names: Vec<&str> = scene.geometry.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["floor", "lid"]);
    assert_eq!(scene.geometry.surface_of, [0, 1]);
}

#[test]
fn solids_are_surfaces_and_objects() {
    let scene = read(ascii("lid", &SQUARE[..1]) + &ascii("pot", &SQUARE[1..])).unwrap();
    for by in [GroupBy::Surface, GroupBy::Object] {
        assert_eq!(scene.grouping(by).names, ["lid", "pot"]);
    }
    let scene = read(binary(b"solid lid", &SQUARE, [0.0; 3])).unwrap();
    assert_eq!(scene.grouping(GroupBy::Object).names, ["default"]);
}

#[test]
fn degenerate_facets_stay() {
    let flat = [SQUARE[0], [[2.0, 0.0, 0.0]; 3], SQUARE[1]];
    for scene in [read(binary(b"", &flat, [0.0; 3])), read(ascii("", &flat))] {
        let scene = scene.unwrap();
        assert_eq!(
            scene.geometry.state,
            [TriangleState::Solid, TriangleState::Degenerate, TriangleState::Solid]
        );
    }
}

#[test]
fn normals_against_the_winding_are_said() {
    let scene = read(binary(b"", &SQUARE, [0.0, 0.0, -1.0])).unwrap();
    assert!(scene.findings.iter().any(|f| f.message.contains("2 facets")), "{:?}", scene.findings);
}

#[test]
fn broken_files_are_refused_by_name_and_place() {
    let whole = binary(b"title", &SQUARE, [0.0; 3]);
    refused(&whole[..whole.len() - 1], &["header", "2 facets", "holds 1", "cut off"]);
    refused(&whole[..60], &["header"]);
    let mut nan = whole.clone();
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    refused(nan, &["facet 1", "finite"]);
    refused(binary(b"", &[], [0.0; 3]), &["no triangles"]);

    let text = ascii("a", &SQUARE);
    refused(text.replacen("vertex 1", "vertex nan", 1), &["line 5", "`nan`"]);
    refused(text.replacen("   vertex 1 0e0 0\n", "", 1), &["line 7", "2 corners"]);
    refused(text.replacen("endfacet", "endface", 1), &["`endface`"]);
    refused(text.replacen(" endfacet\n", "", 1), &["line 8", "`facet`"]);
    refused(&text[..text.len() - 12], &["cut off"]);
    refused("solid a\nendsolid\n", &["no triangles"]);
}

proptest! {
    #[test]
    fn no_cut_or_changed_byte_breaks_the_reader(cut in 0..200_usize, at in 0..184_usize, byte: u8) {
        let mut bytes = binary(b"solid", &SQUARE, [0.0; 3]);
        bytes[at] = byte;
        bytes.truncate(cut);
        let _ = read(&bytes);
        let mut text = ascii("a", &SQUARE).into_bytes();
        text[at] = byte;
        let _ = read(&text);
        text.truncate(cut);
        prop_assert!(read(&text).is_err());
    }
}
