use std::path::Path;

use proptest::prelude::*;

use std::fs;

use super::*;
use crate::scene::import::{ImportOptions, load};
use crate::scene::texture::tests::png;
use crate::scene::{GroupBy, Scene, Side, TriangleId, TriangleState};

/// Writes files into a new folder and loads the first of them.
fn load_files(files: &[(&str, &[u8])]) -> Result<Scene, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    load(&folder.path().join(files[0].0), &ImportOptions::default())
}

fn obj(text: &str) -> Result<Scene, ImportError> {
    load_files(&[("m.obj", text.as_bytes())])
}

fn message(text: &str) -> String {
    obj(text).unwrap_err().to_string()
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn all_index_forms_negative_indices_and_blanks() {
    let s = obj(&format!(
        "\u{feff}# comment\r\n{TRIANGLE}v 1 1 0 0.5 0.5 0.5\r\nvt 0 0\nvt 1 0\nvt 0 1 0\nvn 0 0 1\n\
         f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//1 3//1\nf\t1/1/1  2/2/1\t3/3/1 \nf -4 -3 -2\n\
         f 1 \\\r\n  2 \\\n 4 # end\n"
    ))
    .unwrap();
    let triangles = &s.geometry.triangles;
    assert_eq!(triangles.len(), 6);
    assert!(triangles[..5].iter().all(|t| *t == [0, 1, 2]), "{triangles:?}");
    assert_eq!(triangles[5], [0, 1, 3]);
    assert_eq!(s.geometry.state[1], TriangleState::Duplicate);
    assert_eq!(s.optics.uv[1], [DVec2::ZERO, DVec2::X, DVec2::Y]);
    assert!(s.geometry.sides.iter().all(|s| *s == Sides::Two));
}

#[test]
fn polygons_become_n_minus_2_triangles() {
    let s = obj("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\nf 1 2 3 3\nf 2 2 2\n")
        .unwrap();
    assert_eq!(s.geometry.len(), 3 + 2 + 1);
    let area: f64 = s.geometry.ids().take(3).map(|t| s.geometry.area(t)).sum();
    assert!((area - 10.0).abs() < 1e-12, "{area}");
    assert!(s.geometry.ids().take(3).all(|t| s.geometry.normal(t, Side::Front) == DVec3::Z));
    assert_eq!(s.geometry.state[5], TriangleState::Degenerate);
}

#[test]
fn objects_and_groups_become_surfaces() {
    let s = obj(&format!(
        "{TRIANGLE}f 1 2 3\no chair\nf 1 2 3\ng leg\nf 1 2 3\ng back left\nf 1 2 3\n\
         g leg\nf 1 2 3\no empty\n"
    ))
    .unwrap();
    let names: Vec<&str> = s.geometry.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["default", "chair", "chair/leg", "chair/back left"]);
    assert_eq!(s.geometry.surface_of, [0, 1, 2, 3, 2]);
    assert_eq!(s.grouping(GroupBy::Object).names, ["default", "chair"]);
}

/// Names of the surface that each face is of.
fn surfaces(text: &str) -> Vec<String> {
    let s = obj(&format!("{TRIANGLE}{text}")).unwrap();
    let g = &s.geometry;
    g.surface_of.iter().map(|&k| g.surfaces[k as usize].name.clone()).collect()
}

const F: &str = "f 1 2 3\n";

#[test]
fn faces_are_of_the_group_before_them_whatever_their_material() {
    let of = surfaces;
    // The usual orders: `g` before `usemtl`, and after it.
    let text = format!("g a\nusemtl a\n{F}g b\nusemtl b\n{F}");
    assert_eq!(of(&text), ["a", "b"]);
    assert_eq!(of(&format!("usemtl a\ng a\n{F}usemtl b\ng b\n{F}")), ["a", "b"]);
    // Materials make no parts of their own, even if a group has their name.
    assert_eq!(of(&format!("g a\nusemtl a\n{F}usemtl b\n{F}")), ["a", "a"]);
    assert_eq!(of(&format!("g a\nusemtl b\n{F}g b\nusemtl b\n{F}")), ["a", "b"]);
    assert_eq!(of(&format!("g a\nusemtl a\n{F}usemtl b\n{F}g b\n{F}")), ["a", "a", "b"]);
    // A group stays empty if taking faces would leave another one empty.
    assert_eq!(of(&format!("g table\nusemtl wood\n{F}g wood\n")), ["table"]);
    let text = format!("g x\nusemtl x\n{F}g table\nusemtl wood\n{F}g wood\nusemtl wood\n");
    assert_eq!(of(&text), ["x", "table"]);
    // Another object's faces are not taken, nor those of another material, nor by a group that has
    // faces elsewhere.
    let text = format!("o p\ng a\nusemtl a\n{F}usemtl b\n{F}o q\ng b\n");
    assert_eq!(of(&text), ["p/a", "p/a"]);
    assert_eq!(of(&format!("g a\nusemtl a\n{F}usemtl c\n{F}g b\n")), ["a", "a"]);
    let text = format!("g b\n{F}g a\nusemtl a\n{F}usemtl b\n{F}g b\n");
    assert_eq!(of(&text), ["b", "a", "a"]);
}

