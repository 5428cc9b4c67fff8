//! Documents that are sound: buffers, meshes, nodes, cameras and lamps.

use std::fs;

use base64::Engine;
use glam::DVec3;

use crate::scene::import::{ImportOptions, SidesChoice, load};
use crate::scene::source::ImportError;
use crate::scene::{GroupBy, Lamp, Rgb, Scene, Side, Sides, TriangleId, TriangleState};

/// A document with one buffer, put together piece by piece.
#[derive(Default)]
pub(super) struct Doc {
    pub buffer: Vec<u8>,
    pub views: Vec<String>,
    pub accessors: Vec<String>,
    pub nodes: String,
    pub primitive: String,
    pub rest: String,
}

impl Doc {
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let at = self.buffer.len();
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{}}}"#, bytes.len()));
        self.buffer.extend_from_slice(bytes);
        self.views.len() - 1
    }

    pub fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"}}"#
        ));
        self.accessors.len() - 1
    }

    pub fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let width = if kind == "VEC2" { 2 } else { 3 };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, values.len() / width, kind)
    }

    /// A right triangle in the x-y plane, facing +z, as `POSITION` of accessor 0.
    pub fn triangle() -> Self {
        let mut doc = Self::default();
        doc.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
        doc.primitive = r#"{"attributes":{"POSITION":0}}"#.into();
        doc.nodes = r#"{"mesh":0}"#.into();
        doc
    }

    /// A unit square of four vertices for strips, fans and indices.
    pub fn square(order: [[f32; 3]; 4], primitive: &str) -> Self {
        let mut doc = Self::default();
        doc.floats(order.as_flattened(), "VEC3");
        doc.primitive = primitive.into();
        doc.nodes = r#"{"mesh":0}"#.into();
        doc
    }

    pub fn json(&self, uri: Option<&str>) -> String {
        let uri = uri.map_or(String::new(), |u| format!(r#","uri":"{u}""#));
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{}],
            "meshes":[{{"name":"m","primitives":[{}]}}],"accessors":[{}],"bufferViews":[{}],
            "buffers":[{{"byteLength":{}{uri}}}]{}}}"#,
            self.nodes,
            self.primitive,
            self.accessors.join(","),
            self.views.join(","),
            self.buffer.len(),
            self.rest
        )
    }

    pub fn embedded(&self) -> String {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.buffer);
        self.json(Some(&format!("data:application/octet-stream;base64,{data}")))
    }

    pub fn glb(&self) -> Vec<u8> {
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

    pub fn load(&self) -> Result<Scene, ImportError> {
        load_as("m.gltf", self.embedded().as_bytes())
    }

    pub fn scene(&self) -> Scene {
        self.load().unwrap()
    }

    pub fn message(&self) -> String {
        self.load().unwrap_err().to_string()
    }
}

pub(super) fn load_as(name: &str, bytes: &[u8]) -> Result<Scene, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    load(&path, &ImportOptions::default())
}

pub(super) fn corners(s: &Scene, t: u32) -> [DVec3; 3] {
    s.geometry.corners(TriangleId(t))
}

pub(super) fn has_finding(s: &Scene, place: &str, message: &str) -> bool {
    s.findings.iter().any(|f| f.place.contains(place) && f.message.contains(message))
}

pub(super) const UNIT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

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
            r#""sparse":{{"count":1,"indices":{{"bufferView":{indices},"componentType":5121}},
            "values":{{"bufferView":{values}}}}},"type""#
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
        {{"name":"bulb","translation":[0,4,0],
        "extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
        {{"name":"spot","rotation":[-{half},0,0,{half}],
        "extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},
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
fn every_node_with_a_mesh_is_an_object() {
    let mut doc = Doc::triangle();
    doc.nodes = r#"{"children":[1,2,3]},{"mesh":0,"name":"wheel"},
        {"mesh":0,"name":"wheel","translation":[0,0,1]},{"mesh":0,"translation":[0,0,2]}"#
        .into();
    let names = |by| doc.scene().grouping(by).names;
    assert_eq!(names(GroupBy::Object), ["wheel", "wheel (node 2)", "m"]);
    assert_eq!(names(GroupBy::Surface), ["wheel", "m"]);
}

#[test]
fn colours_of_vertices_multiply_the_base_colour() {
    let mut doc = Doc::triangle();
    let bytes = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 0, 0];
    doc.accessor(&bytes, 5121, 3, "VEC4");
    doc.accessors[1] = doc.accessors[1].replace(r#""count""#, r#""normalized":true,"count""#);
    doc.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":1}}"#.into();
    let rho = doc.scene().optics.reflectance[0];
    assert!((rho - Rgb::new(1.0, 1.0, 0.0) / 3.0).length() < 1e-9, "{rho}");
    let mut doc = Doc::triangle();
    doc.floats(&[0.5; 9], "VEC3");
    doc.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":1}}"#.into();
    assert_eq!(doc.scene().optics.reflectance[0], Rgb::splat(0.5));
}

#[test]
fn the_first_version_is_named_with_a_way_to_convert_it() {
    let first = r#"{"asset":{"version":"1.0"},"meshes":{"m":{}},"nodes":{}}"#;
    let message = load_as("m.gltf", first.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("is glTF 1.0, not 2.0") && message.contains("gltf-pipeline"));
    let mut first = Doc::triangle().glb();
    first[4] = 1;
    let message = load_as("m.glb", &first).unwrap_err().to_string();
    assert!(message.contains("GLB version 1") && message.contains("gltf-pipeline"), "{message}");
}

#[test]
fn a_scene_without_nodes_has_no_triangles() {
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"name":"empty"}]}"#;
    let message = load_as("m.gltf", text.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("has no triangles"), "{message}");
}

#[test]
fn chunks_without_padding_are_read() {
    let doc = Doc::triangle();
    let json = doc.json(None).into_bytes();
    let json = [&json[..], &b" ".repeat(5 - json.len() % 4)].concat();
    assert_eq!(json.len() % 4, 1);
    let words = |words: &[usize]| -> Vec<u8> {
        words.iter().flat_map(|&w| (w as u32).to_le_bytes()).collect()
    };
    let length = 12 + 8 + json.len() + 8 + doc.buffer.len();
    let head = [b"glTF", &*words(&[2, length, json.len()]), b"JSON"].concat();
    let tail = [&*words(&[doc.buffer.len()]), b"BIN\0", &doc.buffer].concat();
    let glb = [head, json, tail].concat();
    assert_eq!(load_as("m.glb", &glb).unwrap().geometry.len(), 1);
}
