//! Lines of words.

use std::ops::Range;

use super::bytes;
use crate::numbers;
use crate::random::Random;

/// Most bytes of what is repeated.
const MOST: usize = 1 << 20;

pub fn wrong(file: &[u8], random: &mut Random) -> Vec<u8> {
    match random.below(12) {
        0 => bytes::wrong(file, random),
        1..=4 => of_lines(file, random),
        _ => of_words(file, random),
    }
}

fn of_lines(file: &[u8], random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = file.split_inclusive(|b| *b == b'\n').collect();
    let n = lines.len();
    if n == 0 {
        return Vec::new();
    }
    let at = random.below(n);
    match random.below(5) {
        0 => {
            lines.drain(random.piece(n));
        }
        1 => {
            let times = if random.one_in(20) { 20_000 } else { 1 + random.below(3) };
            let most = MOST / lines[at].len().max(1);
            let line = lines[at];
            lines.splice(at..at, std::iter::repeat_n(line, times.min(most)));
        }
        2 => lines.swap(at, random.below(n)),
        3 => {
            let piece = lines[random.piece(n)].to_vec();
            lines.splice(at..at, piece);
        }
        _ => lines[at] = &lines[at][..random.below(lines[at].len())],
    }
    lines.concat()
}

fn of_words(file: &[u8], random: &mut Random) -> Vec<u8> {
    let words = words(file);
    if words.is_empty() {
        return bytes::wrong(file, random);
    }
    let own = random.pick(&words).clone();
    let other = file[random.pick(&words).clone()].to_vec();
    let is_number = |word: &Range<usize>| {
        std::str::from_utf8(&file[word.clone()]).is_ok_and(|w| w.parse::<f64>().is_ok())
    };
    let all: Vec<Range<usize>> = words.iter().filter(|w| is_number(w)).cloned().collect();
    let number = if all.is_empty() { own.clone() } else { random.pick(&all).clone() };
    let (place, new) = match random.below(8) {
        0 => (own, Vec::new()),
        1 | 2 => (own, other),
        3 => {
            let value = std::str::from_utf8(&file[number.clone()]).ok();
            let value = value.and_then(|v| v.parse::<f64>().ok()).unwrap_or_default();
            let step = if random.one_in(2) { 1.0 } else { -1.0 };
            (number, (value + step).to_string().into_bytes())
        }
        4 => (own.start..own.start, mark(random)),
        _ => (number, numbers::text(random).into_bytes()),
    };
    [&file[..place.start], &new, &file[place.end..]].concat()
}

/// Something between words.
fn mark(random: &mut Random) -> Vec<u8> {
    const MARKS: &[&[u8]] = &[
        b" ",
        b"\t",
        b"\r",
        b"\n",
        b"\0",
        b"/",
        b"//",
        b",",
        b";",
        b":",
        b"=",
        b"#",
        b"!",
        b"\"",
        b"\\",
        b"\\\n",
        b"%",
        b"(",
        b"{",
        b"\xff",
        b"\xc3\xa9",
        b"\xef\xbb\xbf",
        b"\x1a",
    ];
    random.pick(MARKS).to_vec()
}

/// Where words and numbers are.
fn words(file: &[u8]) -> Vec<Range<usize>> {
    let is_part = |b: &u8| b.is_ascii_alphanumeric() || b"+-._".contains(b);
    let (mut words, mut at) = (Vec::new(), 0);
    while at < file.len() {
        let length = file[at..].iter().take_while(|b| is_part(b)).count();
        if length > 0 {
            words.push(at..at + length);
        }
        at += length + 1;
    }
    words
}