#[test]
fn groups_named_after_their_faces_get_them() {
    // As in CornellBox-Original.obj.
    let text = format!(
        "g wall\nusemtl wall\n{F}usemtl short\n{F}{F}g short\nusemtl short\nusemtl tall\n{F}{F}\
         g tall\nusemtl tall\ng light\nusemtl light\n{F}"
    );
    assert_eq!(surfaces(&text), ["wall", "short", "short", "tall", "tall", "light"]);
    let s = obj(&format!("{TRIANGLE}{text}")).unwrap();
    let said = s.findings.iter().find(|f| f.message.contains("named after")).unwrap();
    assert_eq!(said.place, "line 10");
    assert!(said.message.ends_with("short, tall"), "{}", said.message);
    // Without any group before.
    let text = format!("usemtl a\n{F}g a\nusemtl b\n{F}{F}g b\n");
    assert_eq!(surfaces(&text), ["a", "b", "b"]);
    let s = obj(&format!("{TRIANGLE}{text}")).unwrap();
    assert_eq!(s.geometry.surfaces.len(), 2);
    let text = format!("o room\nusemtl a\n{F}g a\nusemtl b\n{F}g b\n");
    assert_eq!(surfaces(&text), ["room/a", "room/b"]);
}

#[test]
fn materials_reflect_emit_and_let_through() {
    let mtl = b"newmtl red\nKd .6 .1 .2 # comment\nKe 2 4 8\nnewmtl glass\nKd 1\nd 0.2\n\
        newmtl film\nKd .5 .5 .5\nTr .9\nnewmtl solid\nKd .5 .5 .5\nd 1\nTr 1\n";
    let text = format!(
        "mtllib my stuff.mtl\n{TRIANGLE}usemtl red\nf 1 2 3\nusemtl glass\nf 1 3 2\n\
         usemtl film\nf 1 2 3\nusemtl solid\nf 1 2 3\n"
    );
    let s = load_files(&[("m.obj", text.as_bytes()), ("my stuff.mtl", mtl)]).unwrap();
    assert_eq!(s.optics.reflectance[0], Rgb::new(0.6, 0.1, 0.2));
    let t = TriangleId(0);
    let expected = Rgb::new(2.0, 4.0, 8.0) * std::f64::consts::PI;
    assert_eq!(s.optics.emission(t, Side::Front), expected);
    assert_eq!(s.optics.emission(t, Side::Back), Rgb::ZERO);
    assert_eq!(
        s.geometry.state,
        [
            TriangleState::Solid,
            TriangleState::Transparent,
            TriangleState::Transparent,
            TriangleState::Duplicate
        ]
    );
    let left_out = s.findings.iter().find(|f| f.message.contains("light")).unwrap();
    assert_eq!(left_out.place, "material glass, material film");
}

/// States and reflectances of one triangle a material of a library.
fn with_library(mtl: &[u8], names: &[&str]) -> Scene {
    let mut text = String::from("mtllib m.mtl\n");
    for (i, name) in names.iter().enumerate() {
        text += &format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nusemtl {name}\nf -3 -2 -1\n");
    }
    load_files(&[("m.obj", text.as_bytes()), ("m.mtl", mtl)]).unwrap()
}

