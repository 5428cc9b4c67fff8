//! From a file's bytes to its JSON and its buffers.

use std::collections::HashMap;
use std::sync::Arc;

use gltf::json;
use serde_json::Value;

use super::document::{Bytes, Document};
use super::uri;
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// Opens a document and loads its buffers.
pub fn open<'a>(source: &'a Source<'a>) -> Result<Document<'a>, ImportError> {
    let (text, chunk) = split(source)?;
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let root = match json::Root::from_slice(text) {
        Ok(root) => root,
        Err(error) => read_loosely(source, text)?.ok_or_else(|| {
            source.malformed(Place::Element("JSON".into()), error.to_string(), remedy_for(text))
        })?,
    };
    if !root.asset.version.starts_with("2.") {
        return Err(source.malformed(
            Place::Element("asset".into()),
            format!("is glTF {}, not 2.0", root.asset.version),
            "export the model as glTF 2.0",
        ));
    }
    let buffers = buffers(source, &root, chunk)?;
    Ok(Document { source, text, root, buffers })
}

/// What to do about a file of the first version.
const CONVERT: &str = "convert it, for example by `npx gltf-pipeline -i old.gltf -o new.gltf`";

/// Reads what the schema refuses and is sound: a scene without nodes. Names the first version of
/// glTF, which is written otherwise.
fn read_loosely(source: &Source<'_>, text: &[u8]) -> Result<Option<json::Root>, ImportError> {
    let Ok(mut value) = serde_json::from_slice::<Value>(text) else { return Ok(None) };
    let version = value.pointer("/asset/version").and_then(Value::as_str);
    // Its lists are maps.
    if version.is_some_and(|v| v.starts_with("1.")) || value["meshes"].is_object() {
        let place = Place::Element("asset".into());
        return Err(source.malformed(place, "is glTF 1.0, not 2.0", CONVERT));
    }
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    Ok(json::Root::from_slice(value.to_string().as_bytes()).ok())
}

fn remedy_for(text: &[u8]) -> &'static str {
    if text.first().is_none_or(|&b| b != b'{' && !b.is_ascii_whitespace()) {
        "is it a glTF file? Export the model again"
    } else {
        EXPORT_AGAIN
    }
}

const MAGIC: &[u8] = b"glTF";

/// The JSON and the binary chunk of a GLB file; all of a plain file is JSON.
fn split<'a>(source: &Source<'a>) -> Result<(&'a [u8], Option<&'a [u8]>), ImportError> {
    let bytes = source.bytes;
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let broken = |place: &str, problem: String| {
        source.malformed(Place::Element(place.into()), problem, "copy or export the file again")
    };
    let word = |at: usize| {
        bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(broken("GLB header", format!("the file ends after {} bytes", bytes.len())));
    };
    if version != 2 {
        let place = Place::Element("GLB header".into());
        let problem = format!("is GLB version {version}, not 2");
        let remedy = if version == 1 { CONVERT } else { "export the model as glTF 2.0" };
        return Err(source.malformed(place, problem, remedy));
    }
    if length > bytes.len() {
        return Err(broken(
            "GLB header",
            format!("the file is truncated: it has {} of {length} bytes", bytes.len()),
        ));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at < length {
        let place = format!("GLB chunk at byte {at}");
        let end = word(at).and_then(|n| (at + 8).checked_add(n)).filter(|&end| end <= bytes.len());
        let Some(end) = end else {
            return Err(broken(&place, "goes beyond the end of the file".into()));
        };
        let data = &bytes[at + 8..end];
        match &bytes[at + 4..at + 8] {
            b"JSON" => json = json.or(Some(data)),
            b"BIN\0" => binary = binary.or(Some(data)),
            _ => {}
        }
        // Chunks are padded to four bytes; some writers forget to count the padding, and some to
        // write it.
        let known = |at: usize| matches!(bytes.get(at + 4..at + 8), Some(b"JSON" | b"BIN\0"));
        at = if known(end) { end } else { end.next_multiple_of(4) };
    }
    match json {
        Some(json) => Ok((json, binary)),
        None => Err(broken("GLB", "has no JSON chunk".into())),
    }
}

fn buffers<'a>(
    source: &Source<'_>,
    root: &json::Root,
    chunk: Option<&'a [u8]>,
) -> Result<Vec<Option<Bytes<'a>>>, ImportError> {
    // Many buffers may name one file: it is loaded once.
    let mut loaded: HashMap<&str, Arc<[u8]>> = HashMap::new();
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (i, buffer) in root.buffers.iter().enumerate() {
        let place = || Place::Element(format!("buffer {i}"));
        let bytes = match &buffer.uri {
            None => chunk.filter(|_| i == 0).map(Bytes::Chunk),
            Some(name) => {
                let bytes = match loaded.get(name.as_str()) {
                    Some(bytes) => bytes.clone(),
                    None => uri::read(source, name).map_err(|problem| {
                        source.malformed(place(), problem, "put the file beside the model")
                    })?,
                };
                loaded.insert(name, bytes.clone());
                Some(Bytes::Loaded(bytes))
            }
        };
        if let Some(bytes) = &bytes
            && (bytes.len() as u64) < buffer.byte_length.0
        {
            return Err(source.malformed(
                place(),
                format!("has {} of {} bytes", bytes.len(), buffer.byte_length.0),
                "copy or export the file again",
            ));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}
