//! Solutions per source: mixed, they are what the scene solved afresh is, to the tolerance of the
//! solver; in a file, they stay what they are.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::Path;

use common::scenes::{grey, rectangle, room, scene_of};
use glam::{DVec3, dvec3};
use hemicube::engines::{EngineOptions, ExactOptions, HemicubeOptions, RaysOptions};
use hemicube::export::{read_factors, read_scene, read_sources, read_store, write_hemi};
use hemicube::form_factors::FormFactors;
use hemicube::progress::Silent;
use hemicube::scene::{Lamp, Material, Rgb, Scene, Sides, TriangleState, luminance};
use hemicube::solution::{Adaptive, LightOptions, Solution, light};
use hemicube::store::{Group, GroupError, MixError, Store, sources};

/// A room with a window to the sky, two panels that emit and three lamps, two of one name.
fn scene() -> Scene {
    let panel =
        |x: f64, y: f64| rectangle([dvec3(x, y, -0.3), dvec3(0.5, 0.0, 0.0), dvec3(0.0, 0.0, 0.5)]);
    let made =
        |name: &str, radiance: Rgb| Material { name: name.into(), radiance, ..grey(0.5, 0.0) };
    let (first, second, walls) = (panel(-0.8, 0.8), panel(0.4, 0.6), room());
    let meshes = [
        (&first, made("first", dvec3(3.0, 2.0, 1.0))),
        (&second, made("second", dvec3(0.5, 0.0, 2.0))),
        (&walls, made("wall", Rgb::ZERO)),
    ];
    let mut scene = scene_of(meshes, Sides::Two);
    let point = |name: &str, x: f64, intensity: DVec3| Lamp::Point {
        name: name.into(),
        position: DVec3::new(x, 0.3, 0.2),
        intensity,
        x_axis: DVec3::X,
        photometry: None,
    };
    scene.lamps = vec![
        point("spots", 0.2, DVec3::splat(2.0)),
        point("spots", -0.2, DVec3::splat(1.0)),
        point("bulb", 0.1, DVec3::new(1.0, 0.5, 0.2)),
    ];
    scene.geometry.state[9] = TriangleState::Transparent;
    scene.sky = DVec3::new(0.2, 0.3, 0.9);
    scene
}

/// The material of the walls.
const WALL: usize = 2;

fn options(engine: EngineOptions) -> LightOptions {
    LightOptions { patch_size: Some(0.05), engine, tolerance: Some(1e-9), ..Default::default() }
}

fn engines() -> [EngineOptions; 3] {
    [
        EngineOptions::Hemicube(HemicubeOptions { resolution: 64, ..Default::default() }),
        EngineOptions::Exact(ExactOptions::default()),
        EngineOptions::Rays(RaysOptions { samples: 256, seed: 0 }),
    ]
}

/// Other lamps: dimmed, in other colours, and one that is out.
fn relit(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for (name, emitter) in hemicube::store::emitters(&scene) {
        match name.as_str() {
            "first" => emitter.set_emission(&mut scene, DVec3::new(0.0, 5.0, 7.0)),
            "spots" => emitter.scale(&mut scene, 0.3),
            "bulb" => emitter.set_emission(&mut scene, DVec3::new(0.1, 4.0, 0.0)),
            "sky" => emitter.scale(&mut scene, 0.0),
            _ => {}
        }
    }
    scene
}

fn stored(scene: &Scene, options: &LightOptions) -> (Store, FormFactors) {
    scene.solve(sources(scene, &[]).unwrap(), options, &Silent).unwrap()
}

/// The worst difference of two solutions, as a share of the mean of the second.
fn apart(a: &Solution, b: &Solution) -> f64 {
    let mean = b.irradiance.iter().map(|h| luminance(*h)).sum::<f64>() / b.patches.len() as f64;
    let pairs = a.irradiance.iter().zip(&b.irradiance).chain(a.reflected.iter().zip(&b.reflected));
    pairs.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max) / mean
}

