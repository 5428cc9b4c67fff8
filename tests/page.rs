//! The page of a model: its layers add up to the light of the scene, and its file holds them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::io::{Cursor, Read};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use common::baked::baked;
use common::scenes::{grey, rectangle, room, scene_of};
use glam::{DVec3, dvec3};
use hemicube::bake::{BakeError, BakeOptions, Layers};
use hemicube::export::{PageView, write_html};
use hemicube::gather::GatherOptions;
use hemicube::scene::{Camera, Material, Rgb, Scene, Sides, luminance};
use hemicube::store::{Store, sources};
use hemicube::tone::Tone;
use hemicube::{LightOptions, Silent};
use serde_json::Value;

/// Width of a texel, m.
const TEXEL: f64 = 0.05;

/// A closed room with two panels of different colours.
fn scene() -> Scene {
    let panel =
        |x: f64| rectangle([dvec3(x, 0.9, -0.3), dvec3(0.4, 0.0, 0.0), dvec3(0.0, 0.0, 0.4)]);
    let made =
        |name: &str, radiance: Rgb| Material { name: name.into(), radiance, ..grey(0.5, 0.0) };
    let (first, second, walls) = (panel(-0.8), panel(0.4), room());
    let meshes = [
        (&first, made("first", dvec3(3.0, 2.0, 1.0))),
        (&second, made("second & <b>", dvec3(0.5, 0.0, 2.0))),
        (&walls, made("wall", Rgb::ZERO)),
    ];
    scene_of(meshes, Sides::Two)
}

fn solved(scene: &Scene) -> Store {
    let all = sources(scene, &[]).unwrap();
    scene.solve(all, &LightOptions::default(), &Silent).unwrap().0
}

fn layers(scene: &Scene, store: &Store, options: &BakeOptions) -> Result<Layers, BakeError> {
    Layers::new(scene, store, options, Some(GatherOptions::of_pictures(0)), &Silent)
}

#[test]
fn layers_add_up_to_the_light_of_the_scene() {
    let scene = scene();
    let store = solved(&scene);
    let options = BakeOptions { texel: Some(TEXEL), ..BakeOptions::default() };
    let layers = layers(&scene, &store, &options).unwrap();
    let weights: Vec<Rgb> = store.sources.iter().map(|s| s.weight(&scene).unwrap()).collect();
    baked(&scene, Some(TEXEL), true, |bake| {
        assert_eq!(layers.size(), bake.size());
        let all = bake.irradiance().iter().map(|e| luminance(DVec3::from(e.map(f64::from))));
        let all: Vec<f64> = all.collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let squares = all.iter().enumerate().map(|(i, all)| {
            let parts = layers.irradiance.iter().zip(&weights);
            let sum: Rgb = parts.map(|(l, w)| DVec3::from(l[i].map(f64::from)) * *w).sum();
            (luminance(sum) - all).powi(2)
        });
        let rms = (squares.sum::<f64>() / all.len() as f64).sqrt() / mean;
        // Each is gathered with rays of its own.
        assert!(rms < 0.02, "{rms}");
        Ok(())
    })
    .unwrap();
}

#[test]
fn an_atlas_that_does_not_fit_is_refused() {
    let scene = scene();
    let options = BakeOptions { texel: Some(TEXEL), memory: 1 << 20 };
    let refused = layers(&scene, &solved(&scene), &options).map(|_| ()).unwrap_err();
    assert!(matches!(refused, BakeError::Memory { allowed, .. } if allowed == 1 << 20));
}

#[test]
fn a_page_holds_its_layers() {
    let scene = scene();
    let store = solved(&scene);
    let options = BakeOptions { texel: Some(TEXEL), ..BakeOptions::default() };
    let layers = layers(&scene, &store, &options).unwrap();
    let view = PageView {
        cameras: vec![Camera::at(DVec3::ZERO, DVec3::NEG_Z)],
        exposure: 1.5,
        tone: Tone::Reinhard,
        unit: "lx".into(),
        error: Some(0.01),
        served: true,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    write_html(&path, &scene, &store, &layers, &view, &Silent).unwrap();
    let page = fs::read_to_string(&path).unwrap();
    assert!(!page.contains("{{"), "a place was not filled");
    let start = page.find("id=\"data\">").unwrap() + "id=\"data\">".len();
    let end = start + page[start..].find("</script>").unwrap();
    let bytes = STANDARD.decode(&page[start..end]).unwrap();
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut member = |name: &str| {
        let mut bytes = Vec::new();
        archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
        bytes
    };
    let manifest: Value = serde_json::from_slice(&member("manifest.json")).unwrap();
    assert_eq!(manifest["exposure"], 1.5);
    assert_eq!(manifest["tone"], "reinhard");
    assert_eq!(manifest["inside"], true);
    let names: Vec<&str> = manifest["sources"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, store.sources.iter().map(|s| s.name.as_str()).collect::<Vec<_>>());
    let [width, height] = layers.size();
    for (k, light) in layers.irradiance.iter().enumerate() {
        let peak = manifest["sources"][k]["peak"].as_f64().unwrap();
        let [low, high] = ["low", "high"].map(|part| {
            let bytes = member(&format!("light/{k}_{part}.npy"));
            bytes[bytes.len() - 3 * width * height..].to_vec()
        });
        let read = decoded(&low, &high, [width, height]);
        for (i, (texel, codes)) in light.iter().zip(read).enumerate() {
            for (value, code) in texel.iter().zip(codes) {
                let octaves = (f64::from(code) - 1.0) / 128.0 - 40.0;
                let said = if code == 0 { 0.0 } else { peak * octaves.exp2() };
                let off = (said - f64::from(*value)).abs();
                assert!(off <= 0.003 * f64::from(*value) + 1e-11 * peak, "{i}: {said}, {value}");
            }
        }
    }
    let corners: u64 = manifest["materials"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m["count"].as_u64().unwrap())
        .sum();
    assert_eq!(corners as usize, 3 * layers.facets().len());
}

/// What a page does with the bytes of a layer: codes of red, green and blue of each texel.
fn decoded(low: &[u8], high: &[u8], [width, height]: [usize; 2]) -> Vec<[u16; 3]> {
    let texels = width * height;
    let mut planes = vec![[0_u16; 3]; texels];
    for plane in 0..3 {
        for i in 0..texels {
            let before = match i {
                0 => 0,
                _ if i % width == 0 => planes[i - width][plane],
                _ => planes[i - 1][plane],
            };
            let zigzag = u16::from_le_bytes([low[plane * texels + i], high[plane * texels + i]]);
            let difference = (zigzag >> 1) ^ (zigzag & 1).wrapping_neg();
            planes[i][plane] = before.wrapping_add(difference);
        }
    }
    planes.iter().map(|[g, r, b]| [r.wrapping_add(*g), *g, b.wrapping_add(*g)]).collect()
}
