//! NumPy arrays: what they say that they hold, and their numbers.

use super::{bytes, json, text};
use crate::numbers;
use crate::random::Random;

/// Bytes before the text of the header.
const START: usize = 10;

pub fn wrong(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let length = usize::from(u16::from_le_bytes([*file.get(8)?, *file.get(9)?]));
    let header = file.get(START..START + length)?;
    let numbers = &file[START + length..];
    match random.below(8) {
        0 => Some(with(&text::wrong(header, random), numbers)),
        1 => Some(with(header, &bytes::wrong(numbers, random))),
        2 => shorter(header, numbers, random),
        _ => Some(with(header, &values(header, numbers, random))),
    }
}

/// An array of a header and its numbers.
pub fn with(header: &[u8], numbers: &[u8]) -> Vec<u8> {
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header);
    file.extend(numbers);
    file
}

/// The kind of the numbers, such as `<f8`.
fn kind(header: &[u8]) -> &str {
    let text = std::str::from_utf8(header).unwrap_or_default();
    text.split("'descr': '").nth(1).and_then(|t| t.split('\'').next()).unwrap_or_default()
}

/// Other values of some numbers.
fn values(header: &[u8], numbers: &[u8], random: &mut Random) -> Vec<u8> {
    let kind = kind(header);
    if kind.starts_with("|S") {
        return json::wrong(numbers, random).unwrap_or_else(|| bytes::wrong(numbers, random));
    }
    let size = kind.get(2..).and_then(|n| n.parse().ok()).unwrap_or(1);
    let mut numbers = numbers.to_vec();
    let count = numbers.len() / size;
    if count == 0 {
        return numbers;
    }
    let many = if random.one_in(8) { count } else { 1 };
    for k in 0..many {
        let at = size * if many == 1 { random.below(count) } else { k };
        let own = numbers[at..at + size].to_vec();
        let new = match (kind, random.below(4)) {
            ("<f8", 0 | 1) => numbers::real(random).to_le_bytes().to_vec(),
            ("<f4", 0 | 1) => (numbers::real(random) as f32).to_le_bytes().to_vec(),
            (_, 2) => {
                let from = size * random.below(count);
                numbers[from..from + size].to_vec()
            }
            (_, 3) => {
                let mut near = own.clone();
                near[0] = near[0].wrapping_add(if random.one_in(2) { 1 } else { 255 });
                near
            }
            _ => numbers::bytes(random),
        };
        if new.len() == size {
            numbers[at..at + size].copy_from_slice(&new);
        }
    }
    numbers
}

/// One number more or less, and a shape that says so.
fn shorter(header: &[u8], numbers: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let size: usize = kind(header).get(2..)?.parse().ok()?;
    let count = numbers.len() / size.max(1);
    let wanted = if random.one_in(2) { count + 1 } else { count.saturating_sub(1) };
    let mut numbers = numbers.to_vec();
    numbers.resize(wanted * size, 0);
    let text = std::str::from_utf8(header).ok()?;
    let (before, after) = text.split_once("'shape': (")?;
    let after = after.split_once(')')?.1;
    Some(with(format!("{before}'shape': ({wanted},){after}").as_bytes(), &numbers))
}