#[test]
fn tr_counts_as_its_exporter_means_it() {
    let (solid, clear) = (TriangleState::Solid, TriangleState::Transparent);
    let states = |mtl: &str| with_library(mtl.as_bytes(), &["a", "b"]).geometry.state;
    let of = |a: &str, b: &str| states(&format!("newmtl a\nKd 1\n{a}\nnewmtl b\nKd 1\n{b}\n"));
    assert_eq!(of("d 1\nTr 1.000000", "d 1\nTr 1"), [solid, solid]);
    assert_eq!(of("Tr 1.000000", "Tr 1"), [solid, solid], "the exporter's opaque");
    assert_eq!(of("Tr 1", "Tr 0"), [clear, solid]);
    assert_eq!(of("Tr 1", ""), [clear, solid]);
    let scene = with_library(b"newmtl a\nKd 1\nTr 1\n", &["a"]);
    assert!(scene.findings.iter().any(|f| f.message
        == "all materials of m.mtl say Tr 1, taken as \
                                                          opaque"));
    let scene = with_library(b"newmtl a\nKd 1\nd .1\nnewmtl b\nKd 1\n", &["a", "b"]);
    let left_out = scene.findings.iter().find(|f| f.place == "material a").unwrap();
    assert!(left_out.remedy.contains("d of MTL"), "{left_out:?}");
}

#[test]
fn mirrors_and_glass_are_not_black() {
    let mtl = b"newmtl a\nKd 0 0 0\nKs .8 .7 .6\nillum 3\nnewmtl b\nKd 0 0 0\nKs .5 .5 .5\n\
        newmtl c\nKd .2 .2 .2\nKs .3 .3 .3\nillum 5\nnewmtl d\nKd .2 .2 .2\nKs 1 1 1\nillum 2\n";
    let scene = with_library(mtl, &["a", "b", "c", "d"]);
    let expected = [Rgb::new(0.8, 0.7, 0.6), Rgb::splat(0.5), Rgb::splat(0.5), Rgb::splat(0.2)];
    for (found, expected) in scene.optics.reflectance.iter().zip(expected) {
        assert!((*found - expected).length() < 1e-9, "{found} {expected}");
    }
    let specular = scene.optics.materials.iter().filter(|m| m.specular);
    assert_eq!(specular.map(|m| m.name.as_str()).collect::<Vec<_>>(), ["a", "b", "c"]);
    let said = scene.findings.iter().filter(|f| f.message.contains("(Ks)"));
    let places: Vec<&str> = said.map(|f| f.place.as_str()).collect();
    assert_eq!(places, ["material a, material b, material c"], "said once");
}

