//! glTF: a model with every part that is read, and one as the exporters write it.

use std::error::Error;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::{Input, Sound, images};

/// A binary file of its two parts.
pub fn glb(text: &[u8], buffer: &[u8]) -> Vec<u8> {
    let padded = |part: &[u8], by: u8| {
        let mut part = part.to_vec();
        part.resize(part.len().next_multiple_of(4), by);
        part
    };
    let (text, buffer) = (padded(text, b' '), padded(buffer, 0));
    let mut file = b"glTF".to_vec();
    let all = 28 + text.len() + buffer.len();
    for word in [2, all as u32, text.len() as u32] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(text);
    file.extend((buffer.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(buffer);
    file
}

/// With a buffer and a picture in files of their own, and in itself.
pub fn gltf() -> Sound {
    let (picture, jpeg) = (images::masked()?, images::jpeg()?);
    let (mut model, buffer) = model(&picture)?;
    model["buffers"][0]["uri"] = json!("model%20data.bin");
    model["images"][0] = json!({ "uri": "map.jpg" });
    let outside = Input::new("m.gltf", model.to_string());
    model["buffers"][0]["uri"] = json!(embedded("application/octet-stream", &buffer));
    model["images"][0] = json!({ "uri": embedded("image/png", &picture) });
    Ok(vec![
        Input::new("m.gltf", model.to_string()),
        outside.and("model data.bin", buffer).and("map.jpg", jpeg),
    ])
}

pub fn glbs() -> Sound {
    let (model, buffer) = model(&images::masked()?)?;
    Ok(vec![Input::new("m.glb", glb(model.to_string().as_bytes(), &buffer))])
}

fn embedded(kind: &str, bytes: &[u8]) -> String {
    format!("data:{kind};base64,{}", STANDARD.encode(bytes))
}

/// A buffer and where its parts are.
#[derive(Default)]
struct Parts {
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Parts {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let (at, length) = (self.buffer.len(), bytes.len());
        self.views.push(json!({ "buffer": 0, "byteOffset": at, "byteLength": length }));
        self.buffer.extend(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": count, "type": kind
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let width = if kind == "VEC2" { 2 } else { 3 };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, values.len() / width, kind)
    }
}

fn model(picture: &[u8]) -> Result<(Value, Vec<u8>), Box<dyn Error>> {
    let mut parts = Parts::default();
    let square: &[f32] = &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let positions = parts.floats(square, "VEC3");
    let uv = parts.floats(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0], "VEC2");
    let colours = parts.floats(&[0.5; 12], "VEC3");
    let shorts: Vec<u8> = [0_u16, 2, 1, 0, 3, 2].iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices = parts.accessor(&shorts, 5123, 6, "SCALAR");
    let bytes = parts.accessor(&[0, 3, 2, 1], 5121, 4, "SCALAR");
    let small: Vec<u8> = [[0_i16, 0, 0, 0], [9, 0, 0, 0], [0, 9, 0, 0]]
        .iter()
        .flatten()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    let small = parts.accessor(&small, 5122, 3, "VEC3");
    parts.views[5]["byteStride"] = json!(8);
    let at = parts.view(&[1, 0]);
    let moved: Vec<u8> = [1.0_f32, 0.5, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let values = parts.view(&moved);
    let mut sparse = parts.accessors[positions].clone();
    sparse["sparse"] = json!({
        "count": 1, "indices": { "bufferView": at, "componentType": 5123 },
        "values": { "bufferView": values }
    });
    parts.accessors.push(sparse);
    let sparse = parts.accessors.len() - 1;
    let image = parts.view(picture);
    let mut model = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_texture_transform", "KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 3] }],
        "nodes": [
            { "name": "floor", "mesh": 0, "children": [1, 2], "scale": [4.0, 1.0, 3.0] },
            { "name": "lamp", "mesh": 1, "translation": [0.25, 2.5, 0.25],
              "rotation": [1.0, 0.0, 0.0, 0.0], "scale": [0.5, 1.0, 0.5] },
            { "name": "leaf", "mesh": 2, "matrix":
              [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0] },
            { "name": "eye", "camera": 0, "translation": [2.0, 1.0, 6.0], "children": [4] },
            { "name": "spot", "extensions": { "KHR_lights_punctual": { "light": 1 } } }
        ],
        "cameras": [{ "type": "perspective", "perspective":
            { "yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5 } }],
        "meshes": [
            { "name": "floor", "primitives": [{ "material": 0, "indices": indices, "attributes":
                { "POSITION": positions, "TEXCOORD_0": uv, "COLOR_0": colours } }] },
            { "name": "lamp", "primitives": [{ "material": 1, "indices": bytes, "mode": 6,
                "attributes": { "POSITION": sparse } }] },
            { "name": "leaf", "primitives": [
                { "material": 2, "mode": 5,
                  "attributes": { "POSITION": positions, "TEXCOORD_0": uv } },
                { "attributes": { "POSITION": small } }] }
        ],
        "materials": [
            { "name": "wood", "doubleSided": true, "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.7, 0.6, 1.0], "metallicFactor": 0.1,
                "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform":
                    { "offset": [0.1, 0.2], "rotation": 0.5, "scale": [2.0, 2.0] } } } } },
            { "name": "glow", "emissiveFactor": [1.0, 0.9, 0.8], "extensions": {
                "KHR_materials_emissive_strength": { "emissiveStrength": 20.0 } } },
            { "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.4,
              "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
              "emissiveTexture": { "index": 0 }, "emissiveFactor": [0.1, 0.1, 0.1],
              "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.1 } } },
            { "name": "gold", "extensions": { "KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [0.0, 0.0, 0.0, 1.0], "specularFactor": [0.7, 0.5, 0.2] } } }
        ],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648 }],
        "images": [{ "bufferView": image, "mimeType": "image/png" }]
    });
    model["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "intensity": 3.0 },
        { "type": "spot", "name": "s", "color": [1.0, 0.5, 0.2], "intensity": 50.0,
          "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.6 } },
        { "type": "point", "range": 10.0 }
    ] } });
    model["accessors"] = json!(parts.accessors);
    model["bufferViews"] = json!(parts.views);
    model["buffers"] = json!([{ "byteLength": parts.buffer.len() }]);
    Ok((model, parts.buffer))
}
