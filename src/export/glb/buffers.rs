//! The binary part of a glTF file, and the file as a whole.

use serde_json::{Map, Value, json};

/// Bytes, views of them, and accessors.
#[derive(Debug, Default)]
pub(super) struct Buffers {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// What accessors hold.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;

/// What views are for.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

impl Buffers {
    /// A view of some bytes.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Vertices' values of so many components; `bounded` says their least and most.
    pub fn floats(&mut self, values: &[f32], width: usize, bounded: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(VERTICES));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][(width - 1).min(3)];
        let count = values.len() / width;
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": count, "type": kind
        });
        if bounded {
            let bound = |start: f32, f: fn(f32, f32) -> f32| -> Vec<f32> {
                let of = |c| values.iter().skip(c).step_by(width).fold(start, |m, v| f(m, *v));
                (0..width).map(of).collect()
            };
            accessor["min"] = json!(bound(f32::INFINITY, f32::min));
            accessor["max"] = json!(bound(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Colours of vertices, 0..1, opaque, in 16 bits.
    pub fn colours(&mut self, values: &[[f32; 3]]) -> usize {
        let wide = |c: f32| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|c| [wide(c[0]), wide(c[1]), wide(c[2]), u16::MAX])
            .flat_map(u16::to_le_bytes)
            .collect();
        let view = self.view(&bytes, Some(VERTICES));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": UNSIGNED_SHORT,
            "normalized": true,
            "count": values.len(),
            "type": "VEC4",
        }));
        self.accessors.len() - 1
    }

    /// Indices of vertices.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(INDICES));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": UNSIGNED_INT,
            "count": values.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// The file: a header, the document, and the bytes.
    pub fn finish(mut self, mut json: Map<String, Value>) -> Result<Vec<u8>, String> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        json.insert("buffers".into(), json!([{ "byteLength": self.bytes.len() }]));
        json.insert("bufferViews".into(), Value::Array(self.views));
        json.insert("accessors".into(), Value::Array(self.accessors));
        let mut text = serde_json::to_vec(&json).map_err(|e| e.to_string())?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bytes.len();
        let word = |n: usize| u32::try_from(n).map(u32::to_le_bytes);
        let large = |_| String::from("a model of more than 4 GiB cannot be written as .glb");
        let mut file = Vec::with_capacity(length);
        file.extend(b"glTF");
        file.extend(2_u32.to_le_bytes());
        file.extend(word(length).map_err(large)?);
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.bytes)] {
            file.extend(word(chunk.len()).map_err(large)?);
            file.extend(kind);
            file.extend(chunk);
        }
        Ok(file)
    }
}