#[test]
fn equal_findings_are_one() {
    let mtl: String = (0..9).map(|i| format!("newmtl m{i}\nmap_Kd gone.png\n")).collect();
    let names: Vec<String> = (0..9).map(|i| format!("m{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let scene = with_library(mtl.as_bytes(), &names);
    let said: Vec<_> = scene.findings.iter().filter(|f| f.message.contains("gone.png")).collect();
    assert_eq!(said.len(), 1);
    assert_eq!(said[0].place, "material m0, material m1, material m2, material m3 and 5 more");
}

#[test]
fn utf_16_is_read_and_names_are_never_empty() {
    let text = format!("mtllib m.mtl\n{TRIANGLE}usemtl é\nf 1 2 3\nusemtl\nf 1 3 2\n");
    let little: Vec<u8> =
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let mtl = "\u{feff}newmtl é\nKd .2 .3 .4\n";
    let big: Vec<u8> = mtl.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let s = load_files(&[("m.obj", &little), ("m.mtl", &big)]).unwrap();
    assert_eq!(s.optics.reflectance[0], Rgb::new(0.2, 0.3, 0.4));
    let names: Vec<&str> = s.optics.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["é", "(none)"]);
}

#[test]
fn colours_of_vertices_multiply_the_reflectance() {
    let corners =
        |a: &str, b: &str, c: &str| format!("v 0 0 0 {a}\nv 1 0 0 {b}\nv 0 1 0 {c}\nf 1 2 3\n");
    let rho = |text: &str| obj(text).unwrap().optics.reflectance[0];
    let mean = rho(&corners("1 0 0", "0 1 0", "0 0 0"));
    assert!((mean - Rgb::new(1.0, 1.0, 0.0) / 3.0).length() < 1e-9, "{mean}");
    let bytes = rho(&corners("188 188 188", "188 188 188", "188 188 188"));
    assert!((bytes - Rgb::splat(0.502_886)).length() < 1e-5, "sRGB of 0 to 255: {bytes}");
    // A weight is no colour.
    assert_eq!(rho(&corners("1", "1", "1")), Rgb::splat(0.5));
    let text = format!("mtllib m.mtl\nusemtl a\n{}", corners("1 0 0", "1 0 0", "1 0 0"));
    let files: [(&str, &[u8]); 2] =
        [("m.obj", text.as_bytes()), ("m.mtl", b"newmtl a\nKd .4 .4 .4\n")];
    assert_eq!(load_files(&files).unwrap().optics.reflectance[0], Rgb::new(0.4, 0.0, 0.0));
}

#[test]
fn several_libraries_on_one_line() {
    let text = format!("mtllib a b.mtl c.mtl\n{TRIANGLE}usemtl x\nf 1 2 3\nusemtl y\nf 1 2 3\n");
    let s = load_files(&[
        ("m.obj", text.as_bytes()),
        ("a b.mtl", b"newmtl x\nKd .1 .1 .1\n"),
        ("c.mtl", b"newmtl y\nKd .2 .2 .2\n"),
    ])
    .unwrap();
    assert_eq!(s.optics.reflectance, [Rgb::splat(0.1), Rgb::splat(0.2)]);
}

#[test]
fn what_is_missing_is_assumed_and_said() {
    let text = format!("mtllib no.mtl\n{TRIANGLE}f 1 2 3\nusemtl gone\nf 1 2 3\nl 1 2\np 1\n");
    let s = obj(&text).unwrap();
    assert_eq!(s.optics.reflectance, [Rgb::splat(0.5); 2]);
    let said: Vec<String> =
        s.findings.iter().map(|f| format!("{}: {}", f.place, f.message)).collect();
    assert!(said[0].starts_with("line 1: material library no.mtl is missing"), "{said:?}");
    assert!(said.iter().any(|m| m.starts_with("line 5: faces have no material")), "{said:?}");
    assert!(said.iter().any(|m| m.starts_with("material gone: is not defined")), "{said:?}");
    assert!(said.iter().any(|m| m.starts_with("line 8: 2 points, lines")), "{said:?}");
}

#[test]
fn textures_multiply_over_the_footprint_with_v_upwards() {
    let (red, green) = ([[255, 0, 0, 255]; 64], [[0, 255, 0, 255]; 64]);
    let image_of_halves = [red, green].concat();
    let image = png(8, 16, &image_of_halves);
    let mtl = b"newmtl a\nKd .5 .5 .5\nmap_Kd -s 1 .5 1 a tex.png\nnewmtl b\nmap_Kd no.png\n\
        newmtl c\nmap_Kd bad.png\n";
    let text = format!(
        "mtllib m.mtl\n{TRIANGLE}vt 0 0\nvt 1 0\nvt 0 1\nvt 0 nan\nusemtl a\nf 1/1 2/2 3/3\n\
         usemtl b\nf 1/1 2/2 3/4\nusemtl c\nf 1/1 2/2 3/3\n"
    );
    let files: [(&str, &[u8]); 4] =
        [("m.obj", text.as_bytes()), ("m.mtl", mtl), ("a tex.png", &image), ("bad.png", b"bad")];
    let s = load_files(&files).unwrap();
    // Scaled by a half in v, the triangle lies in the lower, green half.
    assert!((s.optics.reflectance[0] - Rgb::new(0.0, 0.5, 0.0)).length() < 1e-9);
    assert_eq!(s.optics.reflectance[1], Rgb::splat(0.5));
    assert_eq!(s.optics.reflectance[2], Rgb::splat(0.5));
    assert!(s.optics.materials[2].reflectance_texture.is_none());
    assert!(s.findings.iter().any(|f| f.message.contains("no.png is missing")));
    assert!(s.findings.iter().any(|f| f.place == "texture bad.png"));
}

#[test]
fn an_opacity_map_cuts_faces_out() {
    // White above and black below, as grey and as alpha.
    let grey = |v: u8| [[v, v, v, 255]; 32];
    let alpha = |a: u8| [[9, 200, 9, a]; 32];
    let mtl = b"newmtl a\nmap_Kd m.png\nmap_d m.png\nnewmtl b\nmap_d gone.png\n";
    let text = format!(
        "mtllib m.mtl\n{TRIANGLE}vt 0 .05\nvt 1 .05\nvt 0 .95\nusemtl a\nf 1/1 2/2 3/3\n\
         usemtl b\nf 1 3 2\n"
    );
    for texels in [[grey(255), grey(0)].concat(), [alpha(255), alpha(0)].concat()] {
        let image = png(8, 8, &texels);
        let files: [(&str, &[u8]); 3] =
            [("m.obj", text.as_bytes()), ("m.mtl", mtl), ("m.png", &image)];
        let s = load_files(&files).unwrap();
        let g = &s.geometry;
        let area = |face: u32| g.ids().filter(|&t| g.face(t) == face).map(|t| g.area(t)).sum();
        let (cut, whole): (f64, f64) = (area(0), area(1));
        assert!((cut / whole - 0.25).abs() < 1e-6, "{cut} of {whole}");
        assert!(s.findings.iter().any(|f| f.message.contains("opacity map gone.png is missing")));
    }
}

#[test]
fn errors_name_the_line() {
    assert!(message("v 0 0 0\nv 0 nan 0\n").contains("line 2: `nan` is not a finite number"));
    assert!(message("v 0 0\n").contains("line 1: `v` needs three numbers"));
    assert!(message("v 1e999 0 0\n").contains("line 1"));
    let out = message(&format!("{TRIANGLE}f 1 2 9\n"));
    assert!(out.contains("line 4: vertex 9 does not exist: the file has 3"), "{out}");
    assert!(message(&format!("{TRIANGLE}f 1 2 -4\n")).contains("line 4"));
    assert!(message(&format!("{TRIANGLE}f 0 1 2\n")).contains("numbers begin at 1"));
    assert!(message(&format!("{TRIANGLE}f 1/5 2/5 3/5\n")).contains("texture coordinate 5"));
    assert!(message(&format!("{TRIANGLE}f 1 2 99999999999999999999\n")).contains("line 4"));
    assert!(message(&format!("{TRIANGLE}f 1 2 5000000000\n")).contains("line 4"));
    assert!(message(TRIANGLE).contains("no triangles"));
    let text = format!("mtllib m.mtl\n{TRIANGLE}f 1 2 3\n");
    let error = load_files(&[("m.obj", text.as_bytes()), ("m.mtl", b"newmtl a\n\nKd 1 x 1\n")]);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("m.mtl: line 3: `x`"), "{error}");
    for line in ["Ke 1e308 0 0", "Kd 1e300"] {
        let mtl = format!("newmtl a\n{line}\n");
        let error = load_files(&[("m.obj", text.as_bytes()), ("m.mtl", mtl.as_bytes())]);
        let error = error.unwrap_err().to_string();
        assert!(error.contains("m.mtl: line 2: `K") && error.contains("exceeds 1e30"), "{error}");
    }
}

