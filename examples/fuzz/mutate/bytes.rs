//! Bytes of which nothing is known.

use crate::numbers;
use crate::random::Random;

/// Most bytes of an input.
const MOST: usize = 1 << 20;

pub fn wrong(file: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = file.to_vec();
    if bytes.is_empty() {
        return numbers::bytes(random);
    }
    let n = bytes.len();
    match random.below(10) {
        0 => bytes[random.place(n)] ^= 1 << random.below(8),
        1 => bytes[random.place(n)] = random.next() as u8,
        2 => bytes.truncate(random.below(n)),
        3 => {
            bytes.drain(random.piece(n));
        }
        4 => {
            let piece = bytes[random.piece(n)].to_vec();
            let times = if random.one_in(20) { 1000 } else { 1 };
            let at = random.place(n);
            let most = MOST / piece.len();
            bytes.splice(at..at, piece.repeat(times.min(most)));
        }
        5 => {
            let piece = bytes[random.piece(n)].to_vec();
            let at = random.below(n - piece.len() + 1);
            bytes[at..at + piece.len()].copy_from_slice(&piece);
        }
        6 => {
            let at = random.place(n);
            let more: Vec<u8> = (0..1 + random.below(8)).map(|_| random.next() as u8).collect();
            bytes.splice(at..at, more);
        }
        _ => over(&mut bytes, &numbers::bytes(random), random),
    }
    bytes
}

/// Writes a number over what is there, where numbers of its size may stand.
fn over(bytes: &mut [u8], number: &[u8], random: &mut Random) {
    let Some(room) = bytes.len().checked_sub(number.len()) else { return };
    let mut at = random.place(room + 1);
    if !random.one_in(4) {
        at -= at % number.len();
    }
    bytes[at..at + number.len()].copy_from_slice(number);
}

/// The beginning of one file and the end of another.
pub fn spliced(a: &[u8], b: &[u8], random: &mut Random) -> Vec<u8> {
    [&a[..random.below(a.len() + 1)], &b[random.below(b.len() + 1)..]].concat()
}
