use std::fs;
use std::path::Path;

use base64::Engine;
use glam::{DVec2, DVec3};
use proptest::prelude::*;

use crate::scene::import::{ImportOptions, SidesChoice, load};
use crate::scene::source::{ImportError, Source};
use crate::scene::texture::tests::png;
use crate::scene::{Lamp, Rgb, Scene, Side, Sides, TriangleId, TriangleState};

/// A document with one buffer, put together piece by piece.
#[derive(Default)]
struct Doc {
    buffer: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    nodes: String,
    primitive: String,
    rest: String,
}

impl Doc {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let at = self.buffer.len();
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{}}}"#, bytes.len()));
        self.buffer.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"}}"#
        ));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let width = if kind == "VEC2" { 2 } else { 3 };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, values.len() / width, kind)
    }

    /// A right triangle in the x-y plane, facing +z, as `POSITION` of accessor 0.
    fn triangle() -> Self {
        let mut doc = Self::default();
        doc.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
        doc.primitive = r#"{"attributes":{"POSITION":0}}"#.into();
        doc.nodes = r#"{"mesh":0}"#.into();
        doc
    }

    /// A unit square of four vertices for strips, fans and indices.
    fn square(order: [[f32; 3]; 4], primitive: &str) -> Self {
        let mut doc = Self::default();
        doc.floats(order.as_flattened(), "VEC3");
        doc.primitive = primitive.into();
        doc.nodes = r#"{"mesh":0}"#.into();
        doc
    }

    fn json(&self, uri: Option<&str>) -> String {
        let uri = uri.map_or(String::new(), |u| format!(r#","uri":"{u}""#));
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{}],"meshes":[{{"name":"m","primitives":[{}]}}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}{uri}}}]{}}}"#,
            self.nodes,
            self.primitive,
            self.accessors.join(","),
            self.views.join(","),
            self.buffer.len(),
            self.rest
        )
    }

    fn embedded(&self) -> String {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.buffer);
        self.json(Some(&format!("data:application/octet-stream;base64,{data}")))
    }

    fn glb(&self) -> Vec<u8> {
        let mut json = self.json(None).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.buffer.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut out = b"glTF".to_vec();
        let length = 12 + 8 + json.len() + 8 + binary.len();
        for word in [2, length as u32, json.len() as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(&json);
        out.extend((binary.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(&binary);
        out
    }

    fn load(&self) -> Result<Scene, ImportError> {
        load_as("m.gltf", self.embedded().as_bytes())
    }

    fn scene(&self) -> Scene {
        self.load().unwrap()
    }

    fn message(&self) -> String {
        self.load().unwrap_err().to_string()
    }
}

fn load_as(name: &str, bytes: &[u8]) -> Result<Scene, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    load(&path, &ImportOptions::default())
}

fn corners(s: &Scene, t: u32) -> [DVec3; 3] {
    s.geometry.corners(TriangleId(t))
}

fn has_finding(s: &Scene, place: &str, message: &str) -> bool {
    s.findings.iter().any(|f| f.place.contains(place) && f.message.contains(message))
}

const UNIT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

#[test]
fn embedded_external_and_binary_buffers_are_alike() {
    let doc = Doc::triangle();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("my é.bin"), &doc.buffer).unwrap();
    fs::write(folder.path().join("m.gltf"), doc.json(Some("my%20%C3%A9.bin"))).unwrap();
    let external = load(&folder.path().join("m.gltf"), &ImportOptions::default()).unwrap();
    for s in [doc.scene(), external, load_as("m.glb", &doc.glb()).unwrap()] {
        assert_eq!(corners(&s, 0), UNIT);
        assert_eq!((s.geometry.len(), s.up), (1, DVec3::Y));
        assert_eq!(s.geometry.sides, [Sides::One]);
        assert_eq!(s.optics.reflectance, [Rgb::splat(0.9)], "the default material, clamped");
        assert_eq!(s.geometry.surfaces[0].name, "m");
        assert!(!has_finding(&s, "", "metallic"));
    }
}

