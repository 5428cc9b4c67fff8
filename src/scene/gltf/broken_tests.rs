//! Documents that are broken, or ask for too much.

use std::fs;
use std::path::Path;

use base64::Engine;
use proptest::prelude::*;

use super::material_tests::{LEFT, halves, textured};
use super::tests::{Doc, load_as};
use crate::scene::import::{ImportOptions, load};
use crate::scene::source::Source;

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
    broken(
        &|d| {
            d.nodes = r#"{"mesh":0,"children":[1]},{"translation":[1e38,0,0],
                "extensions":{"KHR_lights_punctual":{"light":0}}}"#
                .into();
            d.rest = r#","extensions":{"KHR_lights_punctual":{"lights":[{"name":"far",
                "type":"point","intensity":1}]}}"#
                .into();
        },
        "light far: a coordinate exceeds 1e15 metres",
    );
    let long = Doc::triangle().json(Some(&"é".repeat(9999)));
    let message = load_as("m.gltf", long.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("is missing") && message.len() < 500, "{message}");
    let zeros = r#"{"componentType":5126,"count":33554432,"type":"VEC3","sparse":{"count":1,
        "indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":0}}}"#;
    broken(&|d| d.accessors[0] = zeros.into(), "33554432 elements are zeros that no buffer");
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
            let sparse = r#""sparse":{"count":0,
                "indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":0}}"#;
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

#[test]
fn json_of_another_shape_is_an_error() {
    for text in ["0", "[]", "[0]", "null", "true", r#""glTF""#, "{}", r#"{"scenes":0,"meshes":1}"#]
    {
        assert!(load_as("m.gltf", text.as_bytes()).is_err(), "{text}");
    }
}

fn reads_without_panic(name: &str, bytes: &[u8]) {
    let source = Source::new(Path::new(name), bytes);
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
