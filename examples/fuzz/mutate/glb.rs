//! Binary glTF: its JSON or its buffer, with lengths that are right.

use super::{bytes, json};
use crate::corpus::gltf::glb;
use crate::random::Random;

pub fn wrong(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let length = |at: usize| {
        file.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let end = 20 + length(12)?;
    let text = file.get(20..end)?;
    let buffer = file.get(end + 8..).unwrap_or_default();
    let made = match random.one_in(4) {
        true => glb(text, &bytes::wrong(buffer, random)),
        false => glb(&json::wrong(text, random)?, buffer),
    };
    Some(if random.one_in(20) { bytes::wrong(&made, random) } else { made })
}
