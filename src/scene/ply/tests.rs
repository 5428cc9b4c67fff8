//! PLY files of every form, whole and broken.

use std::fs;

use glam::DVec3;
use proptest::prelude::*;

use crate::scene::{ImportOptions, Rgb, Scene, Side, load};

const HEADER: &str = "element vertex 4
property float x
property double y
comment colours between the coordinates
property uchar red
property float z
element edge 1
property int a
property list uchar short weights
element face 2
property uchar material
property list uchar int vertex_indices
end_header
";

const ASCII: &str = "0 0 200 0\n1 0 200 0\n1 1 7 0.5\n0 1 0 0\n3 2 5 6\n1 4 0 1 2 3\n0 3 2 1 0\n";

/// The same numbers in binary.
fn binary(big: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut push = |number: &[u8]| {
        if big {
            bytes.extend(number.iter().rev());
        } else {
            bytes.extend(number);
        }
    };
    for (x, y, red, z) in
        [(0.0, 0.0, 200, 0.0), (1.0, 0.0, 200, 0.0), (1.0, 1.0, 7, 0.5), (0.0, 1.0, 0, 0.0)]
    {
        push(&f32::to_le_bytes(x));
        push(&f64::to_le_bytes(y));
        push(&[red]);
        push(&f32::to_le_bytes(z));
    }
    push(&3_i32.to_le_bytes());
    push(&[2]);
    [5_i16, 6].iter().for_each(|w| push(&w.to_le_bytes()));
    for (material, corners) in [(1, &[0, 1, 2, 3][..]), (0, &[2, 1, 0])] {
        push(&[material]);
        push(&[corners.len() as u8]);
        corners.iter().for_each(|c: &i32| push(&c.to_le_bytes()));
    }
    bytes
}

fn file(format: &str, body: &[u8]) -> Vec<u8> {
    [format!("ply\nformat {format} 1.0\n{HEADER}").as_bytes(), body].concat()
}

fn files() -> [Vec<u8>; 3] {
    [
        file("ascii", ASCII.as_bytes()),
        file("binary_little_endian", &binary(false)),
        file("binary_big_endian", &binary(true)),
    ]
}

fn read(bytes: impl AsRef<[u8]>) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.ply");
    fs::write(&path, bytes).unwrap();
    let read = load(&path, &ImportOptions::default()).map_err(|e| e.to_string());
    if let Err(message) = &read {
        assert!(message.contains("m.ply: ") && message.len() < 500, "{message}");
    }
    read
}

fn refused(bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let message = read(bytes).unwrap_err();
    assert!(parts.iter().all(|part| message.contains(part)), "{message}");
}

#[test]
fn every_form_holds_the_same_mesh() {
    for bytes in files() {
        let scene = read(&bytes).unwrap();
        let g = &scene.geometry;
        assert_eq!(g.vertices[2], DVec3::new(1.0, 1.0, 0.5));
        assert_eq!(g.triangles.len(), 3, "a quadrangle and a triangle");
        assert_eq!(g.triangles[2], [2, 1, 0]);
        assert_eq!(g.surfaces.len(), 1);
    }
    let crlf = [
        "ply\r\nformat ascii 1.0\r\n",
        &HEADER.replace('\n', "\r\n"),
        &ASCII.replace('\n', "\r\n"),
    ];
    assert_eq!(read(crlf.concat()).unwrap().geometry.triangles.len(), 3);
}

#[test]
fn truncated_files_are_refused_at_every_length() {
    for bytes in files() {
        // The last byte of the text is but the end of its line.
        for length in 1..=bytes.len() - 2 {
            let message = read(&bytes[..length]).unwrap_err();
            let reason =
                ["cut off", "fewer numbers", "not how a PLY file begins", "not understood"];
            let reasons = ["no count", "no property", "not known", "not exist", "not a number"];
            assert!(reason.iter().chain(&reasons).any(|r| message.contains(r)), "{message}");
        }
    }
}

#[test]
fn wrong_numbers_are_refused_by_place() {
    let text = String::from_utf8(files()[0].clone()).unwrap();
    refused(text.replace("1 1 7 0.5", "1 1 7 nan"), &["line 18", "finite"]);
    refused(text.replace("1 1 7 0.5", "1 1 7 x"), &["line 18", "`x`"]);
    refused(text.replace("1 1 7 0.5", "1 1 7"), &["line 18", "fewer"]);
    refused(text.replace("1 1 7 0.5", "1 1 7 0 9"), &["line 18", "more numbers"]);
    refused(text.replace("4 0 1 2 3", "4 0 1 2 4"), &["line 21", "vertex 4", "has 4"]);
    refused(text.replace("4 0 1 2 3", "4 0 1 2 -1"), &["line 21", "vertex -1"]);
    refused(text.replace("4 0 1 2 3", "-4 0 1 2 3"), &["line 21", "length"]);
    refused(text.replace("4 0 1 2 3", "4 0 1 2 1e300"), &["line 21", "vertex 1e300 does"]);
    refused(text.replace("format ascii", "format morse"), &["line 2", "morse"]);
    refused(
        text.replace("property float x", "property float w"),
        &["element vertex", "property x"],
    );
    refused(text.replace("vertex_indices", "corners"), &["element face", "vertex_indices"]);

    let [_, little, big] = files();
    for (mut bytes, index) in [(little, 9_i32.to_le_bytes()), (big, 9_i32.to_be_bytes())] {
        let last = bytes.len() - 4;
        bytes[last..].copy_from_slice(&index);
        refused(&bytes, &["face 1", "vertex 9"]);
    }
}

#[test]
fn colours_of_vertices_are_reflectance() {
    let vertices = |kind: &str, white: &str| {
        let p = |c| format!("property {kind} {c}\n");
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{}{}{}element face 1\nproperty list uchar int vertex_indices\n\
             end_header\n",
            p("red"),
            p("green"),
            p("blue")
        );
        format!("{header}0 0 0 {white} 0 0\n1 0 0 0 {white} 0\n0 1 0 0 0 0\n3 0 1 2\n")
    };
    for (kind, white) in [("uchar", "255"), ("float", "1"), ("ushort", "65535")] {
        let scene = read(vertices(kind, white)).unwrap();
        let rho = scene.optics.reflectance[0];
        assert!((rho - Rgb::new(1.0, 1.0, 0.0) / 3.0).length() < 1e-9, "{kind}: {rho}");
        assert!(scene.findings.iter().any(|f| f.message.contains("the colours of vertices")));
    }
}

#[test]
fn strips_are_triangles_that_face_one_way() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\n\
        end_header\n0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n9 0 1 2 3 4 -1 0 1 2\n";
    let scene = read(text).unwrap();
    let g = &scene.geometry;
    assert_eq!(g.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [0, 1, 2]]);
    let normals: Vec<f64> = g.ids().take(3).map(|t| g.normal(t, Side::Front).z).collect();
    assert_eq!(normals, [-1.0; 3]);
    refused(text.replace("4 -1 0", "4 -2 0"), &["vertex -2"]);
}

proptest! {
    #[test]
    fn no_changed_byte_breaks_the_reader(form in 0..3_usize, at in 0..400_usize, byte: u8) {
        let mut bytes = files()[form].clone();
        let at = at % bytes.len();
        bytes[at] = byte;
        let _ = read(&bytes);
    }
}