#[test]
fn mixed_light_is_the_light_solved_afresh() {
    let scene = scene();
    for engine in engines() {
        let options = options(engine);
        let (store, _) = stored(&scene, &options);
        for wanted in [scene.clone(), relit(&scene)] {
            let mixed = store.mix(&wanted).unwrap();
            let afresh = light(&wanted, &options, &Silent).unwrap();
            // Several emitters share their shadow rays, which differ then.
            let sampled = matches!(engine, EngineOptions::Rays(_));
            let allowed = if sampled { 0.02 } else { 1e-7 };
            let found = apart(&mixed, &afresh);
            assert!(found < allowed, "{engine:?}: {found}");
            let [a, b] = [&mixed, &afresh].map(|s| s.report.energy.unwrap());
            for (a, b) in a.absorbed.iter().zip(b.absorbed) {
                assert!((a - b).abs() <= allowed * b, "{engine:?}: absorbed {a}, {b}");
            }
        }
    }
}

#[test]
fn each_sampled_source_is_what_it_is_alone() {
    let scene = scene();
    let options = options(EngineOptions::Rays(RaysOptions { samples: 256, seed: 0 }));
    let (store, _) = stored(&scene, &options);
    for name in ["first", "second", "spots", "bulb", "sky"] {
        let mut alone = scene.clone();
        for (other, emitter) in hemicube::store::emitters(&scene) {
            if other != name {
                emitter.scale(&mut alone, 0.0);
            }
        }
        // The same rows, as other sources have them made for all that they light.
        let mixed = store.mix(&alone).unwrap();
        let afresh = light(&alone, &options, &Silent).unwrap();
        let found = apart(&mixed, &afresh);
        assert!(found < 1e-6, "{name}: {found}");
        let noise = |s: &Solution| s.halves.as_ref().map(|[a, b]| (a[7] - b[7]).length());
        let [a, b] = [&mixed, &afresh].map(|s| noise(s).unwrap());
        assert!((a - b).abs() <= 0.02 * b, "{name}: halves {a}, {b}");
    }
}

#[test]
fn other_reflectances_are_solved_by_the_same_factors() {
    let scene = scene();
    for engine in engines() {
        let options = options(engine);
        let (store, factors) = stored(&scene, &options);
        let mut wanted = relit(&scene);
        wanted.optics.set_reflectance(WALL, DVec3::new(0.8, 0.2, 0.4));
        assert_eq!(store.mix(&wanted).map(|_| ()), Err(MixError::Reflectance));
        let again = store.solve_mixed(&wanted, &factors, &options, &Silent).unwrap().unwrap();
        let all = store.clone().solve_again(&wanted, &factors, &options, &Silent).unwrap();
        let mixed = all.mix(&wanted).unwrap();
        assert!(apart(&mixed, &again) < 1e-7, "{engine:?}: {}", apart(&mixed, &again));
        let afresh = light(&wanted, &options, &Silent).unwrap();
        let sampled = matches!(engine, EngineOptions::Rays(_));
        let allowed = if sampled { 0.02 } else { 1e-7 };
        assert!(apart(&again, &afresh) < allowed, "{engine:?}: {}", apart(&again, &afresh));
    }
}

