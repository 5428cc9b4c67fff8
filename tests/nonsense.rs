//! Files of solutions and matrices whose checksums are right and whose numbers cannot be.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::Path;

use common::scenes::{grey, room, scene_of};
use glam::DVec3;
use hemicube::engines::{EngineOptions, RaysOptions};
use hemicube::export::{read_factors, read_npz, read_scene, read_store, write_hemi};
use hemicube::scene::{Camera, Lamp, Rgb, Scene, Sides};
use hemicube::store::sources;
use hemicube::{LightOptions, MatrixOptions, Silent};
use serde_json::{Value, json};
use zip::write::SimpleFileOptions;

type Members = Vec<(String, Vec<u8>)>;

/// Bytes that reading may take.
const MEMORY: u64 = 1 << 28;

fn scene() -> Scene {
    let mut scene = scene_of([(&room(), grey(0.5, 1.0))], Sides::Two);
    scene.lamps = vec![Lamp::Spot {
        name: "spot".into(),
        position: DVec3::ZERO,
        direction: DVec3::X,
        intensity: Rgb::ONE,
        inner: 0.1,
        outer: 0.5,
        x_axis: DVec3::Y,
        photometry: None,
    }];
    scene.cameras = vec![Camera::at(DVec3::ZERO, DVec3::X)];
    scene.sky = Rgb::splat(0.1);
    scene.geometry.face_of = (0..scene.geometry.len() as u32).collect();
    scene
}

fn members(path: &Path) -> Members {
    let mut zip = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let count = zip.len();
    let read = |k| {
        let mut member = zip.by_index(k).unwrap();
        let name = member.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).unwrap();
        (name, bytes)
    };
    (0..count).map(read).collect()
}

fn write(path: &Path, members: &Members) {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    fs::write(path, zip.finish().unwrap().into_inner()).unwrap();
}

fn checksum(members: &Members, of: impl Fn(&str) -> bool) -> String {
    let mut hash = blake3::Hasher::new();
    for (_, bytes) in members.iter().filter(|m| of(&m.0)) {
        hash.update(bytes);
    }
    hash.finalize().to_hex().to_string()
}

/// Changes the manifest, and makes all checksums right.
fn with_manifest(members: &mut Members, change: impl FnOnce(&mut Value)) {
    let sums = ["scene", "light", "factors"]
        .map(|part| checksum(members, |name| name.starts_with(&format!("{part}/"))));
    let manifest = members.iter_mut().find(|m| m.0 == "manifest.json").unwrap();
    let mut value: Value = serde_json::from_slice(&manifest.1).unwrap();
    change(&mut value);
    value["checksums"] = json!({ "scene": sums[0], "light": sums[1], "factors": sums[2] });
    manifest.1 = value.to_string().into_bytes();
}

/// Puts bytes in the place of a number of an array.
fn set(members: &mut Members, name: &str, number: usize, bytes: &[u8]) {
    let array = members.iter_mut().find(|m| m.0 == format!("{name}.npy")).unwrap();
    let start = array.1.iter().position(|b| *b == b'\n').unwrap() + 1;
    let at = start + number * bytes.len();
    array.1[at..at + bytes.len()].copy_from_slice(bytes);
}

/// All that is read of a file of solutions; its error names the file.
#[track_caller]
fn refused(path: &Path, part: &str) {
    let scene = read_scene(path);
    let store = scene.and_then(|scene| read_store(path, &scene, MEMORY, &Silent));
    let found = store.and_then(|_| read_factors(path, MEMORY));
    let message = found.map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("m.hemi: ") && message.contains(part), "{part}: {message}");
}

fn written(path: &Path) -> Members {
    let scene = scene();
    let engine = EngineOptions::Rays(RaysOptions { samples: 32, seed: 0 });
    let options = LightOptions { patch_size: Some(1.0), engine, ..LightOptions::default() };
    let found = sources(&scene, &[]).unwrap();
    let (store, factors) = scene.solve(found, &options, &Silent).unwrap();
    write_hemi(path, &scene, &store, &factors, &Silent).unwrap();
    members(path)
}