#[test]
fn all_index_types_strips_and_fans() {
    let round = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let zigzag = [round[0], round[1], round[3], round[2]];
    let fan = Doc::square(round, r#"{"attributes":{"POSITION":0},"mode":6}"#);
    let strip = Doc::square(zigzag, r#"{"attributes":{"POSITION":0},"mode":5}"#);
    let mut docs = vec![fan, strip];
    let order = [0_u32, 1, 2, 0, 2, 3];
    for component in [5121, 5123, 5125] {
        let mut doc = Doc::square(round, r#"{"attributes":{"POSITION":0},"indices":1,"mode":4}"#);
        let bytes: Vec<u8> = match component {
            5121 => order.iter().map(|&i| i as u8).collect(),
            5123 => order.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect(),
            _ => order.iter().flat_map(|&i| i.to_le_bytes()).collect(),
        };
        doc.accessor(&bytes, component, 6, "SCALAR");
        docs.push(doc);
    }
    for doc in docs {
        let s = doc.scene();
        assert_eq!(s.geometry.len(), 2);
        for t in s.geometry.ids() {
            assert!((s.geometry.area(t) - 0.5).abs() < 1e-12);
            assert_eq!(s.geometry.normal(t, Side::Front), DVec3::Z);
        }
        assert!(s.geometry.state.iter().all(|p| *p == TriangleState::Solid));
    }
}

#[test]
fn strides_quantized_positions_and_sparse_accessors() {
    let mut doc = Doc::triangle();
    // Interleaved: 16 bytes a vertex, positions in the first 12.
    let mut bytes = Vec::new();
    for p in [[0.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]] {
        bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(7.0_f32.to_le_bytes());
    }
    bytes.truncate(44);
    doc.accessor(&bytes, 5126, 3, "VEC3");
    doc.views[1] = doc.views[1].replace('}', r#","byteStride":16}"#);
    doc.primitive = r#"{"attributes":{"POSITION":1}}"#.into();
    assert_eq!(corners(&doc.scene(), 0), UNIT.map(|p| 2.0 * p));

    let mut doc = Doc::triangle();
    let bytes: Vec<u8> =
        [0_i16, 0, 0, 32_767, 0, 0, 0, 32_767, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    doc.accessor(&bytes, 5122, 3, "VEC3");
    doc.accessors[1] = doc.accessors[1].replace('}', r#","normalized":true}"#);
    doc.primitive = r#"{"attributes":{"POSITION":1}}"#.into();
    doc.rest = r#","extensionsRequired":["KHR_mesh_quantization"]"#.into();
    assert_eq!(corners(&doc.scene(), 0), UNIT);

    let mut doc = Doc::triangle();
    let indices = doc.view(&[2]);
    let values = doc.view(&[0.0_f32, 0.0, 5.0].map(f32::to_le_bytes).concat());
    doc.accessors[0] = doc.accessors[0].replace(
        r#""type""#,
        &format!(
            r#""sparse":{{"count":1,"indices":{{"bufferView":{indices},"componentType":5121}},"values":{{"bufferView":{values}}}}},"type""#
        ),
    );
    assert_eq!(corners(&doc.scene(), 0), [DVec3::ZERO, DVec3::X, 5.0 * DVec3::Z]);
}

#[test]
fn nodes_place_instances_and_mirrors_keep_fronts_outside() {
    let mut doc = Doc::triangle();
    doc.nodes = r#"{"children":[1,2,3],"translation":[0,0,10]},
        {"mesh":0,"name":"moved","translation":[1,2,3],"scale":[2,2,2]},
        {"mesh":0,"name":"mirrored","scale":[-1,1,1]},
        {"mesh":0,"matrix":[0,1,0,0, -1,0,0,0, 0,0,1,0, 5,0,0,1]}"#
        .into();
    let s = doc.scene();
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    assert_eq!(corners(&s, 0), [at(1.0, 2.0, 13.0), at(3.0, 2.0, 13.0), at(1.0, 4.0, 13.0)]);
    assert_eq!(s.geometry.normal(TriangleId(1), Side::Front), DVec3::Z);
    assert_eq!(corners(&s, 2), [at(5.0, 0.0, 10.0), at(5.0, 1.0, 10.0), at(4.0, 0.0, 10.0)]);
    let names: Vec<_> = s.geometry.surfaces.iter().map(|s| (s.name.as_str(), s.node)).collect();
    assert_eq!(names, [("moved", 1), ("mirrored", 2), ("m", 3)]);
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
        r#""doubleSided":true,"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}},"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],"metallicFactor":0}"#,
    );
    assert_eq!(s.optics.reflectance, [Rgb::new(0.5, 0.25, 0.125)]);
    assert_eq!(s.geometry.sides, [Sides::Two]);
    let emission = Rgb::new(8.0, 4.0, 0.0) * std::f64::consts::PI;
    assert_eq!(s.optics.emission(TriangleId(0), Side::Front), emission);
    assert_eq!(s.optics.emission(TriangleId(0), Side::Back), emission);
    assert!(s.findings.is_empty(), "{:?}", s.findings);
    assert!(has_finding(&material(r#""doubleSided":false"#), "material a", "metallic"));

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
fn textured(image: &[u8], info: &str, material: &str, uv: [f32; 6]) -> Doc {
    let mut doc = Doc::triangle();
    doc.floats(&uv, "VEC2");
    let view = doc.view(image);
    doc.primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}"#.into();
    doc.rest = format!(
        r#","images":[{{"bufferView":{view},"mimeType":"image/png"}}],"samplers":[{{"wrapS":33071}}],"textures":[{{"source":0,"sampler":0}}],"materials":[{{"name":"t","pbrMetallicRoughness":{{"metallicFactor":0,"baseColorFactor":[0.5,0.5,0.5,1],"baseColorTexture":{{"index":0{info}}}}}{material}}}]"#
    );
    doc
}

/// Left half red and clear, right half green and solid.
fn halves() -> Vec<u8> {
    let row: Vec<[u8; 4]> =
        (0..16).map(|x| if x < 8 { [255, 0, 0, 0] } else { [0, 255, 0, 255] }).collect();
    png(16, 16, &row.repeat(16)).to_vec()
}

const LEFT: [f32; 6] = [0.0, 0.0, 0.5, 0.0, 0.0, 1.0];
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
    for doubt in ["no texture coordinates", "vertex colours", "morph targets"] {
        let named = s.findings.iter().filter(|f| f.message.contains(doubt)).count();
        assert_eq!(named, 1, "{doubt}");
    }
}

#[test]
fn points_and_lines_are_left_out_and_said() {
    let mut doc = Doc::triangle();
    doc.primitive += r#",{"attributes":{"POSITION":0},"mode":0},{"attributes":{},"mode":3}"#;
    let s = doc.scene();
    assert_eq!(s.geometry.len(), 1);
    assert!(has_finding(&s, "meshes", "2 primitives of points or lines"));
}

#[test]
fn cameras_and_lamps_follow_their_nodes() {
    let mut doc = Doc::triangle();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    doc.nodes = format!(
        r#"{{"mesh":0,"children":[1,2,3,4,5]}},
        {{"name":"view","camera":0,"translation":[1,2,3],"rotation":[0,{half},0,{half}]}},
        {{"camera":1}},
        {{"name":"bulb","translation":[0,4,0],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
        {{"name":"spot","rotation":[-{half},0,0,{half}],"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},
        {{"name":"sun","extensions":{{"KHR_lights_punctual":{{"light":2}}}}}}"#
    );
    doc.rest = r#","cameras":[
        {"type":"perspective","perspective":{"yfov":0.8,"znear":0.1,"aspectRatio":1.5}},
        {"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":9,"znear":0.1}}],
        "extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"point","color":[1,0.5,0.25],"intensity":100},
        {"type":"spot","intensity":10,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}},
        {"type":"directional","intensity":3}]}}"#
        .into();
    let s = doc.scene();
    let [camera] = &s.cameras[..] else { panic!("{:?}", s.cameras) };
    assert_eq!((camera.name.as_str(), camera.eye), ("view", DVec3::new(1.0, 2.0, 3.0)));
    assert!((camera.forward - DVec3::NEG_X).length() < 1e-6, "{}", camera.forward);
    assert!((camera.up - DVec3::Y).length() < 1e-6);
    assert!((camera.vfov - 0.8).abs() < 1e-6);
    assert_eq!(camera.aspect, Some(1.5));
    assert!(has_finding(&s, "camera", "orthographic"));
    assert_eq!(s.lamps.len(), 3);
    let intensity = Rgb::new(100.0, 50.0, 25.0);
    let position = DVec3::new(0.0, 4.0, 0.0);
    let (name, x_axis) = ("bulb".into(), DVec3::X);
    assert_eq!(s.lamps[0], Lamp::Point { name, position, intensity, x_axis, photometry: None });
    let Lamp::Spot { direction, inner, outer, .. } = &s.lamps[1] else { panic!() };
    assert!((*direction - DVec3::NEG_Y).length() < 1e-6, "{direction}");
    assert!((inner - 0.1).abs() < 1e-6 && (outer - 0.5).abs() < 1e-6);
    let (direction, irradiance) = (DVec3::NEG_Z, Rgb::splat(3.0));
    assert_eq!(s.lamps[2], Lamp::Directional { name: "sun".into(), direction, irradiance });
}

#[test]
fn required_extensions_are_named_with_a_remedy() {
    for (extension, remedy) in [
        ("KHR_draco_mesh_compression", "untick Compression"),
        ("EXT_meshopt_compression", "meshopt"),
        ("KHR_texture_basisu", "PNG"),
        ("XYZ_unheard_of", "export without it"),
    ] {
        let mut doc = Doc::triangle();
        doc.rest = format!(r#","extensionsRequired":["{extension}"]"#);
        let message = doc.message();
        assert!(message.contains(extension) && message.contains(remedy), "{message}");
    }
}

#[test]
fn options_scale_turn_and_override() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.glb");
    fs::write(&path, Doc::triangle().glb()).unwrap();
    let options = ImportOptions {
        unit: 0.001,
        up: Some(2.0 * DVec3::Z),
        max_reflectance: 0.5,
        sides: SidesChoice::Two,
    };
    let s = load(&path, &options).unwrap();
    assert_eq!(corners(&s, 0), UNIT.map(|p| p * 0.001));
    assert_eq!((s.up, s.geometry.sides[0]), (DVec3::Z, Sides::Two));
    assert_eq!(s.optics.reflectance, [Rgb::splat(0.5)]);
    for wrong in [
        ImportOptions { unit: 0.0, ..options },
        ImportOptions { unit: f64::NAN, ..options },
        ImportOptions { max_reflectance: 1.0, ..options },
        ImportOptions { up: Some(DVec3::ZERO), ..options },
    ] {
        use ImportError::{MaxReflectance, Unit, Up};
        let error = load(&path, &wrong);
        assert!(matches!(error, Err(Unit(_) | MaxReflectance(_) | Up(_))), "{wrong:?}");
    }
}

#[test]
fn broken_documents_are_errors_with_a_place() {
    let broken = |change: &dyn Fn(&mut Doc), expected: &str| {
        let mut doc = Doc::triangle();
        change(&mut doc);
        let message = doc.message();
        assert!(message.contains(expected), "`{message}` lacks `{expected}`");
    };
    let replace = |what: &'static str, with: &'static str| {
        move |d: &mut Doc| {
            d.accessors.iter_mut().chain(&mut d.views).for_each(|s| *s = s.replace(what, with));
            d.primitive = d.primitive.replace(what, with);
            d.nodes = d.nodes.replace(what, with);
        }
    };
    broken(&|d| d.primitive = r#"{"attributes":{"POSITION":7}}"#.into(), "accessor 7: does not");
    broken(&|d| d.primitive = r#"{"attributes":{}}"#.into(), "node 0 (m), primitive 0: has no POS");
    broken(&replace(r#""mesh":0"#, r#""mesh":9"#), "mesh 9 does not exist");
    broken(&replace(r#""count":3"#, r#""count":4"#), "accessor 0: its 4 elements go beyond");
    broken(&replace(r#""count":3"#, r#""count":18446744073709551615"#), "accessor 0");
    broken(&replace(r#""byteLength":36"#, r#""byteLength":37"#), "buffer view 0: goes beyond");
    broken(&replace(r#""byteOffset":0"#, r#""byteOffset":18446744073709551615"#), "buffer view 0");
    broken(&replace("VEC3", "VEC2"), "accessor 0: is Vec2 instead of Vec3");
    broken(&replace("VEC3", "VEC9"), "accessor 0: has an unknown type");
    broken(&replace(r#""buffer":0"#, r#""buffer":3"#), "its buffer 3 has no data");
    broken(&replace(r#"{"mesh":0}"#, r#"{"mesh":0,"children":[0]}"#), "its own ancestor");
    broken(&replace(r#"{"mesh":0}"#, r#"{"children":[8]}"#), "node 8: does not exist");
    broken(
        &replace(r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[1e38,1e38,1e38],"children":[]}"#),
        "exceeds",
    );
    broken(&|d| d.buffer[..4].copy_from_slice(&f32::NAN.to_le_bytes()), "vertex 0 is not finite");
    broken(
        &|d| {
            d.accessor(&[0, 1, 3], 5121, 3, "SCALAR");
            d.primitive = r#"{"attributes":{"POSITION":0},"indices":1}"#.into();
        },
        "index 3 is out of range: it has 3 vertices",
    );
    broken(&|d| d.nodes = "{}".into(), "has no triangles");
    // No data, and far more of it than memory holds.
    broken(
        &|d| {
            let n = u64::MAX;
            let sparse = r#""sparse":{"count":0,"indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":0}}"#;
            d.accessors[0] =
                format!(r#"{{"componentType":5126,"count":{n},"type":"VEC3",{sparse}}}"#);
        },
        "makes more than",
    );
}

#[test]
fn a_small_file_cannot_ask_for_all_memory() {
    // A binary tree would need a graph; a flat list of instances of a large mesh is enough.
    let mut doc = Doc::triangle();
    let indices = vec![0_u8; 300_000];
    doc.accessor(&indices, 5121, indices.len(), "SCALAR");
    doc.primitive = r#"{"attributes":{"POSITION":0},"indices":1}"#.into();
    let children: Vec<String> = (1..=3000).map(|i| i.to_string()).collect();
    let nodes = vec![r#"{"mesh":0}"#; 3000].join(",");
    doc.nodes = format!(r#"{{"children":[{}]}},{nodes}"#, children.join(","));
    // 100,000 triangles 3,000 times: the vertices stay few, the triangles do not.
    assert!(doc.message().contains("makes more than 33554432 triangles"));
}

#[test]
fn every_truncation_of_a_glb_is_an_error() {
    let whole = Doc::triangle().glb();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.glb");
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(load(&path, &ImportOptions::default()).is_err(), "{length} bytes");
    }
    fs::write(&path, &whole[..whole.len() - 1]).unwrap();
    let message = load(&path, &ImportOptions::default()).unwrap_err().to_string();
    assert!(message.contains("m.glb") && message.contains("truncated"), "{message}");
}

#[test]
fn missing_files_and_remote_ones_are_errors() {
    let message = |uri: &str| {
        load_as("m.gltf", Doc::triangle().json(Some(uri)).as_bytes()).unwrap_err().to_string()
    };
    assert!(message("gone.bin").contains("buffer 0: the file gone.bin is missing"));
    assert!(message("https://example.org/a.bin").contains("is not a file"));
    assert!(message("data:,abc").contains("buffer 0: has 3 of 36 bytes"));
    assert!(message("data:;base64,!!").contains("not base64"));
}

fn reads_without_panic(name: &str, bytes: &[u8]) {
    let source = Source { path: Path::new(name), bytes };
    let mut builder = crate::scene::SceneBuilder::new("noise");
    if super::read(&source, &mut builder).is_ok() {
        let _ = crate::scene::inspect(&builder.finish());
    }
}

proptest! {
    #[test]
    fn noise_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        reads_without_panic("m.gltf", &bytes);
        reads_without_panic("m.glb", &[b"glTF\x02\0\0\0", &bytes[..]].concat());
    }

    #[test]
    fn mutated_files_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
    ) {
        let whole = textured(&halves(), "", r#","alphaMode":"MASK""#, LEFT).glb();
        let mut bytes = whole.clone();
        for (at, value) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        reads_without_panic("m.glb", &bytes);
        reads_without_panic("m.glb", &bytes[..cut.index(bytes.len())]);
    }

    #[test]
    fn mutated_numbers_never_panic(at in 0_usize..60, value in "-?[0-9]{1,20}") {
        // Replaces the nth number of the JSON.
        let doc = textured(&halves(), "", r#","alphaMode":"BLEND""#, LEFT);
        let text = doc.json(None);
        let starts: Vec<usize> = text
            .char_indices()
            .filter(|&(i, c)| c.is_ascii_digit() && text[..i].ends_with([':', '[', ',']))
            .map(|(i, _)| i)
            .collect();
        let from = starts[at % starts.len()];
        let digits = text[from..].find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(0);
        let json = format!("{}{value}{}", &text[..from], &text[from + digits..]);
        let data = base64::engine::general_purpose::STANDARD.encode(&doc.buffer);
        let json = json.replacen(
            r#""buffers":[{"#,
            &format!(r#""buffers":[{{"uri":"data:;base64,{data}","#),
            1,
        );
        reads_without_panic("m.gltf", json.as_bytes());
    }
}