#[test]
fn a_file_holds_what_was_solved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.hemi");
    let scene = scene();
    let adaptive = LightOptions {
        patch_size: Some(0.2),
        adaptive: Some(Adaptive { max_factor: 0.01, min_area: 0.01 }),
        ..options(engines()[0])
    };
    for options in engines().map(options).into_iter().chain([adaptive]) {
        let (store, factors) = stored(&scene, &options);
        write_hemi(&path, &scene, &store, &factors, &Silent).unwrap();
        assert_eq!(read_sources(&path).unwrap(), store.sources);
        let read = read_scene(&path).unwrap();
        assert_eq!(read.geometry.fingerprint(), scene.geometry.fingerprint());
        assert_eq!((&read.lamps, read.sky), (&scene.lamps, scene.sky));
        assert_eq!(read.optics.emission, scene.optics.emission);
        let wanted = relit(&read);
        let back = read_store(&path, &wanted, 1 << 30, &Silent).unwrap();
        // Rounded to single precision.
        let [was, is] = [&store, &back].map(|s| s.mix(&wanted).unwrap());
        assert!(apart(&is, &was) < 1e-5, "{}", apart(&is, &was));
        assert_eq!(is.usable, was.usable);
        let rows = read_factors(&path, 1 << 30).unwrap();
        assert_eq!((rows.rows(), rows.entries()), (factors.rows(), factors.entries()));
        for i in back.patches.ids() {
            assert_eq!(rows.account(i), factors.account(i));
            let [a, b] = [&rows, &factors].map(|f| f.row(i).map(|r| r.entries().collect()));
            let (a, b): (Option<Vec<_>>, Option<Vec<_>>) = (a, b);
            assert_eq!(a, b);
        }
    }
}

#[test]
fn broken_and_foreign_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scene = scene();
    let (store, factors) = stored(&scene, &options(engines()[2]));
    write_hemi(&at("whole.hemi"), &scene, &store, &factors, &Silent).unwrap();
    let whole = fs::read(at("whole.hemi")).unwrap();
    let all = |path: &Path| {
        read_scene(path).and_then(|scene| {
            read_store(path, &scene, 1 << 30, &Silent)?;
            read_factors(path, 1 << 30)
        })
    };
    all(&at("whole.hemi")).unwrap();
    for length in (0..whole.len()).step_by(whole.len() / 40).chain([whole.len() - 1]) {
        fs::write(at("cut.hemi"), &whole[..length]).unwrap();
        let message = all(&at("cut.hemi")).unwrap_err().to_string();
        assert!(message.contains("cut.hemi"), "{message}");
    }
    // A byte that is another one: within arrays a checksum differs. Some bytes of an archive mean
    // nothing, as dates.
    let mut noticed = 0;
    const TRIED: usize = 60;
    for k in 0..TRIED {
        let mut bytes = whole.clone();
        let at_byte = (k * 7919 + 1) * whole.len() / (TRIED * 7919);
        bytes[at_byte] ^= 0x10;
        fs::write(at("bent.hemi"), &bytes).unwrap();
        noticed += usize::from(all(&at("bent.hemi")).is_err());
    }
    assert!(noticed * 10 >= TRIED * 9, "{noticed} of {TRIED}");
    fs::write(at("noise.hemi"), [7; 4096]).unwrap();
    assert!(all(&at("noise.hemi")).unwrap_err().to_string().contains("no whole file"));
    let error = read_store(&at("whole.hemi"), &other_scene(), 1 << 30, &Silent).unwrap_err();
    assert!(error.to_string().contains("patches are not those"), "{error}");
    let error = read_store(&at("whole.hemi"), &scene, 1 << 10, &Silent).unwrap_err();
    assert!(error.to_string().contains("are allowed"), "{error}");
}

/// A file whose manifest somebody has changed.
fn with_manifest(path: &Path, from: &str, to: &str) -> Vec<u8> {
    use std::io::{Cursor, Read, Write};
    let mut old = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let mut new = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for k in 0..old.len() {
        let mut member = old.by_index(k).unwrap();
        let name = member.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).unwrap();
        if name == "manifest.json" {
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.contains(from), "{from}");
            bytes = text.replace(from, to).into_bytes();
        }
        new.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        new.write_all(&bytes).unwrap();
    }
    new.finish().unwrap().into_inner()
}