#[test]
fn forward_references_are_allowed() {
    assert_eq!(obj(&format!("f 1 2 3\n{TRIANGLE}")).unwrap().geometry.len(), 1);
}

fn reads_without_panic(bytes: &[u8]) {
    let mut builder = SceneBuilder::new("noise");
    if read(&Source::new(Path::new("m.obj"), bytes), &mut builder).is_ok() {
        let _ = crate::scene::inspect(&builder.finish());
    }
    let _ = mtl::parse(&Source::new(Path::new("m.mtl"), bytes), &mut HashMap::new());
}

proptest! {
    #[test]
    fn noise_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        reads_without_panic(&bytes);
    }

    #[test]
    fn statements_of_noise_never_panic(
        lines in proptest::collection::vec(
            "(v|vt|f|o|g|usemtl|mtllib|newmtl|Kd|Ke|d|Tr|map_Kd|l)( [-0-9./a-z#\\\\é]{0,6}){0,6}",
            0..20,
        ),
    ) {
        reads_without_panic(lines.join("\n").as_bytes());
        reads_without_panic(format!("newmtl a\n{}", lines.join("\r\n")).as_bytes());
    }

    #[test]
    fn faces_always_yield_n_minus_2_triangles(
        points in proptest::collection::vec((-3_i8..4, -3_i8..4, -3_i8..4), 3..12),
    ) {
        let mut text = String::new();
        for (x, y, z) in &points {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "f";
        for i in 1..=points.len() {
            text += &format!(" {i}");
        }
        prop_assert_eq!(obj(&text).unwrap().geometry.len(), points.len() - 2);
    }
}
