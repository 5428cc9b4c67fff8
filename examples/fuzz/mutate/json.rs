//! JSON.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use super::{text, wrong as any_wrong};
use crate::numbers;
use crate::random::Random;

/// Stands where a text that may be no JSON is put in.
const RAW: &str = "@raw@";

pub fn wrong(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    if random.one_in(10) {
        return Some(text::wrong(file, random));
    }
    let mut root: Value = serde_json::from_slice(file).ok()?;
    let mut paths = Vec::new();
    collect(&root, String::new(), &mut paths);
    let path = random.pick(&paths).clone();
    let other: &String = random.pick(&paths);
    let other = root.pointer(other)?.clone();
    let mut raw = None;
    match random.below(10) {
        0 => remove(&mut root, &path)?,
        1 => repeat(&mut root, &path, random)?,
        2 => *root.pointer_mut(&path)? = other,
        _ => raw = replace(root.pointer_mut(&path)?, &other, random),
    }
    let text = root.to_string();
    Some(match raw {
        Some(raw) => text.replacen(&format!("\"{RAW}\""), &raw, 1).into_bytes(),
        None => text.into_bytes(),
    })
}

/// The paths of all values (RFC 6901).
fn collect(value: &Value, path: String, paths: &mut Vec<String>) {
    match value {
        Value::Array(all) => {
            for (i, value) in all.iter().enumerate() {
                collect(value, format!("{path}/{i}"), paths);
            }
        }
        Value::Object(all) => {
            for (key, value) in all {
                let key = key.replace('~', "~0").replace('/', "~1");
                collect(value, format!("{path}/{key}"), paths);
            }
        }
        _ => {}
    }
    paths.push(path);
}

fn remove(root: &mut Value, path: &str) -> Option<()> {
    let (parent, key) = path.rsplit_once('/')?;
    match root.pointer_mut(parent)? {
        Value::Array(all) => drop(all.remove(key.parse().ok()?)),
        Value::Object(all) => drop(all.remove(key)),
        _ => {}
    }
    Some(())
}

fn repeat(root: &mut Value, path: &str, random: &mut Random) -> Option<()> {
    let (parent, key) = path.rsplit_once('/')?;
    let Value::Array(all) = root.pointer_mut(parent)? else { return Some(()) };
    let value = all.get(key.parse::<usize>().ok()?)?.clone();
    let times = if random.one_in(10) { 2000 } else { 1 };
    all.extend(std::iter::repeat_n(value, times));
    Some(())
}

/// Changes a value; a text that takes its place is returned.
fn replace(value: &mut Value, other: &Value, random: &mut Random) -> Option<String> {
    let raw = |value: &mut Value, text: String| {
        *value = RAW.into();
        Some(text)
    };
    match value {
        Value::Number(number) => match random.below(4) {
            0 => {
                let step = if random.one_in(2) { 1.0 } else { -1.0 };
                let next = number.as_f64().unwrap_or_default() + step;
                raw(value, next.to_string())
            }
            1 => raw(value, random.below(20).to_string()),
            _ => {
                let text = numbers::text(random);
                raw(value, text)
            }
        },
        Value::String(text) => {
            *text = match text.split_once(";base64,") {
                Some((head, data)) if !random.one_in(8) => {
                    let data = STANDARD.decode(data).unwrap_or_default();
                    format!("{head};base64,{}", STANDARD.encode(any_wrong(&data, random)))
                }
                _ => string(text, other, random),
            };
            None
        }
        Value::Bool(is) => {
            *is = !*is;
            None
        }
        _ => {
            const ANY: &[&str] = &["null", "[]", "{}", "0", "-1", "\"\"", "true", "[null]"];
            let text =
                if random.one_in(30) { "[".repeat(5000) } else { random.pick(ANY).to_string() };
            raw(value, text)
        }
    }
}

fn string(text: &str, other: &Value, random: &mut Random) -> String {
    const ANY: &[&str] =
        &["", "x", "/", "..", "data:,", "data:;base64,A", "%", "%ff", "é", "\u{0}"];
    match (random.below(3), other) {
        (0, Value::String(other)) => other.clone(),
        (1, _) => String::from_utf8_lossy(&text::wrong(text.as_bytes(), random)).into_owned(),
        _ if random.one_in(20) => "x".repeat(1 << random.below(16)),
        _ => (*random.pick(ANY)).to_owned(),
    }
}
