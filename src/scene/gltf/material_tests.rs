//! Materials and their textures.

use glam::DVec2;

use super::tests::{Doc, has_finding};
use crate::scene::texture::tests::png;
use crate::scene::{Rgb, Scene, Side, Sides, TriangleId, TriangleState};

#[test]
fn a_material_without_a_diffuse_colour_is_not_black() {
    let mut doc = Doc::triangle();
    doc.primitive = r#"{"attributes":{"POSITION":0},"material":0}"#.into();
    doc.rest = r#","materials":[{"name":"gold","extensions":{
        "KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0,0,0,1],
        "specularFactor":[0.75,0.5,0.25]}}}]"#
        .into();
    let scene = doc.scene();
    assert_eq!(scene.optics.reflectance[0], Rgb::new(0.75, 0.5, 0.25));
    assert!(scene.findings.iter().any(|f| f.place == "material gold"));
}

#[test]
fn materials_reflect_emit_and_let_through() {
    let material = |text: &str| {
        let mut doc = Doc::triangle();
        doc.primitive = r#"{"attributes":{"POSITION":0},"material":0}"#.into();
        doc.rest = format!(r#","materials":[{{"name":"a",{text}}}]"#);
        doc.scene()
    };
    let s = material(
        r#""doubleSided":true,"emissiveFactor":[1,0.5,0],
        "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}},
        "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],"metallicFactor":0}"#,
    );
    assert_eq!(s.optics.reflectance, [Rgb::new(0.5, 0.25, 0.125)]);
    assert_eq!(s.geometry.sides, [Sides::Two]);
    let emission = Rgb::new(8.0, 4.0, 0.0) * std::f64::consts::PI;
    assert_eq!(s.optics.emission(TriangleId(0), Side::Front), emission);
    assert_eq!(s.optics.emission(TriangleId(0), Side::Back), emission);
    assert!(s.findings.is_empty(), "{:?}", s.findings);
    assert!(!s.optics.materials[0].specular);
    let metallic = material(r#""doubleSided":false"#);
    assert!(has_finding(&metallic, "material a", "metallic"));
    assert!(metallic.optics.materials[0].specular);

    let base =
        |alpha: f64| format!(r#""pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{alpha}]}}"#);
    let state = |text: String| material(&text).geometry.state[0];
    assert_eq!(state(base(0.1)), TriangleState::Solid, "opaque mode ignores alpha");
    assert_eq!(state(base(0.4) + r#","alphaMode":"BLEND""#), TriangleState::Transparent);
    assert_eq!(state(base(0.6) + r#","alphaMode":"BLEND""#), TriangleState::Solid);
    assert_eq!(state(base(0.4) + r#","alphaMode":"MASK","alphaCutoff":0.3"#), TriangleState::Solid);
    assert_eq!(state(base(0.4) + r#","alphaMode":"MASK""#), TriangleState::Transparent);
    let transmission = r#""extensions":{"KHR_materials_transmission":{"transmissionFactor":0.9}}"#;
    assert_eq!(state(transmission.into()), TriangleState::Transparent);
    assert!(has_finding(&material(transmission), "material a", "lets light through: 1 triangle"));
}

/// A triangle over the lower left half of an image, as the only texture of a material.
pub(super) fn textured(image: &[u8], info: &str, material: &str, uv: [f32; 6]) -> Doc {
    let mut doc = Doc::triangle();
    doc.floats(&uv, "VEC2");
    let view = doc.view(image);
    doc.primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}"#.into();
    doc.rest = format!(
        r#","images":[{{"bufferView":{view},"mimeType":"image/png"}}],
        "samplers":[{{"wrapS":33071}}],"textures":[{{"source":0,"sampler":0}}],
        "materials":[{{"name":"t","pbrMetallicRoughness":{{"metallicFactor":0,
        "baseColorFactor":[0.5,0.5,0.5,1],"baseColorTexture":{{"index":0{info}}}}}{material}}}]"#
    );
    doc
}

/// Left half red and clear, right half green and solid.
pub(super) fn halves() -> Vec<u8> {
    let row: Vec<[u8; 4]> =
        (0..16).map(|x| if x < 8 { [255, 0, 0, 0] } else { [0, 255, 0, 255] }).collect();
    png(16, 16, &row.repeat(16)).to_vec()
}

pub(super) const LEFT: [f32; 6] = [0.0, 0.0, 0.5, 0.0, 0.0, 1.0];
const RIGHT: [f32; 6] = [0.5, 0.0, 1.0, 0.0, 0.5, 1.0];

#[test]
fn textures_multiply_over_the_triangles_own_footprint() {
    let close = |s: &Scene, expected: [f64; 3]| {
        let rho = s.optics.reflectance[0];
        assert!((rho - Rgb::from(expected)).length() < 1e-6, "{rho} is not {expected:?}");
    };
    close(&textured(&halves(), "", "", LEFT).scene(), [0.5, 0.0, 0.0]);
    close(&textured(&halves(), "", "", RIGHT).scene(), [0.0, 0.5, 0.0]);
    close(&textured(&halves(), "", "", [0.0, 0.0, 1.0, 0.0, 0.5, 1.0]).scene(), [0.25, 0.25, 0.0]);
    let shifted = r#","extensions":{"KHR_texture_transform":{"offset":[0.5,0]}}"#;
    close(&textured(&halves(), shifted, "", LEFT).scene(), [0.0, 0.5, 0.0]);
    // A quarter turn counter-clockwise in the image: u' = v, v' = -u.
    let turned = r#","extensions":{"KHR_texture_transform":{"rotation":1.5707963267948966}}"#;
    let doc = textured(&halves(), turned, "", [0.0, 0.5, 0.9, 0.5, 0.0, 1.0]);
    let s = doc.scene();
    close(&s, [0.0, 0.5, 0.0]);
    assert!((s.optics.uv[0][1] - DVec2::new(0.5, -0.9)).length() < 1e-6);
}

#[test]
fn emissive_textures_multiply_the_radiance() {
    let emissive = r#","emissiveFactor":[4,4,4],"emissiveTexture":{"index":0}"#;
    let s = textured(&halves(), "", emissive, RIGHT).scene();
    let expected = Rgb::new(0.0, 4.0, 0.0) * std::f64::consts::PI;
    assert!((s.optics.emission(TriangleId(0), Side::Front) - expected).length() < 1e-6);
    let other = emissive.replace(r#""index":0"#, r#""index":0,"texCoord":1"#);
    let s = textured(&halves(), "", &other, RIGHT).scene();
    assert!(has_finding(&s, "material t", "texture coordinates of its own"));
}

#[test]
fn texture_alpha_decides_triangle_by_triangle() {
    for (mode, uv, state) in [
        (r#","alphaMode":"BLEND""#, LEFT, TriangleState::Transparent),
        (r#","alphaMode":"BLEND""#, RIGHT, TriangleState::Solid),
        (r#","alphaMode":"MASK""#, LEFT, TriangleState::Transparent),
        (r#","alphaMode":"MASK""#, RIGHT, TriangleState::Solid),
        ("", LEFT, TriangleState::Solid),
    ] {
        assert_eq!(textured(&halves(), "", mode, uv).scene().geometry.state, [state], "{mode}");
    }
}

#[test]
fn broken_textures_are_assumed_grey_and_said() {
    let s = textured(b"not a png", "", "", LEFT).scene();
    assert_eq!(s.optics.reflectance, [Rgb::splat(0.25)]);
    assert!(has_finding(&s, "texture 0", "mid-grey of 0.5 is assumed"));
    let mut doc = textured(&halves(), "", "", LEFT);
    doc.rest = doc.rest.replace(r#""bufferView":2"#, r#""uri":"gone.png""#);
    let s = doc.scene();
    assert_eq!(s.optics.reflectance, [Rgb::splat(0.25)]);
    assert!(has_finding(&s, "texture 0", "gone.png is missing"));
}

#[test]
fn doubts_of_a_mesh_are_named_once_for_all_its_instances() {
    let mut doc = textured(&halves(), "", "", LEFT);
    doc.primitive =
        r#"{"attributes":{"POSITION":0,"COLOR_0":0},"material":0,"targets":[{"POSITION":0}]}"#
            .into();
    doc.nodes = r#"{"mesh":0,"children":[1]},{"mesh":0,"translation":[0,0,1]}"#.into();
    let s = doc.scene();
    assert_eq!(s.geometry.len(), 2);
    for doubt in ["no texture coordinates", "morph targets"] {
        let named = s.findings.iter().filter(|f| f.message.contains(doubt)).count();
        assert_eq!(named, 1, "{doubt}");
    }
}
