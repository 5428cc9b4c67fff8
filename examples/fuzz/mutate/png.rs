//! PNG: its chunks, with checksums that are right.

use std::io::{Read, Write};

use flate2::Crc;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;

use super::bytes;
use crate::random::Random;

const SIGNATURE: usize = 8;

pub fn wrong(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let mut chunks = chunks(file)?;
    let n = chunks.len();
    let at = random.below(n);
    match random.below(6) {
        0 => drop(chunks.remove(at)),
        1 => chunks.insert(random.below(n), chunks[at].clone()),
        2 => chunks.swap(at, random.below(n)),
        _ => {
            let (kind, data) = &mut chunks[at];
            *data = match &*kind {
                b"IDAT" => packed(&bytes::wrong(&unpacked(data), random))?,
                _ => bytes::wrong(data, random),
            };
        }
    }
    let mut made = file[..SIGNATURE].to_vec();
    for (kind, data) in &chunks {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(data);
        made.extend((data.len() as u32).to_be_bytes());
        made.extend(kind);
        made.extend(data);
        made.extend(crc.sum().to_be_bytes());
    }
    Some(made)
}

/// The kind of each chunk and its data.
fn chunks(file: &[u8]) -> Option<Vec<([u8; 4], Vec<u8>)>> {
    let mut rest = file.get(SIGNATURE..)?;
    let mut chunks = Vec::new();
    while rest.len() >= 12 {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (kind, after) = after.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let data = after.get(..length)?;
        chunks.push((*kind, data.to_vec()));
        rest = after.get(length + 4..)?;
    }
    (!chunks.is_empty()).then_some(chunks)
}

fn unpacked(data: &[u8]) -> Vec<u8> {
    /// Most bytes of an image that is changed.
    const MOST: u64 = 1 << 22;
    let mut pixels = Vec::new();
    // What can be read of a broken one is kept.
    let _ = ZlibDecoder::new(data).take(MOST).read_to_end(&mut pixels);
    pixels
}

fn packed(pixels: &[u8]) -> Option<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(pixels).ok()?;
    encoder.finish().ok()
}
