//! Inputs with something wrong.

mod archive;
mod array;
mod bytes;
mod glb;
mod json;
mod png;
mod text;

use crate::corpus::Input;
use crate::random::Random;

/// An input made of one of those that are sound.
pub fn mutate(sound: &[Input], random: &mut Random) -> Input {
    let mut input = random.pick(sound).clone();
    let other = random.pick(sound).clone();
    let mut times = 1;
    while times < 6 && random.one_in(2) {
        times += 1;
    }
    for _ in 0..times {
        // What is opened, rather than what it refers to.
        let file = if random.one_in(3) { random.below(input.files.len()) } else { 0 };
        let (_, own) = &mut input.files[file];
        let others = &random.pick(&other.files).1;
        *own = if random.one_in(30) {
            bytes::spliced(own, others, random)
        } else {
            wrong(own, random)
        };
    }
    input
}

/// A file with something wrong, as its format has places for it.
fn wrong(file: &[u8], random: &mut Random) -> Vec<u8> {
    // Nothing is known of a format where it is broken already.
    let known = if random.one_in(12) { None } else { of_format(file, random) };
    known.unwrap_or_else(|| bytes::wrong(file, random))
}

fn of_format(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    match file {
        [b'g', b'l', b'T', b'F', ..] => glb::wrong(file, random),
        [b'P', b'K', ..] => archive::wrong(file, random),
        [0x89, b'P', b'N', b'G', ..] => png::wrong(file, random),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => array::wrong(file, random),
        [b'{' | b'[', ..] => json::wrong(file, random),
        [b'p', b'l', b'y', ..] => Some(headed(file, random)),
        _ if !file.contains(&0) => Some(text::wrong(file, random)),
        _ => None,
    }
}

/// A file of a header of lines and a body of anything.
fn headed(file: &[u8], random: &mut Random) -> Vec<u8> {
    const END: &[u8] = b"end_header\n";
    let end =
        file.windows(END.len()).position(|w| w == END).map_or(file.len(), |at| at + END.len());
    let (header, body) = file.split_at(end);
    match (random.one_in(2), body.contains(&0)) {
        (true, _) => [&text::wrong(header, random), body].concat(),
        (_, true) => [header, &bytes::wrong(body, random)].concat(),
        _ => [header, &text::wrong(body, random)].concat(),
    }
}