#[test]
fn changed_manifests_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scene = scene();
    let (store, factors) = stored(&scene, &options(engines()[2]));
    write_hemi(&at("whole.hemi"), &scene, &store, &factors, &Silent).unwrap();
    let patches = format!("\"patches\": {}", store.patches.len());
    for (from, to) in [
        ("\"lamp\": 2", "\"lamp\": 9"),
        ("\"material\": 1", "\"material\": 77"),
        ("\"version\": 1", "\"version\": 2"),
        (&*patches, "\"patches\": 0"),
        (&*patches, "\"patches\": 4294967295"),
        ("\"whole_from\": null", "\"whole_from\": 4000000000"),
        ("\"moved\": 0", "\"moved\": 18446744073709551615"),
        ("\"sampled\": true", "\"sampled\": false"),
    ] {
        fs::write(at("changed.hemi"), with_manifest(&at("whole.hemi"), from, to)).unwrap();
        let read = read_scene(&at("changed.hemi"))
            .and_then(|scene| read_store(&at("changed.hemi"), &scene, 1 << 30, &Silent));
        let message = read.map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("changed.hemi"), "{to}: {message}");
    }
}

fn other_scene() -> Scene {
    Scene::builtin("cornell-box").unwrap()
}

#[test]
fn what_was_not_solved_for_is_told() {
    let scene = scene();
    let (store, _) = stored(&scene, &options(engines()[0]));
    let error = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        store.mix(&scene).map(|_| ()).unwrap_err()
    };
    let found = error(&|s| s.optics.set_radiance(WALL, Rgb::ONE));
    assert_eq!(found, MixError::Unsolved("wall".into()));
    let found = error(&|s| s.lamps[0].set_emission(Rgb::ONE));
    assert_eq!(found, MixError::Apart("spots".into()));
    assert_eq!(error(&|s| *s = other_scene()), MixError::Foreign);
}

#[test]
fn groups_are_solved_together() {
    let scene = scene();
    let group = |name: &str, members: &[&str]| Group {
        name: name.into(),
        members: members.iter().map(ToString::to_string).collect(),
    };
    let groups = [group("warm", &["first", "bulb"]), group("screen", &["wall"])];
    let all = sources(&scene, &groups).unwrap();
    let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["warm", "screen", "second", "sky", "spots"]);
    // Of two colours, so each is as it was; a screen that is dark is solved at unit white.
    assert!(all[0].keeps_its_colour() && !all[1].keeps_its_colour());
    let member = |s: usize, m: usize| all[s].members[m].emission;
    assert_eq!(member(0, 0), DVec3::new(3.0, 2.0, 1.0));
    assert_eq!(member(1, 0), Rgb::ONE);
    // The brighter of two lamps of one name is 1, and the other half of it.
    assert_eq!((member(4, 0), member(4, 1)), (Rgb::ONE, Rgb::splat(0.5)));
    let (store, _) = scene.solve(all, &options(engines()[0]), &Silent).unwrap();
    let mut wanted = scene.clone();
    for (name, emitter) in hemicube::store::emitters(&scene) {
        match (name.as_str(), emitter) {
            ("first" | "bulb", e) => e.scale(&mut wanted, 0.25),
            ("wall", _) => emitter.set_emission(&mut wanted, DVec3::Y),
            _ => {}
        }
    }
    let mixed = store.mix(&wanted).unwrap();
    let afresh = light(&wanted, &options(engines()[0]), &Silent).unwrap();
    assert!(apart(&mixed, &afresh) < 1e-7, "{}", apart(&mixed, &afresh));

    let refused = |groups: &[Group]| sources(&scene, groups).unwrap_err();
    let unknown = refused(&[group("a", &["third"])]);
    assert_eq!(unknown, GroupError::Unknown { group: "a".into(), name: "third".into() });
    let twice = refused(&[group("a", &["first"]), group("b", &["first"])]);
    assert_eq!(twice, GroupError::Twice { group: "b".into(), name: "first".into() });
    assert_eq!(refused(&[group("bulb", &["first"])]), GroupError::Name("bulb".into()));
    let dark = refused(&[group("a", &["first", "wall"])]);
    assert_eq!(dark, GroupError::Dark { group: "a".into(), name: "wall".into() });
}
