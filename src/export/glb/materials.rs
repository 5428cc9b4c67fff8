//! Materials, textures and extensions of a baked model.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::buffers::Buffers;
use super::mode::BakeMode;
use crate::export::png::encode_png;

/// The filters and wrapping of an atlas: no mipmaps, which would mix charts.
const LINEAR: u32 = 9729;
const CLAMP: u32 = 33071;

/// Materials in use: one of the original's, or none, at an irradiance that a texel of 1 stands for.
#[derive(Debug, Default)]
pub(super) struct Variants {
    used: Vec<(Option<usize>, f64)>,
}

impl Variants {
    /// The number of one in the new document.
    pub fn number(&mut self, material: Option<usize>, intensity: f64) -> usize {
        let own = (material, intensity);
        let known = self.used.iter().position(|u| *u == own);
        known.unwrap_or_else(|| {
            self.used.push(own);
            self.used.len() - 1
        })
    }
}

/// Makes the materials in use show the light.
pub(super) fn light(
    json: &mut Map<String, Value>,
    (mode, set): (BakeMode, usize),
    variants: &Variants,
) {
    let texture = match mode {
        BakeMode::Lightmap { .. } => length(json, "textures"),
        _ => 0,
    };
    let old = json.remove("materials").unwrap_or_default();
    let plain = || json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 } });
    let variant = |(material, intensity): &(Option<usize>, f64)| {
        let own = material.and_then(|m| old.get(m)).filter(|m| m.is_object());
        let own = own.cloned().unwrap_or_else(plain);
        match mode {
            BakeMode::Unlit => unlit(&own, json!({ "baseColorTexture": { "index": texture } })),
            BakeMode::Vertex => {
                let mut own = unlit(&own, json!({}));
                within(&mut own, "extras")["hemicube"] = json!({ "scale": intensity });
                own
            }
            BakeMode::Lightmap { .. } => lightmapped(&own, (texture, set), *intensity),
        }
    };
    json.insert("materials".into(), variants.used.iter().map(variant).collect());
    let keeps_lamps = matches!(mode, BakeMode::Lightmap { keeps_lamps: true });
    if !matches!(mode, BakeMode::Lightmap { .. }) {
        for key in ["textures", "samplers", "images"] {
            json.remove(key);
        }
    }
    if !keeps_lamps {
        drop_extension(json.get_mut("extensions"), "KHR_lights_punctual");
        for node in json.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten() {
            drop_extension(node.get_mut("extensions"), "KHR_lights_punctual");
        }
    }
}

fn drop_extension(extensions: Option<&mut Value>, name: &str) {
    if let Some(Value::Object(extensions)) = extensions {
        extensions.remove(name);
    }
}

/// A material that shows its colour as it is, on its front.
fn unlit(material: &Value, mut pbr: Value) -> Value {
    pbr["metallicFactor"] = json!(0.0);
    pbr["roughnessFactor"] = json!(1.0);
    let mut own =
        json!({ "pbrMetallicRoughness": pbr, "extensions": { "KHR_materials_unlit": {} } });
    for key in ["name", "extras"] {
        if let Some(value) = material.get(key) {
            own[key] = value.clone();
        }
    }
    own
}

/// The same material with a lightmap.
fn lightmapped(material: &Value, (texture, set): (usize, usize), intensity: f64) -> Value {
    let mut own = material.clone();
    if let Some(own) = own.as_object_mut() {
        // Each side has triangles of its own.
        own.remove("doubleSided");
        // Masks are cut out.
        if own.get("alphaMode").and_then(Value::as_str) == Some("MASK") {
            own.remove("alphaMode");
            own.remove("alphaCutoff");
        }
    }
    within(&mut own, "extensions")["MOZ_lightmap"] =
        json!({ "index": texture, "texCoord": set, "intensity": intensity });
    own
}

/// The object of that name in another; what is none is replaced.
fn within<'a>(own: &'a mut Value, key: &str) -> &'a mut Value {
    let value = &mut own[key];
    if !value.is_object() {
        *value = json!({});
    }
    value
}

/// Adds the images, and for the last of them, the atlas, a texture.
pub(super) fn images(
    json: &mut Map<String, Value>,
    images: Vec<Option<Vec<u8>>>,
    mode: BakeMode,
    buffers: &mut Buffers,
) {
    if images.is_empty() {
        return;
    }
    let names = json.remove("images").unwrap_or_default();
    let last = images.len() - 1;
    let mut written = Vec::new();
    for (i, image) in images.into_iter().enumerate() {
        let name = match i {
            _ if i == last => json!("light"),
            _ => names[i].get("name").cloned().unwrap_or(Value::Null),
        };
        // What cannot be read is a grey texel.
        let bytes = image.filter(|b| kind(b).is_some()).unwrap_or_else(grey);
        let mut own = json!({
            "mimeType": kind(&bytes).unwrap_or("image/png"),
            "bufferView": buffers.view(&bytes, None),
        });
        if name.is_string() {
            own["name"] = name;
        }
        written.push(own);
    }
    json.insert("images".into(), Value::Array(written));
    let sampler = length(json, "samplers");
    push(
        json,
        "samplers",
        json!({
            "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP, "wrapT": CLAMP
        }),
    );
    let mut texture = json!({ "source": last, "sampler": sampler });
    if !matches!(mode, BakeMode::Unlit) {
        texture["name"] = json!("irradiance");
    }
    push(json, "textures", texture);
}

fn grey() -> Vec<u8> {
    encode_png([1, 1], &[188; 3]).unwrap_or_default()
}

fn kind(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        [0xff, 0xd8, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        _ => None,
    }
}

fn length(json: &Map<String, Value>, key: &str) -> usize {
    json.get(key).and_then(Value::as_array).map_or(0, Vec::len)
}

fn push(json: &mut Map<String, Value>, key: &str, value: Value) {
    if let Value::Array(all) = json.entry(key).or_insert_with(|| json!([])) {
        all.push(value);
    }
}

/// Names the extensions that are used, and no others.
pub(super) fn extensions(json: &mut Map<String, Value>) {
    let mut used = BTreeSet::new();
    for value in json.values_mut() {
        collect(value, &mut used);
    }
    if let Some(Value::Object(own)) = json.get("extensions") {
        used.extend(own.keys().cloned());
    }
    if json.get("extensions").and_then(Value::as_object).is_some_and(Map::is_empty) {
        json.remove("extensions");
    }
    let required = json.remove("extensionsRequired").unwrap_or_default();
    let required: Vec<Value> = required
        .as_array()
        .into_iter()
        .flatten()
        .filter(|e| e.as_str().is_some_and(|e| used.contains(e)))
        .cloned()
        .collect();
    json.remove("extensionsUsed");
    if !used.is_empty() {
        json.insert("extensionsUsed".into(), used.into_iter().collect());
    }
    if !required.is_empty() {
        json.insert("extensionsRequired".into(), Value::Array(required));
    }
}

/// The names of extensions below a value; empty lists of them are taken out.
fn collect(value: &mut Value, used: &mut BTreeSet<String>) {
    match value {
        Value::Array(all) => all.iter_mut().for_each(|v| collect(v, used)),
        Value::Object(all) => {
            if let Some(Value::Object(own)) = all.get("extensions") {
                used.extend(own.keys().cloned());
                if own.is_empty() {
                    all.remove("extensions");
                }
            }
            all.values_mut().for_each(|v| collect(v, used));
        }
        _ => {}
    }
}