#[test]
fn manifests_that_say_what_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hemi");
    let whole = written(&path);
    let up_to = json!(1e300);
    for (place, value, part) in [
        ("/scene/sky/0", json!(-1.0), "its sky"),
        ("/scene/sky/0", up_to.clone(), "its sky"),
        ("/scene/up", json!([0.0, 0.0, 0.0]), "its upward direction"),
        ("/scene/max_reflectance", json!(1.0), "its reflectance"),
        ("/scene/materials/0/reflectance/1", json!(-0.5), "its materials"),
        ("/scene/lamps/0/Spot/intensity/0", json!(-1.0), "its lamps"),
        ("/scene/lamps/0/Spot/direction", json!([0.0, 0.0, 0.0]), "its lamps"),
        ("/scene/lamps/0/Spot/outer", json!(0.01), "its lamps"),
        ("/scene/cameras/0/vfov", json!(4.0), "its cameras"),
        ("/scene/cameras/0/aspect", json!(-1.0), "its cameras"),
        ("/scene/object_of", json!([]), "its surfaces"),
        ("/scene/whole_from", json!(u32::MAX), "its stage"),
        ("/light/sources/0/members/0/emission/0", json!(-1.0), "light that cannot be"),
        ("/light/energy/0/absorbed/2", json!(1e200), "light that cannot be"),
        ("/light/patches", json!(1_u64 << 40), "are allowed"),
        ("/light/patch_size", json!(1e-6), "patches are not those"),
        ("/light/patch_size", json!(-1.0), "positive area"),
        ("/factors/blocks/0/weights/equal", json!(1), "more than their rays"),
    ] {
        let mut members = whole.clone();
        with_manifest(&mut members, |m| *m.pointer_mut(place).unwrap() = value.clone());
        write(&path, &members);
        refused(&path, part);
    }
    // What claims so many patches is read by itself, too.
    let mut members = whole.clone();
    with_manifest(&mut members, |m| m["light"]["patches"] = json!(u64::MAX));
    write(&path, &members);
    assert!(read_factors(&path, MEMORY).is_err());
}

/// Blanks shrink a thousandfold, and so would a million names of nothing.
#[test]
fn a_manifest_that_inflates_a_thousandfold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hemi");
    let mut members = written(&path);
    let manifest = members.iter_mut().find(|m| m.0 == "manifest.json").unwrap();
    manifest.1.resize(1 << 26, b' ');
    write(&path, &members);
    assert!(fs::metadata(&path).unwrap().len() < 1 << 18);
    refused(&path, "was not written by hemicube solve");
}

#[test]
fn arrays_of_numbers_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hemi");
    let whole = written(&path);
    let last = scene().geometry.len() - 1;
    let double = |x: f64| x.to_le_bytes().to_vec();
    let single = |x: f32| x.to_le_bytes().to_vec();
    for (name, number, bytes, part) in [
        ("scene/reflectance", 1, double(1.5), "its reflectance"),
        ("scene/emission", 1, double(-1.0), "its emission"),
        ("scene/vertices", 1, double(1e300), "its vertices"),
        ("scene/face", last, u32::MAX.to_le_bytes().to_vec(), "its face"),
        ("light/irradiance", 4, single(f32::INFINITY), "light/irradiance.npy"),
        ("light/direct", 4, single(f32::NAN), "light/direct.npy"),
        ("factors/account", 3, double(1e9), "factors/account.npy"),
        ("factors/patches", 0, u32::to_le_bytes(2).to_vec(), "patches.npy is not in order"),
    ] {
        let mut members = whole.clone();
        set(&mut members, name, number, &bytes);
        with_manifest(&mut members, |_| {});
        write(&path, &members);
        refused(&path, part);
    }
}

#[test]
fn a_matrix_that_claims_a_billion_patches_is_refused_before_they_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.npz");
    let scene = scene();
    let matrix = scene.form_factors(&MatrixOptions::default(), &Silent).unwrap();
    matrix.save(&path, &scene.geometry, &Silent).unwrap();
    let mut stored = read_npz(&path, MEMORY).unwrap();
    let area = scene.geometry.ids().map(|t| scene.geometry.area(t)).fold(0.0, f64::max);
    // 4^10 a side of each triangle.
    stored.origin.patch_size = Some(area / 4_f64.powi(10));
    let message = stored.restore(&scene.geometry, MEMORY).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("rows, and the model has"), "{message}");
}
